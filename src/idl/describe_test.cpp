#include "sentree/idl/describe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sentree::idl {
namespace {

constexpr std::string_view kDescribed = R"(
  include "geometry.thrift"
  enum Mode { SLOW, FAST = 4 }
  struct Point { 1: string label }
  struct Place { 1: Point label, 2: geometry.Segment at, 3: optional list<Place> inside }
  service Guide {
    Mode go(1: Place to, 2: double speed = 0.5 (unit = "m/s"), 3: map<string, i32> limits)
    oneway void stop()
    double charge() (unit = "%")
  }
)";

Result<IncludedFile> geometry(std::string_view, std::string_view) {
  return IncludedFile{.file = "geometry.thrift",
                      .source = "struct Point { 1: double x }\nstruct Segment { 1: Point a, 2: Point b }"};
}

class Describe : public ::testing::Test {
 protected:
  Schema schema_ = *Schema::load(kDescribed, "guide.thrift", geometry).value;
  Value described_ = describe(*schema_.service("Guide"));

  [[nodiscard]] const Value& method(std::size_t i) const { return described_.find("methods")->as_list()->at(i); }
  [[nodiscard]] const Value& type(std::string_view name) const { return *described_.at({"types", name}); }
};

TEST_F(Describe, NamesArgumentsWithTypeDefaultAndUnit) {
  EXPECT_EQ(to_json(*method(0).find("args")),
            R"([{"name":"to","type":"Place","required":true},)"
            R"({"name":"speed","type":"double","required":false,"default":0.5,"unit":"m/s"},)"
            R"({"name":"limits","type":"map<string, i32>","required":true}])");
  EXPECT_EQ(method(0).find("result")->text(), "Mode");
}

TEST_F(Describe, SaysWhatHasNoResultAndWhatUnitAResultHas) {
  EXPECT_EQ(to_json(method(1)), R"({"name":"stop","args":[],"result":"void","oneway":true})");
  EXPECT_EQ(to_json(method(2)), R"({"name":"charge","args":[],"result":"double","oneway":false,"unit":"%"})");
}

TEST_F(Describe, EnumsListTheirNamesAndContainersTheirElements) {
  EXPECT_EQ(to_json(type("Mode")), R"({"kind":"enum","values":["SLOW","FAST"]})");
  EXPECT_EQ(to_json(type("map<string, i32>")), R"({"kind":"map","key":"string","element":"i32"})");
}

TEST_F(Describe, AStructMayContainItself) {
  const List& fields = *type("Place").find("fields")->as_list();
  EXPECT_EQ(fields[2].find("type")->text(), "list<Place>");
  EXPECT_EQ(*fields[2].find("required")->as_bool(), false);
  EXPECT_EQ(type("list<Place>").find("element")->text(), "Place");
}

TEST_F(Describe, TellsTypesOfTheSameNameInTwoFilesApart) {
  const List& place = *type("Place").find("fields")->as_list();
  const List& segment = *type(place[1].find("type")->text()).find("fields")->as_list();
  const std::string_view ours = place[0].find("type")->text();
  const std::string_view theirs = segment[0].find("type")->text();
  EXPECT_NE(ours, theirs);
  EXPECT_EQ(type(ours).find("fields")->as_list()->at(0).find("name")->text(), "label");
  EXPECT_EQ(type(theirs).find("fields")->as_list()->at(0).find("name")->text(), "x");
  EXPECT_EQ(segment[1].find("type")->text(), theirs);
}

}  // namespace
}  // namespace sentree::idl
