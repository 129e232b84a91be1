#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <variant>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/record/audience.h"
#include "sentree/record/mcap.h"
#include "sentree/record/packed_json.h"
#include "sentree/record/run_record.h"
#include "sentree/record/sink.h"
#include "sentree/record/writer.h"

namespace sentree::record {

/// A chunk's messages are handed to the writer's thread in so many parts, so that little is left to do at the end.
inline constexpr std::size_t kBatchesPerChunk = 4;
/// Between two times that an audience is given what was recorded since [wall time].
inline constexpr Duration kAudiencePeriod = std::chrono::milliseconds(50);
/// Parts of chunks that wait for the disk; beyond that messages are lost (and counted), or wait if `wait_when_full`.
inline constexpr std::size_t kWaitingBatchesMax = 64 * kBatchesPerChunk;

struct RecorderOptions {
  Compression compression = Compression::kZstd;
  std::size_t chunk_size = 512U << 10U;  ///< Packed bytes after which a chunk is ended; its JSON is about as long.
  /// Wall time after which an unfinished chunk is written all the same; 0: never, so that the bytes of the file depend
  /// on the messages only.
  Duration flush_every = std::chrono::milliseconds(500);
  bool wait_when_full = false;
  std::string library = "sentree";
  /// Told once, in the writer's thread, when writing fails. What comes later is not recorded.
  std::function<void(const Diagnostic&)> on_failure;
  /// Sees each message that has a `RunRecord` as it is recorded, in the thread that records it, with the recorder's
  /// lock held.
  std::function<void(TimePoint, RunRecord)> tap = {};
  /// Given what is recorded within `kAudiencePeriod`, which changes no byte of the file. Borrowed until the recorder is
  /// closed; null: nobody.
  Audience* audience = nullptr;
};

struct RecorderReport {
  std::uint64_t messages = 0;
  std::uint64_t lost = 0;  ///< Messages for which there was no room.
  std::uint64_t gaps = 0;  ///< Times that this began.
  std::uint64_t bytes = 0;
  bool failed = false;
};

/// Writes messages to a file from a thread of its own. `message` never waits for the disk (see `wait_when_full`).
///
/// A gap is a message of topic "/gaps" in the recording: how many were lost, from when to when. From any thread.
class Recorder {
 public:
  Recorder(std::unique_ptr<Sink> sink, RecorderOptions options);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// A topic of JSON messages. Schemas of one name are one.
  ChannelId add_channel(std::string topic, std::string_view schema, std::string_view json_schema);

  /// Records a message; `pack` adds its JSON to what it is given, which holds others already. The writer's thread
  /// prints it.
  /// Cost: that of `pack` and an uncontended lock.
  template <class Pack>
  void pack(ChannelId channel, TimePoint time, Pack&& pack) {
    const std::lock_guard lock(mutex_);
    (void)pack_locked(channel, time, pack);
  }
  /// The same of a message that is a `RunRecord` too, which `make` makes if somebody follows.
  template <class Pack, class Make>
  void pack(ChannelId channel, TimePoint time, Pack&& pack, Make&& make) {
    const std::lock_guard lock(mutex_);
    if (pack_locked(channel, time, pack) && options_.tap) options_.tap(time, make());
  }

  /// Records a message; `append` adds its JSON to the string that it is given.
  template <class Append, class... Make>
  void message(ChannelId channel, TimePoint time, Append&& append, Make&&... make) {
    std::string json;
    append(json);
    pack(
        channel, time, [&](PackedJson& out) { out.json(json); }, std::forward<Make>(make)...);
  }

  /// From now on `tap` sees messages, as `RecorderOptions::tap` does; an empty one ends that. Returns when all
  /// earlier messages are in the sink: those whose sequence numbers are not beyond the answer.
  /// Error: record.ended, if nothing is recorded any more; the tap is then gone.
  [[nodiscard]] Result<std::uint32_t> follow(std::function<void(TimePoint, RunRecord)> tap);

  /// Returns when all messages, attachments and metadata so far are in the sink, or nothing is recorded any more.
  void flush();

  void attach(Attachment attachment);
  void add(Metadata metadata);

  /// Ends the file. Called by the destructor; nothing is recorded afterwards.
  void close();
  [[nodiscard]] RecorderReport report() const;

 private:
  // Messages in the order in which they came: each an entry's header and its packed JSON.
  struct Batch {
    PackedJson packed;
    std::size_t messages = 0;
    bool ends_chunk = false;
    std::size_t channels = 0;  // that there were when it was handed on
    std::uint32_t last = 0;    // sequence number of its last message
  };
  struct Entry {
    std::int64_t time = 0;
    std::uint32_t sequence = 0;
    std::uint32_t size = 0;
    ChannelId channel = 0;
  };
  using Item = std::variant<Batch, Attachment, Metadata>;

  // False: there was no room.
  template <class Pack>
  bool pack_locked(ChannelId channel, TimePoint time, Pack&& pack) {
    if (!make_room(time)) return false;
    const std::size_t begin = begin_entry(channel, time);
    pack(batch_.packed);
    end_entry(begin);
    return true;
  }
  std::size_t begin_entry(ChannelId channel, TimePoint time);
  void end_entry(std::size_t begin);

  // With the lock held. False: there is none, and the message is lost.
  bool make_room(TimePoint time);
  // Hands on what there is of a part of a chunk: all of it, or what the audience is to have now.
  enum class Seal : std::uint8_t { kBeginning, kPart, kChunk };
  bool seal(Seal seal);
  [[nodiscard]] std::size_t part_size() const { return begun_ + batch_.packed.size(); }
  // Whether there are messages that no ended chunk has.
  [[nodiscard]] bool is_open() const { return batch_.messages > 0 || handed_on_ > 0 || begun_ > 0; }
  void renew_batch();
  // With the lock, until what was recorded so far is in the sink. False: it will not be.
  bool await_written(std::unique_lock<std::mutex>& lock);
  void push(Item item);
  void note_gap();
  void work();
  Result<void> write(const Item& item);
  Result<void> write(const Batch& batch);

  RecorderOptions options_;
  std::unique_ptr<Sink> sink_;
  Writer writer_;

  mutable std::mutex mutex_;
  std::condition_variable work_;
  std::condition_variable room_;  // also: something was written
  Batch batch_;
  std::size_t handed_on_ = 0;  // packed bytes of the open chunk, in whole parts, that are in the queue or beyond
  std::size_t begun_ = 0;      // the same of the part that `batch_` goes on with
  std::deque<Item> queue_;
  std::vector<Batch> spare_;
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  ChannelId gaps_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint32_t written_ = 0;   // the last sequence number that is in the sink
  std::size_t unwritten_ = 0;   // attachments and metadata that are not
  std::uint64_t lost_now_ = 0;  // in the gap that is open
  TimePoint lost_from_{};
  TimePoint lost_to_{};
  RecorderReport report_;
  bool closing_ = false;
  // Of the writer's thread.
  Chunk chunk_;
  std::size_t written_channels_ = 0;
  std::size_t written_schemas_ = 0;
  std::thread thread_;
};

}  // namespace sentree::record
