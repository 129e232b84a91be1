#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "sentree/bt/registry.h"
#include "sentree/bt/runner.h"

namespace sentree::bt {
namespace {

using ::testing::HasSubstr;

// Built beside this test (tests/CMakeLists.txt).
std::string plugin(const std::string& name) { return SENTREE_PLUGIN_FOLDER "/lib" + name + ".so"; }

Diagnostic refusal(const std::string& file) {
  Registry registry;
  const auto loaded = registry.plugin(file);
  return loaded ? Diagnostic{} : loaded.error();
}

TEST(Plugin, NodesRunLikeThoseOfTheProgram) {
  Registry registry;
  const auto registered = registry.plugin(plugin("nodes_plugin"));
  ASSERT_TRUE(registered) << to_string(registered.error());
  auto loaded = load(R"(<root BTCPP_format="4"><BehaviorTree ID="M"><Sequence>
      <Script code="x := 3"/><CountTo limit="3" anything="{x}"/><Double in="{x}" out="{y}"/>
      <ScriptCondition code="y == 6 &amp;&amp; THE_ANSWER == 42"/>
    </Sequence></BehaviorTree></root>)",
                     {.registry = &registry});
  for (const Diagnostic& d : loaded.diagnostics) ADD_FAILURE() << to_string(d);
  ASSERT_TRUE(loaded.ok());
  Runner runner(std::move(*loaded.value));
  EXPECT_EQ(runner.tick(), Status::kRunning);
  EXPECT_EQ(runner.tick(), Status::kRunning);
  EXPECT_EQ(runner.tick(), Status::kSuccess);
}

TEST(Plugin, IsFoundByAPathWithoutAFolder) {
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(SENTREE_PLUGIN_FOLDER);
  Registry registry;
  EXPECT_TRUE(registry.plugin("libnodes_plugin.so"));
  std::filesystem::current_path(before);
}

TEST(Plugin, SaysWhyItCannotBeLoaded) {
  EXPECT_EQ(refusal("/nowhere/libx.so").message, "plug-in /nowhere/libx.so: no such file");
  EXPECT_EQ(refusal(SENTREE_SOURCE_DIR "/README.md").code, "bt.plugin-unreadable");
  EXPECT_THAT(refusal(SENTREE_SOURCE_DIR "/README.md").message, HasSubstr("cannot be loaded: "));
  EXPECT_EQ(refusal(plugin("no_plugin")).code, "bt.plugin-symbol");
  EXPECT_THAT(refusal(plugin("no_plugin")).message, HasSubstr("SENTREE_REGISTER_NODES"));
  EXPECT_EQ(refusal(plugin("other_abi_plugin")).code, "bt.plugin-abi");
  EXPECT_THAT(refusal(plugin("other_abi_plugin")).message,
              HasSubstr("was built for sentree::bt 0; this program needs"));
  EXPECT_EQ(refusal(plugin("throws_plugin")).code, "bt.plugin-threw");
  EXPECT_THAT(refusal(plugin("throws_plugin")).message, HasSubstr("the robot is not there"));
}

TEST(Plugin, AnIdOfTwoPluginsIsReportedWithBothFiles) {
  Registry registry;
  ASSERT_TRUE(registry.plugin(plugin("nodes_plugin")));
  ASSERT_TRUE(registry.plugin(plugin("nodes_again_plugin")));
  ASSERT_EQ(registry.problems().size(), 1U);
  EXPECT_EQ(registry.problems().front().code, "bt.duplicate-node");
  EXPECT_EQ(registry.problems().front().message,
            "plug-in " + plugin("nodes_again_plugin") + ": C++ node \"Double\" is registered twice; plug-in " +
                plugin("nodes_plugin") +
                ", which was loaded before, has that ID: give one of them another, or load the nodes once only");
}

TEST(Plugin, AnIdOfTheProgramAndOfAPluginIsReportedWithItsFile) {
  Registry registry;
  registry.action("Double", [](Context&) { return Status::kSuccess; });
  ASSERT_TRUE(registry.plugin(plugin("nodes_again_plugin")));
  ASSERT_EQ(registry.problems().size(), 1U);
  EXPECT_THAT(registry.problems().front().message,
              HasSubstr("nodes_again_plugin.so: C++ node \"Double\" is registered"));
}

TEST(Plugin, LoadedTwiceIsReportedByTheTreeThatUsesIt) {
  Registry registry;
  ASSERT_TRUE(registry.plugin(plugin("nodes_plugin")));
  ASSERT_TRUE(registry.plugin(plugin("nodes_plugin")));
  ASSERT_FALSE(registry.problems().empty());
  EXPECT_EQ(registry.problems().front().code, "bt.duplicate-node");
  EXPECT_THAT(registry.problems().front().message, HasSubstr("or load the nodes once only"));
}

}  // namespace
}  // namespace sentree::bt
