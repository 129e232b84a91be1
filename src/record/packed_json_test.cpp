#include "sentree/record/packed_json.h"

#include <gtest/gtest.h>

#include <limits>

#include "sentree/base/json.h"
#include "sentree/base/rng.h"
#include "sentree/record/observation.h"

namespace sentree::record {
namespace {

std::string random_text(Rng& rng) {
  static const std::string kPieces[] = {"", "a", "battery.level", "\"", "\\", "\n", "\x01", "é", "\xff", "{", "$bytes"};
  std::string text;
  for (std::uint64_t i = rng.next() % 4; i > 0; --i) text += kPieces[rng.next() % std::size(kPieces)];
  if (rng.next() % 50 == 0) text.resize(255 + rng.next() % 2, 'x');
  return text;
}

Value random_packed(Rng& rng, int depth) {
  static const double kNumbers[] = {0.0,
                                    -0.0,
                                    1.0,
                                    0.1,
                                    -273.15,
                                    1e300,
                                    5e-324,
                                    std::numeric_limits<double>::infinity(),
                                    std::numeric_limits<double>::quiet_NaN()};
  switch (rng.next() % (depth > 3 ? 6 : 8)) {
    case 0: return {};
    case 1: return rng.next() % 2 == 0;
    case 2: return static_cast<std::int64_t>(rng.next()) >> (rng.next() % 64);
    case 3: return kNumbers[rng.next() % std::size(kNumbers)];
    case 4: return random_text(rng);
    case 5: return Bytes{std::vector<std::byte>(rng.next() % 5, std::byte{0xA7})};
    case 6: {
      List list;
      for (std::uint64_t i = rng.next() % 4; i > 0; --i) list.push_back(random_packed(rng, depth + 1));
      return list;
    }
    default: {
      Map map;
      for (std::uint64_t i = rng.next() % 4; i > 0; --i) map[random_text(rng)] = random_packed(rng, depth + 1);
      return map;
    }
  }
}

TEST(PackedJson, PrintsWhatWouldHaveBeenPrintedAtOnce) {
  constexpr std::uint64_t kSeed = 20;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Rng rng(kSeed);
  PackedJson packed;
  for (int i = 0; i < 5000; ++i) {
    Message message;
    message.sequence = rng.next() >> (rng.next() % 2 == 0 ? 0U : 40U);
    message.time = TimePoint(Duration(static_cast<std::int64_t>(rng.next() % 10'000'000'000)));
    message.stamp = rng.next() % 1000;
    message.kind = static_cast<MessageKind>(rng.next() % 4);
    message.source = random_text(rng);
    message.target = random_text(rng);
    message.name = random_text(rng);
    message.call = rng.next() % 3;
    message.tick = rng.next() % 100;
    message.data = random_packed(rng, 0);
    std::string at_once;
    append_observation(at_once, message);
    packed.clear();
    pack_observation(packed, message);
    std::string later;
    PackedJson::unpack(later, packed.bytes());
    ASSERT_EQ(later, at_once);
  }
}

TEST(PackedJson, RoundsAsFarAsItSays) {
  PackedJson packed;
  const double ranges[] = {0.12345, 2.0, -0.0004, std::numeric_limits<double>::infinity()};
  packed.rounded(0.12345678);
  packed.raw(" ");
  packed.rounded_list(ranges);
  packed.json(" {}");
  std::string text;
  PackedJson::unpack(text, packed.bytes());
  EXPECT_EQ(text, "0.123457 0.123,2,0,0 {}");
}

}  // namespace
}  // namespace sentree::record
