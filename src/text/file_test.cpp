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

TEST(ReadLog, KeepsWhatWasReadWhileItLived) {
  const std::filesystem::path folder = ::testing::TempDir();
  const auto a = folder / "read_log_a.txt", b = folder / "read_log_b.txt";
  ASSERT_TRUE(write_file(a, "a"));
  ASSERT_TRUE(write_file(b, "b"));
  ASSERT_TRUE(read_file(b));
  {
    const ReadLog log;
    ASSERT_TRUE(read_file(a));
    ASSERT_TRUE(read_file(a));
    EXPECT_FALSE(read_file(folder / "missing"));
    ASSERT_EQ(log.files().size(), 1u);
    EXPECT_EQ(log.files()[0].path, a);
    EXPECT_EQ(log.files()[0].content, "a");
  }
  ASSERT_TRUE(read_file(b));
}

}  // namespace
}  // namespace sentree::text
