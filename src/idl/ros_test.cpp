#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "sentree/idl/conform.h"
#include "sentree/idl/schema.h"

namespace sentree::idl {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using Files = std::map<std::string, std::string>;

Loaded<Schema> load(const std::string& source, const std::string& file, const Files& files = {}) {
  return Schema::load(source, file, [files](std::string_view path, std::string_view) -> Result<IncludedFile> {
    const auto found = files.find(std::string(path));
    if (found == files.end()) return fail("file.missing", "no such file");
    return IncludedFile{found->first, found->second};
  });
}

std::string error_of(const std::string& source, const std::string& file = "p/msg/A.msg", const Files& files = {}) {
  const auto loaded = load(source, file, files);
  return loaded.ok() ? "" : to_string(loaded.diagnostics.front());
}

const Files kTime{{"builtin_interfaces/msg/Time.msg", "int32 sec\nuint32 nanosec\n"},
                  {"std_msgs/msg/Header.msg", "builtin_interfaces/Time stamp\nstring frame_id\n"}};

TEST(RosInterface, OfAMessageIsATopicWithItsFieldsAsArguments) {
  const auto loaded = load(
      "# a battery\n"
      "uint8 STATUS_FULL=4   # constants do not travel\n"
      "std_msgs/Header header\n"
      "float32 voltage\t12.5\n"
      "uint8 status\n"
      "string<=8 name \"a # b\n"
      "float32[] cells\n"
      "uint8[4] id\n"
      "string<=3[<=2] tags ['x', \"y\"]\n",
      "sensors/msg/Battery.msg", kTime);
  ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  const ServicePtr service = loaded.value->service("Battery");
  ASSERT_NE(service, nullptr);
  EXPECT_EQ(service->name, "sensors/msg/Battery");
  ASSERT_THAT(service->method_names(), ElementsAre("message"));
  const Method& method = *service->methods[0];
  EXPECT_TRUE(method.oneway);
  std::vector<std::string> types;
  for (const Field& f : method.arguments.fields) types.push_back(f.type->name);
  EXPECT_THAT(types, ElementsAre("std_msgs/msg/Header", "float32", "uint8", "string<=8", "float32[]", "uint8[4]",
                                 "string<=3[<=2]"));
  const auto empty = conform_arguments(method, Map());
  ASSERT_TRUE(empty) << empty.error().message;
  EXPECT_EQ(to_json(*empty),
            R"({"header":{"stamp":{"sec":0,"nanosec":0},"frame_id":""},"voltage":12.5,"status":0,"name":"\"a",)"
            R"("cells":[],"id":{"$bytes":"AAAAAA=="},"tags":["x","y"]})");
  EXPECT_EQ(loaded.value->constant("Battery.STATUS_FULL")->value, Value(4));
  EXPECT_FALSE(check_ranges(method, *conform_arguments(method, Map{{"status", 256}})));
  EXPECT_THAT(loaded.value->files(),
              ElementsAre("sensors/msg/Battery.msg", "std_msgs/msg/Header.msg", "builtin_interfaces/msg/Time.msg"));
}

TEST(RosInterface, OfAServiceIsOneCall) {
  const auto loaded = load("bool data\n---\nbool success\nstring message\n", "std_srvs/srv/SetBool.srv");
  ASSERT_TRUE(loaded.ok());
  const Method& method = *loaded.value->service("SetBool")->find("call");
  EXPECT_FALSE(method.oneway);
  EXPECT_EQ(method.arguments.field_names(), std::vector<std::string>{"data"});
  EXPECT_THAT(method.result->structure->field_names(), ElementsAre("success", "message"));
}

TEST(RosInterface, OfAnActionHasCallsAndTopics) {
  const auto loaded = load("float32 target_yaw\n---\nbool ok\n---\nfloat32 turned\n", "nav2_msgs/action/Spin.action");
  ASSERT_TRUE(loaded.ok());
  const ServicePtr spin = loaded.value->service("Spin");
  EXPECT_THAT(spin->method_names(), ElementsAre("send_goal", "cancel_goal", "feedback", "result", "status"));
  EXPECT_THAT(spin->find("send_goal")->arguments.field_names(), ElementsAre("target_yaw"));
  EXPECT_THAT(spin->find("result")->arguments.field_names(), ElementsAre("goal_id", "status", "result"));
  EXPECT_TRUE(spin->find("feedback")->oneway);
  EXPECT_FALSE(spin->find("cancel_goal")->oneway);
}

TEST(RosInterface, SaysWhereItIsWrong) {
  EXPECT_THAT(error_of("int32 a\nint23 b\n"), HasSubstr("p/msg/A.msg:2:1: \"int23\" is no type"));
  EXPECT_THAT(error_of("int23 b\n"), HasSubstr("did you mean \"int32\"?"));
  EXPECT_THAT(error_of("int32 a\nint32 a\n"), HasSubstr(":2:7: the field \"a\" is there already"));
  EXPECT_THAT(error_of("int32 Bad\n"), HasSubstr("lower case"));
  EXPECT_THAT(error_of("int32 a__b\n"), HasSubstr("single underscores"));
  EXPECT_THAT(error_of("int32\n"), HasSubstr("name of a field or a constant is missing"));
  EXPECT_THAT(error_of("uint8 A=256\n"), HasSubstr(":1:9: \"256\" is no uint8"));
  EXPECT_THAT(error_of("int8 a -129\n"), HasSubstr("\"-129\" is no int8"));
  EXPECT_THAT(error_of("bool a maybe\n"), HasSubstr("\"maybe\" is no bool"));
  EXPECT_THAT(error_of("int32[2] a [1]\n"), HasSubstr("has 1 items, which int32[2] cannot hold"));
  EXPECT_THAT(error_of("int32[0] a\n"), HasSubstr("is no length"));
  EXPECT_THAT(error_of("int32<=4 a\n"), HasSubstr("only string and wstring"));
  EXPECT_THAT(error_of("int32[] A=[1]\n"), HasSubstr("a constant is of a base type"));
  EXPECT_THAT(error_of("other/Thing a\n"), HasSubstr(":1:1: there is no message \"other/msg/Thing\""));
  EXPECT_THAT(error_of("int32 a\n---\nint32 b\n"), HasSubstr("a message has no parts"));
  EXPECT_THAT(error_of("int32 a\n", "p/srv/A.srv"), HasSubstr("one line --- between"));
  EXPECT_THAT(error_of("int32 a\n", "A.msg"), HasSubstr("PACKAGE/msg/Name.msg"));
  EXPECT_THAT(error_of("B b\n", "p/msg/A.msg", {{"p/msg/B.msg", "int32 x\nint23 y\n"}}), HasSubstr("p/msg/B.msg:2:1"));
}

TEST(RosInterface, ThatHoldsItselfIsRefused) {
  EXPECT_THAT(error_of("B b\n", "p/msg/A.msg", {{"p/msg/B.msg", "C c\n"}, {"p/msg/C.msg", "B[] b\n"}}),
              HasSubstr("holds itself"));
}

TEST(RosInterface, OfAThousandNestedMessagesIsTooDeep) {
  Files files;
  for (int i = 0; i < 1000; ++i) files["p/msg/M" + std::to_string(i) + ".msg"] = "M" + std::to_string(i + 1) + " m\n";
  files["p/msg/M1000.msg"] = "int32 x\n";
  EXPECT_THAT(error_of("M0 m\n", "p/msg/A.msg", files), HasSubstr("deep"));
}

TEST(RosInterface, WhoseZeroWouldBeHugeMustBeGivenWhole) {
  const auto loaded = load("float64[100000] cells\n", "p/msg/A.msg");
  ASSERT_TRUE(loaded.ok());
  EXPECT_FALSE(loaded.value->service("A")->methods[0]->arguments.fields[0].default_value);
}

TEST(RosInterface, IsReadWhateverIsCutOff) {
  const std::string whole =
      "uint8 A=1\nstd_msgs/Header header\nstring<=4[<=2] t [\"a\", 'b']\nfloat64[3] x [1.5, -2e3, 0]\n---\nwstring w "
      "\"q\"\n";
  for (std::size_t n = 0; n <= whole.size(); ++n) {
    static_cast<void>(load(whole.substr(0, n), "p/srv/A.srv", kTime));
    static_cast<void>(load(whole.substr(n), "p/msg/A.msg", kTime));
  }
}

}  // namespace
}  // namespace sentree::idl
