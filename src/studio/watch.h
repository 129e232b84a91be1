#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/steering.h"
#include "sentree/text/file.h"

namespace sentree::studio {

/// Where what is seen goes. Called one at a time, in the thread that is in `Watch::follow`.
struct WatchListeners {
  std::vector<runtime::Stream::Listener> observations;
  /// The blackboards, as `bt::export_blackboard` gives them.
  std::function<void(TimePoint, const Value&)> blackboard;
  /// Something a person should know; it goes on.
  std::function<void(const std::string&)> problem;
};

/// A program with BehaviorTree.CPP 4.3 or later that executes a tree, seen through its Groot 2 publisher as if it were
/// a run of ours: a plan, observations, blackboards, and steering as far as the publisher goes, which is breakpoints,
/// forced results of nodes and to go on.
///
/// Time 0 is when it was found. What changes comes from the publisher's recording, with its times [wall time]; who
/// else drains that recording gets a part of it, so statuses are compared once a second. Each look that finds changes
/// counts as a tick.
class Watch {
 public:
  /// Between two looks, and between two looks at the blackboards.
  static constexpr std::chrono::milliseconds kLookPeriod{50};
  static constexpr std::chrono::milliseconds kBoardPeriod{500};

  /// @param address  As for `groot::Client::connect`.
  /// Errors: groot.*, xml.*, bt.*.
  [[nodiscard]] static Result<std::unique_ptr<Watch>> start(const std::string& address);
  ~Watch();
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Of a project that is made for it: its mission is executed elsewhere.
  [[nodiscard]] const project::Plan& plan() const;
  [[nodiscard]] const std::vector<text::ReadFile>& files() const;
  /// While somebody is in `follow`.
  [[nodiscard]] runtime::Steering& steering();

  /// Until `stop`, or until the program executes another tree. One call per object. Hooks that were set here are taken
  /// away at the end.
  [[nodiscard]] runtime::RunReport follow(const WatchListeners& listeners);
  /// From any thread.
  void stop();
  /// Why `follow` ended: there is another tree.
  [[nodiscard]] bool other_tree() const;

 private:
  struct Impl;
  explicit Watch(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::studio
