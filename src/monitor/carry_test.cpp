#include "sentree/monitor/carry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/base/rng.h"
#include "sentree/monitor/quick.h"

namespace sentree::monitor {
namespace {

using std::chrono::milliseconds;

Model carried_model(const std::string& states) {
  auto loaded = scxml::load(
      "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>" + states + "</scxml>",
      "m.scxml");
  EXPECT_TRUE(loaded.ok());
  auto made = Model::make({.name = "m", .chart = *loaded.value, .violated = {"bad"}, .renames = {}, .span = {}});
  EXPECT_TRUE(made.ok());
  return *made.value;
}

Message carried_message(const std::string& name, int ms, Value data = Map()) {
  Message m;
  m.name = name;
  m.time = TimePoint(milliseconds(ms));
  m.data = std::move(data);
  return m;
}

constexpr auto kOnce = R"(
  <datamodel><data id='n' expr='0'/></datamodel>
  <state id='idle'><transition event='go' target='waits'/></state>
  <state id='waits'>
    <onentry><send event='late' delay='1s'/></onentry>
    <transition event='done' target='idle'><assign location='n' expr='n + 1'/></transition>
    <transition event='late' target='bad'/>
  </state>
  <state id='bad'><transition event='go' target='waits'/></state>)";

TEST(CarryMonitor, KeepsAnOpenDeadline) {
  const Model before = carried_model(kOnce);
  const Model after = carried_model("<state id='new'/>" + std::string(kOnce));
  State state = start(before, TimePoint{});
  (void)observe(before, state, carried_message("go", 100));
  auto carried = carry(before, state, after, TimePoint(milliseconds(500)));
  ASSERT_TRUE(carried.ok());
  EXPECT_EQ(next_timer(after, *carried.value), TimePoint(milliseconds(1100)));
  const Decisions decisions = advance(after, *carried.value, TimePoint(milliseconds(2000)));
  ASSERT_EQ(decisions.size(), 1U);
  EXPECT_EQ(decisions[0].at, TimePoint(milliseconds(1100)));
  EXPECT_FALSE(decisions[0].witness_complete);
}

TEST(CarryMonitor, KeepsWhatWasDecided) {
  const Model before = carried_model(kOnce);
  State state = start(before, TimePoint{});
  (void)observe(before, state, carried_message("go", 100));
  (void)advance(before, state, TimePoint(milliseconds(2000)));
  auto carried =
      carry(before, state, carried_model("<state id='new'/>" + std::string(kOnce)), TimePoint(milliseconds(2000)));
  ASSERT_TRUE(carried.ok());
  EXPECT_EQ(carried.value->verdict, Verdict::kViolated);
  EXPECT_EQ(carried.value->trail.violations, 1U);
}

TEST(WithoutWitnesses, DecidesTheSameAtTheSameTimes) {
  const Model whole = carried_model(kOnce);
  const Model quick = without_witnesses(whole);
  int decided = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    State a = start(whole, TimePoint{});
    State b = start(quick, TimePoint{});
    int now = 0;
    for (int i = 0; i < 600; ++i) {
      now += static_cast<int>(rng.below(rng.below(20) == 0 ? 1200 : 200));
      const Message m = carried_message(rng.below(3) == 0 ? "go" : "done", now);
      const Decisions x = observe(whole, a, m);
      const Decisions y = observe(quick, b, m);
      ASSERT_EQ(x.size(), y.size());
      for (std::size_t d = 0; d < x.size(); ++d) {
        ++decided;
        EXPECT_EQ(x[d].verdict, y[d].verdict);
        EXPECT_EQ(x[d].at, y[d].at);
        EXPECT_TRUE(y[d].witness.empty());
      }
    }
    EXPECT_EQ(static_cast<const Core&>(a), static_cast<const Core&>(b));
    EXPECT_EQ(vacuity(whole, a), vacuity(quick, b));
    EXPECT_TRUE(b.trail.history->empty());
  }
  EXPECT_GT(decided, 20);
}

}  // namespace
}  // namespace sentree::monitor
