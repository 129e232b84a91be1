#include "sentree/base/value.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "sentree/base/rng.h"

namespace sentree {
namespace {

using ::testing::ElementsAre;

Value random_value(Rng& rng, int depth) {
  switch (rng.below(depth > 0 ? 8 : 6)) {
    case 0: return nullptr;
    case 1: return rng.below(2) == 0;
    case 2: return static_cast<std::int64_t>(rng.next());
    case 3: return std::bit_cast<double>(rng.next());
    case 4: return std::string(rng.below(5), static_cast<char>('a' + rng.below(26)));
    case 5: return Bytes{{std::byte(rng.below(256)), std::byte(rng.below(256))}};
    case 6: {
      List list;
      for (std::uint64_t n = rng.below(4); n > 0; --n) list.push_back(random_value(rng, depth - 1));
      return list;
    }
    default: {
      Map map;
      for (std::uint64_t n = rng.below(4); n > 0; --n)
        map[std::string(1, static_cast<char>('a' + n))] = random_value(rng, depth - 1);
      return map;
    }
  }
}

TEST(Value, KeepsTypesApart) {
  EXPECT_NE(Value(1), Value(1.0));
  EXPECT_NE(Value(), Value(false));
  EXPECT_NE(Value(""), Value(Bytes{}));
  EXPECT_NE(Value(List{}), Value(Map{}));
  EXPECT_EQ(Value("a"), Value(std::string("a")));
  EXPECT_EQ(to_string(Value(Bytes{}).type()), "bytes");
  EXPECT_EQ(to_string(Value().type()), "null");
}

TEST(Value, ComparesDoublesByTheirBits) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Value(nan), Value(nan));
  EXPECT_NE(Value(0.0), Value(-0.0));
  EXPECT_EQ(Value(List{nan}), Value(List{nan}));
  EXPECT_EQ(Value(Map{{"x", nan}}), Value(Map{{"x", nan}}));
}

TEST(Value, ReadsEitherNumberAndFollowsPaths) {
  const Value value = Map{{"result", Map{{"percentage", 0.5}, {"count", 3}}}};
  EXPECT_EQ(value.at({"result", "percentage"})->number(), 0.5);
  EXPECT_EQ(value.at({"result", "count"})->number(), 3.0);
  EXPECT_EQ(value.at({"result", "gone", "deeper"}), nullptr);
  EXPECT_EQ(value.at({"result", "count", "deeper"}), nullptr);
  EXPECT_EQ(value.find("result")->number(-1), -1);
  EXPECT_EQ(Value("text").text(), "text");
  EXPECT_EQ(Value(1).text(), "");
}

TEST(Value, EqualValuesHashAlikeAndJsonTellsThemApart) {
  Rng rng(11);
  for (int round = 0; round < 2000; ++round) {
    SCOPED_TRACE("seed 11, round " + std::to_string(round));
    const Value a = random_value(rng, 3);
    const Value b = random_value(rng, 3);
    const Value copy = a;
    EXPECT_EQ(a, copy);
    EXPECT_EQ(a.hash(), copy.hash());
    EXPECT_EQ(to_json(a), to_json(copy));
    if (a == b) {
      EXPECT_EQ(a.hash(), b.hash());
    } else {
      EXPECT_NE(a.hash(), b.hash());  // a collision of 64 bits would be a bug of the mixing, not chance
    }
  }
}

TEST(Value, HashesAlikeOnEveryMachine) {
  EXPECT_EQ(Value().hash(), 14087677454934409008ULL);
  EXPECT_EQ((Value(Map{{"a", 1}, {"b", List{true, "x", 2.5}}}).hash()), 10818745342939313003ULL);
}

TEST(Map, KeepsTheOrderOfInsertionAsPartOfTheValue) {
  Map map{{"b", 1}, {"a", 2}};
  map["b"] = 3;
  EXPECT_EQ(to_json(map), R"({"b":3,"a":2})");
  EXPECT_NE(map, (Map{{"a", 2}, {"b", 3}}));
  EXPECT_TRUE(map.erase("b"));
  EXPECT_FALSE(map.erase("b"));
  map["b"] = 4;
  std::vector<std::string> keys;
  for (const auto& [key, value] : map) keys.push_back(key);
  EXPECT_THAT(keys, ElementsAre("a", "b"));
}

TEST(Map, TakesTheLastOfRepeatedKeysInTheFirstsPlace) {
  EXPECT_EQ(to_json(Map{{"a", 1}, {"b", 2}, {"a", 3}}), R"({"a":3,"b":2})");
}

TEST(Json, WritesEachTypeOneWay) {
  EXPECT_EQ(to_json(Value()), "null");
  EXPECT_EQ(to_json(List{true, false, 1, -5}), "[true,false,1,-5]");
  EXPECT_EQ(to_json(List{}), "[]");
  EXPECT_EQ(to_json(Map{}), "{}");
  EXPECT_EQ(to_json(std::numeric_limits<std::int64_t>::min()), "-9223372036854775808");
  EXPECT_EQ(to_json(Value(std::numeric_limits<double>::infinity())), "\"Infinity\"");
  EXPECT_EQ(to_json(Value(-std::numeric_limits<double>::infinity())), "\"-Infinity\"");
  EXPECT_EQ(to_json(Value(std::nan(""))), "\"NaN\"");
}

TEST(Json, WritesLongStringsAsItWritesTheirCharacters) {
  const auto inner = [](std::string_view text) {
    const std::string json = to_json(Value(text));
    return json.substr(1, json.size() - 2);
  };
  for (std::size_t size = 7; size <= 66; ++size) {
    for (int octet = 0; octet < 256; ++octet) {
      for (const std::size_t at : {std::size_t{0}, size / 2, size - 1}) {
        std::string text(size, 'x');
        text[at] = static_cast<char>(octet);
        const std::string expected =
            std::string(at, 'x') + inner(std::string(1, static_cast<char>(octet))) + std::string(size - at - 1, 'x');
        ASSERT_EQ(inner(text), expected) << "octet " << octet << " at " << at << " of " << size;
      }
    }
  }
}

TEST(Json, EscapesStringsAndRepairsUtf8) {
  EXPECT_EQ(to_json(Value("a\"b\\c\n\r\t\x01")), R"("a\"b\\c\n\r\t\u0001")");
  EXPECT_EQ(to_json(Value("é→😀")), "\"é→😀\"");
  EXPECT_EQ(to_json(Value(std::string("\0", 1))), R"("\u0000")");
  EXPECT_EQ(to_json(Value("\xff")), "\"\xEF\xBF\xBD\"");
  EXPECT_EQ(to_json(Value("\xc0\xaf")), "\"\xEF\xBF\xBD\xEF\xBF\xBD\"");                  // overlong
  EXPECT_EQ(to_json(Value("\xed\xa0\x80")), "\"\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\"");  // surrogate
  EXPECT_EQ(to_json(Value("\xf4\x90\x80\x80")),
            "\"\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\"");        // past U+10FFFF
  EXPECT_EQ(to_json(Value("a\xe2\x82")), "\"a\xEF\xBF\xBD\xEF\xBF\xBD\"");  // cut off
}

TEST(Json, WritesBytesAsBase64) {
  // RFC 4648, section 10.
  const auto bytes = [](std::string_view text) {
    Bytes b;
    for (const char c : text) b.octets.push_back(static_cast<std::byte>(c));
    return b;
  };
  EXPECT_EQ(to_json(bytes("")), R"({"$bytes":""})");
  EXPECT_EQ(to_json(bytes("f")), R"({"$bytes":"Zg=="})");
  EXPECT_EQ(to_json(bytes("fo")), R"({"$bytes":"Zm8="})");
  EXPECT_EQ(to_json(bytes("foo")), R"({"$bytes":"Zm9v"})");
  EXPECT_EQ(to_json(bytes("foobar")), R"({"$bytes":"Zm9vYmFy"})");
}

TEST(ShortestDecimal, ReadsBackTheSameAndLooksLikeADouble) {
  EXPECT_EQ(shortest_decimal(1), "1.0");
  EXPECT_EQ(shortest_decimal(-0.0), "-0.0");
  EXPECT_EQ(shortest_decimal(0.1), "0.1");
  EXPECT_EQ(shortest_decimal(1e22), "1e+22");
  Rng rng(3);
  for (int round = 0; round < 20000; ++round) {
    const auto number = std::bit_cast<double>(rng.next());
    if (!std::isfinite(number)) continue;
    const std::string text = shortest_decimal(number);
    EXPECT_EQ(std::strtod(text.c_str(), nullptr), number) << text << ", seed 3, round " << round;
    EXPECT_NE(text.find_first_of(".e"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace sentree
