#include "sentree/text/yaml.h"

#include <gtest/gtest.h>

namespace sentree::text {
namespace {

std::string yaml_refusal(std::string_view source) {
  const auto node = parse_yaml(source, "a.yaml");
  return node ? "accepted" : to_string(node.error());
}

TEST(Yaml, KeepsOrderPlacesAndTypes) {
  const auto node = parse_yaml("b: 1\na: [x, '2', 2.5, true, ~]\nc: {d: 1e3}\n", "a.yaml");
  ASSERT_TRUE(node);
  EXPECT_EQ(to_json(node->value()), R"({"b":1,"a":["x","2",2.5,true,null],"c":{"d":1000.0}})");
  EXPECT_EQ(to_string(node->find("a")->items[1].span), "a.yaml:2:8");
  EXPECT_TRUE(node->find("a")->items[1].quoted);
  EXPECT_EQ(node->find("c")->find("d")->number(), 1000.0);
  EXPECT_EQ(node->find("nothing"), nullptr);
}

TEST(Yaml, AnEmptyFileIsNull) { EXPECT_TRUE(parse_yaml("# nothing\n")->is_null()); }

TEST(Yaml, RefusesWithAPlace) {
  EXPECT_TRUE(yaml_refusal("a: [1\nb: 2").starts_with("a.yaml:"));
  EXPECT_EQ(yaml_refusal("a: 1\nb: 2\na: 3\n"), "a.yaml:3:1: key \"a\" stands twice");
  EXPECT_EQ(yaml_refusal("a: 1\n---\nb: 1\n"), "a.yaml:2:1: a second document; one file holds one");
  EXPECT_EQ(yaml_refusal("? [1, 2]\n: 3\n"), "a.yaml:1:3: a key must be a plain text");
}

TEST(Yaml, TellsTheWayOut) {
  const char* const indented = "; this line is indented otherwise than those that it belongs to";
  EXPECT_NE(yaml_refusal("a:\n  b: 1\n c: 2\n").find(indented), std::string::npos);
  EXPECT_NE(yaml_refusal("a:\n- b: 1\n   c: 2\n").find(indented), std::string::npos);
  EXPECT_NE(yaml_refusal("a: b: c\n").find("; a text with a colon in it needs quotes"), std::string::npos);
  EXPECT_NE(yaml_refusal("a: \"b\" c\n").find("; the value ends before this: quotes go around a whole text"),
            std::string::npos);
  EXPECT_NE(yaml_refusal("a: {b: 1\nc: 2\n").find("; a { before this is not closed by }"), std::string::npos);
}

TEST(Yaml, BoundsNestingAndAliases) {
  EXPECT_EQ(yaml_refusal(std::string(200, '[') + std::string(200, ']')), "a.yaml:1:101: nested deeper than 100 levels");
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) bomb += (k ? ", " : "") + before;
    bomb += "]\n";
  }
  EXPECT_EQ(yaml_refusal(bomb), "a.yaml:5:55: more than 200000 nodes");
  // What is kept of nested anchors counts as what is made of them.
  std::string anchors;
  for (int i = 0; i < 50; ++i) anchors += "&a" + std::to_string(i) + " [";
  for (int i = 0; i < 5000; ++i) anchors += "x,";
  EXPECT_EQ(yaml_refusal(anchors + std::string(50, ']')), "a.yaml:1:10289: more than 200000 nodes");
  EXPECT_EQ(yaml_refusal(std::string(4U << 20U, '[')), "a.yaml:1:1: nested deeper than 100 levels");
  EXPECT_EQ(yaml_refusal(std::string((4U << 20U) + 1, ' ')),
            "a.yaml: larger than the 4194304 bytes that are read at most");
  std::string texts = "t: &t " + std::string(1U << 20U, 'x') + "\nall: [";
  for (int i = 0; i < 64; ++i) texts += "*t,";
  EXPECT_EQ(yaml_refusal(texts + "]"), "a.yaml:2:190: more than 67108864 bytes of text");
}

}  // namespace
}  // namespace sentree::text
