#include "sentree/base/flat_map.h"

#include <gtest/gtest.h>

#include <unordered_map>

#include "sentree/base/rng.h"

namespace sentree {
namespace {

TEST(FlatMap, IsAMapThatOnlyGrows) {
  constexpr std::uint64_t kSeed = 7;
  Rng rng(kSeed);
  FlatMap<std::uint64_t, WordHash> map;
  std::unordered_map<std::uint64_t, std::uint32_t> oracle;
  EXPECT_EQ(map.find(1), map.kNone);
  for (std::uint32_t i = 0; i < 20'000; ++i) {
    const std::uint64_t key = rng.below(10'000) << 32U | rng.below(2);
    const auto [ours, is_new] = map.try_emplace(key, i);
    const auto [theirs, was_new] = oracle.try_emplace(key, i);
    ASSERT_EQ(is_new, was_new) << "seed " << kSeed;
    ASSERT_EQ(*ours, theirs->second);
  }
  ASSERT_EQ(map.size(), oracle.size());
  for (const auto& [key, value] : oracle) ASSERT_EQ(map.find(key), value);
  EXPECT_EQ(map.find(UINT64_MAX), map.kNone);
  // Of twelve octets each, at least three fifths are in use.
  EXPECT_LE(map.bytes(), map.size() * 20 + 12);
}

}  // namespace
}  // namespace sentree
