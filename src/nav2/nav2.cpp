#include "sentree/nav2/nav2.h"

#include <cstdint>
#include <string>
#include <utility>

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/nav2/detail/nodes.h"

namespace sentree::nav2 {

namespace {

using bt::Context;
using bt::Next;
using bt::Ports;
using bt::Status;

std::int64_t member(const Value& saved, std::string_view name) {
  const Value* const found = saved.find(name);
  const std::int64_t* const number = found != nullptr ? found->as_int() : nullptr;
  return number != nullptr ? *number : 0;
}

/// Ends the node: its children are halted and begin anew with it.
Next finished(Context& self, Status status) {
  self.reset_children();
  return Next::done(status);
}

/// Ticks every child up to the one that was reached, again at each tick; those before it may run on.
struct PipelineSequence {
  std::int64_t reached = 0;
  std::int64_t skipped = 0;

  Next on_tick(Context& /*self*/) {
    skipped = 0;
    return Next::tick(0);
  }
  Next on_child(Context& self, std::size_t child, Status status) {
    const auto index = static_cast<std::int64_t>(child);
    if (status == Status::kFailure) return end(self, status);
    if (status == Status::kRunning && index >= reached) {
      reached = index;
      return Next::done(status);
    }
    if (status == Status::kSkipped) ++skipped;
    if (child + 1 < self.child_count()) return Next::tick(child + 1);
    const bool all_skipped = skipped == static_cast<std::int64_t>(self.child_count());
    return end(self, all_skipped ? Status::kSkipped : Status::kSuccess);
  }
  void on_halted(Context& /*self*/) { reached = 0; }

  Next end(Context& self, Status status) {
    reached = 0;
    return finished(self, status);
  }
  [[nodiscard]] Value save() const { return Map{{"reached", reached}, {"skipped", skipped}}; }
  [[nodiscard]] bool restore(const Value& saved) {
    reached = member(saved, "reached");
    skipped = member(saved, "skipped");
    return true;
  }
  friend bool operator==(const PipelineSequence&, const PipelineSequence&) = default;
};

/// Ticks all children at each tick, however many of them run.
struct NonblockingSequence {
  std::int64_t running = 0;
  std::int64_t skipped = 0;

  Next on_tick(Context& /*self*/) {
    running = skipped = 0;
    return Next::tick(0);
  }
  Next on_child(Context& self, std::size_t child, Status status) {
    if (status == Status::kFailure) return finished(self, status);
    if (status == Status::kRunning) ++running;
    if (status == Status::kSkipped) ++skipped;
    if (child + 1 < self.child_count()) return Next::tick(child + 1);
    if (running > 0) return Next::done(Status::kRunning);
    const bool all_skipped = skipped == static_cast<std::int64_t>(self.child_count());
    return finished(self, all_skipped ? Status::kSkipped : Status::kSuccess);
  }
  [[nodiscard]] Value save() const { return Map{{"running", running}, {"skipped", skipped}}; }
  [[nodiscard]] bool restore(const Value& saved) {
    running = member(saved, "running");
    skipped = member(saved, "skipped");
    return true;
  }
  friend bool operator==(const NonblockingSequence&, const NonblockingSequence&) = default;
};

/// The first child until it succeeds; between its failures the second one, so many times.
struct RecoveryNode {
  std::int64_t retries = 0;
  std::int64_t recovering = 0;

  static Ports ports() {
    return {bt::input_default<std::int32_t>("number_of_retries", "1", "how often the first child is tried again")};
  }
  Next on_tick(Context& self) {
    if (self.child_count() != 2) {
      self.fail("must have 2 children, what to do and how to recover, and has " + std::to_string(self.child_count()));
      return Next::done(Status::kFailure);
    }
    return Next::tick(recovering != 0 ? 1 : 0);
  }
  Next on_child(Context& self, std::size_t child, Status status) {
    if (status == Status::kRunning) return Next::done(status);
    if (child == 1) {
      if (status != Status::kSuccess) return end(self, Status::kFailure);
      ++retries;
      recovering = 0;
      self.reset_children();
      return Next::tick(0);
    }
    if (status != Status::kFailure) return end(self, status);
    const auto limit = self.input<std::int32_t>("number_of_retries");
    if (!limit) {
      self.fail("needs number_of_retries as a whole number: " + limit.error().message);
      return Next::done(Status::kFailure);
    }
    if (retries >= *limit) return end(self, status);
    recovering = 1;
    return Next::tick(1);
  }
  void on_halted(Context& /*self*/) { retries = recovering = 0; }

  Next end(Context& self, Status status) {
    retries = recovering = 0;
    return finished(self, status);
  }
  [[nodiscard]] Value save() const { return Map{{"retries", retries}, {"recovering", recovering}}; }
  [[nodiscard]] bool restore(const Value& saved) {
    retries = member(saved, "retries");
    recovering = member(saved, "recovering");
    return recovering == 0 || recovering == 1;
  }
  friend bool operator==(const RecoveryNode&, const RecoveryNode&) = default;
};

/// One child after the other until one succeeds; the next activation goes on behind that one.
struct RoundRobin {
  std::int64_t current = 0;
  std::int64_t failed = 0;
  std::int64_t skipped = 0;

  Next on_tick(Context& self) {
    if (self.status() != Status::kRunning) failed = skipped = 0;
    return Next::tick(static_cast<std::size_t>(current));
  }
  Next on_child(Context& self, std::size_t child, Status status) {
    if (status == Status::kRunning) return Next::done(status);
    const auto count = static_cast<std::int64_t>(self.child_count());
    current = (static_cast<std::int64_t>(child) + 1) % count;
    if (status == Status::kSuccess) return finished(self, status);
    ++(status == Status::kSkipped ? skipped : failed);
    if (failed + skipped < count) return Next::tick(static_cast<std::size_t>(current));
    return finished(self, failed == 0 ? Status::kSkipped : Status::kFailure);
  }
  void on_halted(Context& /*self*/) { current = failed = skipped = 0; }

  [[nodiscard]] Value save() const { return Map{{"current", current}, {"failed", failed}, {"skipped", skipped}}; }
  [[nodiscard]] bool restore(const Value& saved) {
    current = member(saved, "current");
    failed = member(saved, "failed");
    skipped = member(saved, "skipped");
    return current >= 0;
  }
  friend bool operator==(const RoundRobin&, const RoundRobin&) = default;
};

/// A Sequence whose place is an entry: it survives halting and failing, and others may change it.
struct PersistentSequence {
  static Ports ports() { return {bt::inout<std::int32_t>("current_child_idx", "which child is next, from 0")}; }

  Next on_tick(Context& self) {
    const auto place = self.input<std::int32_t>("current_child_idx");
    if (!place || *place < 0 || static_cast<std::size_t>(*place) >= self.child_count()) {
      self.fail(!place ? "needs current_child_idx: " + place.error().message
                       : "current_child_idx is " + std::to_string(*place) + "; it has " +
                             std::to_string(self.child_count()) + " children");
      return Next::done(Status::kFailure);
    }
    return Next::tick(static_cast<std::size_t>(*place));
  }
  Next on_child(Context& self, std::size_t child, Status status) {
    if (status == Status::kRunning) return Next::done(status);
    if (status == Status::kFailure) return finished(self, status);
    const bool is_last = child + 1 == self.child_count();
    // An entry that cannot be written gives the tick up by itself.
    (void)self.output<std::int32_t>("current_child_idx", is_last ? 0 : static_cast<std::int32_t>(child + 1));
    return is_last ? finished(self, Status::kSuccess) : Next::tick(child + 1);
  }
  friend bool operator==(const PersistentSequence&, const PersistentSequence&) = default;
};

/// Ticks its child at most so often; in between it is RUNNING. A child that runs is ticked on.
struct RateController {
  std::int64_t since_ns = 0;
  bool first = true;

  static Ports ports() { return {bt::input_default<double>("hz", "10.0", "ticks of the child in a second, at most")}; }

  Next on_tick(Context& self) {
    const auto hz = self.input<double>("hz");
    if (!hz || !(*hz > 0)) {
      self.fail(!hz ? "needs hz: " + hz.error().message : "hz must be greater than 0");
      return Next::done(Status::kFailure);
    }
    if (self.status() == Status::kIdle) {
      since_ns = self.now().time_since_epoch().count();
      first = true;
    }
    const double waited_s = 1e-9 * static_cast<double>(self.now().time_since_epoch().count() - since_ns);
    // A tick that comes a nanosecond early, since periods are rounded to those, is in time.
    constexpr double kRoundingS = 1e-9;
    const bool due = first || self.child_status(0) == Status::kRunning || waited_s + kRoundingS >= 1.0 / *hz;
    return due ? Next::tick(0) : Next::done(Status::kRunning);
  }
  Next on_child(Context& self, std::size_t /*child*/, Status status) {
    first = false;
    if (status == Status::kSuccess) since_ns = self.now().time_since_epoch().count();
    return Next::done(status);
  }
  [[nodiscard]] Value save() const { return Map{{"since_ns", since_ns}, {"first", first}}; }
  [[nodiscard]] bool restore(const Value& saved) {
    since_ns = member(saved, "since_ns");
    const Value* const flag = saved.find("first");
    if (flag == nullptr || flag->as_bool() == nullptr) return false;
    first = *flag->as_bool();
    return true;
  }
  friend bool operator==(const RateController&, const RateController&) = default;
};

/// Its child once; FAILURE from then on, until the node is reset.
struct SingleTrigger {
  bool done = false;

  Next on_tick(Context& self) {
    if (self.status() == Status::kIdle) done = false;
    return done ? Next::done(Status::kFailure) : Next::tick(0);
  }
  Next on_child(Context& /*self*/, std::size_t /*child*/, Status status) {
    done = status == Status::kSuccess || status == Status::kFailure;
    return Next::done(status);
  }
  [[nodiscard]] Value save() const { return done; }
  [[nodiscard]] bool restore(const Value& saved) {
    if (saved.as_bool() == nullptr) return false;
    done = *saved.as_bool();
    return true;
  }
  friend bool operator==(const SingleTrigger&, const SingleTrigger&) = default;
};

/// Its child at first, and again when the goal or the goals on the blackboard have changed; else it is RUNNING.
struct GoalUpdatedController {
  Value seen;

  static Ports ports() {
    return {bt::input("goal", "the goal that is watched"), bt::input("goals", "the goals that are watched")};
  }
  Next on_tick(Context& self) {
    Value now = List{detail::held(self, "goal"), detail::held(self, "goals")};
    const bool updated = self.status() == Status::kIdle || !(now == seen);
    seen = std::move(now);
    const bool due = updated || self.child_status(0) == Status::kRunning;
    return due ? Next::tick(0) : Next::done(Status::kRunning);
  }
  Next on_child(Context& /*self*/, std::size_t /*child*/, Status status) { return Next::done(status); }
  [[nodiscard]] Value save() const { return seen; }
  [[nodiscard]] bool restore(const Value& saved) {
    seen = saved;
    return true;
  }
  friend bool operator==(const GoalUpdatedController&, const GoalUpdatedController&) = default;
};

bt::NodeModel model(std::string id, bt::Category category, Ports ports, std::string description) {
  return {std::move(id), category, std::move(ports), std::move(description)};
}

}  // namespace

void add_nodes(bt::Registry& registry) {
  using enum bt::Category;
  registry.add<PipelineSequence>("PipelineSequence", kControl);
  registry.add<NonblockingSequence>("NonblockingSequence", kControl);
  registry.add<RecoveryNode>("RecoveryNode", kControl);
  registry.add<RoundRobin>("RoundRobin", kControl);
  registry.add<PersistentSequence>("PersistentSequence", kControl);
  registry.add<RateController>("RateController", kDecorator);
  registry.add<SingleTrigger>("SingleTrigger", kDecorator);
  registry.add<GoalUpdatedController>("GoalUpdatedController", kDecorator);
  detail::add_leaves(registry);
}

const std::vector<bt::NodeModel>& models() {
  using enum bt::Category;
  static const std::vector<bt::NodeModel> kModels = [] {
    std::vector<bt::NodeModel> all = {
        model("PauseResumeController", kControl,
              {bt::input<std::string>("pause_service_name"), bt::input<std::string>("resume_service_name")},
              "pauses and resumes what is below it when services are called"),
        model("DistanceController", kDecorator,
              {bt::input_default<double>("distance", "1.0", "metres between two ticks of the child"),
               bt::input_default<std::string>("global_frame", "map"),
               bt::input_default<std::string>("robot_base_frame", "base_link")},
              "ticks its child each time the robot has gone so far"),
        model("SpeedController", kDecorator,
              {bt::input_default<double>("min_rate", "0.1"), bt::input_default<double>("max_rate", "1.0"),
               bt::input_default<double>("min_speed", "0.0"), bt::input_default<double>("max_speed", "0.5"),
               bt::input_default<double>("filter_duration", "0.3")},
              "ticks its child the more often the faster the robot goes"),
    };
    for (bt::NodeModel& each : detail::skill_models()) all.push_back(std::move(each));
    return all;
  }();
  return kModels;
}

}  // namespace sentree::nav2
