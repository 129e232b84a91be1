// Saved runs in which one thing is not as a run leaves it, with a checksum that is right: they are refused, or go on.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree::runtime {
namespace {

using mission::Delivery;
using mission::Rank;
using mission::TreeDelivery;
using mission::TreeState;

struct Damage {
  std::string name;
  std::function<void(mission::State&)> apply;
};

std::vector<Damage> damages(const mission::State& sound) {
  std::vector<Damage> all;
  const auto add = [&](std::string name, std::function<void(mission::State&)> apply) {
    all.push_back({std::move(name), std::move(apply)});
  };
  const auto arrives = [](mission::State& state, TreeDelivery what) {
    state.queue.insert(state.queue.begin(),
                       {state.now, Rank::kMessage, state.order++, {Delivery::kTree, std::move(what)}});
  };
  for (int phase = 0; phase < 4; ++phase) {
    for (const bool over : {false, true}) {
      add(fmt::format("phase {}, over {}", phase, over), [=](mission::State& state) {
        state.tree.phase = static_cast<mission::TreePhase>(phase);
        state.tree.over = over;
      });
    }
  }
  for (std::size_t i = 0; i < sound.skills.size(); ++i) {
    for (int phase = 0; phase <= static_cast<int>(mission::SkillPhase::kKilled); ++phase)
      add(fmt::format("skill {} in phase {}", i, phase),
          [=](mission::State& state) { state.skills[i].phase = static_cast<mission::SkillPhase>(phase); });
    add(fmt::format("skill {} one tick ahead", i), [=](mission::State& state) { ++state.skills[i].tick; });
    add(fmt::format("skill {} asked", i),
        [=](mission::State& state) { state.skills[i].asked = !state.skills[i].asked; });
    add(fmt::format("skill {} to be halted long ago", i),
        [=](mission::State& state) { state.skills[i].halt_due = TimePoint{}; });
    add(fmt::format("skill {} to be woken long ago", i),
        [=](mission::State& state) { state.skills[i].wake = TimePoint{}; });
    add(fmt::format("leaf {} owes another tick", i),
        [=](mission::State& state) { state.tree.leaves[i].outstanding = 7777; });
    add(fmt::format("leaf {} asked before time", i),
        [=](mission::State& state) { state.tree.leaves[i].asked = TimePoint::min(); });
    add(fmt::format("leaf {} answered nothing too late", i),
        [=](mission::State& state) { state.tree.leaves[i].late = TreeState::Completed{}; });
    add(fmt::format("leaf {} holds that it was skipped", i), [=](mission::State& state) {
      state.tree.leaves[i].held = {bt::Status::kSkipped, {}};
    });
    for (int status = 0; status <= static_cast<int>(bt::Status::kSkipped); ++status) {
      add(fmt::format("leaf {} answers status {}", i, status), [=](mission::State& state) {
        state.tree.leaves[i].outstanding = 5;
        arrives(state, mission::Answered{i, 5, static_cast<bt::Status>(status), {}});
      });
    }
    add(fmt::format("leaf {} has halted", i), [=](mission::State& state) {
      state.tree.leaves[i].halt_call = 3;
      arrives(state, mission::Halted{i});
    });
  }
  add("the limit of halts", [=](mission::State& state) { arrives(state, mission::HaltLimit{}); });
  add("nothing on its way", [](mission::State& state) { state.queue.clear(); });
  add("the last first", [](mission::State& state) { std::reverse(state.queue.begin(), state.queue.end()); });
  add("all overdue", [](mission::State& state) {
    for (mission::Waiting& waiting : state.queue) waiting.when = TimePoint{};
  });
  add("the end of time", [](mission::State& state) { state.now = TimePoint::max(); });
  add("near the end of time", [](mission::State& state) {
    state.now = TimePoint::max() - Duration(10);
    state.tree.planned = state.now;
  });
  add("the next tick at the end of time", [](mission::State& state) { state.tree.planned = TimePoint::max(); });
  add("the last tick before time", [](mission::State& state) { state.tree.began = TimePoint::min(); });
  add("the timer before time", [](mission::State& state) { state.tree.timer_at = TimePoint::min(); });
  add("the deadline long ago", [](mission::State& state) { state.tree.deadline.when = TimePoint{}; });
  add("killed, and unknown", [](mission::State& state) { state.down = {"nobody", "sim"}; });
  add("numbered from the start", [](mission::State& state) { state.order = 0; });
  add("numbered to the end", [](mission::State& state) {
    state.stamp = state.published = state.calls = state.tick = state.tree.ticks = ~std::uint64_t{0};
  });
  add("no such time given", [](mission::State& state) { state.tree.given_tick = 99'999; });
  add("no world", [](mission::State& state) { state.world.reset(); });
  return all;
}

TEST(DamagedState, IsRefusedOrGoesOn) {
  auto loaded = project::load_scenario(std::filesystem::path(SENTREE_SOURCE_DIR) /
                                       "examples/recharge/scenarios/experiment1.yaml");
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  loaded.value->virtual_time = true;
  loaded.value->duration = std::chrono::seconds(20);
  const auto plan = project::prepare(std::move(*loaded.value));
  ASSERT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  int refused = 0;
  int accepted = 0;
  // Between two ticks, and while a leaf owes its answer.
  for (const Duration at : {Duration(5'050'000'000), Duration(5'000'000'001)}) {
    std::optional<mission::State> sound;
    RunOptions options;
    options.on_begin = [&](RunInside& inside) {
      inside.scheduler().at(inside.director(), TimePoint(at), Rank::kInjection, [&] {
        sound = inside.capture();
        inside.end();
      });
    };
    (void)runtime::Run(*plan.value, std::move(options)).execute();
    ASSERT_TRUE(sound.has_value());
    for (const Damage& damage : damages(*sound)) {
      SCOPED_TRACE(damage.name);
      mission::State state = *sound;
      damage.apply(state);
      const auto saved = mission::save(*plan.value, state);
      const auto restored = saved ? mission::restore(*plan.value, *saved) : tl::unexpected(saved.error());
      ++(restored ? accepted : refused);
      if (!restored) continue;
      RunOptions from;
      from.from = &*restored;
      (void)runtime::Run(*plan.value, std::move(from)).execute();
    }
  }
  std::printf("%d refused, %d go on\n", refused, accepted);
  EXPECT_GT(refused, 10);
  EXPECT_GT(accepted, 10);
}

}  // namespace
}  // namespace sentree::runtime
