// A robot program with a node of every kind. patrol MISSION.xml [PLUGIN.so …]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pose.h"
#include "sentree/exec/coroutine_action.h"
#include "sentree/exec/executor.h"
#include "sentree/exec/threaded_action.h"

namespace bt = sentree::bt;
namespace exec = sentree::exec;

namespace {

/// A stateful action. Its object is what the node remembers, and travels with the tree's state.
struct DriveTo {
  double left_m = 0;

  static bt::Ports ports() { return {bt::input<Pose>("pose"), bt::input_default<double>("speed", "1.0", "[m/tick]")}; }
  bt::Status on_start(bt::Context& self) {
    const auto pose = self.input<Pose>("pose");
    if (!pose) return bt::Status::kFailure;
    left_m = std::hypot(pose->x, pose->y);
    std::printf("driving to (%g, %g)\n", pose->x, pose->y);
    return bt::Status::kRunning;
  }
  bt::Status on_running(bt::Context& self) {
    left_m -= self.input_or("speed", 1.0);
    return left_m > 0 ? bt::Status::kRunning : bt::Status::kSuccess;
  }
  void on_halted(bt::Context&) { std::puts("stopping"); }

  sentree::Value save() const { return left_m; }
  bool restore(const sentree::Value& saved) {
    left_m = saved.number();
    return saved.is_number();
  }
};

/// A decorator that ticks its child once for each pose of a list.
struct ForEachPose {
  int next = 0;

  static bt::Ports ports() { return {bt::input<std::vector<Pose>>("path"), bt::output<Pose>("pose")}; }
  bt::Next on_tick(bt::Context& self) {
    if (self.status() == bt::Status::kIdle) next = 0;
    return go_on(self);
  }
  bt::Next on_child(bt::Context& self, std::size_t, bt::Status status) {
    if (status == bt::Status::kRunning) return bt::Next::done(status);
    self.reset_child(0);
    if (status == bt::Status::kFailure) return bt::Next::done(status);
    ++next;
    return go_on(self);
  }
  bt::Next go_on(bt::Context& self) {
    const auto path = self.input<std::vector<Pose>>("path");
    if (!path) return bt::Next::done(bt::Status::kFailure);
    const auto place = static_cast<std::size_t>(next);
    if (place >= path->size()) return bt::Next::done(bt::Status::kSuccess);
    if (!self.output("pose", (*path)[place])) return bt::Next::done(bt::Status::kFailure);
    return bt::Next::tick(0);
  }

  sentree::Value save() const { return next; }
  bool restore(const sentree::Value& saved) {
    next = static_cast<int>(saved.number());
    return saved.is_number();
  }
};

/// Hands something over: waits, without a thread, for the hand to be pulled.
exec::Task handover(exec::Coroutine& self) {
  const double wait_s = self->input_or("seconds", 1.0);
  std::puts("please take it");
  co_await self.sleep(sentree::from_seconds(wait_s));
  std::puts("thank you");
  co_return bt::Status::kSuccess;
}

void register_nodes(bt::Registry& registry, const std::shared_ptr<exec::Threads>& threads) {
  // A condition.
  registry.condition("BatteryOk", {bt::input<double>("percent")}, [](bt::Context& self) {
    return self.input_or("percent", 0.0) > 20 ? bt::Status::kSuccess : bt::Status::kFailure;
  });
  // An action that is done at once.
  registry.action("Say", {bt::input("text")}, [](bt::Context& self) {
    std::printf("the path has %s m\n", self.input_or<std::string>("text", "?").c_str());
    return bt::Status::kSuccess;
  });
  registry.add<DriveTo>("DriveTo");
  registry.add<ForEachPose>("ForEachPose", bt::Category::kDecorator);
  // A control: its children twice over, here with only one.
  struct Twice {
    int round = 0;
    bt::Next on_tick(bt::Context&) {
      round = 0;
      return bt::Next::tick(0);
    }
    bt::Next on_child(bt::Context& self, std::size_t child, bt::Status status) {
      if (status != bt::Status::kSuccess) return bt::Next::done(status);
      if (child + 1 < self.child_count()) return bt::Next::tick(child + 1);
      self.reset_children();
      return ++round < 2 ? bt::Next::tick(0) : bt::Next::done(status);
    }
    sentree::Value save() const { return round; }
    bool restore(const sentree::Value& saved) { return saved.is_number(); }
  };
  registry.add<Twice>("Twice", bt::Category::kControl);
  // Hard work in a thread: the tree goes on meanwhile, and can halt it.
  exec::threaded_action(registry, threads, "Plan",
                        {bt::input<Pose>("from"), bt::input<Pose>("to"), bt::output<std::vector<Pose>>("path"),
                         bt::output<double>("length")},
                        [](exec::Job& job) {
                          const auto from = job.input<Pose>("from");
                          const auto to = job.input<Pose>("to");
                          if (!from || !to) return bt::Status::kFailure;
                          std::vector<Pose> path;
                          for (int i = 1; i <= 2 && !job.stop_requested(); ++i)
                            path.push_back({from->x + (to->x - from->x) * i / 2, from->y + (to->y - from->y) * i / 2});
                          job.output("length", std::hypot(to->x - from->x, to->y - from->y));
                          job.output("path", std::move(path));
                          return bt::Status::kSuccess;
                        });
  // A function that waits in the middle.
  exec::coroutine_action(registry, "Handover", {bt::input<double>("seconds")}, handover);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: patrol MISSION.xml [PLUGIN.so ...]\n");
    return 2;
  }
  bt::Registry registry;
  register_nodes(registry, std::make_shared<exec::Threads>());
  for (int i = 2; i < argc; ++i) {
    if (const auto loaded = registry.plugin(argv[i]); !loaded) {
      std::fprintf(stderr, "%s\n", to_string(loaded.error()).c_str());
      return 3;
    }
  }
  auto tree = bt::load_file(argv[1], {.registry = &registry});
  for (const auto& finding : tree.diagnostics) std::fprintf(stderr, "%s\n", to_string(finding).c_str());
  if (!tree.ok()) return 3;

  exec::Executor executor(std::move(*tree.value), {.period = std::chrono::milliseconds(10)});
  const bt::Status status = executor.run();
  if (executor.error()) std::fprintf(stderr, "%s\n", to_string(*executor.error()).c_str());
  std::printf("%s\n", std::string(to_string(status)).c_str());
  return status == bt::Status::kSuccess ? 0 : 1;
}
