// Trees of public projects, which are not part of this repository: $SENTREE_CORPUS, else shared/corpus beside it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "sentree/bt/library.h"
#include "sentree/bt/load.h"
#include "sentree/bt/write.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/tree.h"
#include "sentree/text/file.h"

namespace sentree {
namespace {

using std::filesystem::path;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Files that are wrong, and what is said of them. They stay refused.
const std::map<std::string, std::string> kWrong = {
    {"BehaviorTree+BehaviorTree.CPP/fuzzing/corpus/bt_corpus/corpus2.xml", "Timeout has no port \"timeout_ms\""},
    {"PickNikRobotics+moveit_pro_example_ws/src/factory_sim/objectives/place_tool_in_tool_holder.xml",
     "script \"tool_object_name!=\"\"\", column 19"},
};

path corpus() {
  const char* const given = std::getenv("SENTREE_CORPUS");
  return (given != nullptr ? path(given) : path(SENTREE_SOURCE_DIR) / ".." / "shared" / "corpus") / "bt";
}

class TreeCorpus : public ::testing::Test {
 protected:
  void SetUp() override {
    std::error_code error;
    if (!std::filesystem::is_directory(corpus(), error)) GTEST_SKIP() << "there is no " << corpus();
    for (const auto& entry : std::filesystem::recursive_directory_iterator(corpus())) {
      if (entry.path().extension() == ".xml") files_.insert(entry.path());
    }
    ASSERT_FALSE(files_.empty());
  }

  static std::string name(const path& file) { return file.lexically_relative(corpus()).generic_string(); }

  /// What is wrong with drawing, formatting or comparing the file; empty: nothing.
  static std::string trial(const path& file, const bt::Library& library) {
    const auto source = text::read_file(file);
    if (!source) return source.error().message;
    bt::LoadOptions options;
    options.partial = true;
    library.serve(options);
    const auto tree = bt::load_file(file, options);
    if (has_errors(tree.diagnostics)) {
      for (const Diagnostic& d : tree.diagnostics) {
        if (d.severity == Severity::kError) return d.message;
      }
    }
    const auto models = bt::read_models(*source, file.string());
    if (!tree.ok() && (!models || bt::node_count(*models) == 0)) return "neither a tree nor a palette";
    const draw::Tree drawing = tree.ok() ? graph::drawing_of(*tree.value) : graph::drawing_of(*models);
    if (draw::to_svg(drawing).empty() || draw::to_dot(drawing).empty() || draw::to_mermaid(drawing).empty())
      return "no drawing";
    const auto once = bt::format(*source, file.string());
    if (!once) return "fmt: " + once.error().message;
    const auto twice = bt::format(*once, file.string());
    if (!twice || *twice != *once) return "fmt changes its own form";
    const auto lost = bt::diff(*source, *once);
    if (!lost || !lost->empty()) return "fmt changes the meaning";
    const auto same = bt::diff(*source, *source);
    if (!same || !same->empty()) return "it differs from itself";
    return {};
  }

  /// Trials of all files; those of one folder are given together if asked for.
  void expect_well(bool together) {
    std::map<path, bt::Library> folders;
    for (const path& file : files_) {
      bt::Library& library = folders[together ? file.parent_path() : file];
      if (const auto source = text::read_file(file)) (void)library.add(file, *source);
    }
    std::size_t well = 0;
    for (const path& file : files_) {
      const std::string why = trial(file, folders[together ? file.parent_path() : file]);
      const auto wrong = kWrong.find(name(file));
      if (wrong != kWrong.end()) {
        EXPECT_THAT(why, HasSubstr(wrong->second)) << name(file);
      } else {
        EXPECT_EQ(why, "") << name(file);
      }
      well += why.empty() ? 1 : 0;
    }
    EXPECT_GE(static_cast<double>(well), 0.95 * static_cast<double>(files_.size())) << well << " of " << files_.size();
    RecordProperty("well", static_cast<int>(well));
  }

  std::set<path> files_;
};

TEST_F(TreeCorpus, LoadsDrawsFormatsAndComparesEachFileAlone) { expect_well(false); }

TEST_F(TreeCorpus, DoesSoWithTheOtherFilesOfItsFolder) { expect_well(true); }

TEST_F(TreeCorpus, LoadsDamagedFilesOrSaysWhy) {
  // Each file cut off at some places: no crash, and either a tree or an error.
  for (const path& file : files_) {
    const auto source = text::read_file(file);
    ASSERT_TRUE(source.has_value());
    for (std::size_t part = 1; part < 5; ++part) {
      const auto tree = bt::load(source->substr(0, source->size() * part / 5), {.partial = true}, name(file));
      EXPECT_TRUE(tree.ok() || has_errors(tree.diagnostics)) << name(file) << " cut at " << part << "/5";
    }
  }
}

}  // namespace
}  // namespace sentree
