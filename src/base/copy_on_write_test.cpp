#include "sentree/base/copy_on_write.h"

#include <gtest/gtest.h>

#include <vector>

namespace sentree {
namespace {

using Numbers = CopyOnWrite<std::vector<int>>;

TEST(CopyOnWrite, CopiesWhatIsSharedWhenItIsChanged) {
  Numbers numbers;
  numbers.edit() = {1, 2};
  Numbers copy = numbers;
  EXPECT_EQ(&*copy, &*numbers);
  copy.edit().push_back(3);
  EXPECT_EQ(*numbers, (std::vector{1, 2}));
  EXPECT_EQ(*copy, (std::vector{1, 2, 3}));
}

TEST(CopyOnWrite, OverwritesItsOwnInPlaceAndLeavesWhatOthersHave) {
  Numbers numbers(std::vector{1, 2, 3});
  const int* const room = numbers->data();
  numbers.overwrite().clear();
  EXPECT_EQ(numbers->data(), room);  // takes no other memory
  numbers.edit() = {4, 5};
  const Numbers copy = numbers;
  numbers.overwrite().assign({6});
  EXPECT_EQ(*numbers, std::vector{6});
  EXPECT_EQ(*copy, (std::vector{4, 5}));
  Numbers none;
  EXPECT_TRUE(none.overwrite().empty());
}

}  // namespace
}  // namespace sentree
