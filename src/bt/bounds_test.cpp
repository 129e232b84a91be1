#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "sentree/bt/detail/test_support.h"
#include "sentree/bt/load.h"
#include "sentree/bt/runner.h"
#include "sentree/bt/script.h"

// Every bound, reached: a message, no crash.

namespace sentree::bt {
namespace {

using ::testing::HasSubstr;

/// Every file f<n>.xml includes the next one, padded to that many bytes.
LoadOptions chain(std::size_t padding) {
  LoadOptions options;
  options.read_file = [padding](const std::filesystem::path& path) -> Result<std::string> {
    const int number = std::stoi(path.filename().string().substr(1));
    return "<root BTCPP_format=\"4\"><include path=\"f" + std::to_string(number + 1) + ".xml\"/></root>" +
           std::string(padding, ' ');
  };
  return options;
}
const std::string kIncluding =
    "<root BTCPP_format=\"4\"><include path=\"f1.xml\"/><BehaviorTree ID=\"A\"><AlwaysSuccess/></BehaviorTree></root>";

TEST(Bounds, OfIncludedFiles) {
  LoadOptions options;
  options.read_file = [](const std::filesystem::path& path) -> Result<std::string> {
    std::string text = "<root BTCPP_format=\"4\">";
    for (int i = 0; path.filename() == "f1.xml" && i < 1000; ++i)
      text += "<include path=\"g" + std::to_string(i) + "\"/>";
    return text + "</root>";
  };
  EXPECT_THAT(messages(kIncluding, options), HasSubstr("more than 1000 files are included"));
}

TEST(Bounds, OfTheDepthOfIncludedFiles) {
  EXPECT_THAT(messages(kIncluding, chain(0)), HasSubstr("files include each other more than 64 levels deep"));
}

TEST(Bounds, OfTheBytesOfIncludedFiles) {
  EXPECT_THAT(messages(kIncluding, chain(9U << 20U)),
              HasSubstr("the included files have more than 67108864 bytes together"));
}

TEST(Bounds, OfFilesThatIncludeManyTimesOver) {
  // Each file includes the next one ten times; each is read once.
  int read = 0;
  LoadOptions options;
  options.read_file = [&](const std::filesystem::path& path) -> Result<std::string> {
    ++read;
    const int number = std::stoi(path.filename().string().substr(1));
    std::string text = "<root BTCPP_format=\"4\">";
    for (int i = 0; i < 10 && number < 20; ++i) text += "<include path=\"f" + std::to_string(number + 1) + ".xml\"/>";
    return text + "</root>";
  };
  EXPECT_TRUE(load(kIncluding, options, "m.xml").ok());
  EXPECT_EQ(read, 20);
}

TEST(Bounds, OfTheMainFile) {
  EXPECT_THAT(messages(std::string(kIncludeBytesMax + 1, ' ')), HasSubstr("the file has more than 67108864 bytes"));
}

TEST(Bounds, OfXmlNesting) {
  std::string body;
  for (int i = 0; i < 1'100; ++i) body += "<Inverter>";
  body += "<AlwaysSuccess/>";
  for (int i = 0; i < 1'100; ++i) body += "</Inverter>";
  EXPECT_THAT(messages(in_tree(body)), HasSubstr("nested deeper than 1000 levels"));
}

TEST(Bounds, OfPorts) {
  std::string attributes;
  std::string model = "<TreeNodesModel><Action ID=\"Go\">";
  for (std::size_t i = 0; i <= kPortsMax; ++i) {
    attributes += " p" + std::to_string(i) + "=\"\"";
    model += "<input_port name=\"p" + std::to_string(i) + "\"/>";
  }
  model += "</Action></TreeNodesModel>";
  EXPECT_THAT(messages(in_tree("<Action ID=\"Do\"" + attributes + "/>")), HasSubstr("more than 1000 attributes"));
  EXPECT_THAT(messages(in_tree("<Go/>", model)), HasSubstr("\"Go\" has more than 1000 ports"));
  Registry registry;
  registry.action("Many", Ports(kPortsMax + 1, input<int>("p")), [](Context&) { return Status::kSuccess; });
  EXPECT_THAT(messages(in_tree("<AlwaysSuccess/>"), {.registry = &registry}), HasSubstr("has more than 1000 ports"));
}

TEST(Bounds, OfTheTextOfAPort) {
  EXPECT_THAT(messages(in_tree("<Action ID=\"Go\" to=\"" + std::string(kPortBytesMax + 1, 'x') + "\"/>")),
              HasSubstr("port \"to\" of Go has 1048577 bytes; at most 1048576 are accepted"));
  EXPECT_TRUE(load(in_tree("<Action ID=\"Go\" to=\"" + std::string(kPortBytesMax, 'x') + "\"/>")).ok());
}

TEST(Bounds, OfFindings) {
  std::string body = "<Sequence>";
  for (std::size_t i = 0; i < kFindingsMax + 50; ++i) body += "<Sequnce/>";
  const auto loaded = load(in_tree(body + "</Sequence>"));
  EXPECT_FALSE(loaded.ok());
  EXPECT_EQ(loaded.diagnostics.size(), kFindingsMax + 1);
}

TEST(Bounds, OfFindingsDoNotHideAnError) {
  std::string body = "<Sequence>";
  for (std::size_t i = 0; i < kFindingsMax + 50; ++i) body += "<AlwaysSuccess _x=\"1\"/>";
  const auto loaded = load(in_tree(body + "<Sequnce/></Sequence>"));
  EXPECT_FALSE(loaded.ok());
}

TEST(Bounds, OfEntriesNamedAtRunTime) {
  auto loaded = load(
      in_tree("<Sequence><RunOnce then_skip=\"false\"><Script code=\"n := 0; key := 'k'\"/></RunOnce>"
              "<Script code=\"n += 1; key = 'k' .. n\"/><SetBlackboard value=\"x\" output_key=\"{key}\"/></Sequence>"));
  ASSERT_TRUE(loaded.ok());
  Runner runner(std::move(*loaded.value));
  std::size_t ticks = 0;
  while (runner.tick() == Status::kSuccess) ++ticks;
  EXPECT_EQ(ticks, kRuntimeEntriesMax);
  ASSERT_TRUE(runner.error().has_value());
  EXPECT_EQ(runner.error()->code, "bt.too-many-entries");
  EXPECT_EQ(set_entry(runner.tree(), runner.state(), "one-more", Value(1), TimePoint{}).error().code,
            "bt.too-many-entries");
  EXPECT_TRUE(restore(runner.tree(), save(runner.tree(), runner.state()).value()).has_value());
}

TEST(Bounds, OfTextThatScriptsMake) {
  for (const std::string script : {"s := s .. s", "s := s + s", "s += s"}) {
    auto loaded =
        load(in_tree("<Sequence><RunOnce then_skip=\"false\"><Script code=\"s := 'x'\"/></RunOnce>"
                     "<Script code=\"" +
                     script + "\"/></Sequence>"));
    Runner runner(std::move(*loaded.value));
    int ticks = 0;
    while (runner.tick() == Status::kSuccess) ++ticks;
    EXPECT_EQ(ticks, 20) << script;
    EXPECT_THAT(runner.error()->message, HasSubstr("a text longer than 1048576 bytes"));
  }
}

TEST(Bounds, OfScripts) {
  EXPECT_EQ(compile_script(std::string(1000, '(')).error().code, "bt.script-too-large");
  EXPECT_EQ(compile_script(std::string(1000, '-') + "1").error().code, "bt.script-too-large");
  std::string assignments;
  for (int i = 0; i < 1000; ++i) assignments += "a := ";
  EXPECT_EQ(compile_script(assignments + "1").error().code, "bt.script-too-large");
  EXPECT_EQ(compile_script(std::string(kScriptBytesMax + 1, '1')).error().code, "bt.script-too-large");
  EXPECT_TRUE(compile_script(std::string(90, '(') + "1" + std::string(90, ')')));
}

}  // namespace
}  // namespace sentree::bt
