#include "sentree/idl/conform.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace sentree::idl {
namespace {

using ::testing::HasSubstr;

constexpr std::string_view kIdl = R"(
  enum Status { IDLE = 0, MOVING = 2 }
  struct Pose { 1: double x, 2: double y, 3: double theta = 0 }
  struct Everything {
    1: bool b, 2: i8 s, 3: i16 m, 4: i32 l, 5: i64 xl, 6: double d, 7: string t, 8: binary raw,
    9: Status e, 10: list<Pose> poses, 11: set<i32> numbers, 12: map<string, i32> named, 13: map<i32, string> numbered,
    14: optional Pose maybe
  }
  union Target { 1: string name, 2: Pose pose }
  service Navigation {
    void stopNavigation(1: i64 goal_id)
    void go(1: Target target, 2: Pose start, 3: bool fast = true)
  }
)";

class Conform : public ::testing::Test {
 protected:
  Value good(std::string_view type, Value value) {
    auto out = conform(*schema_.type(type), std::move(value), "v");
    EXPECT_TRUE(out) << out.error().message;
    return out ? *out : Value();
  }
  std::string bad(std::string_view type, Value value) {
    auto out = conform(*schema_.type(type), std::move(value), "v");
    EXPECT_FALSE(out);
    return out ? "" : out.error().message;
  }
  std::string bad_call(std::string_view method, Value arguments) {
    auto out = conform_arguments(*navigation_->find(method), std::move(arguments));
    EXPECT_FALSE(out);
    return out ? "" : out.error().message;
  }

  Schema schema_ = *Schema::load(kIdl, "nav.thrift").value;
  ServicePtr navigation_ = schema_.service("Navigation");
};

Map everything() {
  return {{"b", true},
          {"s", 1},
          {"m", 2},
          {"l", 3},
          {"xl", 4},
          {"d", 5.5},
          {"t", "text"},
          {"raw", Bytes{{std::byte{7}}}},
          {"e", "MOVING"},
          {"poses", List{Map{{"x", 1.0}, {"y", 2.0}, {"theta", 0.0}}}},
          {"numbers", List{1, 2}},
          {"named", Map{{"k", 1}}},
          {"numbered", List{List{1, "one"}}}};
}

TEST_F(Conform, LeavesAProperValueAsItIs) { EXPECT_EQ(good("Everything", everything()), Value(everything())); }

TEST_F(Conform, AcceptsWhatAScriptHas) {
  Map v = everything();
  v["s"] = 1.0;
  v["xl"] = "9007199254740993";
  v["d"] = 3;
  v["raw"] = "octets";
  v["e"] = 2;
  v["numbers"] = List{2.0, 2, 1};
  v["numbered"] = Map{{"5", "five"}};
  v["maybe"] = nullptr;
  const Value out = good("Everything", v);
  EXPECT_EQ(*out.find("s"), Value(1));
  EXPECT_EQ(*out.find("xl"), Value(std::int64_t{9007199254740993}));
  EXPECT_EQ(*out.find("d"), Value(3.0));
  EXPECT_NE(out.find("raw")->as_bytes(), nullptr);
  EXPECT_EQ(*out.find("e"), Value("MOVING"));
  EXPECT_EQ(to_json(*out.find("numbers")), "[2,1]");
  EXPECT_EQ(to_json(*out.find("numbered")), R"([[5,"five"]])");
  EXPECT_EQ(out.find("maybe"), nullptr);
}

TEST_F(Conform, FillsInDefaultsInTheOrderOfTheFields) {
  EXPECT_EQ(to_json(good("Pose", Map{{"y", 2}, {"x", 1}})), R"({"x":1.0,"y":2.0,"theta":0.0})");
}

TEST_F(Conform, NamesThePathAndTheTypes) {
  EXPECT_EQ(bad_call("stopNavigation", Map{{"goal_id", "abc"}}),
            R"(argument "goal_id" of Navigation.stopNavigation: expected i64, got string "abc")");
  EXPECT_EQ(bad_call("go", Map{{"target", Map{{"pose", Map{{"x", "far"}, {"y", 1}}}}}}),
            R"(argument "target.pose.x" of Navigation.go: expected double, got string "far")");
  EXPECT_EQ(bad_call("stopNavigation", Value()),
            R"(argument "goal_id" of Navigation.stopNavigation is missing; it is of type i64)");
  EXPECT_EQ(bad_call("stopNavigation", Map{{"goal", 1}}),
            R"(Navigation.stopNavigation: there is no argument "goal"; there is goal_id)");
  EXPECT_EQ(bad("Pose", Map{{"x", 1}, {"z", 1}}), R"(v: there is no field "z"; there is x, y, theta)");
  Map v = everything();
  v["poses"] = List{Map{{"x", 1}, {"y", 2}}, Map{{"x", 1}}};
  EXPECT_EQ(bad("Everything", v), "v.poses[1].y is missing; it is of type double");
  v = everything();
  v["s"] = 128;
  EXPECT_EQ(bad("Everything", v), "v.s: expected i8 (-128 to 127), got int 128");
  v = everything();
  v["e"] = "MOVNG";
  EXPECT_EQ(bad("Everything", v), R"(v.e: enum Status has no "MOVNG"; did you mean "MOVING"?)");
  v = everything();
  v["numbered"] = List{List{"x", "y"}};
  EXPECT_EQ(bad("Everything", v), R"(v.numbered[0][0]: expected i32, got string "x")");
}

TEST_F(Conform, RefusesNumbersThatAreNotWhole) {
  for (const Value& number : {Value(0.5), Value(1e300), Value(std::nan("")), Value(""), Value("1 "), Value("0x1")}) {
    EXPECT_THAT(bad_call("stopNavigation", Map{{"goal_id", number}}), HasSubstr("expected i64")) << to_json(number);
  }
}

TEST_F(Conform, AUnionHoldsExactlyOneMember) {
  EXPECT_THAT(bad("Target", Map{}), HasSubstr("got none"));
  EXPECT_THAT(bad("Target", Map{{"name", "a"}, {"pose", Map{}}}), HasSubstr(R"(got "name" and "pose")"));
  EXPECT_EQ(to_json(good("Target", Map{{"pose", nullptr}, {"name", "a"}})), R"({"name":"a"})");
}

TEST_F(Conform, NestsUpToItsBound) {
  const Schema s = *Schema::load("struct N { 1: optional N n }", "n.thrift").value;
  const auto nest = [](int depth) {
    Value v{Map{}};
    for (int i = 0; i < depth; ++i) v = Map{{"n", std::move(v)}};
    return v;
  };
  EXPECT_TRUE(conform(*s.type("N"), nest(kValueNestingMax), "v"));
  const auto refused = conform(*s.type("N"), nest(kValueNestingMax + 1), "v");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "idl.too-deep");
  EXPECT_FALSE(conforms(*s.type("N"), nest(kValueNestingMax + 1)));
}

TEST_F(Conform, WhatConformsIsNotChangedByConforming) {
  const Method& go = *navigation_->find("go");
  const Value rough = Map{{"target", Map{{"name", "kitchen"}}}, {"start", Map{{"x", 1}, {"y", 2}}}};
  EXPECT_FALSE(conforms_arguments(go, rough));
  const auto fine = conform_arguments(go, rough);
  ASSERT_TRUE(fine);
  EXPECT_TRUE(conforms_arguments(go, *fine));
  EXPECT_EQ(conform_arguments(go, *fine), fine);
}

TEST_F(Conform, ChecksWrittenArgumentsAsFarAsTheyAreConstant) {
  const Method& go = *navigation_->find("go");
  const SourceSpan at{"GoTo.scxml", 3, 5, 4};
  const auto found = check_arguments(go,
                                     {{"target", std::nullopt, at},
                                      {"fats", Value(true), {"GoTo.scxml", 4, 9, 4}},
                                      {"fast", Value("yes"), {"GoTo.scxml", 5, 9, 4}},
                                      {"fast", Value(true), at}},
                                     at);
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(to_string(found[0]), R"(GoTo.scxml:4:9: Navigation.go has no argument "fats"; did you mean "fast"?)");
  EXPECT_EQ(to_string(found[1]),
            R"(GoTo.scxml:5:9: argument "fast" of Navigation.go: expected bool, got string "yes")");
  EXPECT_EQ(found[2].code, "idl.duplicate");
  EXPECT_EQ(to_string(found[3]), R"(GoTo.scxml:3:5: argument "start" of Navigation.go is missing; it is of type Pose)");
}

TEST_F(Conform, SuggestsMethodsAndServices) {
  EXPECT_EQ(find_method(*navigation_, "stopNavigaton", "navigation").error().message,
            R"(service "navigation" (Navigation) has no method "stopNavigaton"; did you mean "stopNavigation"?)");
  EXPECT_EQ(find_service(schema_, "navigation").error().message,
            R"(nav.thrift has no service "navigation"; did you mean "Navigation"?)");
  EXPECT_TRUE(find_service(schema_, "Navigation"));
}

TEST_F(Conform, KeepsBigIntegersExactForScripts) {
  const Value v = List{kExactInDouble, kExactInDouble + 1, -kExactInDouble - 1, Map{{"id", std::int64_t{1} << 60}}};
  EXPECT_EQ(to_json(for_script(v)),
            R"([9007199254740992,"9007199254740993","-9007199254740993",{"id":"1152921504606846976"}])");
}

TEST_F(Conform, ShowsSignatures) {
  EXPECT_EQ(signature(*navigation_->find("go")), "go(1: Target target, 2: Pose start, 3: bool fast = true): void");
}

TEST(Ranges, AreThoseOfTheUnitOrOfTheAnnotations) {
  const auto schema = Schema::load(R"(
    struct Cell { 1: double charge (unit = "ratio"), 2: i32 number (min = "1", max = "8") }
    service Charger {
      void put(1: double percent (unit = "%"), 2: double tolerance (unit = "m", min = "0"), 3: list<Cell> cells)
    })",
                                   "charger.thrift");
  ASSERT_TRUE(schema.ok()) << to_string(schema.diagnostics.front());
  const ServicePtr service = schema.value->service("Charger");
  const Method& put = *service->find("put");
  const auto told = [&](double percent, double tolerance, double charge, int number) {
    const auto checked = check_ranges(put, Map{{"percent", percent},
                                               {"tolerance", tolerance},
                                               {"cells", List{Map{{"charge", charge}, {"number", number}}}}});
    return checked ? std::string() : checked.error().message;
  };
  EXPECT_EQ(told(0, 0, 0, 1), "");
  EXPECT_EQ(told(100, 1e9, 1, 8), "");
  EXPECT_EQ(told(100.5, 0, 0, 1), "argument \"percent\" of Charger.put: 100.5 is not from 0 to 100 %");
  EXPECT_EQ(told(-1, 0, 0, 1), "argument \"percent\" of Charger.put: -1.0 is not from 0 to 100 %");
  EXPECT_EQ(told(1, -0.5, 0, 1), "argument \"tolerance\" of Charger.put: -0.5 is less than 0 m");
  EXPECT_EQ(told(1, 0, 20, 1), "argument \"cells\" of Charger.put.charge: 20.0 is not from 0 to 1");
  EXPECT_EQ(told(1, 0, 0, 9), "argument \"cells\" of Charger.put.number: 9 is not from 1 to 8");
  const Diagnostics written = check_arguments(
      put, {{"percent", Value(200), {}}, {"tolerance", std::nullopt, {}}, {"cells", std::nullopt, {}}}, {});
  ASSERT_EQ(written.size(), 1U);
  EXPECT_EQ(written[0].code, "idl.out-of-range");
}

TEST(Ranges, MustBeNumbers) {
  const auto schema = Schema::load("struct S { 1: double x (min = \"low\") }", "s.thrift");
  ASSERT_FALSE(schema.ok());
  EXPECT_THAT(schema.diagnostics[0].message, HasSubstr("min = \"low\" must be a number"));
}

TEST(Ranges, HaveAMinimumBelowTheirMaximum) {
  const auto schema = Schema::load("struct S { 1: double x (min = \"50\", max = \"40\") }", "s.thrift");
  ASSERT_FALSE(schema.ok());
  EXPECT_THAT(schema.diagnostics[0].message, HasSubstr("no value of \"x\" is within its bounds: min = 50 is above"));
  EXPECT_TRUE(Schema::load("struct S { 1: double x (min = \"5\", max = \"5\") }", "s.thrift").ok());
}

TEST(Enumerations, ThatGiveOneNumberTwiceArePointedOut) {
  const auto schema = Schema::load("enum Mode { GROUND = 0, HOVER = 0, TRANSIT }", "s.thrift");
  ASSERT_TRUE(schema.ok());
  ASSERT_EQ(schema.diagnostics.size(), 1u);
  EXPECT_THAT(to_string(schema.diagnostics[0]),
              HasSubstr("warning: GROUND and HOVER of enum Mode have one number, 0: who reads it takes it for GROUND"));
}

}  // namespace
}  // namespace sentree::idl
