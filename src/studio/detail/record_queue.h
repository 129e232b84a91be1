#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/record/run_record.h"
#include "sentree/studio/history.h"

namespace sentree::studio {

/// Brings what a run's recorder sees into a history, in a thread of its own. The run pays for a copy of each record.
class RecordQueue {
 public:
  /// Records that wait; the run waits for room.
  static constexpr std::size_t kWaitingMax = std::size_t{1} << 15U;
  /// The same while a `Hold` stands.
  static constexpr std::size_t kHeldMax = std::size_t{1} << 17U;
  /// Records after which the thread begins without being asked.
  static constexpr std::size_t kEnough = std::size_t{1} << 9U;

  /// `history` is borrowed.
  explicit RecordQueue(History& history);
  ~RecordQueue();
  RecordQueue(const RecordQueue&) = delete;
  RecordQueue& operator=(const RecordQueue&) = delete;

  /// For `record::RecorderOptions::tap`.
  void put(TimePoint time, record::RunRecord record);
  /// Brings in everything that was put before.
  void drain();

  /// While it stands, nothing is brought in: whoever has it brings in what was before.
  class Hold {
   public:
    explicit Hold(RecordQueue& queue);
    ~Hold();
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    RecordQueue& queue_;
    std::lock_guard<std::mutex> lock_;
  };

 private:
  using Waiting = std::vector<std::pair<TimePoint, record::RunRecord>>;
  void work();

  History& history_;
  std::mutex draining_;
  Waiting taken_;  // of who drains; keeps its memory
  std::mutex mutex_;
  std::condition_variable changed_;
  Waiting waiting_;
  bool held_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace sentree::studio
