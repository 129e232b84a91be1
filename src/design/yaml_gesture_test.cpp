#include "sentree/design/yaml_gesture.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "sentree/text/file.h"
#include "sentree/text/yaml.h"

namespace sentree::design {
namespace {

namespace fs = std::filesystem;

const std::string kScenario =
    "duration: 2 min\r\ntimeline:\r\n  - {at: 20 s, kill: robot}   # here\r\nexpect: {mission: RUNNING}\r\n";

TEST(YamlGesture, IsTheLeastEditAndHasAName) {
  const auto moved = edit_yaml(kScenario, SetYaml{{"timeline", 0U, "at"}, "21 s"});
  ASSERT_TRUE(moved) << to_string(moved.error());
  EXPECT_EQ(moved->name, "set timeline[0].at to 21 s");
  const std::size_t at = kScenario.find("20 s") + 1;
  EXPECT_EQ(moved->edits, (TextEdits{{at, at + 1, "1"}}));
}

TEST(YamlGesture, KeepsLineEndsOfOtherSystems) {
  const auto added = edit_yaml(kScenario, InsertYaml{{"timeline"}, 1, Map{{"at", "30 s"}, {"restart", "robot"}}});
  ASSERT_TRUE(added) << to_string(added.error());
  EXPECT_EQ(with_edits(kScenario, added->edits).value(),
            "duration: 2 min\r\ntimeline:\r\n  - {at: 20 s, kill: robot}   # here\r\n  - {at: 30 s, restart: "
            "robot}\r\nexpect: {mission: RUNNING}\r\n");
}

TEST(YamlGesture, SaysWhatCannotBe) {
  EXPECT_EQ(edit_yaml(kScenario, SetYaml{{"duration"}, "2 min"}).error().code, "design.nothing-to-do");
  EXPECT_EQ(edit_yaml(kScenario, RemoveYaml{{"seed"}}).error().code, "yaml.no-such-place");
}

// A way to some value of a document, and how many values it has.
std::size_t collect(const text::YamlNode& node, text::YamlPath& path, std::vector<text::YamlPath>& paths) {
  if (!path.empty()) paths.push_back(path);
  for (const auto& [key, value] : node.entries) {
    path.emplace_back(key.scalar);
    collect(value, path, paths);
    path.pop_back();
  }
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    path.emplace_back(i);
    collect(node.items[i], path, paths);
    path.pop_back();
  }
  return paths.size();
}

TEST(YamlGesture, DoesAndUndoesRandomEditsOfEveryExample) {
  std::mt19937 random(20251123);
  std::size_t done = 0;
  std::size_t refused = 0;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(SENTREE_SOURCE_DIR) / "examples")) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string original = text::read_file(entry.path()).value();
    std::string now = original;
    std::vector<TextEdits> back;
    for (int i = 0; i < 40; ++i) {
      const auto root = text::parse_yaml(now);
      ASSERT_TRUE(root) << entry.path() << "\n" << now;
      text::YamlPath path;
      std::vector<text::YamlPath> paths;
      if (collect(*root, path, paths) == 0) break;
      path = paths[random() % paths.size()];
      const auto what = random() % 4;
      const Value value = what == 0 ? Value(Map{{"a", 1}, {"b: c", List{"#", true}}}) : Value("x: y");
      YamlGesture gesture = SetYaml{path, value};
      if (what == 2) gesture = RemoveYaml{path};
      if (what == 3) gesture = InsertYaml{path, random() % 3, value};
      const auto result = edit_yaml(now, gesture);
      if (!result) {
        ++refused;
        continue;
      }
      ++done;
      back.push_back(inverse(now, result->edits));
      now = with_edits(now, result->edits).value();
    }
    for (auto undo = back.rbegin(); undo != back.rend(); ++undo) now = with_edits(now, *undo).value();
    EXPECT_EQ(now, original) << entry.path();
  }
  // Items are only put into sequences: more than half of the others can be done.
  EXPECT_GT(done, 2 * refused) << done << " done, " << refused << " refused";
}

}  // namespace
}  // namespace sentree::design
