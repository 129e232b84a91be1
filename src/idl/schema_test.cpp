#include "sentree/idl/schema.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

namespace sentree::idl {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string first_error(const Loaded<Schema>& loaded) {
  for (const Diagnostic& d : loaded.diagnostics) {
    if (d.severity == Severity::kError) return to_string(d);
  }
  return "";
}

Schema must_load(std::string_view source) {
  auto loaded = Schema::load(source, "a.thrift");
  EXPECT_EQ(first_error(loaded), "");
  return *loaded.value;
}

std::string refusal(std::string_view source) { return first_error(Schema::load(source, "a.thrift")); }

TEST(Schema, ReadsEveryPartOfTheLanguage) {
  const Schema s = must_load(R"(
    namespace cpp robot.api
    namespace * robot
    /** A doc comment. */
    typedef i64 GoalId
    enum Status { IDLE, MOVING = 5, DONE }   # numbered on from 5
    const i32 kLimit = 0x10;
    const map<string, list<i32>> kTable = {"a": [1, 2], "b": []}
    struct Pose { 1: required double x, 2: optional double y, 3: double theta = .5 }
    union Target { 1: string name; 2: Pose pose }
    exception Refused { 1: Status status = Status.MOVING (why = "test") }
    service Base { void ping() }
    service Robot extends Base {
      GoalId go(1: Target target, 2: bool fast = true) throws (1: Refused refused),
      oneway void stop(1: GoalId goal)
    }
  )");
  EXPECT_THAT(s.service_names(), ElementsAre("Base", "Robot"));
  const ServicePtr robot = s.service("Robot");
  ASSERT_NE(robot, nullptr);
  EXPECT_THAT(robot->method_names(), ElementsAre("go", "stop", "ping"));
  const Method* go = robot->find("go");
  EXPECT_EQ(go->result->kind, Kind::kI64);
  EXPECT_EQ(go->arguments.fields[1].default_value, Value(true));
  EXPECT_EQ(go->exceptions[0].type->structure->name, "Refused");
  EXPECT_TRUE(robot->find("stop")->oneway);
  EXPECT_EQ(s.enumeration("Status")->find("DONE")->number, 6);
  EXPECT_EQ(s.constant("kLimit")->value, Value(16));
  EXPECT_EQ(to_json(s.constant("kTable")->value), R"({"a":[1,2],"b":[]})");
  EXPECT_EQ(s.structure("Pose")->fields[0].requiredness, Requiredness::kRequired);
  EXPECT_EQ(s.structure("Target")->kind, StructKind::kUnion);
  EXPECT_EQ(s.structure("Refused")->fields[0].default_value, Value("MOVING"));
}

TEST(Schema, KnowsWhatAnAbsentFieldMeans) {
  const Schema s = must_load(R"(
    enum E { A = 3 }
    struct In { 1: i32 n = 7, 2: optional string t }
    struct Out { 1: In inner, 2: list<In> many, 3: E e, 4: Out own, 5: optional Out again }
  )");
  const Struct* out = s.structure("Out");
  EXPECT_EQ(to_json(*out->fields[0].when_absent), R"({"n":7})");
  EXPECT_EQ(to_json(*out->fields[1].when_absent), "[]");
  EXPECT_EQ(*out->fields[2].when_absent, Value(0)) << "no enumerator is 0";
  EXPECT_FALSE(out->fields[3].when_absent) << "it would contain itself";
  EXPECT_FALSE(out->fields[4].when_absent);
}

TEST(Schema, RefusesWithThePlaceAndTheWayOut) {
  EXPECT_EQ(refusal("struct A {\n  1: Poze p\n}\nstruct Pose {}"),
            R"(a.thrift:2:6: there is no type "Poze"; did you mean "Pose"?)");
  EXPECT_EQ(refusal("const i32 a = \"x\""), "a.thrift:1:15: expected a constant of type i32, found a string");
  EXPECT_EQ(refusal("struct A { 1: i32 a 1: i32 b }"),
            R"(a.thrift:1:28: field number 1 of "b" is that of "a" already)");
  EXPECT_EQ(refusal("struct A { 1: i32 a"), R"(a.thrift:1:20: expected a type, found the end of the file)");
  EXPECT_EQ(refusal("service S extends Bse {}\nservice Base {}"),
            R"(a.thrift:1:19: there is no service "Bse" before this line)");
  EXPECT_EQ(refusal("struct A {}\nservice S { void f() throws (1: A a) }"),
            R"(a.thrift:2:33: "A" is not an exception, so it cannot be thrown)");
  EXPECT_EQ(refusal("enum E { A }\nconst E e = E.B"), R"(a.thrift:2:13: enum E has no "B")");
  EXPECT_THAT(refusal("struct class {}"), HasSubstr("reserved word"));
  EXPECT_THAT(refusal("/* x"), HasSubstr("this comment has no end"));
  EXPECT_THAT(refusal("const i64 a = 99999999999999999999"), HasSubstr("does not fit into an i64"));
  EXPECT_THAT(refusal("typedef A B\ntypedef B A"), HasSubstr("leads back to itself"));
  EXPECT_THAT(refusal("\x01"), HasSubstr("unexpected byte 0x01"));
}

TEST(Schema, ReportsSeveralProblemsAtOnce) {
  const auto loaded = Schema::load("struct A { 1: X x }\nstruct B { 1: Y y }", "a.thrift");
  EXPECT_EQ(loaded.diagnostics.size(), 2U);
}

TEST(Schema, ReadsIncludesOnceAndRefusesCircles) {
  const std::map<std::string, std::string> files = {
      {"geometry.thrift", "struct Pose { 1: double x } enum E { A } const i32 k = 4 service Base { void ping() }"},
      {"loop.thrift", "include \"main.thrift\""}};
  int reads = 0;
  const IncludeReader reader = [&](std::string_view path, std::string_view) -> Result<IncludedFile> {
    ++reads;
    const auto found = files.find(std::string(path));
    if (found == files.end()) return fail("x", "no such file");
    return IncludedFile{found->first, found->second};
  };
  const auto loaded = Schema::load(R"(include "geometry.thrift"
    struct S { 1: geometry.Pose pose, 2: geometry.E e = geometry.E.A, 3: i32 n = geometry.k }
    service Robot extends geometry.Base {})",
                                   "main.thrift", reader);
  ASSERT_TRUE(loaded.ok()) << first_error(loaded);
  EXPECT_EQ(reads, 1);
  EXPECT_EQ(loaded.value->structure("S")->fields[2].default_value, Value(4));
  EXPECT_NE(loaded.value->structure("geometry.Pose"), nullptr);
  EXPECT_NE(loaded.value->service("Robot")->find("ping"), nullptr);
  EXPECT_THAT(loaded.value->files(), ElementsAre("main.thrift", "geometry.thrift"));

  const std::map<std::string, std::string> circle = {{"b.thrift", "include \"a.thrift\""},
                                                     {"a.thrift", "include \"b.thrift\""}};
  const auto refused = Schema::load("include \"b.thrift\"", "a.thrift",
                                    [&](std::string_view path, std::string_view) -> Result<IncludedFile> {
                                      return IncludedFile{std::string(path), circle.at(std::string(path))};
                                    });
  EXPECT_THAT(first_error(refused), HasSubstr("includes itself"));

  const auto missing = Schema::load("include \"no.thrift\"", "a.thrift", reader);
  ASSERT_TRUE(missing.ok()) << "as the compiler has it";
  EXPECT_EQ(missing.diagnostics[0].severity, Severity::kWarning);
}

TEST(Schema, TellsAnAnnotationThatNearlyIsOneOfItsOwn) {
  const auto loaded =
      Schema::load("struct S { 1: double share (untt = \"%\"), 2: i32 n (cpp.type = \"int\") }", "s.thrift");
  ASSERT_TRUE(loaded.ok());
  ASSERT_EQ(loaded.diagnostics.size(), 1U);
  EXPECT_EQ(to_string(loaded.diagnostics[0]),
            "s.thrift:1:29: warning: annotation \"untt\" means nothing here; did you mean \"unit\"?");
}

TEST(Schema, KeepsItsBounds) {
  const auto nested = [](int depth) {
    std::string type;
    for (int i = 0; i < depth; ++i) type += "list<";
    type += "i32" + std::string(static_cast<std::size_t>(depth), '>');
    return "typedef " + type + " T";
  };
  EXPECT_EQ(refusal(nested(kSyntaxNestingMax)), "");
  EXPECT_THAT(refusal(nested(kSyntaxNestingMax + 1)), HasSubstr("nested too deeply"));
  EXPECT_THAT(refusal("const list<i32> a = " + std::string(100000, '[')), HasSubstr("nested too deeply"));
  EXPECT_THAT(refusal(std::string(kFileSizeMax + 1, ' ')), HasSubstr("more than"));

  const auto loaded =
      Schema::load("include \"0\"", "main", [](std::string_view path, std::string_view) -> Result<IncludedFile> {
        return IncludedFile{std::string(path), "include \"" + std::to_string(std::stoi(std::string(path)) + 1) + "\""};
      });
  EXPECT_THAT(first_error(loaded), HasSubstr("include each other more than"));

  std::string many;
  for (std::size_t i = 0; i <= kFilesMax; ++i) many += "include \"f" + std::to_string(i) + "\"\n";
  const auto wide = Schema::load(many, "main", [](std::string_view path, std::string_view) -> Result<IncludedFile> {
    return IncludedFile{std::string(path), ""};
  });
  EXPECT_THAT(first_error(wide), HasSubstr("files are included"));
}

TEST(Schema, StructsOfStructsDoNotGrowWithoutBound) {
  std::string source = "struct S0 { 1: i64 a, 2: i64 b }\n";
  for (int i = 1; i < 60; ++i) {
    const std::string before = "S" + std::to_string(i - 1);
    source += "struct S" + std::to_string(i) + " { 1: " + before + " a, 2: " + before + " b }\n";
  }
  EXPECT_FALSE(must_load(source).structure("S59")->fields[0].when_absent);
}

}  // namespace
}  // namespace sentree::idl
