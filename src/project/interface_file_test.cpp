#include "sentree/project/interface_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "sentree/base/temporary_folder.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"

namespace sentree::project {
namespace {

using ::testing::ElementsAre;

class InterfaceFile : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_.path() / "interfaces/geometry/units"); }
  Loaded<idl::Schema> load(const std::string& source) {
    write("robot.thrift", source);
    return load_interface(folder_.path() / "interfaces/robot.thrift", "my/interfaces/robot.thrift");
  }
  void write(const std::string& name, const std::string& source) {
    ASSERT_TRUE(text::write_file(folder_.path() / "interfaces" / name, source));
  }

  TemporaryFolder folder_{"interface-file"};
};

TEST_F(InterfaceFile, IncludesAreFoundBesideTheFileThatHasThem) {
  write("geometry/pose.thrift",
        "include \"units/length.thrift\"\ninclude \"../common.thrift\"\n"
        "struct Pose { 1: length.Metre x, 2: common.Name name }");
  write("geometry/units/length.thrift", "typedef double Metre");
  write("common.thrift", "typedef string Name");
  const auto loaded = load("include \"geometry/pose.thrift\"\nservice Robot { pose.Pose where() }");
  EXPECT_TRUE(loaded.diagnostics.empty()) << to_string(loaded.diagnostics.front());
  ASSERT_TRUE(loaded.ok());
  EXPECT_THAT(loaded.value->files(),
              ElementsAre("my/interfaces/robot.thrift", "my/interfaces/geometry/pose.thrift",
                          "my/interfaces/geometry/units/length.thrift", "my/interfaces/common.thrift"));
}

TEST_F(InterfaceFile, AnErrorInAnIncludedFileNamesThatFile) {
  write("geometry/pose.thrift", "struct Pose {\n  1: Metre x }");
  const auto loaded = load("include \"geometry/pose.thrift\"");
  ASSERT_EQ(loaded.diagnostics.size(), 1U);
  EXPECT_EQ(to_string(loaded.diagnostics.front()),
            "my/interfaces/geometry/pose.thrift:2:6: there is no type \"Metre\"");
}

TEST_F(InterfaceFile, MayIncludeWhatComesWithSentree) {
  const auto loaded = load("include \"robot.thrift\"\nservice Robot { }");
  EXPECT_FALSE(loaded.ok());  // Its own name wins, so this file includes itself.
  write("mine.thrift", "include \"observer.thrift\"\nservice Mine { observer.ObserverInfo what() }");
  const auto mine = load_interface(folder_.path() / "interfaces/mine.thrift", "mine.thrift");
  EXPECT_TRUE(mine.ok()) << to_string(mine.diagnostics.front());
}

TEST(BundledInterface, IsNamedWithItsForm) {
  EXPECT_EQ(missing_form("nowhere", "std_srvs", "SetBool"), "; did you mean \"std_srvs/srv/SetBool\"?");
  EXPECT_EQ(missing_form("nowhere", "nav2_msgs", "Spin"), "; did you mean \"nav2_msgs/action/Spin\"?");
  EXPECT_THAT(missing_form("nowhere", "nav2_msgs", "Spam"), ::testing::HasSubstr("FILE.thrift/SERVICE, or of ROS"));
  EXPECT_EQ(missing_form("nowhere", "robot.thrift", "Battery"), "");
  EXPECT_FALSE(find_interface("nowhere", "std_srvs")) << "which is a folder";
}

TEST(BundledInterface, SaysThatItIsOfAnotherRelease) {
  const auto said = [](const char* name, const char* release) {
    ::setenv("ROS_DISTRO", release, 1);
    const auto loaded = load_interface(shipped_folder("interfaces") / name, name);
    ::unsetenv("ROS_DISTRO");
    EXPECT_TRUE(loaded.ok());
    return loaded.diagnostics.empty() ? std::string() : loaded.diagnostics.front().message;
  };
  EXPECT_THAT(said("nav2_msgs/action/Spin.action", "jazzy"),
              ::testing::HasSubstr("is Humble's, and ROS_DISTRO is jazzy"));
  EXPECT_EQ(said("nav2_msgs/action/Spin.action", "humble"), "");
  EXPECT_EQ(said("std_srvs/srv/SetBool.srv", "jazzy"), "") << "which is the same in all";
}

}  // namespace
}  // namespace sentree::project
