// The whole system but the machine: random trees, charts, interfaces, components, faults and times from one seed, in
// virtual time.
//
// SENTREE_SEEDS=N runs N missions instead of the usual ones, SENTREE_SEED=S only that of seed S.

#include <gtest/gtest.h>

#include <functional>
#include <iostream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/mission/detail/test_random_mission.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

using mission::MissionGenerator;
using mission::RandomMission;
using mission::RandomNode;

constexpr std::uint64_t kSeeds = 700;
// A mission that says more has said it before: it ends there.
constexpr std::uint64_t kObservationsMax = 3000;

// A project that holds what is tried.
class Bench {
 public:
  // What is wrong with a mission; empty: nothing.
  std::string judge(const RandomMission& mission) {
    const auto file = project_.write(mission);
    if (!file) return to_string(file.error());
    auto scenario = project::load_scenario(*file);
    if (!scenario.ok()) return "";  // shrunk to what no project may be
    auto plan = project::prepare(std::move(*scenario.value));
    if (!plan.ok()) return "";

    Rng rng(mission.seed ^ 0x5eedU);
    const TimePoint moment(Duration(static_cast<std::int64_t>(rng.below(40'000'000'000U))));
    std::optional<mission::State> middle;
    const std::vector<Message> first = run(*plan.value, nullptr, [&](RunInside& inside) {
      inside.scheduler().at(inside.director(), moment, mission::Rank::kInjection, [&] { middle = inside.capture(); });
    });
    // A chart that asks again at once whenever it is answered ends its run with that message.
    if (error_.find("without time passing") != std::string::npos) return "";
    if (!error_.empty()) return "the run could not go on: " + error_;
    ++runs_;
    observations_ += first.size();
    steps_ += executed_;
    if (std::string wrong = unanswered(first); !wrong.empty()) return wrong;
    const std::vector<Message> second = run(*plan.value, nullptr, {});
    if (first != second) return "the same seed gave another run";
    if (middle) {
      const auto saved = mission::save(*plan.value, *middle);
      const auto restored = saved ? mission::restore(*plan.value, *saved) : tl::unexpected(saved.error());
      if (!restored) return "a copy at " + shortest_decimal(seconds(moment)) + " s: " + to_string(restored.error());
      if (*restored != *middle) return "a copy at " + shortest_decimal(seconds(moment)) + " s came back differently";
      const std::vector<Message> rest = run(*plan.value, &*restored, {});
      if (!std::equal(rest.begin(), rest.end(), first.begin() + static_cast<std::ptrdiff_t>(middle->published),
                      first.end()))
        return "a copy at " + shortest_decimal(seconds(moment)) + " s went on differently";
    }
    return "";
  }

  std::uint64_t runs() const { return runs_; }
  std::uint64_t observations() const { return observations_; }
  // Deliveries and calls that were executed and said something.
  std::uint64_t steps() const { return steps_; }

 private:
  std::vector<Message> run(const project::Plan& plan, const mission::State* from,
                           std::function<void(RunInside&)> begin) {
    std::vector<Message> said;
    RunOptions options;
    options.from = from;
    const std::uint64_t before = from != nullptr ? from->published : 0;
    RunInside* inside = nullptr;
    executed_ = 0;
    std::uint64_t last = static_cast<std::uint64_t>(-1);
    options.listeners.push_back([&](const Message& message) {
      said.push_back(message);
      const std::uint64_t executes = inside->scheduler().place().order;
      executed_ += std::exchange(last, executes) != executes ? 1U : 0U;
      if (before + said.size() == kObservationsMax) inside->end();
    });
    options.on_begin = [&](RunInside& of) {
      inside = &of;
      if (begin) begin(of);
    };
    runtime::Run run(plan, std::move(options));
    error_ = run.execute().error;
    return said;
  }

  // Each tick and each halt is answered once, or counted as late, or made void by a halt, a cancellation or the end.
  static std::string unanswered(const std::vector<Message>& messages) {
    std::map<std::uint64_t, const Message*> open;
    std::map<std::string, std::uint64_t> ticking;
    for (const Message& message : messages) {
      const bool asks = message.source == "mission" && message.kind == MessageKind::kRequest;
      if (asks && message.name.ends_with(".tick.request")) {
        if (ticking[message.target] != 0) return message.target + " was ticked while a tick was outstanding";
        ticking[message.target] = message.call;
      }
      if (message.source == "mission" &&
          (message.name.ends_with(".halt.request") || message.name.ends_with(".cancel"))) {
        open.erase(std::exchange(ticking[message.target], 0));
      }
      if (asks) {
        if (!open.emplace(message.call, &message).second) return "call " + std::to_string(message.call) + " twice";
      } else if (message.target == "mission" && message.call != 0) {
        if (open.erase(message.call) == 0) return message.name + " of " + message.source + " answers nothing";
        if (message.name.find(".tick.") != std::string::npos) ticking[message.source] = 0;
      }
    }
    return "";
  }

  TemporaryFolder folder_{"random"};
  mission::RandomProject project_{folder_.path() / "p"};
  std::string error_;
  std::uint64_t runs_ = 0;
  std::uint64_t observations_ = 0;
  std::uint64_t executed_ = 0;  // of the last run
  std::uint64_t steps_ = 0;
};

// Whatever is left out of a mission that fails without it failing less.
RandomMission shrunk(Bench& bench, RandomMission mission) {
  int tries = 200;
  const auto fails = [&](const RandomMission& less) { return tries-- > 0 && !bench.judge(less).empty(); };
  for (std::size_t i = mission.timeline.size(); i-- > 0;) {
    RandomMission less = mission;
    less.timeline.erase(less.timeline.begin() + static_cast<std::ptrdiff_t>(i));
    if (fails(less)) mission = std::move(less);
  }
  // Each node in turn becomes one of its children, or loses one.
  const std::function<bool(RandomMission&, RandomNode&)> less_of = [&](RandomMission& whole, RandomNode& node) {
    for (std::size_t i = 0; i < node.children.size(); ++i) {
      const RandomNode before = node;
      RandomNode child = node.children[i];
      node = std::move(child);
      if (fails(whole)) return true;
      node = before;
      if (node.children.size() > 1) {
        node.children.erase(node.children.begin() + static_cast<std::ptrdiff_t>(i));
        if (fails(whole)) return true;
        node = before;
      }
      if (less_of(whole, node.children[i])) return true;
    }
    return false;
  };
  while (tries > 0 && less_of(mission, mission.tree)) {
  }
  return mission;
}

TEST(RandomMissions, EndAnswerOnceAndAreTheSameAgain) {
  Bench bench;
  for (const std::uint64_t seed : seeds(kSeeds)) {
    const RandomMission mission = MissionGenerator(seed).make();
    const std::string wrong = bench.judge(mission);
    if (wrong.empty()) continue;
    const RandomMission less = shrunk(bench, mission);
    std::string files;
    for (const auto& [name, text] : mission::files_of(less)) files += name + ":\n" + text;
    FAIL() << "seed " << seed << ": " << wrong << "\nshrunk: " << bench.judge(less)
           << "\nIn a copy of examples/recharge:\n"
           << files;
  }
  std::cout << bench.runs() << " missions, " << bench.observations() << " observations, " << bench.steps()
            << " steps\n";
  EXPECT_GT(bench.runs(), seeds(kSeeds).size() / 2);  // the others are refused
  // Of 24,000 missions, as `./test --long` has them, more than ten million.
  constexpr std::uint64_t kStepsOfAMission = 420;
  if (!is_one_seed()) EXPECT_GT(bench.steps(), seeds(kSeeds).size() * kStepsOfAMission);
}

}  // namespace
}  // namespace sentree::runtime
