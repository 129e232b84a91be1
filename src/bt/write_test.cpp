#include "sentree/bt/write.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sentree/bt/load.h"

namespace sentree::bt {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::string_view kFile = R"(<?xml version="1.0"?>
<!-- A mission. -->
<root main_tree_to_execute="Main"   BTCPP_format="4">
<BehaviorTree ID="Main"><Sequence>
   <!-- first -->
   <GoTo   destination="kitchen" carrier='x' name="A"
           _skipIf="n &gt; 1"/>
   <GoTo name="B" destination="hall"/>
  </Sequence></BehaviorTree>
  <TreeNodesModel>
    <Action ID="GoTo"><input_port name="destination" type="std::string">where to</input_port></Action>
  </TreeNodesModel>
</root>
)";

TEST(Format, IndentsKeepsCommentsAndIsIdempotent) {
  const auto formatted = format(kFile);
  ASSERT_TRUE(formatted.has_value());
  EXPECT_THAT(*formatted,
              HasSubstr("<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\">\n  <BehaviorTree ID=\"Main\">\n"));
  EXPECT_THAT(*formatted, HasSubstr("      <!-- first -->\n      <GoTo name=\"A\" destination=\"kitchen\" "
                                    "carrier=\"x\"\n            _skipIf=\"n &gt; 1\"/>\n"));
  EXPECT_THAT(*formatted, HasSubstr("where to</input_port>"));
  EXPECT_EQ(format(*formatted).value(), *formatted);
  EXPECT_TRUE(diff(kFile, *formatted)->empty());
}

TEST(Diff, TellsChangedAddedRemovedAndMovedNodes) {
  std::string other(kFile);
  other.replace(other.find("kitchen"), 7, "cellar");
  auto found = diff(kFile, other).value();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].path, "Main/Sequence/A");
  EXPECT_EQ(found[0].what, "destination: \"kitchen\" → \"cellar\"");
  EXPECT_EQ(found[0].before.line, 6);

  other = kFile;
  other.insert(other.find("<GoTo name=\"B\""), "<AlwaysSuccess/>");
  found = diff(kFile, other).value();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].kind, Difference::Kind::kAdded);
  EXPECT_EQ(diff(other, kFile).value()[0].kind, Difference::Kind::kRemoved);
}

TEST(Diff, DoesNotCountHowANodeIsWritten) {
  std::string other(kFile);
  other.replace(other.find("<GoTo name=\"B\""), 5, "<Action ID=\"GoTo\"");
  EXPECT_TRUE(diff(kFile, other)->empty());
}

std::vector<std::string> told(const std::string& before, const std::string& after) {
  const auto file = [](const std::string& body) {
    return "<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\">" + body + "</BehaviorTree></root>";
  };
  std::vector<std::string> all;
  const auto differences = diff(file(before), file(after));
  for (const Difference& d : *differences) {
    constexpr const char* kNames[] = {"added", "removed", "changed", "moved"};
    all.push_back(std::string(kNames[static_cast<int>(d.kind)]) + " " + d.path + ": " + d.what);
  }
  return all;
}

TEST(Diff, FollowsANodeToAnotherParent) {
  EXPECT_THAT(
      told("<Sequence><A x=\"1\"/><B/></Sequence>", "<Sequence><Inverter><A x=\"1\"/></Inverter><B/></Sequence>"),
      ElementsAre("added M/Sequence/Inverter: Inverter added",
                  "moved M/Sequence/Inverter/A: moved here from M/Sequence/A"));
  EXPECT_THAT(
      told("<Sequence><Inverter><A x=\"1\"/></Inverter><B/></Sequence>", "<Sequence><A x=\"1\"/><B/></Sequence>"),
      ElementsAre("removed M/Sequence/Inverter: Inverter removed",
                  "moved M/Sequence/A: moved here from M/Sequence/Inverter/A"));
}

TEST(Diff, FollowsANamedNodeThatWasChangedOnItsWay) {
  EXPECT_THAT(told("<Sequence><Fallback><A name=\"n\" x=\"1\"/><C/></Fallback><B/></Sequence>",
                   "<Sequence><Fallback><C/></Fallback><B/><Inverter><A name=\"n\" x=\"2\"/></Inverter></Sequence>"),
              ElementsAre("added M/Sequence/Inverter: Inverter added",
                          "moved M/Sequence/Inverter/n: moved here from M/Sequence/Fallback/n",
                          "changed M/Sequence/Inverter/n: x: \"1\" → \"2\""));
}

TEST(Diff, CountsEachCopyOnce) {
  EXPECT_THAT(
      told("<Sequence><Fallback><A/></Fallback></Sequence>", "<Sequence><Inverter><A/></Inverter><A/></Sequence>"),
      ElementsAre("removed M/Sequence/Fallback: Fallback removed", "added M/Sequence/Inverter: Inverter added",
                  "added M/Sequence/A: A added", "moved M/Sequence/Inverter/A: moved here from M/Sequence/Fallback/A"));
}

TEST(Diff, SeesASecondTreeOfTheSameName) {
  const std::string one = R"(<BehaviorTree ID="A"><AlwaysSuccess/></BehaviorTree>)";
  const std::string other = R"(<BehaviorTree ID="A"><AlwaysFailure/></BehaviorTree>)";
  const auto found = diff("<root>" + one + "</root>", "<root>" + one + other + "</root>");
  ASSERT_TRUE(found);
  ASSERT_EQ(found->size(), 1U);
  EXPECT_EQ(found->front().path, "A #2");
  EXPECT_EQ(diff("<root>" + one + other + "</root>", "<root>" + one + one + "</root>")->size(), 2U);
}

TEST(Diff, RefusesWhatIsNoTree) { EXPECT_EQ(diff("<root/>", "<scxml/>").error().code, "bt.not-a-tree"); }

TEST(WithModels, AddsAndReplacesModelsAndKeepsTheRest) {
  const auto changed =
      with_models(kFile, {{"Wait", Category::kAction, {input<double>("seconds", "how long")}, {}}}).value();
  EXPECT_THAT(changed, HasSubstr("<input_port name=\"seconds\" type=\"double\">how long</input_port>"));
  EXPECT_THAT(changed, HasSubstr("<!-- first -->"));
  EXPECT_THAT(changed, HasSubstr("<Action ID=\"GoTo\">"));
  EXPECT_TRUE(load(changed).ok());
}

TEST(WithModels, EndsLinesAsTheFileDoes) {
  const NodeModel model{"Go", Category::kAction, {input("to")}, {}};
  const auto made = with_models("<root BTCPP_format=\"4\">\r\n</root>\r\n", {model});
  ASSERT_TRUE(made);
  for (std::size_t at = made->find('\n'); at != std::string::npos; at = made->find('\n', at + 1))
    EXPECT_EQ((*made)[at - 1], '\r') << *made;
}

TEST(WithModels, LeavesWhatSaysTheSameByteForByte) {
  const auto known = read_models(kFile).value();
  ASSERT_EQ(known.size(), 1U);
  EXPECT_EQ(known[0].ports[0].description, "where to");
  EXPECT_EQ(with_models(kFile, known).value(), kFile);
}

}  // namespace
}  // namespace sentree::bt
