#include "sentree/verify/mutate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/text/xml.h"

namespace sentree::verify {
namespace {

using testing::Contains;
using testing::ElementsAre;

std::vector<std::string> whats(const std::vector<Mutant>& mutants) {
  std::vector<std::string> all;
  for (const Mutant& mutant : mutants) all.push_back(mutant.what);
  return all;
}

constexpr const char* kTree =
    "<root BTCPP_format='4'><BehaviorTree ID='M'>\n"
    "<ReactiveSequence name='Root'><Above threshold='30'/><GoTo to='kitchen'/><GoTo to='station'/></ReactiveSequence>\n"
    "</BehaviorTree></root>";

TEST(Mutants, OfATreeAreSmallChangesOfIt) {
  const auto all = mutants(kTree, "m.xml");
  EXPECT_THAT(whats(all), ElementsAre("Root: ReactiveSequence → Sequence", "Root: ReactiveSequence → ReactiveFallback",
                                      "Above and GoTo exchanged", "GoTo and GoTo exchanged", "Above dropped",
                                      "Above: threshold 30 → 31", "Above: threshold 30 → 29", "GoTo dropped",
                                      "GoTo: to kitchen → station", "GoTo dropped", "GoTo: to station → kitchen"));
  EXPECT_EQ(all[2].text.substr(all[2].text.find("<GoTo"), 50), "<GoTo to='kitchen'/><Above threshold='30'/><GoTo t");
  EXPECT_THAT(all[0].text, testing::HasSubstr("<Sequence name='Root'>"));
  EXPECT_THAT(all[0].text, testing::HasSubstr("</Sequence>\n"));
  EXPECT_EQ(to_string(all[5].place), "m.xml:2:49");
}

TEST(Mutants, OfAChartAreOfItsConditionsAndWhatItDoes) {
  const auto all = mutants(
      "<scxml><state id='a'><transition event='e' cond='x &lt;= 2 &amp;&amp; y == \"n&lt;1\"' "
      "target='b'/></state></scxml>",
      "c.scxml");
  EXPECT_THAT(whats(all), ElementsAre("cond <= → <", "cond 2 → 3", "cond 2 → 1", "cond && → ||",
                                      "cond == → !=", "<transition> e dropped"));
}

TEST(Mutants, OfATreeAreOfItsScriptsAndLeaveOutDecorators) {
  const auto all = mutants(
      "<root><BehaviorTree ID='M'><Inverter><Go _skipIf='n &lt; 3' to='x'/></Inverter></BehaviorTree></root>", "m.xml");
  EXPECT_THAT(whats(all),
              ElementsAre("Inverter dropped, not what is in it", "_skipIf < → <=", "_skipIf 3 → 4", "_skipIf 3 → 2"));
  EXPECT_EQ(all[0].text, "<root><BehaviorTree ID='M'><Go _skipIf='n &lt; 3' to='x'/></BehaviorTree></root>");
}

// A chart that sends a goal: the number that is, and what else it may be from elsewhere.
std::string sends(const std::string& parameters) {
  return "<scxml><state id='a'><onentry><send type='thrift' target='base' event='go'>" + parameters +
         "</send></onentry></state></scxml>";
}

TEST(Mutants, PassAnotherGoal) {
  const std::string source =
      sends("<param name='goal' expr='3'/><param name='to' expr=\"'kitchen'\"/><param name='by' expr='way'/>");
  Passed passed;
  collect_passed(source, passed);
  collect_passed(
      "<root><BehaviorTree ID='M'><Sequence><Go to='station' goal='7'/><Go to='{there}' goal='2'/><Sleep msec='50'/>"
      "<Repeat num_cycles='9'><Go to='it&apos;s' goal='0.5'/></Repeat></Sequence></BehaviorTree></root>",
      passed);
  collect_passed("<world to='nowhere'/>", passed);
  collect_passed("<scxml", passed);
  EXPECT_THAT(passed, testing::UnorderedElementsAre(testing::Pair("goal", ElementsAre("2", "3", "7")),
                                                    testing::Pair("to", ElementsAre("kitchen", "station"))));
  const auto all = mutants(source, "c.scxml", passed);
  // 4 and 2 are tried as numbers one more and less.
  EXPECT_THAT(whats(all), ElementsAre("<send> go dropped", "<param> goal 3 → 7", "expr 3 → 4", "expr 3 → 2",
                                      "<param> to kitchen → station"));
  EXPECT_EQ(all[1].text, sends("<param name='goal' expr='7'/><param name='to' expr=\"'kitchen'\"/>"
                               "<param name='by' expr='way'/>"));
  EXPECT_EQ(all[4].text, sends("<param name='goal' expr='3'/><param name='to' expr=\"'station'\"/>"
                               "<param name='by' expr='way'/>"));
  EXPECT_EQ(to_string(all[4].place), "c.scxml:1:129");
}

TEST(Mutants, OfATreePassWhatOtherFilesDo) {
  Passed passed{{"to", {"kitchen", "5"}}, {"goal", {"3", "kitchen"}}, {"msec", {"900"}}};
  const auto all = mutants(
      "<root><BehaviorTree ID='M'><Go to='hall' goal='7'/><Sleep msec='50'/><Go to='{to}'/></BehaviorTree></root>",
      "m.xml", passed);
  EXPECT_THAT(whats(all), ElementsAre("Go: to hall → kitchen", "Go: goal 7 → 8", "Go: goal 7 → 6", "Go: goal 7 → 3",
                                      "Sleep: msec 50 → 51", "Sleep: msec 50 → 49"));
}

TEST(Mutants, PassAnotherEnumeratorOfThatCallOnly) {
  const auto schema = idl::Schema::load(
      "enum Place { KITCHEN, STATION }\nenum Way { FAST, SLOW }\n"
      "service Base { void go(1: Place to, 2: Way by, 3: i32 goal), void turn(1: Way to) }\n",
      "base.thrift");
  ASSERT_TRUE(schema.ok());
  Passed passed;
  collect_passed("base", *schema.value->service("Base"), passed);
  EXPECT_THAT(whats(mutants(sends("<param name='to' expr=\"'KITCHEN'\"/>"), "c", passed)),
              ElementsAre("<send> go dropped", "<param> to KITCHEN → STATION"));
}

TEST(Mutants, CanAllBeReadAndAreNotTheOriginal) {
  for (const std::string& source :
       {std::string(kTree),
        std::string("<root><BehaviorTree ID='M'><Sequence><Fallback><A n='1'/><B/></Fallback></Sequence></BehaviorTree>"
                    "</root>"),
        std::string("<scxml><datamodel><data id='a' expr=\"true\"/></datamodel><state id='s'><onentry>"
                    "<if cond='a'><send event='x'/></if></onentry></state></scxml>")}) {
    const auto all = mutants(source, "f");
    ASSERT_FALSE(all.empty());
    for (const Mutant& mutant : all) {
      EXPECT_TRUE(text::XmlDocument::parse(mutant.text)) << mutant.what;
      EXPECT_NE(mutant.text, source) << mutant.what;
    }
  }
  EXPECT_TRUE(mutants("<root", "f").empty());
  EXPECT_TRUE(mutants("<world/>", "f").empty());
}

TEST(Mutants, AreBounded) {
  std::string source = "<root><BehaviorTree ID='M'><Sequence>";
  for (int i = 0; i < 500; ++i) source += "<A n='1'/>";
  EXPECT_EQ(mutants(source + "</Sequence></BehaviorTree></root>", "f").size(), kMutantsMax);
}

}  // namespace
}  // namespace sentree::verify
