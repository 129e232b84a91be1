#include "sentree/project/detail/check_literal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace sentree::project {
namespace {

using testing::HasSubstr;

// What is said of an argument of type Order.
std::string refusal_of(const std::string& expression) {
  static const auto schema = idl::Schema::load(
      "enum Mode { SLOW, FAST }\nstruct Point { 1: required double x, 2: required double y }\n"
      "struct Item { 1: string label, 2: double weight = 1, 3: optional Point at }\n"
      "union Goal { 1: string place, 2: Point point }\n"
      "struct Order { 1: Goal goal, 2: Mode mode = Mode.SLOW, 3: list<Item> items = [], 4: map<string, i32> counts = "
      "{} }\n"
      "service S { void put(1: Order order) }",
      "s.thrift");
  const auto tree = scxml::parse_script_expression(expression);
  EXPECT_TRUE(schema.ok() && tree) << expression;
  const idl::Type& type = *schema.value->service("S")->find("put")->arguments.find("order")->type;
  Diagnostics diagnostics;
  check_literal(type, *tree, "param \"order\"", {}, diagnostics);
  return diagnostics.empty() ? "" : diagnostics.front().message;
}

TEST(Literals, ThatFitAreRight) {
  for (const char* expression :
       {"{goal: {place: 'kitchen'}}",
        "{goal: {point: {x: 1, y: -2.5}}, mode: 'FAST', items: [{label: 'a'}], counts: {a: 1}}", "order",
        "{goal: goal}", "{goal: {place: a, point: b}}", "{goal: {place: undefined, point: {x: 1, y: z}}}",
        "{goal: {place: f(1)}, mode: m, items: list, counts: n}",
        "{goal: {place: 'a'}, items: [one, {label: l, at: {x: x, y: y}}]}", "a ? {} : {}"})
    EXPECT_EQ(refusal_of(expression), "") << expression;
}

TEST(Literals, TellWhatIsMissingOrTooMuch) {
  EXPECT_THAT(refusal_of("{mode: 'FAST'}"), HasSubstr("param \"order\".goal is missing"));
  EXPECT_THAT(refusal_of("{goal: {}}"), HasSubstr(".goal: union Goal holds one member, got none"));
  EXPECT_THAT(refusal_of("{goal: {place: 'a', point: {x: 1, y: 2}}}"), HasSubstr("got \"place\" and \"point\""));
  EXPECT_THAT(refusal_of("{goal: {plaec: a}}"),
              HasSubstr("union Goal has no member \"plaec\"; did you mean \"place\"?"));
  EXPECT_THAT(refusal_of("{goal: {point: {x: a}}}"), HasSubstr("point.y is missing"));
  EXPECT_THAT(refusal_of("{goal: g, items: [{lable: a}]}"), HasSubstr("items[0]: there is no field \"lable\""));
  EXPECT_THAT(refusal_of("{goal: g, items: [a, {label: b, weight: 'heavy'}]}"),
              HasSubstr("items[1].weight: expected double"));
  EXPECT_THAT(refusal_of("{goal: g, mode: 'FSAT'}"), HasSubstr("enum Mode has no \"FSAT\"; did you mean \"FAST\"?"));
  EXPECT_THAT(refusal_of("{goal: g, counts: {a: 'one'}}"), HasSubstr("counts[\"a\"]: expected i32"));
  EXPECT_THAT(refusal_of("[1]"), HasSubstr("expected Order"));
}

}  // namespace
}  // namespace sentree::project
