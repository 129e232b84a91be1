#include "sentree/processes/executive.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include "sentree/base/temporary_folder.h"
#include "sentree/processes/supervisor.h"
#include "sentree/text/file.h"

namespace sentree::processes {
namespace {

TEST(Executive, IsNotMissedWhileItsProcessLives) {
  const TemporaryFolder folder("executive");
  const auto file = folder.path() / "executive";
  setenv("SENTREE_ORPHANS_WAIT", "0", 1);
  ASSERT_TRUE(note_executive(file));
  unsetenv("SENTREE_ORPHANS_WAIT");
  ExecutiveWatch watch(file);
  EXPECT_FALSE(watch.is_missed());
  // Another process has its number now.
  const std::string self = std::to_string(getpid());
  ASSERT_TRUE(text::write_file(file, self + " " + std::to_string(process_begun(getpid()) + 1) + " 0\n"));
  EXPECT_TRUE(watch.is_missed());
  ASSERT_TRUE(text::write_file(file, self + " " + std::to_string(process_begun(getpid())) + " 0\n"));
  EXPECT_FALSE(watch.is_missed());
}

TEST(Executive, IsWaitedForAsLongAsItSaid) {
  const TemporaryFolder folder("executive");
  const auto file = folder.path() / "executive";
  ASSERT_TRUE(text::write_file(file, "1 1 1000\n"));
  ExecutiveWatch watch(file);
  EXPECT_FALSE(watch.is_missed());
  ASSERT_TRUE(text::write_file(file, "1 1 0\n"));
  EXPECT_TRUE(watch.is_missed());
}

TEST(Executive, ThatNobodyHasNotedIsWaitedForAMinute) {
  ExecutiveWatch none("/nowhere/executive");
  EXPECT_FALSE(none.is_missed());
  ExecutiveWatch nobody("");
  EXPECT_FALSE(nobody.is_missed());
}

}  // namespace
}  // namespace sentree::processes
