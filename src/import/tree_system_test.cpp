#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "sentree/base/temporary_folder.h"
#include "sentree/import/detail/made_file.h"
#include "sentree/import/import.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::import {
namespace {

using std::filesystem::path;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

const path kMission = path(SENTREE_SOURCE_DIR) / "src/import/testdata/mission";

Imported imported(const path& from, const std::string& main = {}) {
  auto system = import_system(from, main);
  EXPECT_TRUE(system.ok()) << (system.diagnostics.empty() ? "" : to_string(system.diagnostics[0]));
  return system.ok() ? std::move(*system.value) : Imported();
}

// The project that it becomes has no errors.
void expect_runnable(const Imported& system) {
  const TemporaryFolder folder("import");
  ASSERT_TRUE(write_project(system, folder.path() / "made", false));
  auto project = project::load_project(folder.path() / "made");
  ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.at(0));
  const auto plan = project::prepare(project::plain_scenario(std::move(*project.value)));
  EXPECT_TRUE(plan.ok());
  for (const Diagnostic& problem : plan.diagnostics) {
    EXPECT_NE(problem.severity, Severity::kError) << to_string(problem);
    // Nor has anything that the import wrote itself a warning.
    EXPECT_EQ(problem.span.file.find("skills/"), std::string::npos) << to_string(problem);
  }
}

auto told(Fate fate, const std::string& original, const std::string& reason) {
  return AllOf(Field(&Finding::fate, fate), Field(&Finding::original, HasSubstr(original)),
               Field(&Finding::reason, HasSubstr(reason)));
}

TEST(TreeSystem, GivesEachLeafASkillToBeginWith) {
  for (const path& from : {kMission / "main.xml", kMission}) {
    const Imported system = imported(from);
    EXPECT_EQ(system.form, kTreeForm);
    std::vector<std::string> names;
    for (const ProjectFile& file : system.files) names.push_back(file.path);
    EXPECT_THAT(names, ElementsAre("trees/main.xml", "trees/sub/pick.xml", "skills/BatteryOK.scxml",
                                   "skills/CloseGripper.scxml", "skills/FindObject.scxml", "skills/IsPathFree.scxml",
                                   "skills/MoveArm.scxml", "skills/Shout.scxml", "trees/nodes.xml", "sentree.yaml"));
    EXPECT_THAT(made_file(system, "trees/nodes.xml"), AllOf(HasSubstr("MoveArm"), Not(HasSubstr("FindObject"))));
    EXPECT_EQ(made_file(system, "trees/main.xml"), *text::read_file(kMission / "main.xml"));
    expect_runnable(system);
  }
}

TEST(TreeSystem, KeepsWhatHasBeenEditedSinceItWasImported) {
  const TemporaryFolder folder("import");
  const path made = folder.path() / "made";
  Imported system = imported(kMission / "main.xml");
  EXPECT_THAT(*write_project(system, made, false), testing::IsEmpty());
  EXPECT_FALSE(write_project(system, made, false));
  ASSERT_TRUE(text::write_file(made / "skills/Shout.scxml", "mine"));
  // What is written now is not what was written then.
  for (ProjectFile& file : system.files) file.content += "<!-- newer -->\n";
  EXPECT_THAT(*write_project(system, made, true), ElementsAre("skills/Shout.scxml"));
  EXPECT_EQ(*text::read_file(made / "skills/Shout.scxml"), "mine");
  EXPECT_EQ(*text::read_file(made / "skills/MoveArm.scxml"), made_file(system, "skills/MoveArm.scxml"));
  EXPECT_EQ(*text::read_file(made / "sentree.yaml"), made_file(system, "sentree.yaml"));
  // Kept the next time, too, and where no sums are known.
  EXPECT_THAT(*write_project(system, made, true), ElementsAre("skills/Shout.scxml"));
  std::filesystem::remove(made / "IMPORT.md");
  EXPECT_THAT(*write_project(system, made, true), ElementsAre("skills/Shout.scxml"));
  std::filesystem::remove(made / "skills/Shout.scxml");
  EXPECT_THAT(*write_project(system, made, true), testing::IsEmpty());
}

TEST(TreeSystem, NamesTheNodesThatOnlyAPlugInHas) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "go.xml";
  ASSERT_TRUE(text::write_file(source,
                               "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><RetryWithBackoff><Drop/>"
                               "</RetryWithBackoff></BehaviorTree></root>"));
  EXPECT_THAT(imported(source).plug_in_nodes, ElementsAre("RetryWithBackoff"));
  EXPECT_THAT(imported(kMission).plug_in_nodes, testing::IsEmpty());
}

TEST(TreeSystem, SkillsHaveThePortsOfTheirLeaves) {
  const Imported system = imported(kMission / "main.xml");
  EXPECT_THAT(made_file(system, "skills/BatteryOK.scxml"),
              AllOf(HasSubstr("<data id=\"level\"/>"), Not(HasSubstr("halt"))));
  EXPECT_THAT(
      made_file(system, "skills/FindObject.scxml"),
      AllOf(HasSubstr("<param name=\"pose\" expr=\"''\"/>"), Not(HasSubstr("<data id=\"pose")), HasSubstr("halted")));
  EXPECT_THAT(made_file(system, "skills/IsPathFree.scxml"), HasSubstr("To begin with: it holds."));
  EXPECT_THAT(
      system.findings,
      AllOf(Contains(told(Fate::kReview, "pose=\"{where}\"", "whether MoveArm reads or writes it: taken as read")),
            Contains(told(Fate::kByHand, "to-whom of Shout", "no name of <data>")),
            Contains(told(Fate::kByHand, "IsPathFree", "a condition by its name"))));
}

TEST(TreeSystem, WhatNothingHasWrittenBeforeIsWritten) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "go.xml";
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4" main_tree_to_execute="Go">
    <BehaviorTree ID="Go"><Sequence>
      <Script code="speed := 1; size = 2" _skipIf="thing == 4 || weight == 2"/>
      <Look at="{speed}" sees="{thing}"/>
      <SubTree ID="Take" what="{thing}" how="gently" _autoremap="false"/>
      <Tell about="{thing}" of="{weight}"/>
    </Sequence></BehaviorTree>
    <BehaviorTree ID="Take"><Sequence>
      <Grip what="{what}" how="{how}" grasp="{grasp}"/><Lift grasp="{grasp}" weight="{speed}"/>
    </Sequence></BehaviorTree></root>)"));
  const Imported system = imported(source);
  expect_runnable(system);
  const auto ports = [&](const std::string& skill) {
    const std::string chart = made_file(system, "skills/" + skill + ".scxml");
    std::string found;
    for (const char* port : {"at", "sees", "what", "how", "grasp", "weight", "about", "of"}) {
      if (chart.find(std::string("<data id=\"") + port + '"') != std::string::npos) found += std::string(" <") + port;
      if (chart.find(std::string("<param name=\"") + port + '"', chart.find("<donedata>")) != std::string::npos)
        found += std::string(" >") + port;
    }
    return found;
  };
  EXPECT_EQ(ports("Look"), " <at >sees");
  EXPECT_EQ(ports("Grip"), " <what <how >grasp");
  // The blackboard of Take has no speed of Go's.
  EXPECT_EQ(ports("Lift"), " <grasp >weight");
  EXPECT_EQ(ports("Tell"), " <about >of");
}

// The <param> of a skill's results, as written.
std::string result_of(const Imported& system, const std::string& skill, const std::string& port) {
  const std::string chart = made_file(system, "skills/" + skill + ".scxml");
  const std::string begin = "<param name=\"" + port + "\" expr=\"";
  const std::size_t at = chart.find(begin);
  if (at == std::string::npos) return chart;
  return chart.substr(at + begin.size(), chart.find('"', at + begin.size()) - at - begin.size());
}

TEST(TreeSystem, WhatASkillWritesToBeginWithFitsWhatReadsIt) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "go.xml";
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4" main_tree_to_execute="Go">
    <BehaviorTree ID="Go"><Sequence>
      <GetBattery level="{lvl}" charging="{ch}"/><ScriptCondition code="lvl &lt; 20.5 &amp;&amp; !ch"/>
      <GetMode mode="{mode}" _skipIf="lvl &gt; 5"/><ScriptCondition code="mode != 'auto'"/>
      <GetColor color="{color}"/><Wait _skipIf="color == RED"/>
      <GetLimit limit="{limit}" unit="{unit}"/><Script code="least := limit; text := unit .. 1"/>
      <GetOk ok="{ok}"/><ScriptCondition code="least &lt; 1 ? !ok : ch"/>
      <Copied value="{from}"/><SetBlackboard value="{from}" output_key="to"/><ScriptCondition code="to - 1 &lt; 0"/>
      <SubTree ID="Often" times="{n}" often="{hz}" points="{points}"/>
      <LoopDouble queue="{points}" value="{p}"><Use it="{p}"/></LoopDouble>
      <Typed status="{status}" int="{int}" text="{digits}" flags="{flags}" text2="{text2}"/>
      <Count n="{count}"/><Count n="3"/><ScriptCondition code="count &lt; 3"/>
      <Precondition if="digits &lt; 3" else="FAILURE"><Use it="{status}"/></Precondition>
    </Sequence></BehaviorTree>
    <BehaviorTree ID="Often"><Sequence>
      <HowOften n="{times}" hz="{often}" points="{points}"/>
      <Repeat num_cycles="{times}"><RateController hz="{often}"><AlwaysSuccess/></RateController></Repeat>
    </Sequence></BehaviorTree>
    <TreeNodesModel><Action ID="Typed">
      <output_port name="status" type="BT::NodeStatus"/><output_port name="int" type="int"/>
      <output_port name="text" type="std::string"/><output_port name="flags" type="std::vector&lt;int&gt;"/>
      <output_port name="text2" type="std::string"/>
    </Action></TreeNodesModel></root>)"));
  const Imported system = imported(source);
  EXPECT_EQ(result_of(system, "GetBattery", "level"), "0");
  EXPECT_EQ(result_of(system, "GetBattery", "charging"), "false");
  EXPECT_EQ(result_of(system, "GetMode", "mode"), "''");
  EXPECT_EQ(result_of(system, "GetColor", "color"), "0");
  EXPECT_EQ(result_of(system, "GetLimit", "limit"), "0");
  EXPECT_EQ(result_of(system, "GetLimit", "unit"), "''");
  EXPECT_EQ(result_of(system, "GetOk", "ok"), "false");
  EXPECT_EQ(result_of(system, "Copied", "value"), "0");
  EXPECT_EQ(result_of(system, "HowOften", "n"), "1");
  EXPECT_EQ(result_of(system, "HowOften", "hz"), "1");
  EXPECT_EQ(result_of(system, "HowOften", "points"), "[]");
  EXPECT_EQ(result_of(system, "Count", "n"), "n == null ? 0 : n");
  EXPECT_EQ(result_of(system, "Typed", "status"), "'SUCCESS'");
  EXPECT_EQ(result_of(system, "Typed", "int"), "0");
  EXPECT_EQ(result_of(system, "Typed", "text"), "'0'");
  EXPECT_EQ(result_of(system, "Typed", "flags"), "[]");
  EXPECT_EQ(result_of(system, "Typed", "text2"), "''");
  EXPECT_THAT(system.findings, Contains(told(Fate::kByHand, "", "names of enums are registered by a plug-in")));
}

TEST(TreeSystem, WhatIsReadAsTwoThingsIsToBeDoneByHand) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "go.xml";
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4"><BehaviorTree ID="Go"><Sequence>
      <Get parameter="{a}"/><ScriptCondition code="a == 'auto'"/>
      <Get parameter="{b}"/><ScriptCondition code="b &gt; 3"/>
    </Sequence></BehaviorTree></root>)"));
  EXPECT_THAT(imported(source).findings, Contains(told(Fate::kByHand, "parameter of Get",
                                                       "used as a number at " + source.string() +
                                                           ":3:29 and as text at " + source.string() + ":2:29")));
}

TEST(TreeSystem, NodesOfNav2ComeWithSentree) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "go.xml";
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4"><BehaviorTree ID="Go">
    <PipelineSequence>
      <RateController hz="1"><ComputePathToPose goal="{goal}" path="{path}"/></RateController>
      <FollowPath path="{path}"/>
      <Wait loudly="yes"/>
    </PipelineSequence></BehaviorTree></root>)"));
  const Imported system = imported(source);
  EXPECT_THAT(made_file(system, "sentree.yaml"),
              AllOf(HasSubstr("palettes: [trees/nodes.xml, nav2]"), HasSubstr("robot.thrift/Navigation")));
  EXPECT_THAT(made_file(system, "skills/FollowPath.scxml"), HasSubstr("there is no"));
  EXPECT_THAT(made_file(system, "trees/to_the_goal.xml"), HasSubstr("<SubTree ID=\"Go\" goal=\"{goal}\"/>"));
  expect_runnable(system);
  // It has a port that Nav2's has not.
  EXPECT_THAT(made_file(system, "skills/Wait.scxml"), HasSubstr("<data id=\"loudly\"/>"));
}

TEST(TreeSystem, ANodeOfOnesOwnIsNotNav2sBecauseOfItsName) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "go.xml";
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4"><BehaviorTree ID="Go"><Sequence>
      <Spin/><Spin angle="1.57"/><BackUp backup_dist="1"/><IsBatteryLow/><Wait wait_duration="1"/>
      <RateController frequency="1"><AlwaysSuccess/></RateController>
    </Sequence></BehaviorTree>
    <TreeNodesModel><Condition ID="BackUp"><input_port name="backup_dist"/></Condition>
      <Condition ID="IsBatteryLow"><input_port name="below"/></Condition></TreeNodesModel></root>)"));
  const Imported system = imported(source);
  EXPECT_THAT(made_file(system, "skills/Spin.scxml"),
              AllOf(HasSubstr("<data id=\"angle\"/>"), Not(HasSubstr("spin_dist")), Not(HasSubstr("time_allowance"))));
  EXPECT_THAT(made_file(system, "trees/nodes.xml"), AllOf(HasSubstr("angle"), Not(HasSubstr("spin_dist"))));
  EXPECT_THAT(made_file(system, "skills/BackUp.scxml"), Not(HasSubstr("backup_speed")));
  EXPECT_THAT(made_file(system, "skills/IsBatteryLow.scxml"), HasSubstr("it holds"));
  EXPECT_THAT(made_file(system, "skills/Wait.scxml"), HasSubstr("there is no"));
  EXPECT_THAT(system.findings, AllOf(Contains(told(Fate::kByHand, "RateController", "plug-in")),
                                     Not(Contains(told(Fate::kByHand, "", "declared nowhere")))));
}

TEST(TreeSystem, SaysWhatCannotBeMadeOfIt) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "in" / "go.xml";
  std::filesystem::create_directories(source.parent_path());
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4" main_tree_to_execute="Go">
    <BehaviorTree ID="Go"><Jugglers><SubTree ID="Nowhere"/></Jugglers></BehaviorTree></root>)"));
  const Imported system = imported(source);
  EXPECT_THAT(system.findings, AllOf(Contains(told(Fate::kByHand, "Jugglers", "plug-in")),
                                     Contains(told(Fate::kByHand, "Nowhere", "missing_trees.xml"))));
  EXPECT_THAT(made_file(system, "trees/missing_trees.xml"), HasSubstr("ID=\"Nowhere\""));
  ASSERT_TRUE(text::write_file(source, "<root BTCPP_format=\"4\"><BehaviorTree><Sequence></BehaviorTree></root>"));
  EXPECT_THAT(import_system(source).diagnostics, Contains(Field(&Diagnostic::span, Field(&SourceSpan::line, 1))));
}

TEST(TreeSystem, FilesThatAreMadeAreNotThoseOfTheMission) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "nodes.xml";
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4" main_tree_to_execute="Go">
    <BehaviorTree ID="Go"><Sequence><ComputePathToPose goal="{goal}" path="{path}"/><SubTree ID="Mission"/>
      <SubTree ID="Gone"/><Say/></Sequence></BehaviorTree>
    <BehaviorTree ID="Mission"><FollowPath path="{path}"/></BehaviorTree></root>)"));
  const Imported system = imported(source);
  EXPECT_EQ(made_file(system, "trees/nodes.xml"), *text::read_file(source));
  EXPECT_THAT(made_file(system, "trees/nodes_2.xml"), HasSubstr("Say"));
  EXPECT_THAT(made_file(system, "sentree.yaml"), HasSubstr("tree: Mission_2"));
  expect_runnable(system);
}

TEST(TreeSystem, NamesThatFilesAndScriptsCannotHave) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "go.xml";
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4"><BehaviorTree ID="Go"><Sequence>
      <Action ID="With space" var="{a}"/><Action ID="With_space" this="1"/><Action ID="CanGrip" out="{b}"/>
    </Sequence></BehaviorTree></root>)"));
  const Imported system = imported(source);
  expect_runnable(system);
  EXPECT_THAT(system.findings, AllOf(Contains(told(Fate::kByHand, "var of With space", "no name of <data>")),
                                     Contains(told(Fate::kByHand, "this of With_space", "no name of <data>"))));
  // Its tag says that it is an action.
  EXPECT_THAT(made_file(system, "skills/CanGrip.scxml"), HasSubstr("halted"));
  EXPECT_THAT(made_file(system, "sentree.yaml"), HasSubstr("\"With space\": {file: "));
}

TEST(TreeSystem, LinksAreNotFollowedOutOfTheFolder) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "in" / "go.xml";
  std::filesystem::create_directories(source.parent_path());
  ASSERT_TRUE(text::write_file(folder.path() / "secret.xml", "<root BTCPP_format=\"4\"/>"));
  std::filesystem::create_symlink(folder.path() / "secret.xml", source.parent_path() / "link.xml");
  ASSERT_TRUE(text::write_file(source, R"(<root BTCPP_format="4" main_tree_to_execute="Go"><include path="link.xml"/>
    <BehaviorTree ID="Go"><AlwaysSuccess/></BehaviorTree></root>)"));
  EXPECT_THAT(import_system(source).diagnostics, ElementsAre(AllOf(Field(&Diagnostic::code, "import.outside"),
                                                                   Field(&Diagnostic::message, HasSubstr("a link")))));
}

TEST(TreeSystem, WhatLiesBesideTheFolderIsImportedWithTheFolderOfBoth) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "missions" / "go.xml";
  std::filesystem::create_directories(source.parent_path());
  std::filesystem::create_directories(folder.path() / "common");
  ASSERT_TRUE(
      text::write_file(folder.path() / "common" / "out.xml",
                       R"(<root BTCPP_format="4"><BehaviorTree ID="Out"><AlwaysSuccess/></BehaviorTree></root>)"));
  ASSERT_TRUE(
      text::write_file(source, R"(<root BTCPP_format="4" main_tree_to_execute="Go"><include path="../common/out.xml"/>
    <BehaviorTree ID="Go"><SubTree ID="Out"/></BehaviorTree></root>)"));
  const std::string way_out = "sentree import " + folder.path().string() + " --main missions/go.xml";
  EXPECT_THAT(
      import_system(source).diagnostics,
      ElementsAre(AllOf(Field(&Diagnostic::message, HasSubstr(way_out)), Field(&Diagnostic::severity, Severity::kError),
                        Field(&Diagnostic::span, Field(&SourceSpan::line, 1)))));
  const Imported system = imported(folder.path(), "missions/go.xml");
  EXPECT_THAT(made_file(system, "trees/common/out.xml"), HasSubstr("AlwaysSuccess"));
  expect_runnable(system);
}

TEST(TreeSystem, InFormat3SubTreesNameEntriesWithoutBraces) {
  const TemporaryFolder folder("import");
  const path source = folder.path() / "go.xml";
  ASSERT_TRUE(text::write_file(source, R"(<root main_tree_to_execute="Go">
    <BehaviorTree ID="Go"><Sequence><SubTree ID="Find" thing="object"/><Use it="{object}"/></Sequence></BehaviorTree>
    <BehaviorTree ID="Find"><Detect what="{thing}"/></BehaviorTree></root>)"));
  const Imported system = imported(source);
  EXPECT_THAT(made_file(system, "skills/Detect.scxml"), HasSubstr("<param name=\"what\""));
  EXPECT_THAT(made_file(system, "skills/Use.scxml"), HasSubstr("<data id=\"it\"/>"));
  expect_runnable(system);
}

TEST(TreeSystem, FilesThatCannotBeReadAreToBeMendedByHand) {
  const TemporaryFolder folder("import");
  ASSERT_TRUE(text::write_file(folder.path() / "broken.xml",
                               R"(<root BTCPP_format="4"><BehaviorTree ID="B"><Sequence></BehaviorTree></root>)"));
  const auto refused = import_system(folder.path());
  EXPECT_THAT(refused.diagnostics,
              ElementsAre(Field(&Diagnostic::code, "import.unknown-form"),
                          Field(&Diagnostic::message, HasSubstr("</BehaviorTree> closes <Sequence>"))));
  ASSERT_TRUE(text::write_file(folder.path() / "good.xml",
                               R"(<root BTCPP_format="4"><BehaviorTree ID="G"><Go/></BehaviorTree></root>)"));
  ASSERT_TRUE(text::write_file(folder.path() / "package.xml", "<package/>"));
  const Imported system = imported(folder.path());
  EXPECT_THAT(system.findings, ElementsAre(told(Fate::kByHand, "", "</BehaviorTree> closes <Sequence>; nothing of"),
                                           told(Fate::kByHand, "Go", "")));
  expect_runnable(system);
}

TEST(TreeSystem, WhatAReactiveNodeAsksAtEachTickIsACondition) {
  const TemporaryFolder folder("import");
  const path file = folder.path() / "four.xml";
  ASSERT_TRUE(text::write_file(
      file,
      R"(<root BTCPP_format="4"><BehaviorTree ID="M"><ReactiveSequence><BatteryOK/><Sequence><SaySomething message="hi"/>)"
      R"(<MoveBase goal="1;2;3"/></Sequence></ReactiveSequence></BehaviorTree></root>)"));
  const Imported system = imported(file);
  EXPECT_THAT(made_file(system, "skills/BatteryOK.scxml"), HasSubstr("To begin with: it holds."));
  EXPECT_THAT(made_file(system, "skills/MoveBase.scxml"), HasSubstr("halted"));
  EXPECT_THAT(system.findings, Contains(told(Fate::kByHand, "BatteryOK", "a condition by its place under a Reactive")));
  expect_runnable(system);
  // What somebody has said to be an action is one.
  ASSERT_TRUE(text::write_file(
      file,
      R"(<root BTCPP_format="4"><BehaviorTree ID="M"><ReactiveSequence><BatteryOK/><MoveBase/></ReactiveSequence>)"
      R"(</BehaviorTree><TreeNodesModel><Action ID="BatteryOK"/></TreeNodesModel></root>)"));
  EXPECT_THAT(made_file(imported(file), "skills/BatteryOK.scxml"), HasSubstr("halted"));
}

TEST(TreeSystem, OfSeveralMissionsOneIsChosen) {
  const TemporaryFolder folder("import");
  for (const char* name : {"a", "b"}) {
    ASSERT_TRUE(text::write_file(folder.path() / (std::string(name) + ".xml"),
                                 std::string(R"(<root BTCPP_format="4"><BehaviorTree ID=")") + name +
                                     R"("><SubTree ID="common"/></BehaviorTree></root>)"));
  }
  ASSERT_TRUE(text::write_file(folder.path() / "common.xml",
                               R"(<root BTCPP_format="4"><BehaviorTree ID="common"><Go/></BehaviorTree></root>)"));
  const auto refused = import_system(folder.path());
  EXPECT_THAT(refused.diagnostics, ElementsAre(Field(&Diagnostic::message, HasSubstr("--main: a.xml, b.xml"))));
  const Imported system = imported(folder.path(), "b.xml");
  EXPECT_THAT(made_file(system, "trees/a.xml"), HasSubstr("there is no"));
  EXPECT_THAT(made_file(system, "sentree.yaml"), HasSubstr("{files: [trees/b.xml, trees/common.xml], tree: b}"));
  expect_runnable(system);
}

}  // namespace
}  // namespace sentree::import
