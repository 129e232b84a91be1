#pragma once

#include <pthread.h>
#include <time.h>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/base/source.h"
#include "sentree/base/time.h"
#include "sentree/scxml/host.h"

namespace sentree::runtime {

/// What a watchdog watches: the steps of one skill or one monitor.
class Watched {
 public:
  /// Called once, in the watchdog's thread, when a script has not ended in time. The thread that executes it never
  /// comes back: all that it works on now belongs to nobody.
  using Hung = std::function<void(const SourceSpan& script)>;

  explicit Watched(Hung hung) : hung_(std::move(hung)) {}

  /// For `scxml::Host::watch`.
  [[nodiscard]] scxml::ExecutionWatch& execution() { return execution_; }
  /// The thread that steps from now on is this one.
  void in_this_thread();

 private:
  friend class Watchdog;
  scxml::ExecutionWatch execution_;
  Hung hung_;
  std::atomic<clockid_t> clock_{0};
  std::uint64_t step_ = 0;    // the one that was seen last
  std::int64_t used_ns_ = 0;  // processor time of its thread when it was first seen
};

/// Looks, in a thread of its own, for steps of charts that take too long. Duktape cannot stop an endless script, so
/// whoever is told of one leaves its thread behind (see `threads_left_behind`).
class Watchdog {
 public:
  /// @param script_max  Processor time that one step of a chart may take; a machine that is busy with other things does
  ///                    not count.
  explicit Watchdog(Duration script_max);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// Watched as long as somebody else keeps it.
  void watch(std::shared_ptr<Watched> watched);
  [[nodiscard]] Duration script_max() const { return script_max_; }

  /// "skills/GoTo.scxml:14:7: this script does not end (2000 ms of processor time in one step); skill GoTo is given
  /// up".
  [[nodiscard]] std::string reason(const SourceSpan& script, const std::string& who) const;

 private:
  void look();
  void look_at(Watched& watched);

  const Duration script_max_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::vector<std::shared_ptr<Watched>> watched_;
  std::thread thread_;
};

/// A thread that does one thing and that can be left behind when it does not end.
class LeavableThread {
 public:
  /// Runs `task` in a thread of its own and waits. False: `leave` was called before it ended; the thread is left
  /// behind.
  bool run(std::function<void()> task);
  /// From any thread.
  void leave();

 private:
  struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    bool ended = false;
    bool left = false;
  };
  std::shared_ptr<Shared> shared_ = std::make_shared<Shared>();
};

/// Gives up a thread that never comes back from a script: it goes on, with the lowest priority, until the process ends.
void leave_behind(std::thread& thread);
/// The same for a thread that belongs to somebody else.
void leave_behind(pthread_t thread);

/// How many threads have been left behind in this process. If there are any, what they work on must not be destroyed,
/// and the process must end by `_exit`.
[[nodiscard]] std::size_t threads_left_behind();

/// Keeps what a thread that was left behind may still use until the process ends.
void keep_for_ever(std::shared_ptr<void> what);

}  // namespace sentree::runtime
