#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/record/mcap.h"
#include "sentree/studio/history.h"

namespace sentree::studio {

/// Brings what a run's recorder sees into a history, in a thread of its own. The run pays for a copy of each message.
class Intake {
 public:
  /// Bytes that wait; the run waits for room.
  static constexpr std::size_t kWaitingMax = std::size_t{16} << 20U;
  /// The same while a `Hold` stands.
  static constexpr std::size_t kHeldMax = std::size_t{64} << 20U;
  /// Bytes after which the thread begins without being asked.
  static constexpr std::size_t kEnough = std::size_t{256} << 10U;

  /// `history` is borrowed.
  explicit Intake(History& history);
  ~Intake();
  Intake(const Intake&) = delete;
  Intake& operator=(const Intake&) = delete;

  /// For `record::RecorderOptions::tap`.
  void take(const record::Channel& channel, TimePoint time, std::string_view packed);
  /// Brings in everything that was taken before.
  void drain();

  /// While it stands, nothing is brought in: whoever has it brings in what was before.
  class Hold {
   public:
    explicit Hold(Intake& intake);
    ~Hold();
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    Intake& intake_;
    std::lock_guard<std::mutex> lock_;
  };

 private:
  void work();
  [[nodiscard]] bool is_wanted(const record::Channel& channel);

  struct Head {
    std::int64_t time = 0;
    std::uint32_t size = 0;
    record::ChannelId channel = 0;
  };

  History& history_;
  std::mutex draining_;
  std::string json_;  // of who drains
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string waiting_;
  std::vector<std::string> topics_;  // by channel; empty: not wanted
  std::vector<bool> known_;
  bool held_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace sentree::studio
