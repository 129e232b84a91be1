#include "sentree/base/blocks.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

namespace sentree {
namespace {

using Texts = Blocks<std::string>;

std::vector<std::string> texts(std::size_t size) {
  std::vector<std::string> all(size);
  for (std::size_t i = 0; i < size; ++i) all[i] = std::to_string(i);
  return all;
}

TEST(Blocks, HaveWhatWasPutIn) {
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, Texts::kLength, Texts::kLength + 1, 5 * Texts::kLength}) {
    const Texts blocks(texts(size), nullptr);
    EXPECT_EQ(blocks.size(), size);
    EXPECT_EQ(blocks.whole(), texts(size));
    if (size > 0) {
      EXPECT_EQ(blocks[size - 1], std::to_string(size - 1));
    }
  }
}

TEST(Blocks, TakeMemoryOnlyForWhatDiffers) {
  constexpr std::size_t kSize = 100 * Blocks<std::uint64_t>::kLength;
  std::vector<std::uint64_t> numbers(kSize);
  std::iota(numbers.begin(), numbers.end(), 0U);
  const Blocks<std::uint64_t> first(std::vector<std::uint64_t>(numbers), nullptr);
  numbers[kSize / 2] = 7;
  const Blocks<std::uint64_t> second(std::vector<std::uint64_t>(numbers), &first);
  EXPECT_EQ(second.whole(), numbers);
  EXPECT_EQ(&second[0], &first[0]);
  EXPECT_NE(&second[kSize / 2], &first[kSize / 2]);
  EXPECT_GT(first.bytes_beside(nullptr), kSize * sizeof(numbers[0]));
  EXPECT_LT(second.bytes_beside(&first), first.bytes_beside(nullptr) / 20);
}

TEST(Blocks, ShareNothingWithALongerOrShorterEnd) {
  const Texts longer(texts(Texts::kLength + 3), nullptr);
  const Texts shorter(texts(Texts::kLength + 2), &longer);
  EXPECT_EQ(shorter.whole(), texts(Texts::kLength + 2));
  EXPECT_EQ(&shorter[0], &longer[0]);
  EXPECT_EQ(Texts(texts(2 * Texts::kLength), &shorter).whole(), texts(2 * Texts::kLength));
}

TEST(Blocks, CountWhatTheirElementsHold) {
  const Texts blocks(texts(3), nullptr);
  EXPECT_EQ(blocks.bytes_beside(nullptr, [](const std::string& text) { return text.size(); }),
            blocks.bytes_beside(nullptr) + 3);
}

}  // namespace
}  // namespace sentree
