#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "sentree/base/coarse_clock.h"
#include "sentree/base/present.h"
#include "sentree/base/time.h"
#include "sentree/bt/call_watch.h"
#include "sentree/bt/tree.h"

namespace sentree::runtime {

/// Looks, in a thread of its own, for nodes in C++ that do not come back: nobody can end them from outside, and the
/// tree stands until they do. It tells which one it is; and when the mission is to stop, it is waited for so long and
/// no longer.
class NodeWatch {
 public:
  struct Patience {
    Duration told;  ///< With a call before it is told, in wall time.
    Duration halt;  ///< Likewise, once the mission is to stop, before the run ends without it.
    /// Likewise in any case: in virtual time, which stands meanwhile, no limit of time comes. Max: none.
    Duration limit = Duration::max();
  };
  struct Replies {
    std::function<TimePoint()> now;
    std::function<void(const std::string& what)> told;
    /// Its thread never comes back; told once.
    std::function<void(const std::string& why)> given_up;
  };

  /// @param tree    Borrowed.
  /// @param factor  Run seconds per wall second, 0: none pass during a call.
  NodeWatch(const bt::Tree& tree, double factor, Patience patience, Replies replies);
  ~NodeWatch();
  NodeWatch(const NodeWatch&) = delete;
  NodeWatch& operator=(const NodeWatch&) = delete;

  /// For the thread that steps the tree.
  [[nodiscard]] bt::CallWatch& calls() { return calls_; }
  /// The mission is to stop. From any thread.
  void stop_asked();
  /// The thread in a call never comes back. From any thread.
  [[nodiscard]] bool has_given_up() const { return has_given_up_; }

 private:
  void look();
  // True: the call was given up.
  bool look_at(const bt::CallWatch::Call& call, std::optional<Duration> since_asked);
  [[nodiscard]] std::string describe(const bt::CallWatch::Call& call) const;

  const bt::Tree& tree_;
  const double factor_;
  const Patience patience_;
  const Replies replies_;
  bt::CallWatch calls_{&coarse_ms};
  std::uint64_t told_ = 0;          // which call
  std::uint64_t told_at_stop_ = 0;  // likewise
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::optional<std::chrono::steady_clock::time_point> asked_;
  std::atomic<bool> has_given_up_ = false;
  std::thread thread_;
};

/// While it lives, a Mission that is made in this thread has its nodes watched.
using WatchNodes = Present<NodeWatch>;

}  // namespace sentree::runtime
