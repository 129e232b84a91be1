#include "sentree/text/file.h"

#include <gtest/gtest.h>

#include "sentree/base/temporary_folder.h"
#include "sentree/text/read_fence.h"

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

TEST(ReadFence, KeepsASealedProjectInsideItsFolder) {
  const TemporaryFolder sealed("sealed"), other("other");
  const auto secret = other.path() / "secret.txt", own = sealed.path() / "own.txt", link = sealed.path() / "link.txt";
  ASSERT_TRUE(write_file(secret, "secret"));
  ASSERT_TRUE(write_file(own, "own"));
  std::filesystem::create_symlink(secret, link);
  const auto outside = sealed.path() / ".." / other.path().filename() / "secret.txt";
  const SealedFolder seal(sealed.path());
  EXPECT_TRUE(read_file(secret));
  {
    const ReadFence fence(sealed.path());
    EXPECT_TRUE(read_file(own));
    for (const auto& path : {secret, outside, link, std::filesystem::path("/etc/passwd")}) {
      const auto read = read_file(path);
      ASSERT_FALSE(read) << path;
      EXPECT_EQ(read.error().code, "file.outside");
    }
    // A folder that comes with the program, and a project of one's own inside.
    const ReadFence also(sealed.path(), {other.path()});
    EXPECT_FALSE(read_file(secret));
  }
  {
    const ReadFence with(sealed.path(), {other.path(), {}});
    EXPECT_TRUE(read_file(secret));
  }
  const ReadFence trusted(other.path());
  EXPECT_TRUE(read_file(secret));
}

TEST(ReadFence, FindsWhatWasNamedByItsFormerPlace) {
  const TemporaryFolder folder("sealed");
  ASSERT_TRUE(write_file(folder.path() / "own.txt", "own"));
  const SealedFolder seal(folder.path(), "/was/here");
  const ReadFence fence(folder.path());
  EXPECT_EQ(read_file("/was/here/own.txt").value_or(""), "own");
  EXPECT_EQ(read_file("/was/here/../here/own.txt").value_or(""), "own");
  EXPECT_EQ(read_file("/was/here/none.txt").error().code, "file.not-found");
  EXPECT_EQ(read_file("/was/here/../elsewhere/own.txt").error().code, "file.outside");
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
