#include "sentree/bt/library.h"

#include <algorithm>
#include <utility>

#include "sentree/text/xml.h"

namespace sentree::bt {

using text::XmlElement;

namespace {

/// The parser bounds nesting, so the recursion is bounded too.
void note_uses(const XmlElement& tree, std::string_view own, std::set<std::string, std::less<>>& used) {
  for (XmlElement e = tree.first_child(); e; e = e.next_sibling()) {
    const std::string_view id = e.name().starts_with("SubTree") ? e.attribute("ID").value_or("") : e.name();
    if (id != own) used.emplace(id);
    note_uses(e, own, used);
  }
}

}  // namespace

Result<void> Library::add(std::filesystem::path path, std::string_view xml) {
  const auto document = text::XmlDocument::parse(std::string(xml), path.string(), {.lenient = true});
  if (!document) return tl::unexpected(document.error());
  const XmlElement root = document->root();
  if (root.name() != "root") return fail("bt.not-a-tree", "the root element is no <root>", root.span());
  TreeFile file;
  file.path = std::move(path);
  file.main_tree = std::string(root.attribute("main_tree_to_execute").value_or(""));
  std::vector<NodeModel> models;
  for (XmlElement e = root.first_child(); e; e = e.next_sibling()) {
    if (e.name() == "BehaviorTree") {
      file.trees.emplace_back(e.attribute("ID").value_or(""));
      by_tree_.try_emplace(file.trees.back(), files_.size());
      note_uses(e, file.trees.back(), used_);
    } else if (e.name() == "TreeNodesModel") {
      for (XmlElement node = e.first_child(); node; node = node.next_sibling()) {
        if (auto model = read_model(node)) models.push_back(std::move(*model));
      }
    }
  }
  file.models = node_count(models);
  palette_.add(models);
  files_.push_back(std::move(file));
  return {};
}

std::optional<std::filesystem::path> Library::find_tree(std::string_view id) const {
  const auto found = by_tree_.find(id);
  if (id.empty() || found == by_tree_.end()) return std::nullopt;
  return files_[found->second].path;
}

const TreeFile* Library::main_file(std::string_view tree) const {
  if (!tree.empty()) {
    const auto found = by_tree_.find(tree);
    return found != by_tree_.end() ? &files_[found->second] : nullptr;
  }
  const TreeFile* best = nullptr;
  for (const TreeFile& file : files_) {
    if (file.trees.empty()) continue;
    if (!file.main_tree.empty()) return &file;
    const bool is_root = std::any_of(file.trees.begin(), file.trees.end(),
                                     [this](const std::string& id) { return !used_.contains(id); });
    if (best == nullptr && is_root) best = &file;
  }
  if (best != nullptr) return best;
  const auto any = std::find_if(files_.begin(), files_.end(), [](const TreeFile& f) { return !f.trees.empty(); });
  return any != files_.end() ? &*any : nullptr;
}

std::vector<std::string> Library::roots() const {
  std::vector<std::string> ids;
  for (const auto& [id, file] : by_tree_) {
    if (!id.empty() && !used_.contains(id)) ids.push_back(id);
  }
  return ids;
}

void Library::serve(LoadOptions& options) const {
  options.palette = &palette_;
  options.find_tree = [this](std::string_view id) { return find_tree(id); };
}

}  // namespace sentree::bt
