#include "sentree/ros/detail/cdr.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "sentree/idl/conform.h"
#include "sentree/ros/detail/test_chance.h"

namespace sentree::ros {
namespace {

using ::testing::HasSubstr;

std::vector<std::uint8_t> octets(std::string_view hex) {
  std::vector<std::uint8_t> out;
  std::string digits;
  for (const char c : hex) {
    if (c == ' ') continue;
    digits += c;
    if (digits.size() < 2) continue;
    out.push_back(static_cast<std::uint8_t>(std::stoi(digits, nullptr, 16)));
    digits.clear();
  }
  return out;
}

std::vector<std::uint8_t> written(const Codec& codec, const Value& value) {
  std::vector<std::uint8_t> out;
  begin_message(out);
  const auto done = codec.write(out, value);
  EXPECT_TRUE(done) << (done ? "" : done.error().message);
  return out;
}

std::string refusal(const std::string& source, Map value) {
  const idl::Schema& schema = loaded_schema(source);
  auto whole = idl::conform_arguments(*schema.services().front().methods.front(), std::move(value));
  if (!whole) return whole.error().message;
  std::vector<std::uint8_t> out;
  begin_message(out);
  const auto done = Codec::make(fields_of(schema))->write(out, *whole);
  return done ? "" : done.error().message;
}

struct Known {
  const char* source;
  const char* value;
  const char* octets;
};

TEST(Cdr, WritesWhatNodesOfRosWrite) {
  const idl::Schema& battery = loaded_schema(
      "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\nfloat32 charge\nfloat32 "
      "capacity\n"
      "float32 design_capacity\nfloat32 percentage\nuint8 power_supply_status\nuint8 power_supply_health\n"
      "uint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\nfloat32[] cell_temperature\n"
      "string location\nstring serial_number\n",
      "sensor_msgs/msg/BatteryState.msg");
  const Codec codec = *Codec::make(fields_of(battery));
  const Value state = Map{{"header", Map{{"stamp", Map{{"sec", 1700000000}, {"nanosec", 5}}}, {"frame_id", "base"}}},
                          {"voltage", 24.5},
                          {"temperature", 25.0},
                          {"current", -1.5},
                          {"charge", 10.0},
                          {"capacity", 20.0},
                          {"design_capacity", 20.0},
                          {"percentage", 0.5},
                          {"power_supply_status", 2},
                          {"power_supply_health", 1},
                          {"power_supply_technology", 3},
                          {"present", true},
                          {"cell_voltage", List{3.5, static_cast<double>(3.6F)}},
                          {"cell_temperature", List{}},
                          {"location", "slot"},
                          {"serial_number", "SN1"}};
  const auto bytes = octets(
      "00010000 00f15365 05000000 05000000 62617365 00000000 0000c441 0000c841 0000c0bf 00002041 0000a041 0000a041 "
      "0000003f"
      " 02010301 02000000 00006040 66666640 00000000 05000000 736c6f74 00000000 04000000 534e3100");
  EXPECT_EQ(written(codec, state), bytes);
  EXPECT_EQ(*codec.read(bytes, kEncapsulation), state);
}

TEST(Cdr, AlignsBehindTheEncapsulation) {
  const idl::Schema mixed =
      loaded_schema("bool a\nfloat64 b\nint8 c\nuint16 d\nstring e\nint64[] f\nstring[2] g\nuint8 h\nfloat64[<=3] i\n");
  const Codec codec = *Codec::make(fields_of(mixed));
  const Value value =
      Map{{"a", true}, {"b", 1.0},   {"c", -1}, {"d", 2}, {"e", "ab"}, {"f", List{3}}, {"g", List{"x", "yz"}},
          {"h", 9},    {"i", List{}}};
  const auto bytes = octets(
      "00010000 01000000 00000000 00000000 0000f03f ff000200 03000000 61620000 01000000 03000000 00000000 02000000 "
      "78000000"
      " 03000000 797a0009 00000000");
  EXPECT_EQ(written(codec, value), bytes);
  EXPECT_EQ(*codec.read(bytes, kEncapsulation), value);
}

TEST(Cdr, ReadsPosesOfBothByteOrdersAndWithSurplus) {
  const idl::Schema& schema = loaded_schema("std_msgs/Header header\ngeometry_msgs/Pose pose\n");
  const Codec codec = *Codec::make(fields_of(schema));
  auto bytes = octets("00010000 01000000 02000000 04000000 6d617000 00000000 0000f03f 00000000 00000040");
  bytes.resize(bytes.size() + 32);
  for (const int b : {0, 0, 0, 0, 0, 0, 0xf0, 0x3f}) bytes.push_back(static_cast<std::uint8_t>(b));
  const Value pose = *codec.read(bytes, kEncapsulation);
  EXPECT_EQ(*pose.at({"header", "frame_id"}), Value("map"));
  EXPECT_EQ(*pose.at({"pose", "position", "y"}), Value(2.0));
  EXPECT_EQ(*pose.at({"pose", "orientation", "w"}), Value(1.0));
  bytes.insert(bytes.end(), {0, 0, 0});
  EXPECT_EQ(*codec.read(bytes, kEncapsulation), pose);
  const Codec number = *Codec::make(fields_of(loaded_schema("uint32 a\nstring b\n")));
  EXPECT_EQ(to_json(*number.read(octets("00000000 00000102 00000002 6100"), kEncapsulation)), R"({"a":258,"b":"a"})");
  EXPECT_EQ(to_json(*number.read(octets("00010000 02010000 00000000"), kEncapsulation)), R"({"a":258,"b":""})")
      << "an empty text without its NUL";
}

TEST(Cdr, AMessageWithoutFieldsIsOneOctet) {
  const Codec none = *Codec::make(fields_of(loaded_schema("")));
  EXPECT_EQ(written(none, Map()), octets("00010000 00"));
  const idl::Schema& schema = loaded_schema("p/None[3] all\n");
  EXPECT_EQ(written(*Codec::make(fields_of(schema)), Map{{"all", List{Map(), Map(), Map()}}}),
            octets("00010000 000000"));
}

TEST(Cdr, SaysWhatDoesNotFit) {
  EXPECT_THAT(refusal("uint8 a\n", {{"a", 256}}), HasSubstr("a: is 256, and must be from 0 to 255"));
  EXPECT_THAT(refusal("int16[] a\n", {{"a", List{1, 40000}}}), HasSubstr("40000"));
  EXPECT_THAT(refusal("uint32 a\n", {{"a", -1}}), HasSubstr("from 0 to 4294967295"));
  EXPECT_THAT(refusal("float32[3] a\n", {{"a", List{1.0}}}), HasSubstr("a: has 1 items, and must have 3"));
  EXPECT_THAT(refusal("float32[<=1] a\n", {{"a", List{1.0, 2.0}}}), HasSubstr("and may have 1"));
  EXPECT_THAT(refusal("string<=2 a\n", {{"a", "abc"}}), HasSubstr("and may have 2"));
  EXPECT_EQ(refusal("uint64 a\n", {{"a", -1}}), "") << "what is beyond 2^63";
}

TEST(Cdr, CarriesTypesOfThrift) {
  const auto loaded = idl::Schema::load(
      "enum E { A = 1, B = 2 }\n"
      "struct S { 1: double x, 2: optional i32 n, 3: E e }\n"
      "union U { 1: i32 a }\n"
      "struct R { 1: list<R> more }\n"
      "service T { void f(1: S s, 2: map<string, i64> m, 3: binary b, 4: map<i32, bool> k) void u(1: U u) void r(1: R "
      "r) }",
      "t.thrift");
  ASSERT_TRUE(loaded.ok());
  const auto service = loaded.value->service("T");
  const Codec codec = *Codec::make(service->find("f")->arguments);
  for (const char* n : {"", R"("n":7,)"}) {
    const Value value = Map{{"s", n[0] == '\0' ? Map{{"x", 0.5}, {"e", "B"}} : Map{{"x", 0.5}, {"n", 7}, {"e", "B"}}},
                            {"m", Map{{"one", 1}, {"two", 2}}},
                            {"b", Bytes{{std::byte{1}}}},
                            {"k", List{List{3, true}}}};
    EXPECT_EQ(*codec.read(written(codec, value), kEncapsulation), value);
  }
  EXPECT_THAT(Codec::make(service->find("u")->arguments).error().message, HasSubstr("\"U\" is a union"));
  EXPECT_THAT(Codec::make(service->find("r")->arguments).error().message, HasSubstr("holds itself"));
}

TEST(Cdr, ReadsWhatItWroteOfAnyType) {
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Chance chance(seed);
    const idl::Schema& schema = loaded_schema(chance.message());
    const Codec codec = *Codec::make(fields_of(schema));
    const Value value = chance.value(fields_of(schema));
    const auto bytes = written(codec, value);
    const auto read = codec.read(bytes, kEncapsulation);
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(*read, value) << to_json(*read) << "\n" << to_json(value);
    // Cut off anywhere it is an error or another message, and never more.
    for (std::size_t n = 0; n < bytes.size(); ++n)
      static_cast<void>(codec.read(std::span(bytes).first(n), kEncapsulation));
    for (int i = 0; i < 50; ++i) {
      auto broken = bytes;
      for (std::int64_t k = chance.below(4); k >= 0; --k)
        broken[static_cast<std::size_t>(chance.below(static_cast<std::int64_t>(broken.size())))] =
            static_cast<std::uint8_t>(chance.below(256));
      static_cast<void>(codec.read(broken, kEncapsulation));
    }
  }
}

TEST(Cdr, TakesNoMoreValuesThanAllowed) {
  const Codec codec = *Codec::make(fields_of(loaded_schema("bool[] a\n")));
  auto bytes = octets("00010000 e8030000");
  bytes.resize(bytes.size() + 1000);
  EXPECT_TRUE(codec.read(bytes, kEncapsulation));
  rpc::Limits limits;
  limits.values = 100;
  EXPECT_THAT(codec.read(bytes, kEncapsulation, limits).error().message, HasSubstr("more values"));
  EXPECT_THAT(codec.read(octets("00010000 ffffffff"), kEncapsulation).error().message, HasSubstr("ends before"));
}

}  // namespace
}  // namespace sentree::ros
