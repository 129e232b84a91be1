#include "sentree/base/temporary_folder.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

namespace sentree {
namespace {

namespace fs = std::filesystem;

TEST(TemporaryFolder, IsPrivateAndGoneWithAllThatIsInIt) {
  fs::path path;
  {
    const TemporaryFolder folder("test");
    path = folder.path();
    EXPECT_TRUE(path.filename().string().starts_with("sentree-test-"));
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_all);
    fs::create_directory(path / "inside");
    std::ofstream(path / "inside" / "file") << "content";
    ASSERT_TRUE(fs::exists(path / "inside" / "file"));
    EXPECT_NE(TemporaryFolder("test").path(), path);
  }
  EXPECT_FALSE(fs::exists(path));
}

TEST(TemporaryFolder, WhatAKilledProcessLeftIsTakenAway) {
  const TemporaryFolder place("place");
  const auto made = [&](const char* name) {
    const fs::path folder = place.path() / name;
    fs::create_directory(folder);
    fs::permissions(folder, fs::perms::owner_all);
    std::ofstream(folder / "socket") << "";
    return folder;
  };
  const fs::path left = made("sentree-run-abcdef"), held = made("sentree-run-ghijkl"),
                 other = made("others-run-mnopqr");
  keep_temporary_folder(held);
  clean_temporary_folders(place.path(), std::chrono::minutes(1));
  EXPECT_TRUE(fs::exists(left));
  clean_temporary_folders(place.path(), std::chrono::seconds(0));
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(held / "socket"));
  EXPECT_TRUE(fs::exists(other / "socket"));
}

TEST(TemporaryFolder, IsEmptyWhereNoneCanBeMade) {
  const char* before = std::getenv("TMPDIR");
  const std::string kept = before != nullptr ? before : "";
  setenv("TMPDIR", "/nowhere/at/all", 1);
  const TemporaryFolder folder("test");
  if (before != nullptr)
    setenv("TMPDIR", kept.c_str(), 1);
  else
    unsetenv("TMPDIR");
  EXPECT_TRUE(folder.path().empty());
}

}  // namespace
}  // namespace sentree
