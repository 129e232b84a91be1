#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"

namespace sentree::verify {

/// Files of a project in a folder of their own.
class InFolder : public ::testing::Test {
 protected:
  explicit InFolder(const std::string& name) : folder_(name) {}

  void write(const std::string& name, const std::string& text) {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    ASSERT_TRUE(text::write_file(path, text));
  }
  /// The mission, one tree.
  void tree(const std::string& inside) {
    write("mission.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + inside + "</BehaviorTree></root>");
  }

  TemporaryFolder folder_;
};

}  // namespace sentree::verify
