#include "sentree/runtime/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdio>
#include <ctime>
#include <mutex>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "sentree/base/encoder.h"
#include "sentree/base/packed.h"
#include "sentree/base/rng.h"
#include "sentree/base/write_all.h"
#include "sentree/text/file.h"

namespace sentree::runtime {

namespace {

namespace fs = std::filesystem;

// A file is a head of fixed size, then records. The head can be written again without more room on the disk.
constexpr std::string_view kMagic = "SENTREE JOURNAL 1\n";
constexpr std::string_view kAnyMagic = kMagic.substr(0, kMagic.size() - 2);  // of each version
constexpr std::size_t kHeadSize = 512;
constexpr std::size_t kStateAt = 24;  // of the head: its state, then a text
constexpr std::size_t kRecordMax = std::size_t{256} << 20U;
constexpr std::chrono::seconds kSyncInterval{1};

enum class HeadState : char { kOpen = 'o', kGivenUp = 'g', kContinued = 'c' };
enum class Kind : std::uint8_t { kSnapshot = 1, kInstant, kInput, kIntervention, kSent, kParts, kLost };

std::string head(HeadState state, std::string_view text) {
  std::string made(kMagic);
  made.resize(kHeadSize, '\0');
  made[kStateAt] = static_cast<char>(state);
  made.replace(kStateAt + 1, std::min(text.size(), kHeadSize - kStateAt - 2), text, 0, kHeadSize - kStateAt - 2);
  made.resize(kHeadSize, '\0');
  return made;
}

// Size and kind, what it says, and a checksum of both.
std::string record(Kind kind, std::string_view body) {
  std::string made;
  Encoder out(made);
  out.word(body.size());
  out.byte(static_cast<std::uint8_t>(kind));
  made.append(body);
  out.word(hash_bytes(made));
  return made;
}

std::uint64_t word_at(std::string_view octets, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) value |= std::uint64_t{static_cast<unsigned char>(octets[at + i])} << (8 * i);
  return value;
}

std::int64_t ns(TimePoint time) { return time.time_since_epoch().count(); }
TimePoint time_of(std::int64_t ns) { return TimePoint(Duration(ns)); }

std::int64_t clock_ns(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<std::int64_t>(time.tv_sec) * 1'000'000'000 + time.tv_nsec;
}

class File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  ~File() { ::close(descriptor_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

std::int64_t integer(const Value& map, std::string_view key) {
  const Value* value = map.find(key);
  const std::int64_t* number = value != nullptr ? value->as_int() : nullptr;
  return number != nullptr ? *number : 0;
}

Place place_of(const Value& body) {
  return {time_of(integer(body, "at")), static_cast<std::uint64_t>(integer(body, "order"))};
}

void take_parts(const Value& body, Journaled& out) {
  const Value* parts = body.find("parts");
  if (parts != nullptr && parts->as_list() != nullptr) out.parts = *parts->as_list();
}

// What a snapshot says beside the state.
bool take_snapshot(const Value& body, Journaled& out) {
  const Value* state = body.find("state");
  const Value* open = body.find("open");
  const Value* gaps = body.find("gaps");
  if (state == nullptr || state->as_bytes() == nullptr || open == nullptr || open->as_list() == nullptr ||
      gaps == nullptr || gaps->as_list() == nullptr)
    return false;
  const auto& octets = state->as_bytes()->octets;
  out.state.assign(reinterpret_cast<const char*>(octets.data()), octets.size());
  out.open = *open->as_list();
  out.gaps.clear();
  for (const Value& gap : *gaps->as_list())
    out.gaps.push_back({time_of(integer(gap, "from")), time_of(integer(gap, "to")), Duration(integer(gap, "wall"))});
  if (const Value* note = body.find("note")) out.note = *note;
  take_parts(body, out);
  if (const Value* boot = body.find("boot")) out.at.boot = boot->text();
  out.at.up = integer(body, "up");
  out.at.date = integer(body, "date");
  out.reached = time_of(integer(body, "now"));
  return true;
}

constexpr std::size_t kFrame = 8 + 1 + 8;  // of a record: its size, its kind, and the checksum

// The record that octets begin with, without its frame; nothing: none that is whole.
std::optional<std::string_view> whole_record(std::string_view octets) {
  if (octets.size() < kFrame) return std::nullopt;
  const std::uint64_t size = word_at(octets, 0);
  if (size > kRecordMax || octets.size() - kFrame < size) return std::nullopt;
  if (word_at(octets, 9 + size) != hash_bytes(octets.substr(0, 9 + size))) return std::nullopt;
  return octets.substr(9, size);
}

// Whether a record stands anywhere in them: then they are no torn end. True also where that is more than can be looked
// through.
bool holds_record(std::string_view octets) {
  constexpr std::size_t kHashedMax = std::size_t{64} << 20U;
  std::size_t hashed = 0;
  for (std::size_t at = 1; at + kFrame <= octets.size(); ++at) {
    if (hashed >= kHashedMax) return true;
    const auto kind = static_cast<std::uint8_t>(octets[at + 8]);
    const std::uint64_t size = word_at(octets, at);
    if (kind < static_cast<std::uint8_t>(Kind::kSnapshot) || kind > static_cast<std::uint8_t>(Kind::kLost)) continue;
    if (size > kRecordMax || octets.size() - at - kFrame < size) continue;
    hashed += size;
    if (whole_record(octets.substr(at))) return true;
  }
  return false;
}

// Each record that is whole, until one is not.
bool take_records(std::string_view octets, Journaled& out) {
  bool begun = false;
  const std::size_t all = octets.size();
  const auto went_on = [&](const Value& body) {
    out.reached = std::max(out.reached, time_of(integer(body, "at")));
    const std::int64_t up = integer(body, "up");
    out.at.date += up - out.at.up;
    out.at.up = up;
  };
  while (!octets.empty()) {
    const auto inside = whole_record(octets);
    if (!inside) break;
    const auto kind = static_cast<Kind>(octets[8]);
    const auto body = unpack(*inside);
    if (!body) break;
    octets.remove_prefix(kFrame + inside->size());
    if (kind == Kind::kSnapshot) {
      if (!take_snapshot(*body, out)) return false;
      begun = true;
      continue;
    }
    if (!begun) return false;
    const Value* what = body->find("what");
    switch (kind) {
      case Kind::kInstant: went_on(*body); break;
      case Kind::kInput:
        went_on(*body);
        out.inputs.emplace_back(place_of(*body), what != nullptr ? *what : Value());
        break;
      case Kind::kIntervention:
        went_on(*body);
        out.interventions.emplace_back(place_of(*body), *body);
        break;
      case Kind::kParts: take_parts(*body, out); break;
      case Kind::kSent: out.sent.insert(static_cast<std::uint64_t>(integer(*body, "call"))); break;
      case Kind::kLost: out.lost.insert(static_cast<std::uint64_t>(integer(*body, "step"))); break;
      default: return false;
    }
  }
  out.torn = !octets.empty();
  if (begun && out.torn && holds_record(octets)) out.damaged_at = kHeadSize + all - octets.size();
  return begun;
}

// Its head; empty: it has none.
std::string head_of(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return {};
  const File closed(descriptor);
  std::string octets(kHeadSize, '\0');
  const bool is_whole = ::read(descriptor, octets.data(), octets.size()) == static_cast<ssize_t>(octets.size());
  return is_whole && octets.starts_with(kAnyMagic) ? octets : std::string();
}

}  // namespace

WallTime wall_time() {
  static const std::string boot = [] {
    std::string id = text::read_file("/proc/sys/kernel/random/boot_id").value_or("");
    while (!id.empty() && id.back() == '\n') id.pop_back();
    return id;
  }();
  return {boot, clock_ns(CLOCK_BOOTTIME), clock_ns(CLOCK_REALTIME)};
}

std::optional<Duration> between(const WallTime& a, const WallTime& b) {
  if (!a.boot.empty() && a.boot == b.boot) return Duration(std::max<std::int64_t>(b.up - a.up, 0));
  if (b.date < a.date) return std::nullopt;
  return Duration(b.date - a.date);
}

Result<Journaled> read_journal(const fs::path& file) {
  const auto damaged = [&](const std::string& why) {
    return fail("journal.damaged",
                fmt::format("{}: this is no journal of a run, or a damaged one: {}", file.string(), why));
  };
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) {
    return fail("journal.none",
                fmt::format("{}: {}; only a run with --durable keeps a journal, and one that has ended needs none",
                            file.string(), std::generic_category().message(errno)));
  }
  auto lock = std::make_shared<File>(descriptor);
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0)
    return fail("journal.in-use", file.string() + ": the run goes on, or somebody else resumes it");
  const auto content = text::read_file(file);
  if (!content) return tl::unexpected(content.error());
  if (content->starts_with(kAnyMagic) && !content->starts_with(kMagic)) {
    return fail("journal.other-version",
                file.string() + ": a journal of another version of Sentree; the version that wrote it resumes it");
  }
  if (content->size() < kHeadSize || !content->starts_with(kMagic)) return damaged("it does not begin as one");
  const std::string text(content->data() + kStateAt + 1);
  switch (static_cast<HeadState>((*content)[kStateAt])) {
    case HeadState::kOpen: break;
    case HeadState::kGivenUp:
      return fail("journal.given-up", fmt::format("{}: the run cannot be resumed: {}", file.string(), text));
    case HeadState::kContinued:
      return fail("journal.continued",
                  fmt::format("{}: the run was resumed already; {} continues it", file.string(), text));
    default: return damaged("its state is unknown");
  }
  Journaled journaled;
  journaled.file = file;
  journaled.lock = std::move(lock);
  if (!take_records(std::string_view(*content).substr(kHeadSize), journaled))
    return damaged("it has no state of a run");
  if (journaled.damaged_at) {
    // What was done behind it is not known, and would be done again.
    return fail(
        "journal.damaged",
        fmt::format("{0}: damaged at byte {1}, with whole records behind it; what the run did after {2} s is not "
                    "known any more. If that may be done once more: truncate --size={1} \"{0}\", then --resume",
                    file.string(), *journaled.damaged_at, seconds(journaled.reached)));
  }
  return journaled;
}

bool waits_to_be_resumed(const fs::path& file) {
  const std::string octets = head_of(file);
  // What another version wrote, that version goes on with.
  return !octets.empty() && (!octets.starts_with(kMagic) || octets[kStateAt] == static_cast<char>(HeadState::kOpen));
}

std::string continued_by(const fs::path& file) {
  const std::string octets = head_of(file);
  if (!octets.starts_with(kMagic) || octets[kStateAt] != static_cast<char>(HeadState::kContinued)) return {};
  return octets.c_str() + kStateAt + 1;  // up to the zero behind the text
}

void end_journal(const Journaled& journal, const std::string& continued_by) {
  const int descriptor = std::static_pointer_cast<File>(journal.lock)->get();
  const std::string made = head(HeadState::kContinued, continued_by);
  (void)::pwrite(descriptor, made.data(), made.size(), 0);
  (void)::ftruncate(descriptor, static_cast<off_t>(kHeadSize));
  (void)::fsync(descriptor);
  // The file after it, of this run or of one that resumed it, if that was killed while it wrote it.
  (void)::unlink((journal.file.string() + ".new").c_str());
}

class Journal::Impl {
 public:
  explicit Impl(const DurableOptions& options) : options_(options) {
    if (options_.sync != project::JournalSync::kInterval) return;
    syncer_ = std::thread([this] {
      std::unique_lock lock(mutex_);
      while (!end_.wait_for(lock, kSyncInterval, [this] { return ending_; })) {
        // Held meanwhile, so that whoever writes may go on.
        const auto file = file_;
        if (!file || !dirty_.exchange(false)) continue;
        lock.unlock();
        const int error = ::fdatasync(file->get()) == 0 ? 0 : errno;
        ++syncs_;
        lock.lock();
        // A later success says nothing of what was lost here; the file of the next state does.
        if (error != 0 && file == file_) sync_error_ = error;
      }
    });
  }
  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    end_.notify_all();
    if (syncer_.joinable()) syncer_.join();
  }

  void snapshot(TimePoint now, std::string_view state, List open, const std::vector<Gap>& gaps) {
    const Spending spending(*this);
    if (!cost_.given_up.empty()) return;
    const WallTime at = options_.clock();
    List passed;
    for (const Gap& gap : gaps)
      passed.push_back(Map{{"from", ns(gap.from)}, {"to", ns(gap.to)}, {"wall", gap.wall.count()}});
    const auto* octets = reinterpret_cast<const std::byte*>(state.data());
    const Value body =
        Map{{"now", ns(now)},          {"boot", at.boot},       {"up", at.up},
            {"date", at.date},         {"note", options_.note}, {"gaps", std::move(passed)},
            {"open", std::move(open)}, {"parts", parts_},       {"state", Bytes{{octets, octets + state.size()}}}};
    const bool first = file_ == nullptr;
    const bool replaces =
        first && !options_.resumed.empty() && options_.resumed.parent_path() == options_.journal.parent_path();
    const fs::path made = (replaces ? options_.resumed : options_.journal).string() + ".new";
    const int descriptor = ::open(made.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    std::string made_record = record(Kind::kSnapshot, pack(body));
    const std::string whole = head(HeadState::kOpen, "") + (base_.empty() ? made_record : base_);
    bool good = descriptor >= 0;
    auto file = good ? std::make_shared<File>(descriptor) : nullptr;
    good = good && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 && write_all(descriptor, whole);
    if (good && options_.sync != project::JournalSync::kNever) {
      good = ::fdatasync(descriptor) == 0;
      ++syncs_;
    }
    good = good && ::rename(made.c_str(), options_.journal.c_str()) == 0;
    if (!good) {
      const std::string why = std::generic_category().message(errno);
      (void)::unlink(made.c_str());
      // The records behind the last one still say everything, where they can be written.
      if (first) give_up(fmt::format("{}: {}", made.string(), why));
      return;
    }
    ++cost_.snapshots;
    ++cost_.writes;
    cost_.bytes += whole.size();
    base_ = std::move(made_record);
    if (first) begun_ = std::chrono::steady_clock::now();
    const std::lock_guard lock(mutex_);
    file_ = std::move(file);
    sync_error_ = 0;
    dirty_ = false;
  }

  void write(Kind kind, Map body, TimePoint at) {
    const Spending spending(*this);
    if (!cost_.given_up.empty() || !file_) return;
    // What came in says as much.
    if (kind == Kind::kInstant && at <= reached_) return;
    reached_ = std::max(reached_, at);
    if (kind != Kind::kSent && kind != Kind::kParts && kind != Kind::kLost) {
      body["at"] = ns(at);
      body["up"] = options_.clock().up;
    }
    const std::string made = record(kind, pack(Value(std::move(body))));
    base_ += made;
    if (const int error = sync_error_)
      return give_up(fmt::format("{}: {}", options_.journal.string(), std::generic_category().message(error)));
    if (!write_all(file_->get(), made))
      return give_up(fmt::format("{}: {}", options_.journal.string(), std::generic_category().message(errno)));
    ++cost_.writes;
    cost_.bytes += made.size();
    dirty_ = true;
  }

  void before_leaving() {
    if (options_.sync != project::JournalSync::kEach || !file_ || !dirty_.exchange(false)) return;
    const Spending spending(*this);
    ++syncs_;
    ++waits_;
    const auto begun = std::chrono::steady_clock::now();
    if (::fdatasync(file_->get()) != 0)
      return give_up(fmt::format("{}: {}", options_.journal.string(), std::generic_category().message(errno)));
    const auto now = std::chrono::steady_clock::now();
    cost_.waited += now - begun;
    if (is_slow_told_ || now - begun_ < std::chrono::seconds(1)) return;
    const double share = seconds(cost_.waited) / seconds(now - begun_);
    if (share <= kWaitShareMax) return;
    is_slow_told_ = true;
    if (options_.on_slow) options_.on_slow(slow(share));
  }

  [[nodiscard]] std::string slow(double share) const {
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(),
                  "the disk takes %.1f ms for each write that must be on it, %.0f %% of the run's time",
                  seconds(cost_.waited) * 1e3 / static_cast<double>(waits_), share * 100);
    return text.data();
  }

  void give_up(const std::string& why) {
    if (!cost_.given_up.empty()) return;
    cost_.given_up = why;
    if (file_) {
      const std::string made = head(HeadState::kGivenUp, why);
      // Where not even that can be written, there is better no journal than one that ends too early.
      if (::pwrite(file_->get(), made.data(), made.size(), 0) != static_cast<ssize_t>(made.size()))
        (void)::unlink(options_.journal.c_str());
      (void)::ftruncate(file_->get(), static_cast<off_t>(kHeadSize));
    }
    if (options_.on_failure) options_.on_failure(why);
  }

  void remove() {
    if (file_ && cost_.given_up.empty()) (void)::unlink(options_.journal.c_str());
    const std::lock_guard lock(mutex_);
    file_.reset();
  }

  // Counts the time of its life.
  struct Spending {
    explicit Spending(Impl& of) : impl(of), begun(std::chrono::steady_clock::now()) {}
    ~Spending() { impl.cost_.spent += std::chrono::steady_clock::now() - begun; }
    Spending(const Spending&) = delete;
    Spending& operator=(const Spending&) = delete;
    Impl& impl;
    const std::chrono::steady_clock::time_point begun;
  };

  const DurableOptions options_;
  std::string base_;  // the last state and the records behind it, with which the next file begins
  TimePoint reached_{};
  List parts_;
  JournalCost cost_;
  std::atomic<std::uint64_t> syncs_ = 0;
  std::uint64_t waits_ = 0;  // of these, what the run's thread waited for
  std::chrono::steady_clock::time_point begun_;
  bool is_slow_told_ = false;
  std::atomic<int> sync_error_ = 0;  // of the syncer, for who writes next
  std::atomic<bool> dirty_ = false;
  std::mutex mutex_;  // of file_, for who only syncs it
  std::condition_variable end_;
  bool ending_ = false;
  std::shared_ptr<File> file_;  // null: nothing has been written, or nothing is any more
  std::thread syncer_;
};

Journal::Journal(const DurableOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Journal::~Journal() = default;

void Journal::snapshot(TimePoint now, std::string_view state, List open, const std::vector<Gap>& gaps) {
  impl_->snapshot(now, state, std::move(open), gaps);
}
void Journal::instant(TimePoint now) { impl_->write(Kind::kInstant, {}, now); }
void Journal::input(const Place& where, Value delivery) {
  const auto order = static_cast<std::int64_t>(where.order);
  impl_->write(Kind::kInput, Map{{"what", std::move(delivery)}, {"order", order}}, where.when);
}
void Journal::intervention(const Place& where, Value what, const std::string& source) {
  const auto order = static_cast<std::int64_t>(where.order);
  impl_->write(Kind::kIntervention, Map{{"what", std::move(what)}, {"order", order}, {"source", source}}, where.when);
  impl_->before_leaving();
}
void Journal::sent(std::uint64_t call) {
  impl_->write(Kind::kSent, Map{{"call", static_cast<std::int64_t>(call)}}, {});
}
void Journal::lost(std::uint64_t step) {
  impl_->write(Kind::kLost, Map{{"step", static_cast<std::int64_t>(step)}}, {});
}
void Journal::parts(List parts) {
  impl_->parts_ = std::move(parts);
  impl_->write(Kind::kParts, Map{{"parts", impl_->parts_}}, {});
}
void Journal::before_leaving() { impl_->before_leaving(); }
void Journal::give_up(const std::string& why) { impl_->give_up(why); }
void Journal::remove() { impl_->remove(); }
void Journal::spent(Duration time) { impl_->cost_.spent += time; }
JournalCost Journal::cost() const {
  JournalCost cost = impl_->cost_;
  cost.syncs = impl_->syncs_;
  return cost;
}

}  // namespace sentree::runtime
