#include "sentree/record/recorder.h"

#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>

#include "sentree/base/assert.h"
#include "sentree/base/json.h"
#include "sentree/record/schemas.h"

namespace sentree::record {

namespace {
// What the next message takes, mostly.
constexpr std::size_t kNextEntry = 384;
}  // namespace

Recorder::Recorder(std::unique_ptr<Sink> sink, RecorderOptions options)
    : options_(std::move(options)), sink_(std::move(sink)), writer_(*sink_, options_.compression) {
  renew_batch();
  gaps_ = add_channel("/gaps", "sentree.Gap", schemas::kGap);
  // Signals are for the threads of the program that records.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { work(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Recorder::~Recorder() { close(); }

ChannelId Recorder::add_channel(std::string topic, std::string_view schema, std::string_view json_schema) {
  const std::lock_guard lock(mutex_);
  SENTREE_ASSERT(channels_.size() < std::numeric_limits<ChannelId>::max());
  auto known = std::find_if(schemas_.begin(), schemas_.end(), [&](const Schema& s) { return s.name == schema; });
  if (known == schemas_.end()) {
    schemas_.push_back(
        {static_cast<SchemaId>(schemas_.size() + 1), std::string(schema), "jsonschema", std::string(json_schema)});
    known = schemas_.end() - 1;
  }
  channels_.push_back({static_cast<ChannelId>(channels_.size() + 1), known->id, std::move(topic), "json", {}});
  return channels_.back().id;
}

// A full part is handed on; when too many wait, there is no room.
bool Recorder::make_room(TimePoint time) {
  if (closing_ || report_.failed) return false;
  if (part_size() >= options_.chunk_size / kBatchesPerChunk &&
      !seal(handed_on_ + part_size() >= options_.chunk_size ? Seal::kChunk : Seal::kPart)) {
    if (lost_now_ == 0) {
      lost_from_ = time;
      ++report_.gaps;
    }
    lost_to_ = std::max(lost_to_, time);
    ++lost_now_;
    ++report_.lost;
    return false;
  }
  if (lost_now_ > 0) note_gap();
  ++report_.messages;
  return true;
}

// Memory that was used before is in the processor's caches and page tables; new memory costs as much as the messages.
void Recorder::renew_batch() {
  if (spare_.empty()) {
    batch_ = Batch();
    const std::size_t size = options_.chunk_size / kBatchesPerChunk;
    batch_.packed.reserve(size + size / 8);
  } else {
    batch_ = std::move(spare_.back());
    spare_.pop_back();
  }
}

std::size_t Recorder::begin_entry(ChannelId channel, TimePoint time) {
  const Entry entry{time.time_since_epoch().count(), ++sequence_, 0, channel};
  const std::size_t begin = batch_.packed.size();
  std::memcpy(batch_.packed.room(sizeof entry), &entry, sizeof entry);
  ++batch_.messages;
  return begin;
}

void Recorder::end_entry(std::size_t begin) {
  batch_.packed.expect(kNextEntry);
  const auto size = static_cast<std::uint32_t>(batch_.packed.size() - begin - sizeof(Entry));
  std::memcpy(batch_.packed.at(begin + offsetof(Entry, size)), &size, sizeof size);
}

bool Recorder::seal(Seal seal) {
  if (queue_.size() >= kWaitingBatchesMax) {
    if (!options_.wait_when_full) return false;
    std::unique_lock lock(mutex_, std::adopt_lock);
    room_.wait(lock, [&] { return queue_.size() < kWaitingBatchesMax || report_.failed; });
    lock.release();
    if (report_.failed) return false;
  }
  if (seal == Seal::kChunk) handed_on_ = 0;
  if (seal == Seal::kPart) handed_on_ += part_size();
  begun_ = seal == Seal::kBeginning ? part_size() : 0;
  batch_.ends_chunk = seal == Seal::kChunk;
  batch_.channels = channels_.size();
  batch_.last = sequence_;
  push(std::move(batch_));
  renew_batch();
  return true;
}

void Recorder::push(Item item) {
  queue_.push_back(std::move(item));
  work_.notify_one();
}

void Recorder::note_gap() {
  const std::size_t begin = begin_entry(gaps_, lost_to_);
  batch_.packed.value(
      Map{{"lost", static_cast<std::int64_t>(lost_now_)}, {"from", seconds(lost_from_)}, {"to", seconds(lost_to_)}});
  end_entry(begin);
  lost_now_ = 0;
}

bool Recorder::await_written(std::unique_lock<std::mutex>& lock) {
  if (closing_ || report_.failed) return false;
  const std::uint32_t last = sequence_;
  // Where there is no room for it now, the writer takes it when its time comes.
  if (is_open()) (void)seal(Seal::kChunk);
  // Numbers begin anew after the greatest.
  room_.wait(lock, [&] { return static_cast<std::int32_t>(written_ - last) >= 0 || report_.failed; });
  return !report_.failed;
}

void Recorder::flush() {
  std::unique_lock lock(mutex_);
  if (await_written(lock)) room_.wait(lock, [&] { return unwritten_ == 0 || report_.failed; });
}

Result<std::uint32_t> Recorder::follow(std::function<void(TimePoint, RunRecord)> tap) {
  std::unique_lock lock(mutex_);
  const std::uint32_t last = sequence_;
  if (!closing_ && !report_.failed) options_.tap = std::move(tap);
  if (await_written(lock)) return last;
  options_.tap = nullptr;
  return fail("record.ended", "nothing is recorded any more");
}

void Recorder::attach(Attachment attachment) {
  const std::lock_guard lock(mutex_);
  if (closing_ || report_.failed) return;
  ++unwritten_;
  push(std::move(attachment));
}

void Recorder::add(Metadata metadata) {
  const std::lock_guard lock(mutex_);
  if (closing_ || report_.failed) return;
  ++unwritten_;
  push(std::move(metadata));
}

Result<void> Recorder::write(const Item& item) {
  if (const auto* batch = std::get_if<Batch>(&item)) return write(*batch);
  if (const auto* attachment = std::get_if<Attachment>(&item)) return writer_.write(*attachment);
  return writer_.write(std::get<Metadata>(item));
}

Result<void> Recorder::write(const Batch& batch) {
  {
    const std::lock_guard lock(mutex_);
    for (; written_channels_ < batch.channels; ++written_channels_) {
      const Channel& channel = channels_[written_channels_];
      for (; written_schemas_ < channel.schema; ++written_schemas_) chunk_.add(schemas_[written_schemas_]);
      chunk_.add(channel);
      if (options_.audience != nullptr) options_.audience->channel(channel, schemas_[channel.schema - 1U]);
    }
  }
  std::string_view rest = batch.packed.bytes();
  while (!rest.empty()) {
    Entry entry;
    std::memcpy(&entry, rest.data(), sizeof entry);
    const auto time = static_cast<std::uint64_t>(entry.time);
    const std::size_t begin = chunk_.begin_message(entry.channel, entry.sequence, time, time);
    const std::size_t data = chunk_.records.size();
    PackedJson::unpack(chunk_.records, rest.substr(sizeof entry, entry.size));
    chunk_.end_message(begin);
    if (options_.audience != nullptr)
      options_.audience->message(
          {entry.channel, entry.sequence, time, time, std::string_view(chunk_.records).substr(data)});
    rest.remove_prefix(sizeof entry + entry.size);
  }
  if (!batch.ends_chunk || chunk_.empty()) return {};
  auto written = writer_.write(chunk_);
  chunk_.clear();
  return written;
}

void Recorder::work() {
  const auto check = [this](const Result<void>& written) {
    if (written) return true;
    {
      const std::lock_guard lock(mutex_);
      report_.failed = true;
      queue_.clear();
    }
    room_.notify_all();
    if (options_.on_failure) options_.on_failure(written.error());
    return false;
  };
  if (!check(writer_.begin("", options_.library))) return;
  const auto flush_every = options_.flush_every;
  const auto wake_every = options_.audience == nullptr ? flush_every
                          : flush_every.count() == 0   ? kAudiencePeriod
                                                       : std::min(flush_every, kAudiencePeriod);
  auto flushed = std::chrono::steady_clock::now();
  auto woken = flushed;
  for (;;) {
    Item item;
    {
      std::unique_lock lock(mutex_);
      const auto ready = [&] { return !queue_.empty() || closing_; };
      if (wake_every.count() == 0) {
        work_.wait(lock, ready);
      } else if (!work_.wait_until(lock, woken + wake_every, ready)) {
        woken = std::chrono::steady_clock::now();
        if (flush_every.count() > 0 && woken >= flushed + flush_every) {
          flushed = woken;
          if (is_open()) (void)seal(Seal::kChunk);
        } else if (batch_.messages > 0) {
          (void)seal(Seal::kBeginning);
        }
        if (queue_.empty()) continue;
      }
      if (queue_.empty()) break;
      item = std::move(queue_.front());
      queue_.pop_front();
    }
    room_.notify_all();
    if (!check(write(item))) return;
    if (auto* batch = std::get_if<Batch>(&item)) {
      batch->packed.clear();
      batch->messages = 0;
      const std::lock_guard lock(mutex_);
      if (batch->ends_chunk) {
        written_ = batch->last;
        room_.notify_all();
      }
      if (spare_.size() < kWaitingBatchesMax) spare_.push_back(std::move(*batch));
    } else {
      const std::lock_guard lock(mutex_);
      --unwritten_;
      room_.notify_all();
    }
  }
  (void)check(writer_.end(schemas_, channels_));
}

void Recorder::close() {
  {
    const std::lock_guard lock(mutex_);
    if (closing_) return;
    if (lost_now_ > 0) note_gap();
    // The last chunk may go beyond the bound: nothing follows it.
    batch_.ends_chunk = true;
    batch_.channels = channels_.size();
    batch_.last = sequence_;
    if (!report_.failed) push(std::move(batch_));
    closing_ = true;
    work_.notify_one();
  }
  thread_.join();
  const std::lock_guard lock(mutex_);
  report_.bytes = writer_.size();
}

RecorderReport Recorder::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

}  // namespace sentree::record
