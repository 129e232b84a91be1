#include "layers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace sentree::layers {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<SourceFile> read_sources() {
  const std::filesystem::path root = std::filesystem::path(SENTREE_SOURCE_DIR) / "src";
  std::vector<SourceFile> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    const auto extension = entry.path().extension();
    if (extension != ".h" && extension != ".cpp") continue;
    std::ifstream stream(entry.path(), std::ios::binary);
    files.push_back({entry.path().lexically_relative(root).generic_string(),
                     std::string(std::istreambuf_iterator<char>(stream), {})});
  }
  return files;
}

TEST(Layers, AreKeptByEverySource) {
  const std::vector<SourceFile> files = read_sources();
  ASSERT_GT(files.size(), 20u);
  EXPECT_THAT(violations(files), IsEmpty());
}

TEST(Layers, ShowOthersOnlyWhatTheyUse) {
  EXPECT_THAT(
      needlessly_public(read_sources(), {"bt/observer.h", "bt/queue_nodes.h", "bt/schema.h", "groot/publisher.h",
                                         "exec/coroutine_action.h", "exec/threaded_action.h", "exec/threads.h"}),
      IsEmpty())
      << "move them to detail/, or add them here if programs that embed ours need them";
}

TEST(Layers, FormNoCycle) {
  // Each rule names only libraries that stand before it, so a cycle cannot be written down.
  std::vector<std::string_view> before;
  for (const LibraryRule& rule : library_rules()) {
    for (const std::string_view library : rule.may_include)
      EXPECT_THAT(before, ::testing::Contains(library)) << rule.library;
    before.push_back(rule.library);
  }
}

TEST(LayersChecker, FindsAnIncludeOfASibling) {
  EXPECT_THAT(
      violations({{"scxml/chart.h", ""}, {"bt/tree.cpp", "// A comment\n  #  include \"sentree/scxml/chart.h\"\n"}}),
      ElementsAre("src/bt/tree.cpp:2: bt must not include scxml"));
  EXPECT_THAT(violations({{"runtime/run.h", ""}, {"base/value.h", "#include \"sentree/runtime/run.h\"\n"}}),
              ElementsAre("src/base/value.h:1: base must not include runtime"));
}

TEST(LayersChecker, LetsMonitorsUseCharts) {
  EXPECT_THAT(violations({{"scxml/chart.h", ""}, {"monitor/monitor.h", "#include \"sentree/scxml/chart.h\"\n"}}),
              IsEmpty());
}

TEST(LayersChecker, KeepsHeavyHeadersOutOfPublicOnes) {
  EXPECT_THAT(violations({{"rpc/a.h", "#include <thrift/Thrift.h>\n"},
                          {"rpc/a.cpp", "#include <thrift/Thrift.h>\n"},
                          {"rpc/detail/a.h", "#include <thrift/Thrift.h>\n"}}),
              ElementsAre("src/rpc/a.h:1: public header includes <thrift/Thrift.h>; keep it in a .cpp"));
  for (const std::string header : {"boost/beast.hpp", "duktape.h", "yaml-cpp/yaml.h", "nlohmann/json.hpp"}) {
    EXPECT_THAT(violations({{"text/a.h", "#include <" + header + ">\n"}}), SizeIs(1)) << header;
  }
}

TEST(LayersChecker, KeepsPrivateHeadersOutOfPublicOnes) {
  EXPECT_THAT(violations({{"idl/detail/a.h", ""}, {"idl/b.h", "#include \"sentree/idl/detail/a.h\"\n"}}),
              ElementsAre("src/idl/b.h:1: public header includes the private \"sentree/idl/detail/a.h\""));
  for (const std::string header : {"idl/parts/a.h", "idl/test_a.h"}) {
    const std::string include = "#include \"sentree/" + header + "\"\n";
    EXPECT_THAT(violations({{header, ""}, {"idl/b.h", include}}),
                ElementsAre("src/idl/b.h:1: public header includes the private \"sentree/" + header + "\""));
    EXPECT_THAT(violations({{header, ""}, {"idl/parts/b.h", include}, {"idl/test_b.h", include}}), IsEmpty());
  }
  EXPECT_THAT(violations({{"idl/detail/a.h", ""}, {"idl/b.cpp", "#include \"sentree/idl/detail/a.h\"\n"}}), IsEmpty());
}

TEST(LayersChecker, LetsOnlyTestsUsePrivateHeadersOfOtherLibraries) {
  const std::string include = "#include \"sentree/idl/detail/a.h\"\n";
  EXPECT_THAT(violations({{"idl/detail/a.h", ""}, {"rpc/a_test.cpp", include}, {"rpc/a.cpp", include}}),
              ElementsAre("src/rpc/a.cpp:1: \"sentree/idl/detail/a.h\" is private to idl"));
}

TEST(LayersChecker, KnowsWhichHeadersOthersNeed) {
  const std::vector<SourceFile> files = {{"idl/a.h", "#include \"sentree/idl/b.h\"\n"},
                                         {"idl/b.h", ""},
                                         {"idl/alone.h", "#include \"sentree/idl/b.h\"\n"},
                                         {"idl/of_tests.h", ""},
                                         {"idl/for_users.h", ""},
                                         {"rpc/a_test.cpp", "#include \"sentree/idl/of_tests.h\"\n"},
                                         {"rpc/a.cpp", "#include \"sentree/idl/a.h\"\n"}};
  EXPECT_THAT(needlessly_public(files, {"idl/for_users.h"}), ElementsAre("idl/alone.h", "idl/of_tests.h"));
}

TEST(LayersChecker, FollowsIncludesToWhatMustStayHidden) {
  const std::vector<SourceFile> files = {{"sim/ground_truth.h", ""},
                                         {"sim/robot.h", "#include \"sentree/sim/ground_truth.h\"\n"},
                                         {"sim/localization_filter.cpp", "\n#include \"sentree/sim/robot.h\"\n"},
                                         {"sim/laser.cpp", "#include \"sentree/sim/robot.h\"\n"}};
  EXPECT_THAT(
      violations(files),
      ElementsAre("src/sim/localization_filter.cpp:2: must not see \"sentree/sim/ground_truth.h\", not even through "
                  "others: localization estimates from sensors only"));
}

TEST(LayersChecker, AsksForFullPathsAndKnownLibraries) {
  EXPECT_THAT(violations({{"bt/tree.h", ""}, {"bt/tree.cpp", "#include \"tree.h\"\n"}}),
              ElementsAre("src/bt/tree.cpp:1: write \"sentree/bt/tree.h\" instead of \"tree.h\""));
  EXPECT_THAT(violations({{"base/value.h", ""}, {"extra/a.cpp", "#include \"sentree/base/value.h\"\n"}}),
              ElementsAre("src/extra/a.cpp:1: library extra is not in the table of layers"));
  EXPECT_THAT(violations({{"bt/a.cpp", "#include \"sentree/bt/gone.h\"\n"}}),
              ElementsAre("src/bt/a.cpp:1: there is no header \"sentree/bt/gone.h\""));
}

}  // namespace
}  // namespace sentree::layers
