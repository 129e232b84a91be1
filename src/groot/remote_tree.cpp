#include "sentree/groot/remote_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>

#include "sentree/bt/model.h"
#include "sentree/bt/write.h"
#include "sentree/text/xml.h"

namespace sentree::groot {

namespace {

using text::XmlElement;

// The format in which BehaviorTree.CPP 4 describes its nodes.
constexpr int kFormat = 4;

std::string text_of(const XmlElement& element, std::string_view name) {
  return std::string(element.attribute(name).value_or(std::string_view()));
}

std::optional<bt::Category> category_named(std::string_view tag) {
  using bt::Category;
  for (const Category category :
       {Category::kControl, Category::kDecorator, Category::kAction, Category::kCondition, Category::kSubTree}) {
    if (bt::to_string(category) == tag) return category;
  }
  return std::nullopt;
}

class TreeReader {
 public:
  TreeReader(const text::XmlDocument& document, const RemoteTreeOptions& options)
      : options_(options), root_(document.root()) {}

  Result<RemoteTree> read(const std::vector<bt::NodeModel>& models) {
    std::vector<bt::NodeModel> own;
    for (const bt::NodeModel& model : models) {
      categories_.emplace(model.id, model.category);
      if (model.category != bt::Category::kSubTree && bt::find_builtin(model.id, kFormat) == nullptr)
        own.push_back(model);
    }
    find_instances();
    if (instances_.empty()) return wrong("there is no BehaviorTree in it");
    name_instances();
    find_uses(root_);
    RemoteTree remote;
    remote.boards.push_back({text_of(instances_.front().element, "ID"), 0});
    remote.mission = fmt::format("<root BTCPP_format=\"4\"{}>\n",
                                 text::xml_attribute("main_tree_to_execute", instances_.front().id));
    for (const Instance& instance : instances_) {
      remote.mission += fmt::format("  <BehaviorTree{}>\n", text::xml_attribute("ID", instance.id));
      std::set<std::string, std::less<>> names;
      write(remote.mission, instance.element.first_child(), 2, instance.path, names);
      remote.mission += "  </BehaviorTree>\n";
    }
    remote.mission += bt::write_models(own) + "</root>\n";
    if (auto numbered = number(remote, instances_.front().element.first_child(), 1); !numbered)
      return tl::unexpected(numbered.error());
    return remote;
  }

 private:
  struct Instance {
    XmlElement element;
    std::string path;
    std::string id;  // of its own
  };

  static tl::unexpected<Diagnostic> wrong(std::string why) {
    return fail("groot.tree", "the publisher's tree cannot be read: " + std::move(why));
  }

  void find_instances() {
    std::set<std::string, std::less<>> paths;
    for (auto child = root_.first_child(); child; child = child.next_sibling()) {
      if (child.name() != "BehaviorTree" || !child.first_child()) continue;
      const std::string path = instances_.empty() ? std::string() : text_of(child, "_fullpath");
      if (paths.insert(path).second) instances_.push_back({child, path, {}});
    }
    for (std::size_t i = 1; i < instances_.size(); ++i) by_path_[instances_[i].path] = i;
  }

  void name_instances() {
    std::map<std::string, int, std::less<>> count;
    for (const Instance& instance : instances_) ++count[text_of(instance.element, "ID")];
    std::set<std::string, std::less<>> taken;
    for (Instance& instance : instances_) {
      const std::string id = text_of(instance.element, "ID");
      instance.id = count[id] == 1 ? id : fmt::format("{} {}", id, instance.path.empty() ? "main" : instance.path);
      while (!taken.insert(instance.id).second) instance.id += "'";
    }
  }

  // Which SubTree stands for which instance: each for one at most, so that the tree is as large as what is read.
  void find_uses(const XmlElement& root) {
    std::set<std::size_t> used;
    std::vector<XmlElement> open{root};
    while (!open.empty()) {
      const XmlElement element = open.back();
      open.pop_back();
      if (element.name() == "SubTree") {
        const auto found = by_path_.find(text_of(element, "_fullpath"));
        if (found != by_path_.end() && used.insert(found->second).second) uses_[element.offset()] = found->second;
      }
      for (auto child = element.first_child(); child; child = child.next_sibling()) open.push_back(child);
    }
  }

  // What a leaf is called: its name is in messages, so it must be there once.
  std::string name_of(const XmlElement& element, const std::string& id, bool is_external,
                      std::set<std::string, std::less<>>& names) const {
    std::string name = text_of(element, "name");
    if (!is_external) return name == id ? std::string() : name;
    const bool is_reserved =
        std::find(options_.reserved.begin(), options_.reserved.end(), name) != options_.reserved.end();
    // Those without a name of their own are numbered by who loads them.
    if (name == id && !is_reserved) return {};
    if (is_reserved || !names.insert(name).second) name += " #" + text_of(element, "_uid");
    return name;
  }

  // Nesting is bounded by text::kXmlNestingMax.
  void write(std::string& out, const XmlElement& element, std::size_t depth, const std::string& inside,
             std::set<std::string, std::less<>>& names) const {
    const std::string indent(2 * depth, ' ');
    const std::string tag(element.name());
    const auto explicit_category = element.attribute("ID") ? category_named(tag) : std::nullopt;
    const std::string id = explicit_category ? text_of(element, "ID") : tag;
    const bool is_subtree = tag == "SubTree";
    const bool is_builtin = !is_subtree && bt::find_builtin(id, kFormat) != nullptr;
    std::string written = tag;
    if (is_subtree) {
      write_subtree(out, element, indent, inside);
      return;
    }
    out += indent + "<";
    if (is_builtin) {
      out += written = id;
    } else {
      const auto known = categories_.find(id);
      const std::size_t children = element.children().size();
      const bt::Category category = explicit_category            ? *explicit_category
                                    : known != categories_.end() ? known->second
                                    : children == 0              ? bt::Category::kAction
                                    : children == 1              ? bt::Category::kDecorator
                                                                 : bt::Category::kControl;
      out += written = bt::to_string(category);
      out += text::xml_attribute("ID", id);
    }
    const std::string name = name_of(element, id, !is_builtin && !element.first_child(), names);
    if (!name.empty()) out += text::xml_attribute("name", name);
    write_given(out, element);
    if (!element.first_child()) {
      out += "/>\n";
      return;
    }
    out += ">\n";
    for (auto child = element.first_child(); child; child = child.next_sibling())
      write(out, child, depth + 1, inside, names);
    out += fmt::format("{}</{}>\n", indent, written);
  }

  void write_subtree(std::string& out, const XmlElement& element, const std::string& indent,
                     const std::string& inside) const {
    const auto use = uses_.find(element.offset());
    const std::string path = text_of(element, "_fullpath");
    const std::string before = inside.empty() ? std::string() : inside + "/";
    out += indent + "<SubTree";
    out += text::xml_attribute("ID",
                               use != uses_.end() ? instances_[use->second].id : text_of(element, "ID") + " (unknown)");
    out += text::xml_attribute("name", path.starts_with(before) ? path.substr(before.size()) : path);
    write_given(out, element);
    out += "/>\n";
  }

  void write_given(std::string& out, const XmlElement& element) const {
    if (options_.bare) return;
    element.for_each_attribute([&](std::string_view name, std::string_view value) {
      if (name != "ID" && name != "name" && name != "_uid" && name != "_fullpath")
        out += text::xml_attribute(name, value);
    });
  }

  // In the order in which the loader numbers nodes: depth first, through SubTrees.
  Result<void> number(RemoteTree& remote, const XmlElement& element, std::size_t depth) {
    if (depth > kRemoteDepthMax) return wrong(fmt::format("it is deeper than {} nodes", kRemoteDepthMax));
    if (remote.uids.size() == kRemoteNodesMax) return wrong("it has too many nodes");
    const std::string text = text_of(element, "_uid");
    std::uint16_t uid = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), uid);
    if (error != std::errc() || end != text.data() + text.size() || uid == 0)
      return wrong(fmt::format("node \"{}\" has no number", text_of(element, "name")));
    if (!numbers_.insert(uid).second) return wrong(fmt::format("several nodes have the number {}", uid));
    remote.uids.push_back(uid);
    if (element.name() == "SubTree") {
      const auto use = uses_.find(element.offset());
      if (use == uses_.end()) return {};
      remote.boards.push_back({instances_[use->second].path, uid});
      return number(remote, instances_[use->second].element.first_child(), depth + 1);
    }
    for (auto child = element.first_child(); child; child = child.next_sibling()) {
      if (auto numbered = number(remote, child, depth + 1); !numbered) return numbered;
    }
    return {};
  }

  const RemoteTreeOptions& options_;
  const XmlElement root_;
  std::vector<Instance> instances_;  // the main tree first
  std::map<std::string, std::size_t, std::less<>> by_path_;
  std::unordered_map<std::size_t, std::size_t> uses_;  // by the offset of the SubTree
  std::map<std::string, bt::Category, std::less<>> categories_;
  std::set<std::uint16_t> numbers_;
};

}  // namespace

Result<RemoteTree> read_remote_tree(const std::string& xml, const RemoteTreeOptions& options) {
  const auto document = text::XmlDocument::parse(xml, "the publisher's tree", {.lenient = true});
  if (!document) return tl::unexpected(document.error());
  const auto models = bt::read_models(xml, "the publisher's tree");
  if (!models) return tl::unexpected(models.error());
  return TreeReader(*document, options).read(*models);
}

}  // namespace sentree::groot
