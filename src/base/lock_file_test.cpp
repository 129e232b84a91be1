#include "sentree/base/lock_file.h"

#include <gtest/gtest.h>

#include <cerrno>

#include "sentree/base/temporary_folder.h"

namespace sentree {
namespace {

TEST(LockFile, IsHeldByOneWhoSaysWho) {
  const TemporaryFolder folder("lock");
  const auto path = folder.path() / "lock";
  LockFile first = LockFile::take(path);
  ASSERT_EQ(first.state(), LockFile::State::kHeld);
  EXPECT_EQ(LockFile::take(path).other(), "another program");
  tell_holder(*first.descriptor(), "somebody");
  const LockFile second = LockFile::take(path);
  EXPECT_EQ(second.state(), LockFile::State::kTaken);
  EXPECT_EQ(second.other(), "somebody");
  first = {};
  EXPECT_EQ(LockFile::take(path).state(), LockFile::State::kHeld);
}

TEST(LockFile, ThatCannotBeMadeSaysWhy) {
  const TemporaryFolder folder("lock");
  const LockFile lock = LockFile::take(folder.path() / "nowhere" / "lock");
  EXPECT_EQ(lock.state(), LockFile::State::kNoAccess);
  EXPECT_EQ(lock.why(), ENOENT);
}

}  // namespace
}  // namespace sentree
