#include "sentree/text/file.h"

#include <gtest/gtest.h>

namespace sentree::text {
namespace {

TEST(File, ReadsBackWhatWasWritten) {
  const auto path = std::filesystem::path(testing::TempDir()) / "file_test.txt";
  ASSERT_TRUE(write_file(path, "one"));
  ASSERT_TRUE(write_file(path, "two\n"));
  EXPECT_EQ(*read_file(path), "two\n");
  EXPECT_EQ(read_file(path, "shown.txt", 3).error().message, "larger than the 3 bytes that are read at most");
}

TEST(File, SaysWhyNot) {
  EXPECT_EQ(to_string(read_file("/nonexistent/x", "x").error()), "x: no such file");
  EXPECT_EQ(to_string(read_file("/", "root").error()), "root: not a regular file");
  EXPECT_EQ(write_file("/nonexistent/x", "").error().code, "file.unwritable");
}

}  // namespace
}  // namespace sentree::text
