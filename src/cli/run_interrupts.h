#pragma once

#include <signal.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "sentree/runtime/run.h"

namespace sentree::cli {

/// Turns Ctrl-C, SIGTERM and a terminal that goes away into an orderly end. The signals are blocked in all threads and
/// awaited in one.
class RunInterrupts {
 public:
  /// Before anything that starts threads, which must not take the signals.
  static void block();

  explicit RunInterrupts(runtime::Run& run);
  RunInterrupts(const RunInterrupts&) = delete;
  RunInterrupts& operator=(const RunInterrupts&) = delete;
  ~RunInterrupts();

  /// The run is over: from now on a signal ends the waiting.
  void run_is_over();
  /// Returns at the next signal.
  void wait_for_one();

 private:
  void wait();

  std::mutex mutex_;
  std::condition_variable asked_;
  runtime::Run* run_;  // null: it is over
  bool asked_to_end_ = false;
  std::atomic<bool> done_ = false;
  std::thread thread_;
};

}  // namespace sentree::cli
