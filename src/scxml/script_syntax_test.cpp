#include "sentree/scxml/script_syntax.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::scxml {
namespace {

using testing::ElementsAre;

// As a text with every pair of parentheses.
std::string shown(const ScriptTree& tree, std::uint32_t id) {
  const ScriptNode& n = tree.at(id);
  std::string inner;
  for (std::size_t i = 0; i < n.operands.size(); ++i) {
    if (i > 0) inner += " ";
    if (!n.names.empty()) inner += n.names[i] + ":";
    inner += shown(tree, n.operands[i]);
  }
  switch (n.kind) {
    case ScriptNode::Kind::kText: return "'" + n.text + "'";
    case ScriptNode::Kind::kMember: return inner + "." + n.text;
    default: break;
  }
  return n.operands.empty() && n.kind != ScriptNode::Kind::kList && n.kind != ScriptNode::Kind::kRecord
             ? n.text
             : "(" + n.text + " " + inner + ")";
}

std::string read(std::string_view source) {
  const auto tree = parse_script_expression(source);
  return tree ? shown(*tree, tree->root()) : "?";
}

TEST(ScriptSyntax, BindsAsTheStandardSays) {
  EXPECT_EQ(read("a.b * 100 < 20 && c !== 'x'"), "(&& (< (* a.b 100) 20) (!== c 'x'))");
  EXPECT_EQ(read("a || b && !c"), "(|| a (&& b (! c)))");
  EXPECT_EQ(read("-a + b % 2"), "(+ (- a) (% b 2))");
  EXPECT_EQ(read("a ? b : c ? d : e"), "(? a b (? c d e))");
  EXPECT_EQ(read("x = y = 1, z"), "(, (= x (= y 1)) z)");
  EXPECT_EQ(read("typeof a === 'number'"), "(=== (typeof a) 'number')");
}

TEST(ScriptSyntax, ReadsCallsListsAndRecords) {
  EXPECT_EQ(read("['A', \"B\"].indexOf(_event.data.result.status) >= 0"),
            "(>= (( ([ 'A' 'B').indexOf _event.data.result.status) 0)");
  EXPECT_EQ(read("[, 1, , 2,]"), "([ hole 1 hole 2)");
  EXPECT_EQ(read("[]"), "([ )");
  EXPECT_EQ(read("{name: a, 'other': [1]}"), "({ name:a other:([ 1))");
  EXPECT_EQ(read("Math.min(a[0], f())"), "(( Math.min ([ a 0) (( f))");
  EXPECT_EQ(read("/a\\/[/]b/.test(x) / 2"), "(/ (( regex.test x) 2)");
}

TEST(ScriptSyntax, PathsAreWhatTheyShow) {
  const auto tree = parse_script_expression("_event.data.result");
  ASSERT_TRUE(tree);
  EXPECT_EQ(tree->path(tree->root()), "_event.data.result");
}

TEST(ScriptSyntax, RefusesWhatItDoesNotKnow) {
  for (const char* source : {"", "a +", "`a`", "a => b", "var x = 1", "(a", "'a", "a b", "1a", "if (a) b", "a; b"})
    EXPECT_EQ(read(source), "?") << source;
  EXPECT_EQ(read(std::string(1000, '(') + "a" + std::string(1000, ')')), "?");
  EXPECT_EQ(read(std::string(100'000, '!') + "a"), "?");
}

TEST(ScriptSyntax, NamesOfAScriptAreNotThoseOfItsTexts) {
  EXPECT_THAT(names_in_script("var a = 'b'; // c\n f(a) /* d */ + /e/.x"), ElementsAre("a", "f", "var", "x"));
}

TEST(ScriptSyntax, FindsTheStatesThatAreAskedFor) {
  EXPECT_THAT(states_asked_for("In('a') && In( \"b.c\" ) && f.In('d') && In(e) // In('f')"), ElementsAre("a", "b.c"));
  EXPECT_THAT(states_asked_for("`x` + In('a') + Inn('b') + In('c' + d) + \"In('e')\""), ElementsAre("a"));
  EXPECT_THAT(states_asked_for(" In( b.c-d )", true), ElementsAre("b.c-d"));
}

}  // namespace
}  // namespace sentree::scxml
