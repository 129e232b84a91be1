#include "sentree/scxml/carry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "sentree/scxml/step.h"

namespace sentree::scxml {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

Chart chart(const std::string& body) {
  auto loaded =
      load("<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>" + body + "</scxml>");
  EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  return *loaded.value;
}

Session begun(const Chart& chart) {
  Session session;
  Effects effects;
  start(chart, session, {}, {}, effects);
  return session;
}

void send(const Chart& chart, Session& session, const std::string& name, TimePoint now = {}) {
  Effects effects;
  Event event;
  event.name = name;
  step(chart, session, event, now, effects);
}

constexpr auto kBefore = R"(
  <datamodel><data id='n' expr='1'/></datamodel>
  <state id='a'><transition event='go' target='b'><assign location='n' expr='7'/></transition></state>
  <state id='b'>
    <onentry><send event='late' delay='5s'/></onentry>
    <transition event='on' cond='n === 7' target='c'/>
    <transition event='late' target='a'/>
  </state>
  <state id='c'/>)";

TEST(Carry, KeepsStatesDataAndTimersWhereGuardsAndOrderHaveChanged) {
  const Chart before = chart(kBefore);
  const Chart after = chart(R"(
    <datamodel><data id='extra' expr='"fresh"'/><data id='n' expr='2'/></datamodel>
    <state id='c'/>
    <state id='outer'><state id='x'/><state id='b'>
      <transition event='on' cond='n === 8' target='a'/>
      <transition event='on' cond='extra === "fresh" &amp;&amp; n === 7' target='c'/>
      <transition event='late' target='x'/>
    </state></state>
    <state id='a'/>)");
  Session session = begun(before);
  send(before, session, "go");
  auto carried = carry(before, session, after);
  ASSERT_TRUE(carried.ok()) << to_string(carried.diagnostics.front());
  EXPECT_THAT(carried.value->active_ids(after), ElementsAre("outer", "b"));
  EXPECT_EQ(carried.value->data(after), (Map{{"extra", "fresh"}, {"n", 7}}));
  EXPECT_EQ(carried.value->next_timer(), session.next_timer());
  Session by_time = *carried.value;
  Effects effects;
  step_timers(after, by_time, by_time.next_timer(), effects);
  EXPECT_THAT(by_time.active_ids(after), ElementsAre("outer", "x"));
  send(after, *carried.value, "on");
  EXPECT_THAT(carried.value->active_ids(after), ElementsAre("c"));
}

TEST(Carry, RefusesAnActiveStateThatIsGone) {
  const Chart before = chart(kBefore);
  Session session = begun(before);
  const Chart after = chart("<state id='b'/>");
  const auto refused = carry(before, session, after);
  ASSERT_THAT(refused.diagnostics, SizeIs(1));
  EXPECT_EQ(refused.diagnostics[0].code, "scxml.cannot-carry");
  EXPECT_THAT(refused.diagnostics[0].message, HasSubstr("state \"a\" is active"));
  // One that is not active may go.
  send(before, session, "go");
  EXPECT_TRUE(carry(before, session, after).ok());
}

TEST(Carry, RefusesWhatWouldBeNoConfiguration) {
  const Chart before = chart("<parallel id='p'><state id='l'/><state id='r'/></parallel>");
  const Session session = begun(before);
  const auto region =
      carry(before, session, chart("<parallel id='p'><state id='l'/><state id='r'/><state id='m'/></parallel>"));
  ASSERT_THAT(region.diagnostics, SizeIs(1));
  EXPECT_THAT(region.diagnostics[0].message, HasSubstr("a region of which nothing is active"));
  const auto inside = carry(before, session,
                            chart("<parallel id='p'><state id='l'><state id='l1'/></state><state id='r'/></parallel>"));
  ASSERT_THAT(inside.diagnostics, SizeIs(1));
  EXPECT_THAT(inside.diagnostics[0].message, HasSubstr("none of which is active"));
  const auto either = carry(before, session, chart("<state id='p'><state id='l'/><state id='r'/></state>"));
  ASSERT_THAT(either.diagnostics, SizeIs(1));
  EXPECT_THAT(either.diagnostics[0].message, HasSubstr("only one"));
}

TEST(Carry, KeepsHistoryThatIsStillWhole) {
  const std::string rest = R"(
    <state id='s'><history id='h'><transition target='s1'/></history>
      <state id='s1'><transition event='next' target='s2'/></state><state id='s2'/>
      <transition event='out' target='o'/>
    </state>
    <state id='o'><transition event='back' target='h'/></state>)";
  const Chart before = chart(rest);
  const Chart after = chart("<state id='first'/>" + rest);
  Session session = begun(before);
  for (const char* event : {"next", "out"}) send(before, session, event);
  auto carried = carry(before, session, after);
  ASSERT_TRUE(carried.ok());
  send(after, *carried.value, "back");
  EXPECT_THAT(carried.value->active_ids(after), ElementsAre("s", "s2"));
}

}  // namespace
}  // namespace sentree::scxml
