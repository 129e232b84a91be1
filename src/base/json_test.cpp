#include "sentree/base/json.h"

#include <gtest/gtest.h>

#include "sentree/base/rng.h"

namespace sentree {
namespace {

TEST(Base64, ReadsBackWhatItWrote) {
  Rng rng(11);
  for (std::size_t size = 0; size < 70; ++size) {
    std::vector<std::byte> octets(size);
    for (std::byte& octet : octets) octet = static_cast<std::byte>(rng.next() & 255);
    std::string text;
    append_base64(text, octets);
    EXPECT_EQ(decode_base64(text), octets) << text;
  }
}

TEST(Base64, RefusesWhatIsNone) {
  EXPECT_FALSE(decode_base64("AAA").has_value());
  EXPECT_FALSE(decode_base64("AA=A").has_value());
  EXPECT_FALSE(decode_base64("A===").has_value());
  EXPECT_FALSE(decode_base64("AA\nA").has_value());
  EXPECT_FALSE(decode_base64("AA==AAAA").has_value());
}

TEST(Json, IsAppendedAsToJsonHasIt) {
  const Value value = Map{{"a", List{1, 2.0, 0.1, -1e300, "x\"\n\x01ü", nullptr, true}},
                          {"b", Bytes{{std::byte{1}, std::byte{255}}}},
                          {"c", Map()},
                          {"d", List()}};
  std::string out = "before ";
  append_json(out, value);
  EXPECT_EQ(out, "before " + to_json(value));
  EXPECT_EQ(to_json(value),
            R"({"a":[1,2.0,0.1,-1e+300,"x\"\n\u0001ü",null,true],"b":{"$bytes":"Af8="},"c":{},"d":[]})");
}

TEST(Json, GivesOctetsBack) {
  const Value read = Map{{"a", List{Map{{"$bytes", "Af8="}}}}, {"b", Map{{"$bytes", 1}}}, {"c", Map{{"$bytes", "?"}}}};
  const Value expected =
      Map{{"a", List{Bytes{{std::byte{1}, std::byte{255}}}}}, {"b", Map{{"$bytes", 1}}}, {"c", Map{{"$bytes", "?"}}}};
  EXPECT_EQ(with_bytes(read), expected);
}

}  // namespace
}  // namespace sentree
