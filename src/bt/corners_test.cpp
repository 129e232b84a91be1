#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/load.h"
#include "sentree/bt/script.h"

// What loading warns of: children that are never reached, corners that a tree depends on, scripts that cannot work.

namespace sentree::bt {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string found_in(const std::string& body, const std::string& more = {}) {
  std::string all;
  for (const Diagnostic& d : load(in_tree(body, more), {}, "m.xml").diagnostics)
    all += d.code + " " + to_string(d) + "\n";
  return all;
}

const std::string kSkippable = "<AlwaysSuccess _skipIf=\"1\"/>";
const std::string kAction = "<Action ID=\"Go\"/>";

struct Corner {
  std::string risky;  ///< Gives the warning.
  std::string code;
  std::string safe;  ///< Looks alike and does not.

  // The name of the test case.
  friend void PrintTo(const Corner& corner, std::ostream* out) { *out << corner.code << ": " << corner.risky; }
};

class Corners : public ::testing::TestWithParam<Corner> {};

TEST_P(Corners, AreWarnedOfWhereATreeDependsOnThemOnly) {
  EXPECT_THAT(found_in(GetParam().risky), HasSubstr(GetParam().code));
  EXPECT_THAT(found_in(GetParam().safe), Not(HasSubstr(GetParam().code)));
}

INSTANTIATE_TEST_SUITE_P(
    Load, Corners,
    ::testing::Values(
        Corner{"<Sequence _skipIf=\"0\">" + kSkippable + "</Sequence>", "bt.skipped-stays-running",
               "<Sequence _skipIf=\"0\">" + kSkippable + "<AlwaysSuccess/></Sequence>"},
        Corner{"<Inverter _onHalted=\"n := 1\">" + kSkippable + "</Inverter>", "bt.skipped-stays-running",
               "<Inverter>" + kSkippable + "</Inverter>"},
        Corner{"<AlwaysSuccess _onHalted=\"n := 1\"/>", "bt.on-halted", "<AlwaysSuccess _onSuccess=\"n := 1\"/>"},
        Corner{"<ReactiveSequence><AlwaysSuccess/><Precondition if=\"1\">" + kAction +
                   "</Precondition></ReactiveSequence>",
               "bt.precondition-once",
               "<ReactiveSequence><AlwaysSuccess/><Precondition if=\"1\"><AlwaysSuccess/></Precondition>"
               "</ReactiveSequence>"},
        Corner{"<Precondition if=\"1\">" + kSkippable + "</Precondition>", "bt.precondition-once",
               "<Sequence><Precondition if=\"1\">" + kAction + "</Precondition></Sequence>"},
        Corner{"<Repeat num_cycles=\"2\"><RunOnce><AlwaysSuccess/></RunOnce></Repeat>", "bt.run-once",
               "<Sequence><RunOnce><AlwaysSuccess/></RunOnce></Sequence>"},
        Corner{"<Timeout msec=\"9\"><SequenceWithMemory>" + kAction + kSkippable + "</SequenceWithMemory></Timeout>",
               "bt.memory-kept", "<SequenceWithMemory>" + kAction + kSkippable + "</SequenceWithMemory>"},
        Corner{"<IfThenElse><Inverter>" + kSkippable + "</Inverter><AlwaysSuccess/></IfThenElse>",
               "bt.skipped-condition", "<IfThenElse><ScriptCondition code=\"1\"/>" + kSkippable + "</IfThenElse>"},
        Corner{"<WhileDoElse>" + kSkippable + "<AlwaysSuccess/></WhileDoElse>", "bt.skipped-condition",
               "<WhileDoElse><Condition ID=\"C\"/><AlwaysSuccess/></WhileDoElse>"},
        Corner{"<Fallback><Inverter><AlwaysFailure/></Inverter><AlwaysSuccess/></Fallback>", "bt.unreachable-child",
               "<Fallback><ScriptCondition code=\"1\"/><AlwaysSuccess/></Fallback>"},
        Corner{"<Parallel success_count=\"3\">" + kAction + kAction + "</Parallel>", "bt.threshold",
               "<Parallel success_count=\"{n}\" failure_count=\"2\">" + kAction + kAction + "</Parallel>"},
        Corner{"<Parallel failure_count=\"3\">" + kAction + kAction + "</Parallel>", "bt.threshold",
               "<Parallel success_count=\"-9\">" + kAction + kAction + "</Parallel>"},
        Corner{"<ParallelAll max_failures=\"3\">" + kAction + kAction + "</ParallelAll>", "bt.threshold",
               "<ParallelAll max_failures=\"2\">" + kAction + kAction + "</ParallelAll>"},
        Corner{"<ManualSelector selection=\"2\">" + kAction + kAction + "</ManualSelector>", "bt.bad-selection",
               "<ManualSelector selection=\"1\">" + kAction + kAction + "</ManualSelector>"},
        Corner{"<Repeat>" + kAction + "</Repeat>", "bt.missing-port",
               "<Repeat num_cycles=\"{n}\">" + kAction + "</Repeat>"},
        Corner{"<RetryUntilSuccessful>" + kAction + "</RetryUntilSuccessful>", "bt.missing-port",
               "<RetryUntilSuccessful num_attempts=\"2\">" + kAction + "</RetryUntilSuccessful>"},
        Corner{"<Timeout>" + kAction + "</Timeout>", "bt.missing-port",
               "<Timeout msec=\"9\">" + kAction + "</Timeout>"},
        Corner{"<Delay>" + kAction + "</Delay>", "bt.missing-port", "<Delay delay_msec=\"9\">" + kAction + "</Delay>"},
        Corner{"<Sleep/>", "bt.missing-port", "<Sleep msec=\"9\"/>"},
        Corner{"<SetBlackboard value=\"1\"/>", "bt.missing-port", "<SetBlackboard value=\"1\" output_key=\"k\"/>"},
        Corner{"<UnsetBlackboard/>", "bt.missing-port", "<UnsetBlackboard key=\"k\"/>"},
        Corner{
            "<Sequence><KeepRunningUntilFailure><AlwaysSuccess/></KeepRunningUntilFailure><AlwaysSuccess/></Sequence>",
            "bt.unreachable-child",
            // A leaf of somebody else's making may return SKIPPED.
            "<Fallback><ForceSuccess><Action ID=\"Go\"/></ForceSuccess><AlwaysSuccess/></Fallback>"}));

TEST(PortsThatMakeEveryTickFail, AreToldAtTheirPlace) {
  EXPECT_THAT(found_in("<Parallel failure_count=\"3\"><AlwaysSuccess/><AlwaysSuccess/></Parallel>"),
              HasSubstr("failure_count of Parallel is 3, and there are 2 children; every tick of it fails"));
  EXPECT_THAT(found_in("<ManualSelector selection=\"1\"><AlwaysSuccess/></ManualSelector>"),
              HasSubstr("there is 1 child, counted from 0"));
  EXPECT_THAT(found_in("<Repeat><AlwaysSuccess/></Repeat>"),
              HasSubstr("num_cycles of Repeat is missing; every tick of it fails"));
  const auto all = load(
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"A\">\n<ParallelAll max_failures=\"9\">"
      "<AlwaysSuccess/></ParallelAll></BehaviorTree></root>",
      {}, "m.xml");
  EXPECT_EQ(to_string(all.diagnostics.at(0).span), "m.xml:2:28");
}

TEST(CornersOfSubTrees, FollowFromTheTreeThatTheyName) {
  const std::string sub = "<BehaviorTree ID=\"S\">" + kSkippable + "</BehaviorTree>";
  EXPECT_THAT(found_in("<IfThenElse><SubTree ID=\"S\"/><AlwaysSuccess/></IfThenElse>", sub),
              HasSubstr("bt.skipped-condition"));
  EXPECT_THAT(found_in("<Sequence _skipIf=\"0\"><SubTree ID=\"S\"/></Sequence>", sub),
              HasSubstr("bt.skipped-stays-running"));
}

TEST(CornersOfSubTrees, SurviveALongChainOfThem) {
  // Not reached from the main tree, so nothing else bounds the chain.
  std::string more;
  for (int i = 0; i < 20'000; ++i) {
    more += "<BehaviorTree ID=\"T" + std::to_string(i) + "\">" +
            (i + 1 < 20'000 ? "<SubTree ID=\"T" + std::to_string(i + 1) + "\"/>" : "<AlwaysSuccess/>") +
            "</BehaviorTree>";
  }
  EXPECT_THAT(found_in("<AlwaysSuccess/>", more), HasSubstr("bt.unused-tree"));
}

TEST(TreesNamedAsNodes, AreToldInFormatFour) {
  const auto told = [](const std::string& id, const std::string& format = "4") {
    const auto loaded =
        load("<root BTCPP_format=\"" + format +
                 "\" main_tree_to_execute=\"Main\"><BehaviorTree ID=\"Main\">\n"
                 "<Sequence><SubTree ID=\"" +
                 id +
                 "\"/><Action ID=\"Used\"/><Declared/></Sequence></BehaviorTree>\n"
                 "<BehaviorTree ID=\"" +
                 id +
                 "\"><AlwaysSuccess/></BehaviorTree>\n"
                 "<TreeNodesModel><Action ID=\"Declared\"/><Condition ID=\"Spare\"/></TreeNodesModel></root>",
             {}, "m.xml");
    std::string all;
    for (const Diagnostic& one : loaded.diagnostics) {
      if (one.code == "bt.tree-named-as-node") all += to_string(one) + "\n";
    }
    return all;
  };
  for (const char* id : {"Timeout", "Sequence", "SubTree", "Used", "Declared", "Spare"})
    EXPECT_THAT(told(id), HasSubstr("m.xml:3:19")) << id;
  EXPECT_THAT(told("Timeout"),
              HasSubstr("\"Timeout\" has the name of a node that is built in, which BehaviorTree.CPP 4 refuses"));
  EXPECT_EQ(told("TimeoutTree"), "");
  EXPECT_EQ(told("Timeout", "3"), "");
}

TEST(OnHalted, IsToldOncePerTree) {
  const std::string all = found_in(
      "<Sequence><AlwaysSuccess _onHalted=\"n := 1\"/><AlwaysSuccess _onHalted=\"n := 2\"/>"
      "<AlwaysSuccess _onHalted=\"n := 3\"/></Sequence>");
  EXPECT_THAT(all, HasSubstr("(3 nodes of this tree have one)"));
  EXPECT_EQ(all.find("bt.on-halted"), all.rfind("bt.on-halted"));
}

TEST(Scripts, AreReportedAtTheVeryPlace) {
  const auto first = [](const std::string& xml) { return to_string(load(xml, {}, "m.xml").diagnostics.at(0).span); };
  const std::string start = "<root BTCPP_format=\"4\">\n<BehaviorTree ID=\"A\">\n";
  const std::string end = "\n</BehaviorTree></root>";
  EXPECT_EQ(first(start + "<Script name=\"n +\" code=\"n := 1; n +\"/>" + end), "m.xml:3:37");
  EXPECT_EQ(first(start + "<Script code=\"n := 1 m := 2\"/>" + end), "m.xml:3:22");
  // With a reference in it, the script as a whole.
  EXPECT_EQ(first(start + "<Script code=\"n := 1 &lt; \"/>" + end), "m.xml:3:15");
}

TEST(Scripts, WarnOfIntegersBeyond64BitsAndOfMissingSeparators) {
  EXPECT_THAT(found_in("<Script code=\"n := 99999999999999999999\"/>"),
              HasSubstr("column 6: \"99999999999999999999\" does not fit into 64 bits and counts as 0"));
  EXPECT_THAT(found_in("<Script code=\"n := 0x8000000000000000\"/>"), HasSubstr("bt.script-integer"));
  EXPECT_THAT(found_in("<Script code=\"n := 9223372036854775807\"/>"), Not(HasSubstr("bt.script-integer")));
  EXPECT_THAT(found_in("<Script code=\"n := 1 m := 2\"/>"),
              HasSubstr("column 8: a statement begins here without a \";\" before it"));
  EXPECT_THAT(found_in("<Script code=\"; n := 1;; m := 2;\"/>"), Not(HasSubstr("bt.script-separator")));
}

struct Typed {
  std::string code;
  std::string mistake;  ///< Empty: none.

  friend void PrintTo(const Typed& typed, std::ostream* out) { *out << typed.code; }
};

class ScriptTypes : public ::testing::TestWithParam<Typed> {};

TEST_P(ScriptTypes, AreCheckedWhereEverybodyAgreesOnThem) {
  const std::string all = found_in(
      "<Sequence><Script code=\"n := 1; s := 'red'; e := '7'; x := 1; k := 'a'\"/><SetBlackboard value=\"1\" "
      "output_key=\"x\"/><Script code=\"k := 'b'\"/><Script code=\"" +
      GetParam().code + "\"/></Sequence>");
  if (GetParam().mistake.empty()) {
    EXPECT_THAT(all, Not(HasSubstr("bt.script-type")));
  } else {
    EXPECT_THAT(all, HasSubstr(GetParam().mistake));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Load, ScriptTypes,
    ::testing::Values(Typed{"r := n == 'red'", "text is compared with a number, 'red'"},
                      Typed{"r := 'red' &lt; n", "text is compared with a number"},
                      Typed{"r := s == n", "text is compared with a number"}, Typed{"r := n == '7'", ""},
                      Typed{"r := s == 'red'", ""}, Typed{"r := n + 1 &gt; 2", ""}, Typed{"r := s .. n", ""},
                      Typed{"r := s + 'b'", ""}, Typed{"r := s * 2", "an arithmetic or logical operator gets text"},
                      Typed{"r := s &amp;&amp; n", "an arithmetic or logical operator gets text"},
                      Typed{"r := -s", "need a number and get text"}, Typed{"s += 'x'", ""},
                      Typed{"s -= 1", "\"s\" holds text and is to be changed as a number"},
                      Typed{"n -= 'x'", "the right side is text"},
                      Typed{"n = 'blue'", "\"n\" holds a number and cannot take text, 'blue'"},
                      // Two writers disagree about x: nothing is known.
                      Typed{"r := x == 'red'", ""}, Typed{"r := n ? 1 : 'a'; q := r == 1", ""},
                      Typed{"r := (n &gt; 0 ? s : s) - 1", "an arithmetic or logical operator gets text"},
                      Typed{"r := 1 &lt; n &lt; 3", ""}, Typed{"r := k * 1", "gets text"}));

TEST(ScriptTypes, FollowFromPortsThatReadTheEntry) {
  const char* const read = "<Delay delay_msec=\"{p}\"><AlwaysSuccess/></Delay></Sequence>";
  EXPECT_THAT(found_in("<Sequence><Script code=\"p := 'abc'\"/>" + std::string(read)),
              HasSubstr("\"p\" holds a number and cannot take text, 'abc'"));
  EXPECT_THAT(found_in("<Sequence><Script code=\"p := '20'\"/>" + std::string(read)), Not(HasSubstr("bt.script-type")));
}

TEST(Entries, AreWhatOutputsName) {
  EXPECT_THAT(
      found_in("<LoopDouble queue=\"1;2\" value=\"x\"><AlwaysSuccess/></LoopDouble>"),
      HasSubstr("output port \"value\" of LoopDouble is \"x\", which is no entry to write to; write value=\"{name}\""));
  EXPECT_THAT(found_in("<LoopDouble queue=\"1;2\" value=\"{x}\"><AlwaysSuccess/></LoopDouble>"),
              Not(HasSubstr("bt.not-an-entry")));
}

TEST(Entries, WithOneBraceAreTexts) {
  for (const char* value : {"{n", "n}", "'n}"})
    EXPECT_THAT(found_in("<SetBlackboard value=\"" + std::string(value) + "\" output_key=\"m\"/>"),
                HasSubstr("bt.half-entry"));
  for (const char* value : {"{n}", "json:{}", "a {n} b}", "}"})
    EXPECT_THAT(found_in("<SetBlackboard value=\"" + std::string(value) + "\" output_key=\"m\"/>"),
                Not(HasSubstr("bt.half-entry")));
}

TEST(ScriptTypesOfPorts, ComeFromWhatWritesTheEntry) {
  EXPECT_THAT(found_in("<Sequence><LoopDouble queue=\"1;2\" value=\"{v}\"><AlwaysSuccess/></LoopDouble>"
                       "<Script code=\"r := v == 'big'\"/></Sequence>"),
              HasSubstr("text is compared with a number, 'big'"));
  EXPECT_THAT(found_in("<Sequence><LoopString queue=\"a;b\" value=\"{v}\"><AlwaysSuccess/></LoopString>"
                       "<Script code=\"r := v - 1\"/></Sequence>"),
              HasSubstr("gets text"));
}

}  // namespace
}  // namespace sentree::bt
