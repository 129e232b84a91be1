#include "sentree/mission/memory_elsewhere.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/encoder.h"
#include "sentree/base/packed.h"
#include "sentree/scxml/step.h"

namespace sentree::mission {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

project::Plan plan_with_timers() {
  auto loaded = project::load_scenario(std::filesystem::path(SENTREE_SOURCE_DIR) /
                                       "examples/recharge/scenarios/experiment1.yaml");
  EXPECT_TRUE(loaded.ok());
  auto plan = project::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok());
  plan.value->leaves[0].chart = scxml::load(R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">
  <state id="s"><onentry><send event="later" delay="2s"/></onentry></state></scxml>)",
                                            "timer.scxml")
                                    .value;
  return std::move(*plan.value);
}

State new_state(const project::Plan& plan) {
  State state;
  state.skills.resize(plan.leaves.size());
  return state;
}

// At work, with a timer that rings two seconds after `now`.
SkillState waiting(const scxml::Chart& chart, TimePoint now) {
  SkillState skill;
  skill.phase = SkillPhase::kRunning;
  skill.run = 3;
  skill.tick = skill.answered = 40;
  scxml::Effects effects;
  scxml::Host host;
  scxml::execute(chart, skill.session, {.kind = scxml::StepOrder::Kind::kStart, .now = now, .event = {}, .options = {}},
                 effects, host);
  skill.wake = skill.session.next_timer();
  return skill;
}

TEST(MemoryElsewhere, IsThatOfTheSkillAtTheTimeOfTheRun) {
  const project::Plan plan = plan_with_timers();
  const TimePoint there(seconds(100));
  const TimePoint here(seconds(7));
  const SkillState skill = waiting(*plan.leaves[0].chart, there);
  State state = new_state(plan);
  state.queue.push_back({here + seconds(5), Rank::kTick, state.order++, {Delivery::kTree, TreeDelivery(Period{})}});
  const auto recalled = recall_skill(plan, 0, remember(*plan.leaves[0].chart, skill, there), here, state);
  ASSERT_TRUE(recalled) << recalled.error().message;
  EXPECT_EQ(state.skills[0], waiting(*plan.leaves[0].chart, here));
  // It waits for its timer, before what comes later.
  ASSERT_EQ(state.queue.size(), 2U);
  EXPECT_EQ(state.queue[0].when, here + seconds(2));
  EXPECT_EQ(state.queue[0].what, (Delivery{0, SkillDelivery(SkillTimer{here + seconds(2)})}));
}

TEST(MemoryElsewhere, OfASkillThatWasNeverAskedForAnythingIsNew) {
  const project::Plan plan = plan_with_timers();
  State state = new_state(plan);
  state.skills[0].run = 9;
  ASSERT_TRUE(recall_skill(plan, 0, remember(*plan.leaves[0].chart, {}, TimePoint(seconds(1))), {}, state));
  EXPECT_EQ(state, new_state(plan));
}

TEST(MemoryElsewhere, OfTheWorldGoesOnFromTheTimeOfTheRun) {
  const project::Plan plan = plan_with_timers();
  sim::State world = sim::initial_state(*plan.world, 5);
  world.time = TimePoint(seconds(30));
  State state = new_state(plan);
  const auto recalled = recall_world(plan, remember(world, TimePoint(seconds(31))), TimePoint(seconds(12)), state);
  ASSERT_TRUE(recalled) << recalled.error().message;
  ASSERT_TRUE(state.world);
  EXPECT_EQ(state.world->time, world.time);
  EXPECT_EQ(state.world->clock.run_anchor, TimePoint(seconds(12)));
  EXPECT_EQ(state.world->clock.sim_anchor, world.time);
}

// With a checksum that is right.
std::string sealed(const Value& told) {
  const std::string packed = pack(told);
  std::string memory("SMEM1");
  Encoder(memory).word(hash_bytes(packed));
  return memory + packed;
}

TEST(MemoryElsewhere, ThatNobodyToldIsRefusedAndChangesNothing) {
  const project::Plan plan = plan_with_timers();
  const scxml::Chart& chart = *plan.leaves[0].chart;
  const SkillState skill = waiting(chart, TimePoint(seconds(100)));
  const std::string sound = remember(chart, skill, TimePoint(seconds(100)));
  const State before = new_state(plan);
  State state = before;
  const auto refused = [&](std::string_view memory, std::size_t leaf = 0) {
    const auto recalled = recall_skill(plan, leaf, memory, TimePoint(seconds(7)), state);
    return !recalled && recalled.error().code == "mission.bad-state" && state == before;
  };
  for (std::size_t i = 0; i < sound.size(); ++i) {
    std::string damaged = sound;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x41);
    EXPECT_TRUE(refused(damaged)) << i;
    EXPECT_TRUE(refused(sound.substr(0, i))) << i;
  }
  EXPECT_TRUE(refused(std::string(kMemoryMax + 100, 'S')));
  EXPECT_TRUE(refused(sound, 1)) << "of another chart";
  EXPECT_FALSE(recall_world(plan, sound, TimePoint(seconds(7)), state));
  EXPECT_EQ(state, before);

  const auto lies = [&](const std::function<void(SkillState&)>& lie) {
    SkillState other = skill;
    lie(other);
    return refused(remember(chart, other, TimePoint(seconds(100))));
  };
  EXPECT_TRUE(lies([](SkillState& s) { s.phase = SkillPhase::kResting; }));
  EXPECT_TRUE(lies([](SkillState& s) { s.latest.transition = 7; }));
  EXPECT_TRUE(lies([](SkillState& s) { s.wake = TimePoint(seconds(-1)); }));
  EXPECT_TRUE(lies([](SkillState& s) { s.halt_due = kNever - milliseconds(1); }));
  EXPECT_TRUE(lies([](SkillState& s) {
    s.lines.push_back({.service = "x", .waiting = {}, .not_before = kNever - milliseconds(1)});
  }));
  for (const Value& told : {Value(), Value(Map{}), Value(Map{{"now", -1}, {"part", Value()}}),
                            Value(Map{{"now", INT64_MAX}, {"part", Value()}}), Value(Map{{"now", 1}, {"part", 1}}),
                            Value(Map{{"now", 1}, {"part", Map{}}}), Value(Map{{"now", "1"}, {"part", Value()}})})
    EXPECT_TRUE(refused(sealed(told))) << to_json(told);
}

}  // namespace
}  // namespace sentree::mission
