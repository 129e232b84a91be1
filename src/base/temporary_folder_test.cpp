#include "sentree/base/temporary_folder.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <optional>
#include <string>

namespace sentree {
namespace {

namespace fs = std::filesystem;

TEST(TemporaryFolder, IsPrivateAndGoneWithAllThatIsInIt) {
  fs::path path;
  {
    const TemporaryFolder folder("test");
    path = folder.path();
    EXPECT_TRUE(path.filename().string().starts_with("sentree-test-"));
    EXPECT_EQ(fs::status(path).permissions() & fs::perms::all, fs::perms::owner_all);
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
    fs::permissions(folder, fs::perms::owner_all | fs::perms::sticky_bit);
    std::ofstream(folder / "socket") << "";
    return folder;
  };
  const fs::path left = made("sentree-run-abcdef"), held = made("sentree-run-ghijkl"),
                 other = made("others-run-mnopqr"), alike = made("sentree-mine-stuvwx");
  fs::permissions(alike, fs::perms::owner_all);  // as mkdtemp makes them
  keep_temporary_folder(held);
  clean_temporary_folders(place.path(), std::chrono::minutes(1));
  EXPECT_TRUE(fs::exists(left));
  clean_temporary_folders(place.path(), std::chrono::seconds(0));
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::exists(held / "socket"));
  EXPECT_TRUE(fs::exists(other / "socket"));
  EXPECT_TRUE(fs::exists(alike / "socket"));
}

// The system's place for temporary files is another one, as long as this lives.
class Elsewhere {
 public:
  explicit Elsewhere(const std::string& place) {
    if (const char* before = std::getenv("TMPDIR")) before_ = before;
    setenv("TMPDIR", place.c_str(), 1);
  }
  ~Elsewhere() {
    if (before_)
      setenv("TMPDIR", before_->c_str(), 1);
    else
      unsetenv("TMPDIR");
  }
  Elsewhere(const Elsewhere&) = delete;
  Elsewhere& operator=(const Elsewhere&) = delete;

 private:
  std::optional<std::string> before_;
};

TEST(TemporaryFolder, IsEmptyWhereNoneCanBeMade) {
  const Elsewhere nowhere("/nowhere/at/all");
  EXPECT_TRUE(TemporaryFolder("test").path().empty());
}

TEST(TemporaryFolder, IsWhereItsPathIsShortEnough) {
  const TemporaryFolder outer("test");
  const fs::path place = outer.path() / std::string(60, 'a');
  fs::create_directory(place);
  const Elsewhere here(place);
  EXPECT_EQ(TemporaryFolder("test").path().parent_path(), place);
  const TemporaryFolder inner("test", 40);
  EXPECT_EQ(inner.path().parent_path(), "/tmp");
  EXPECT_LE(inner.path().native().size(), 40U);
  EXPECT_EQ(TemporaryFolder("test", inner.path().native().size() + 300).path().parent_path(), place);
}

}  // namespace
}  // namespace sentree
