#include "bt_peer.h"

#include <behaviortree_cpp/bt_factory.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <map>

namespace sentree::peer {

namespace {

constexpr const char* kPrefix = "BehaviorTree.CPP:";

class AddOne final : public BT::SyncActionNode {
 public:
  AddOne(const std::string& name, const BT::NodeConfig& config) : SyncActionNode(name, config) {}
  static BT::PortsList providedPorts() { return {BT::InputPort<double>("in"), BT::OutputPort<double>("out")}; }
  BT::NodeStatus tick() override {
    const auto value = getInput<double>("in");
    if (!value) return BT::NodeStatus::FAILURE;
    setOutput("out", value.value() + 1.0);
    return BT::NodeStatus::SUCCESS;
  }
};

class GoTo final : public BT::StatefulActionNode {
 public:
  GoTo(const std::string& name, const BT::NodeConfig& config) : StatefulActionNode(name, config) {}
  static BT::PortsList providedPorts() { return {}; }
  BT::NodeStatus onStart() override { return BT::NodeStatus::RUNNING; }
  BT::NodeStatus onRunning() override { return BT::NodeStatus::RUNNING; }
  void onHalted() override {}
};

class Turn final : public BT::StatefulActionNode {
 public:
  Turn(const std::string& name, const BT::NodeConfig& config) : StatefulActionNode(name, config) {}
  static BT::PortsList providedPorts() { return {}; }
  BT::NodeStatus onStart() override { return BT::NodeStatus::SUCCESS; }
  BT::NodeStatus onRunning() override { return BT::NodeStatus::SUCCESS; }
  void onHalted() override {}
};

void register_nodes(BT::BehaviorTreeFactory& factory) {
  factory.registerSimpleAction("UserSync", [](BT::TreeNode&) { return BT::NodeStatus::SUCCESS; });
  factory.registerSimpleCondition("BatteryLow", [](BT::TreeNode&) { return BT::NodeStatus::FAILURE; });
  factory.registerSimpleCondition("BatteryOk", [](BT::TreeNode&) { return BT::NodeStatus::SUCCESS; });
  factory.registerNodeType<AddOne>("AddOne");
  factory.registerNodeType<GoTo>("GoTo");
  factory.registerNodeType<Turn>("Turn");
}

/// Keeps the least time of each benchmark, by its name without the prefix: ours first, the peer's second.
class RatioReporter final : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.iterations == 0) continue;
      std::string name = run.benchmark_name();
      const bool is_peer = name.starts_with(kPrefix);
      if (is_peer) name.erase(0, std::string(kPrefix).size());
      double& least = is_peer ? times_[name].second : times_[name].first;
      const double time_s = run.real_accumulated_time / static_cast<double>(run.iterations);
      least = least == 0 ? time_s : std::min(least, time_s);
    }
  }

  void Finalize() override {
    ConsoleReporter::Finalize();
    std::printf("\n%-45s %14s %14s %8s\n", "", "ours [ns]", "peer [ns]", "faster");
    for (const auto& [name, both] : times_) {
      if (both.first == 0 || both.second == 0) continue;
      std::printf("%-45s %14.0f %14.0f %7.1fx\n", name.c_str(), both.first * 1e9, both.second * 1e9,
                  both.second / both.first);
    }
  }

 private:
  std::map<std::string, std::pair<double, double>> times_;
};

}  // namespace

void tick(benchmark::State& bench, const std::string& xml, bool exactly_once) {
  try {
    BT::BehaviorTreeFactory factory;
    register_nodes(factory);
    BT::Tree tree = factory.createTreeFromText(xml);
    for (int i = 0; i < 10; ++i) tree.tickExactlyOnce();
    for (auto _ : bench) benchmark::DoNotOptimize(exactly_once ? tree.tickExactlyOnce() : tree.tickOnce());
  } catch (const std::exception& thrown) {
    bench.SkipWithError(thrown.what());
  }
}

void load(benchmark::State& bench, const std::string& xml) {
  try {
    BT::BehaviorTreeFactory factory;
    register_nodes(factory);
    for (auto _ : bench) {
      BT::Tree tree = factory.createTreeFromText(xml);
      benchmark::DoNotOptimize(tree);
    }
  } catch (const std::exception& thrown) {
    bench.SkipWithError(thrown.what());
  }
}

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  benchmark::Shutdown();
  return 0;
}

}  // namespace sentree::peer
