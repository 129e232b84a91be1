// Trees that come, go and are called otherwise, wherever they are named: least edits, and undoing restores identical
// bytes.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/design/tree_edit.h"
#include "sentree/design/workspace.h"
#include "sentree/lsp/index.h"
#include "sentree/lsp/rename.h"

namespace sentree::lsp {
namespace {

namespace fs = std::filesystem;

constexpr int kTreeGestures = 200;
constexpr int kTreeTriesMax = 2'000;
constexpr std::size_t kTreeGrowthMax = 12'000;

std::map<std::string, std::string> texts_in(const design::Workspace& workspace) {
  std::map<std::string, std::string> texts;
  for (const auto& [file, document] : workspace.documents()) texts[file] = document.text;
  return texts;
}

class TreeGestures {
 public:
  TreeGestures(design::Workspace& workspace, unsigned seed) : workspace_(workspace), random_(seed) {}

  /// False: it was refused.
  bool do_any() {
    const design::Document& document = *workspace_.find("mission.xml");
    const auto outline = design::outline_of(document.text, kinds_);
    if (!outline || outline->trees.empty()) return false;
    const design::OutlineTree& tree = outline->trees[draw(outline->trees.size())];
    const std::string fresh = "Made" + std::to_string(++fresh_);
    const auto node = [&] { return tree.nodes.empty() ? tree.element : tree.nodes[draw(tree.nodes.size())].element; };
    switch (draw(6)) {
      case 0: return edit(document, design::AddTree{fresh});
      case 1: return edit(document, design::DeleteTree{tree.element});
      case 2: {
        const std::string call = "<SubTree ID=\"" + outline->trees[draw(outline->trees.size())].id + "\"/>";
        const design::Slot slot{tree.nodes.empty() ? tree.element : node(), draw(3)};
        return edit(document, design::PasteNodes{draw(2) == 0 ? call : document.text, slot});
      }
      case 3: return edit(document, design::ExtractTree{node(), fresh});
      default: return rename(tree.id, fresh);
    }
  }

  [[nodiscard]] int renamed() const { return renamed_; }

 private:
  std::size_t draw(std::size_t bound) { return random_() % bound; }

  bool edit(const design::Document& document, const design::TreeGesture& gesture) {
    const auto result = design::edit_tree(document.text, gesture, kinds_);
    return result && workspace_.edit("mission.xml", document.version, result->edits, result->name).has_value();
  }

  bool rename(const std::string& from, const std::string& to) {
    index_.refresh(workspace_.overlay());
    const auto renaming = lsp::rename(index_, {SymbolKind::kTree, from}, to);
    if (!renaming) return false;
    std::vector<design::Workspace::NewText> texts;
    for (const auto& [path, edits] : renaming->edits) {
      const std::string file = fs::path(path).lexically_relative(workspace_.folder()).generic_string();
      const std::string& text = workspace_.find(file)->text;
      for (const design::TextEdit& edit : edits) {
        EXPECT_EQ(text.substr(edit.from, edit.to - edit.from), from) << "the name, and nothing else";
        EXPECT_EQ(edit.text, to);
      }
      texts.push_back({file, design::with_edits(text, edits).value()});
    }
    EXPECT_FALSE(texts.empty());
    ++renamed_;
    return workspace_.put(texts, "rename " + from + " to " + to).has_value();
  }

  design::Workspace& workspace_;
  std::mt19937 random_;
  const design::Kinds kinds_{{}};
  Index index_{workspace_.folder()};
  int fresh_ = 0;
  int renamed_ = 0;
};

TEST(TreeGestures, OfProjectsAreUndoneToIdenticalBytes) {
  const char* const given = std::getenv("SENTREE_SEED");
  const auto seed = given != nullptr ? static_cast<unsigned>(std::stoul(given)) : std::random_device()();
  int projects = 0;
  for (const auto& example : fs::directory_iterator(fs::path(SENTREE_SOURCE_DIR) / "examples")) {
    if (!fs::exists(example.path() / "mission.xml") || !fs::exists(example.path() / "sentree.yaml")) continue;
    SCOPED_TRACE(example.path().filename().string() + ", SENTREE_SEED=" + std::to_string(seed));
    const TemporaryFolder folder("gestures");
    const fs::path copy = folder.path() / "project";
    fs::copy(example.path(), copy, fs::copy_options::recursive);
    auto workspace = design::Workspace::open(copy).value();
    const auto original = texts_in(workspace);
    TreeGestures gestures(workspace, seed);
    int done = 0;
    for (int tried = 0; done < kTreeGestures && tried < kTreeTriesMax; ++tried) {
      if (!gestures.do_any()) continue;
      ++done;
      if (workspace.find("mission.xml")->text.size() > original.at("mission.xml").size() + kTreeGrowthMax) {
        ASSERT_TRUE(workspace.undo());
      }
    }
    EXPECT_EQ(done, kTreeGestures);
    EXPECT_GT(gestures.renamed(), 20);
    while (!workspace.undo_steps().empty()) ASSERT_TRUE(workspace.undo());
    ASSERT_EQ(texts_in(workspace), original);
    for (const auto& [file, document] : workspace.documents()) EXPECT_FALSE(document.is_dirty()) << file;
    ++projects;
  }
  EXPECT_GE(projects, 10);
}

}  // namespace
}  // namespace sentree::lsp
