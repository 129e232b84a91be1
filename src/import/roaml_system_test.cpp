#include "sentree/import/detail/roaml_system.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "sentree/base/temporary_folder.h"
#include "sentree/idl/schema.h"
#include "sentree/import/detail/made_file.h"
#include "sentree/project/plan.h"
#include "sentree/scxml/chart.h"
#include "sentree/text/file.h"

namespace sentree::import {
namespace {

using std::filesystem::path;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

const path kMuseum = path(SENTREE_SOURCE_DIR) / "src/import/testdata/museum";

Imported museum() {
  auto imported = import_system(kMuseum);
  EXPECT_TRUE(imported.ok()) << (imported.diagnostics.empty() ? "" : to_string(imported.diagnostics[0]));
  return imported.ok() ? std::move(*imported.value) : Imported();
}

auto roaml_finding(Fate fate, const std::string& original, const std::string& reason) {
  return AllOf(Field(&Finding::fate, fate), Field(&Finding::original, HasSubstr(original)),
               Field(&Finding::reason, HasSubstr(reason)));
}

// Every chart loads, every interface is Thrift.
void expect_files_load(const Imported& imported) {
  for (const ProjectFile& file : imported.files) {
    if (file.path.ends_with(".scxml")) {
      const auto chart = scxml::load(file.content, file.path);
      EXPECT_TRUE(chart.ok()) << to_string(chart.diagnostics.at(0)) << "\n" << file.content;
    } else if (file.path.ends_with(".thrift")) {
      const auto schema = idl::Schema::load(file.content, file.path);
      EXPECT_TRUE(schema.ok()) << to_string(schema.diagnostics.at(0)) << "\n" << file.content;
    }
  }
}

TEST(RoamlSystem, BecomesAProjectThatCheckAccepts) {
  const TemporaryFolder folder("import");
  const path target = folder.path() / "museum";
  const Imported imported = museum();
  expect_files_load(imported);
  ASSERT_TRUE(write_project(imported, target, false));
  auto project = project::load_project(target);
  ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.at(0));
  EXPECT_EQ(project.value->period, std::chrono::milliseconds(500));
  EXPECT_TRUE(project.value->repeat);
  project::Scenario scenario = project::plain_scenario(std::move(*project.value));
  scenario.virtual_time = false;
  const auto plan = project::prepare(scenario);
  for (const Diagnostic& problem : plan.diagnostics)
    EXPECT_NE(problem.severity, Severity::kError) << to_string(problem);
}

TEST(RoamlSystem, ASystemWithoutNodesIsReadyToRunInVirtualTime) {
  const TemporaryFolder folder("import");
  const path target = folder.path() / "ticks";
  const auto imported = import_system(path(SENTREE_SOURCE_DIR) / "src/import/testdata/ticks");
  ASSERT_TRUE(imported.ok());
  EXPECT_THAT(imported.value->findings, ::testing::IsEmpty());
  ASSERT_TRUE(write_project(*imported.value, target, false));
  auto scenario = project::load_scenario(target / "scenarios/run.yaml");
  ASSERT_TRUE(scenario.ok()) << to_string(scenario.diagnostics.at(0));
  EXPECT_TRUE(scenario.value->virtual_time);
  const auto plan = project::prepare(std::move(*scenario.value));
  for (const Diagnostic& problem : plan.diagnostics)
    EXPECT_NE(problem.severity, Severity::kError) << to_string(problem);
}

TEST(RoamlSystem, PluginsAnswerByTheirProtocol) {
  const Imported imported = museum();
  const std::string chart = made_file(imported, "skills/LevelAbove.scxml");
  EXPECT_THAT(chart,
              HasSubstr("<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\""));
  EXPECT_THAT(chart, HasSubstr("<transition event=\"bt_tick\" target=\"ready\">"));
  EXPECT_THAT(chart, HasSubstr("<send event=\"bt_return_status\">"));
  EXPECT_THAT(chart, HasSubstr("<param name=\"status\" expr=\"'FAILURE'\"/>"));
  EXPECT_THAT(chart, HasSubstr("<send event=\"bt_return_halted\"/>"));
  EXPECT_THAT(chart, HasSubstr("<!-- The last level counts. -->"));
  EXPECT_THAT(made_file(imported, "sentree.yaml"),
              HasSubstr("LevelAbove: {file: skills/LevelAbove.scxml, protocol: as2fm, subscribe: "
                        "[topics.battery_level]}"));
}

TEST(RoamlSystem, PortsAreReadAtEachTickAndWrittenWithTheAnswer) {
  const Imported imported = museum();
  EXPECT_THAT(made_file(imported, "skills/Guide.scxml"),
              HasSubstr("<assign location=\"stop\" expr=\"_event.data.stop\"/>"));
  EXPECT_THAT(made_file(imported, "skills/NextStop.scxml"), HasSubstr("<param name=\"stop\" expr=\"stop\"/>"));
  EXPECT_THAT(made_file(imported, "trees/policy.xml"), HasSubstr("<input_port name=\"stop\" type=\"int\"/>"));
}

TEST(RoamlSystem, TopicsServicesAndActionsBecomeInterfacesOfWhatTheChartsUse) {
  const Imported imported = museum();
  const std::string topics = made_file(imported, "interfaces/topics.thrift");
  EXPECT_THAT(topics, HasSubstr("oneway void battery_level(1: i32 data);"));
  EXPECT_THAT(topics, HasSubstr("cmd_vel(1: cmd_vel_linear linear, 2: cmd_vel_angular angular);"));
  EXPECT_THAT(topics, HasSubstr("go_to_stop_result(1: i32 goal_id, 2: string status, 3: bool arrived);"));
  EXPECT_THAT(topics, HasSubstr("oneway void drained(1: i32 left);"));
  EXPECT_THAT(made_file(imported, "interfaces/Museum.thrift"),
              HasSubstr("bool go_to_stop_send_goal(1: i32 goal_id, 2: i32 stop_id);"));
  const std::string doors = made_file(imported, "interfaces/Doors.thrift");
  EXPECT_THAT(doors, HasSubstr("open_Response open();"));
  EXPECT_THAT(doors, HasSubstr("1: bool is_ok"));
}

TEST(RoamlSystem, AChartThatTakesItsServiceFromAPortIsWrittenForEachLeaf) {
  const Imported imported = museum();
  EXPECT_THAT(made_file(imported, "skills/open_door.scxml"),
              HasSubstr("<send type=\"thrift\" target=\"Doors\" event=\"open\"/>"));
  EXPECT_THAT(made_file(imported, "skills/close_door.scxml"),
              HasSubstr("<transition event=\"Doors.close.reply\" cond=\"!_event.data.result.is_ok\" target=\"idle\">"));
}

TEST(RoamlSystem, LeavesOfOneNameAreTold) {
  const Imported imported = museum();
  EXPECT_THAT(made_file(imported, "trees/policy.xml"), HasSubstr("name=\"guide_2\""));
  const std::string yaml = made_file(imported, "sentree.yaml");
  EXPECT_THAT(yaml, HasSubstr("guide: {file: skills/Guide.scxml, protocol: as2fm, data: {go_goal_id: 0}, "
                              "subscribe: [topics.go_to_stop_result]}"));
  EXPECT_THAT(yaml, HasSubstr("guide_2: {file: skills/Guide.scxml, protocol: as2fm, data: {go_goal_id: 1000}, "));
}

TEST(RoamlSystem, NodesAreModelsWithClocksAndChances) {
  const Imported imported = museum();
  const std::string node = made_file(imported, "models/Museum.scxml");
  EXPECT_THAT(node, HasSubstr("<send event=\"rate.drain\" delay=\"250ms\"/>"));
  EXPECT_THAT(node, HasSubstr("<transition event=\"Museum.go_to_stop_send_goal.request\" target=\"moving\">"));
  EXPECT_THAT(node, HasSubstr("<send type=\"thrift\" target=\"Museum\" event=\"go_to_stop_send_goal.reply\">"));
  EXPECT_THAT(node, HasSubstr("<transition cond=\"drawn &lt; 0.8\" target=\"idle\">"));
  EXPECT_THAT(node, HasSubstr("<param name=\"linear\" expr=\"{x: 0.5, y: 0, z: 0}\"/>"));
  EXPECT_THAT(made_file(imported, "models/Doors.scxml"), HasSubstr("expr=\"_event.data.left\""));
  EXPECT_THAT(made_file(imported, "scenarios/run.yaml"), HasSubstr("clock: virtual"));
  const std::string yaml = made_file(imported, "sentree.yaml");
  EXPECT_THAT(yaml, HasSubstr("Museum: {interface: Museum.thrift/Museum, at: model}"));
  EXPECT_THAT(yaml, HasSubstr("topics: {interface: topics.thrift/topics, at: topics}"));
  EXPECT_THAT(
      yaml,
      HasSubstr("  - {file: models/Doors.scxml, name: Doors_node, serves: [Doors], subscribe: [topics.drained]}"));
}

TEST(RoamlSystem, ListsWhatIsLeftToDo) {
  const Imported imported = museum();
  EXPECT_THAT(imported.findings,
              Contains(roaml_finding(Fate::kByHand, "never_empty: The level stays above 10", "JANI")));
  EXPECT_THAT(imported.findings,
              Contains(roaml_finding(Fate::kByHand, "elsewhere/secret", "outside the imported folder")));
  EXPECT_THAT(imported.findings, Contains(roaml_finding(Fate::kByHand, "ros_action_thread", "nothing here does")));
  EXPECT_THAT(imported.findings, Contains(roaml_finding(Fate::kNotNeeded, "max_array_size", "")));
  EXPECT_THAT(made_file(imported, "models/Museum.scxml"),
              HasSubstr("<!-- not translated, see IMPORT.md: <ros_action_thread"));
  const std::string report = report_of(imported, "museum");
  EXPECT_THAT(report, HasSubstr("properties.jani:3"));
}

TEST(RoamlSystem, OfAMainFileOnlyItsFolderIsRead) {
  const auto imported = import_system(kMuseum / "Main/main.xml");
  ASSERT_TRUE(imported.ok());
  EXPECT_THAT(imported.value->findings, Contains(roaml_finding(Fate::kByHand, "../Plugins/level.ascxml", "--main")));
  EXPECT_THAT(made_file(*imported.value, "skills/LevelAbove.scxml"), HasSubstr("there is no"));
}

TEST(RoamlSystem, SeveralMainFilesMustBeToldApart) {
  const TemporaryFolder folder("import");
  const std::string tree = "<root BTCPP_format=\"4\"><BehaviorTree ID=\"T\"><AlwaysSuccess/></BehaviorTree></root>";
  ASSERT_TRUE(text::write_file(folder.path() / "bt.xml", tree));
  for (const char* name : {"a.xml", "b.xml"}) {
    ASSERT_TRUE(text::write_file(
        folder.path() / name,
        "<convince_mc_tc><behavior_tree><input type=\"bt.cpp-xml\" src=\"bt.xml\"/></behavior_tree></convince_mc_tc>"));
  }
  EXPECT_EQ(import_system(folder.path()).diagnostics.at(0).code, "import.ambiguous");
  const auto chosen = import_system(folder.path(), "b.xml");
  ASSERT_TRUE(chosen.ok());
  // Nobody elsewhere is needed: there is something to run.
  EXPECT_THAT(made_file(*chosen.value, "scenarios/run.yaml"), HasSubstr("clock: virtual"));
}

// Whole systems and single charts that other people wrote, where a copy of them lies beside the sources.
TEST(RoamlSystem, TranslatesPublicChartsToChartsThatLoad) {
  const char* const given = std::getenv("SENTREE_CORPUS");
  const path corpus = given != nullptr ? path(given) : path(SENTREE_SOURCE_DIR) / ".." / "shared" / "corpus";
  std::error_code error;
  if (!std::filesystem::is_directory(corpus, error)) GTEST_SKIP() << "there is no " << corpus;
  const auto folder = SourceFolder::open(corpus);
  ASSERT_TRUE(folder) << to_string(folder.error());
  int charts = 0;
  int plugins_only = 0;
  for (const std::string& name : folder->with_ending({".ascxml"})) {
    const TemporaryFolder system("import");
    const auto source = folder->read(name);
    ASSERT_TRUE(source);
    ASSERT_TRUE(text::write_file(system.path() / "chart.ascxml", *source));
    const bool is_plugin = source->find("<bt_tick") != std::string::npos;
    const std::size_t at = source->find("name=\"", source->find("<ascxml"));
    const std::string id = at == std::string::npos ? "X" : source->substr(at + 6, source->find('"', at + 6) - at - 6);
    ASSERT_TRUE(text::write_file(system.path() / "bt.xml",
                                 "<root BTCPP_format=\"4\"><BehaviorTree ID=\"T\"><Action ID=\"" +
                                     (is_plugin ? id : "AlwaysSuccess") + "\"/></BehaviorTree></root>"));
    ASSERT_TRUE(text::write_file(
        system.path() / "main.xml",
        std::string("<roaml><behavior_tree><input type=\"bt.cpp-xml\" src=\"bt.xml\"/>") +
            (is_plugin
                 ? "<input type=\"bt-plugin-ascxml\" src=\"chart.ascxml\"/></behavior_tree>"
                 : "</behavior_tree><node_models><input type=\"node-ascxml\" src=\"chart.ascxml\"/></node_models>") +
            "</roaml>"));
    const auto imported = import_system(system.path());
    ASSERT_TRUE(imported.ok()) << name << ": " << to_string(imported.diagnostics.at(0));
    SCOPED_TRACE(name);
    expect_files_load(*imported.value);
    ++charts;
    plugins_only += is_plugin ? 1 : 0;
  }
  EXPECT_GT(charts, 0);
  RecordProperty("charts", charts);
  RecordProperty("plugins", plugins_only);
}

}  // namespace
}  // namespace sentree::import
