#include "sentree/project/mission_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "sentree/base/temporary_folder.h"
#include "sentree/bt/runner.h"
#include "sentree/nav2/nav2.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::project {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

/// A project in a folder of its own.
class TreeFolder {
 public:
  TreeFolder& file(const std::string& name, const std::string& content) {
    fs::create_directories((folder_.path() / name).parent_path());
    std::ofstream(folder_.path() / name) << content;
    return *this;
  }
  TreeFolder& tree(const std::string& name, const std::string& id, const std::string& body,
                   const std::string& more = {}) {
    return file(name, "<root BTCPP_format=\"4\"><BehaviorTree ID=\"" + id + "\">" + body + "</BehaviorTree>" + more +
                          "</root>\n");
  }
  TreeFolder& yaml(const std::string& text) { return file("sentree.yaml", text); }

  [[nodiscard]] const fs::path& path() const { return folder_.path(); }
  [[nodiscard]] Loaded<Project> project() const { return load_project(folder_.path()); }
  /// What is said of the mission, or of the project that does not load.
  [[nodiscard]] std::string told(TreePurpose purpose = TreePurpose::kRun) const {
    const auto loaded = project();
    std::string all = text(loaded.diagnostics);
    if (!loaded.ok()) return all;
    bt::Registry registry;
    const auto tree = load_mission(*loaded.value, registry, purpose);
    return all + text(tree.diagnostics) + (tree.ok() ? "loaded" : "");
  }

 private:
  [[nodiscard]] std::string text(const Diagnostics& diagnostics) const {
    std::string all;
    for (const Diagnostic& d : diagnostics) all += to_string(d) + "\n";
    // Paths without the folder's changing name.
    const std::string here = folder_.path().string() + "/";
    for (std::size_t at = 0; (at = all.find(here, at)) != std::string::npos;) all.erase(at, here.size());
    return all;
  }
  TemporaryFolder folder_{"mission-tree"};
};

constexpr const char* kSkill =
    "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" initial=\"s\"><state "
    "id=\"s\">"
    "<transition event=\"tick\" target=\"success\"/><transition event=\"halt\" target=\"halted\"/></state><final "
    "id=\"success\"/><final id=\"halted\"/></scxml>";

TEST(MissionTree, DoesNotTakeASlipOfAKindForASkillOfThatName) {
  TreeFolder folder;
  folder.yaml("mission: {file: m.xml}\nskills: {Go: {at: 'tcp://127.0.0.1:9'}}\n");
  folder.tree("m.xml", "Main", "<Aciton ID=\"Go\" name=\"Go\"/>");
  EXPECT_THAT(folder.told(), HasSubstr("there is no node \"Aciton\"; did you mean \"Action\"?"));
}

TEST(MissionFiles, AreFoundByPatternsAndLendEachOtherTheirTrees) {
  TreeFolder folder;
  folder.yaml("mission: {files: [trees/*.xml, more/dock.xml], tree: Main}\n")
      .tree("trees/b_main.xml", "Main", "<Sequence><SubTree ID=\"Drive\"/><SubTree ID=\"Dock\"/></Sequence>")
      .tree("trees/a_drive.xml", "Drive", "<AlwaysSuccess/>")
      .tree("more/dock.xml", "Dock", "<AlwaysSuccess/>");
  EXPECT_EQ(folder.told(), "loaded");
  const auto project = folder.project();
  ASSERT_TRUE(project.ok());
  EXPECT_EQ(project.value->mission.path, "trees/b_main.xml");
  EXPECT_EQ(project.value->mission_files.size(), 3U);
}

TEST(MissionFiles, NeedNoNameOfTheMainTreeWhereOneFileNamesIt) {
  TreeFolder folder;
  folder.yaml("mission: {files: \"*.xml\"}\n")
      .tree("a.xml", "A", "<AlwaysSuccess/>")
      .file("b.xml",
            "<root BTCPP_format=\"4\" main_tree_to_execute=\"B\"><BehaviorTree ID=\"B\"><SubTree "
            "ID=\"A\"/></BehaviorTree></root>");
  EXPECT_EQ(folder.told(), "loaded");
  EXPECT_EQ(folder.project().value->mission.path, "b.xml");
}

TEST(MissionFiles, SayWhatIsMissing) {
  TreeFolder folder;
  folder.yaml("mission: {files: [trees/*.xml], tree: Mian}\n").tree("trees/a.xml", "Main", "<AlwaysSuccess/>");
  EXPECT_THAT(
      folder.told(),
      HasSubstr("sentree.yaml:1:18: none of the mission's files has a BehaviorTree \"Mian\"; did you mean \"Main\"?"));
  folder.yaml("mission: {files: [tree/*.xml], tree: Main}\n");
  EXPECT_THAT(folder.told(), HasSubstr("sentree.yaml:1:18: \"tree/*.xml\" matches no file"));
  folder.yaml("mission: {files: [trees/*.xml], tree: Main}\n").tree("trees/a.xml", "Main", "<SubTree ID=\"Gone\"/>");
  EXPECT_THAT(folder.told(), HasSubstr("trees/a.xml:1:61: there is no BehaviorTree \"Gone\""));
  EXPECT_THAT(folder.told(TreePurpose::kLook), HasSubstr("warning: there is no BehaviorTree \"Gone\""));
}

TEST(MissionFiles, SayWhichFileHasATreeThatIsMissed) {
  TreeFolder folder;
  folder.yaml("mission: {file: main.xml}\n")
      .tree("main.xml", "Main", "<SubTree ID=\"Charge\"/>")
      .tree("trees/charge.xml", "Charge", "<AlwaysSuccess/>");
  EXPECT_THAT(folder.told(), HasSubstr("main.xml:1:61: there is no BehaviorTree \"Charge\"; trees/charge.xml has it: "
                                       "write mission: {files: [main.xml, trees/charge.xml]}"));
  folder.yaml("mission: {files: [main.xml]}\n");
  EXPECT_THAT(folder.told(), HasSubstr("; trees/charge.xml has it; name it under mission.files"));
  folder.yaml("mission: {file: main.xml, tree: Charge}\n");
  EXPECT_THAT(folder.told(), HasSubstr("there is no BehaviorTree \"Charge\"; trees/charge.xml has it"));
}

TEST(MissionEntries, AreThereBeforeTheFirstTick) {
  TreeFolder folder;
  folder.yaml("mission: {file: main.xml, entries: {battery: 0.8, estop: false}}\n")
      .tree("main.xml", "Main", "<ScriptCondition code=\"battery &gt; 0.5 &amp;&amp; !estop\"/>")
      .file("scenarios/low.yaml", "override: {mission: {entries: {battery: 0.2}}}\n");
  EXPECT_EQ(folder.told(), "loaded");
  const auto result_of = [](Project project) {
    bt::Registry registry;
    bt::Runner runner(std::move(*load_mission(project, registry).value));
    return runner.tick();
  };
  EXPECT_EQ(result_of(*folder.project().value), bt::Status::kSuccess);
  auto low = load_scenario(folder.path() / "scenarios/low.yaml");
  ASSERT_TRUE(low.ok());
  ASSERT_EQ(low.value->project.entries.size(), 2U) << "the others stay";
  EXPECT_EQ(result_of(low.value->project), bt::Status::kFailure);
  folder.yaml("mission: {file: main.xml, entries: {batery: 0.8, estop: [1], \"{x}\": 1}}\n");
  EXPECT_THAT(folder.told(),
              HasSubstr("sentree.yaml:1:57: entry \"estop\" must begin with a number, true, false or a text"));
  EXPECT_THAT(folder.told(), HasSubstr("sentree.yaml:1:62: \"{x}\" is no name of an entry"));
  folder.yaml("mission: {file: main.xml, entries: {batery: 0.8, estop: false}}\n");
  EXPECT_THAT(folder.told(), HasSubstr("sentree.yaml:1:37: warning: nothing in tree \"Main\" names entry \"batery\"; "
                                       "did you mean \"battery\"?"));
}

TEST(Palettes, SayWhatNodesAreAndAreToldWhereTheyAreNamed) {
  TreeFolder folder;
  folder.yaml("mission: {file: m.xml}\npalettes: [nodes.xml]\n")
      .tree("m.xml", "M", "<Sequence><GoTo/><Twice><AlwaysSuccess/></Twice></Sequence>");
  EXPECT_THAT(folder.told(), HasSubstr("sentree.yaml:2:11: file \"nodes.xml\": no such file"));
  folder.file("nodes.xml",
              "<root><TreeNodesModel><Action ID=\"GoTo\"/><Decorator ID=\"Twice\"/></TreeNodesModel></root>");
  EXPECT_EQ(folder.told(), "m.xml:1:62: \"Twice\" is declared as Decorator, and no C++ node of that ID is registered\n")
      << "a project must run";
  EXPECT_THAT(folder.told(TreePurpose::kLook), HasSubstr("loaded"));
}

TEST(Palettes, OfNav2BringItsNodes) {
  TreeFolder folder;
  folder.yaml("mission: {file: m.xml}\npalettes: nav2\n")
      .tree("m.xml", "M",
            "<RecoveryNode><RateController hz=\"2\"><AlwaysSuccess/></RateController><AlwaysSuccess/></RecoveryNode>");
  EXPECT_EQ(folder.told(), "loaded");
  folder.tree("m.xml", "M", "<SpeedController><AlwaysSuccess/></SpeedController>");
  EXPECT_THAT(folder.told(), HasSubstr("\"SpeedController\" is declared as Decorator, and no C++ node"));
}

TEST(Palettes, OfNav2BringSkillsUnlessTheProjectHasThem) {
  TreeFolder folder;
  folder.yaml("mission: {file: m.xml}\npalettes: nav2\n")
      .tree("m.xml", "M", "<Sequence><Wait/><GoalUpdated/></Sequence>");
  EXPECT_EQ(folder.told(), "loaded");
  folder.yaml("mission: {file: m.xml}\n");
  EXPECT_THAT(folder.told(), HasSubstr("there is no node \"Wait\""));
}

TEST(Palettes, OfNav2DescribeWhatTheirSkillsTakeAndGive) {
  const std::filesystem::path folder = shipped_folder("skills") / "nav2";
  std::set<std::string> leaves;
  for (const bt::NodeModel& model : nav2::models()) {
    if (model.category != bt::Category::kAction && model.category != bt::Category::kCondition) continue;
    for (const std::string& file : {model.id + ".scxml", model.id + std::string(kActionChart)}) {
      leaves.insert(file);
      std::error_code error;
      if (file.ends_with(kActionChart) && !std::filesystem::exists(folder / file, error)) continue;
      const auto source = text::read_file(folder / file);
      ASSERT_TRUE(source) << file;
      scxml::LoadOptions options;
      options.read = [&](std::string_view uri) { return text::read_file(folder / std::string(uri)); };
      const auto chart = scxml::load(*source, file, options);
      ASSERT_TRUE(chart.ok()) << file;
      EXPECT_EQ(category_of(*chart.value), model.category) << file;
    }
  }
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    if (file.path().extension() != ".scxml") continue;
    EXPECT_TRUE(leaves.contains(file.path().filename())) << file.path();
  }
}

TEST(Palettes, OfNav2SendGoalsWhereTheProjectHasActions) {
  TreeFolder folder;
  folder.tree("m.xml", "M", "<Sequence><Spin spin_dist=\"1.57\"/><Wait/></Sequence>");
  folder.yaml(
      "mission: {file: m.xml}\npalettes: nav2\nservices:\n"
      "  spin: {interface: nav2_msgs/action/Spin, at: topics}\n");
  const auto project = folder.project();
  ASSERT_TRUE(project.ok());
  EXPECT_TRUE(skill_file(*project.value, nullptr, "Spin").path.ends_with("skills/nav2/Spin.action.scxml"));
  EXPECT_TRUE(skill_file(*project.value, nullptr, "Wait").path.ends_with("skills/nav2/Wait.scxml"));
  folder.file("skills/Spin.scxml", kSkill);
  EXPECT_EQ(skill_file(*project.value, nullptr, "Spin").path, "skills/Spin.scxml");
  folder.yaml("mission: {file: m.xml}\npalettes: nav2\n");
  const auto without = folder.project();
  EXPECT_EQ(skill_file(*without.value, nullptr, "Spin").path, "skills/Spin.scxml");
  EXPECT_TRUE(skill_file(*without.value, nullptr, "BackUp").path.ends_with("skills/nav2/BackUp.scxml"));
}

TEST(Packages, AreLookedForInTheProjectsFolders) {
  TreeFolder folder;
  const std::string include =
      "<root BTCPP_format=\"4\" main_tree_to_execute=\"M\"><include ros_pkg=\"nav\" path=\"t.xml\"/></root>";
  folder.yaml("mission: {file: m.xml}\npackages: [vendor]\n").file("m.xml", include);
  EXPECT_THAT(folder.told(), HasSubstr("there is no ROS package \"nav\"; tried vendor/share/nav, vendor/nav"));
  folder.tree("vendor/nav/t.xml", "M", "<AlwaysSuccess/>");
  EXPECT_EQ(folder.told(), "loaded");
}

TEST(Skills, MakeTheirLeavesKnown) {
  TreeFolder folder;
  folder.yaml("mission: {file: m.xml}\n")
      .tree("m.xml", "M", "<Sequence><GoTo place=\"hall\"/><GoTo place=\"door\"/></Sequence>");
  EXPECT_THAT(folder.told(), HasSubstr("there is no node \"GoTo\""));
  EXPECT_THAT(folder.told(), Not(HasSubstr("did you mean \"GoTo\"")));
  folder.file("skills/GoTo.scxml", kSkill);
  EXPECT_EQ(folder.told(), "loaded");
  const auto project = folder.project();
  const auto plan = prepare(plain_scenario(*project.value));
  ASSERT_TRUE(plan.ok());
  ASSERT_EQ(plan.value->leaves.size(), 2U);
  EXPECT_FALSE(plan.value->leaves[0].condition);
  EXPECT_EQ(plan.value->leaves[0].name, "GoTo__2");
  EXPECT_EQ(plan.value->leaves[1].name, "GoTo__3");
}

}  // namespace
}  // namespace sentree::project
