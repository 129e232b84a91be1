#include "sentree/groot/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include "sentree/bt/model.h"
#include "sentree/bt/state.h"
#include "sentree/bt/write.h"
#include "sentree/groot/detail/bytes.h"
#include "sentree/text/xml.h"

namespace sentree::groot {

using bt::Category;
using bt::NodeId;
using bt::PortFact;
using bt::Tree;

namespace {

// What a node is called by where it is registered; a SubTree, by its definition.
std::string id_of(const Tree& tree, NodeId node) {
  return std::string(tree.category(node) == Category::kSubTree ? tree.subtree_id(node) : tree.registration(node));
}

bool can_be_tag(std::string_view id) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !id.empty() && is_letter(id.front()) && std::all_of(id.begin(), id.end(), [&](char c) {
    return is_letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '.';
  });
}

class XmlWriter {
 public:
  explicit XmlWriter(const Tree& tree) : tree_(tree), paths_(instance_paths(tree)) {}

  std::string write() {
    out_ = "<root BTCPP_format=\"4\">\n";
    write_tree(tree_.id(), "", 0);
    for (NodeId node = 0; node < tree_.size(); ++node) {
      if (tree_.category(node) == Category::kSubTree && !tree_.is_unknown(node))
        write_tree(id_of(tree_, node), paths_[node], tree_.children(node)[0]);
    }
    std::vector<bt::NodeModel> all = bt::models(bt::Registry(), true);
    all.push_back({"SubTree", Category::kSubTree, {}, {}});
    std::set<std::string, std::less<>> described;
    for (const bt::NodeModel& model : all) described.insert(model.id);
    for (NodeId node = 0; node < tree_.size(); ++node) {
      const bt::Manifest& manifest = tree_.model().manifest(node);
      if (tree_.category(node) == Category::kSubTree || !described.insert(manifest.id).second) continue;
      all.push_back({manifest.id, manifest.category, manifest.ports, manifest.description});
    }
    return fmt::format("{}{}</root>\n", out_, bt::write_models(all));
  }

 private:
  void write_tree(std::string_view id, const std::string& path, NodeId root) {
    out_ +=
        fmt::format("    <BehaviorTree{}{}>\n", text::xml_attribute("ID", id), text::xml_attribute("_fullpath", path));
    write_node(root, 2);
    out_ += "    </BehaviorTree>\n";
  }

  // Nodes stand where the loader of `read_remote_tree` and Groot expect them; nesting is bounded by bt::kDepthMax.
  void write_node(NodeId node, std::size_t depth) {
    const std::string indent(4 * depth, ' ');
    const bool is_subtree = tree_.category(node) == Category::kSubTree;
    const std::string id = id_of(tree_, node);
    const bool is_short = !is_subtree && can_be_tag(id);
    const std::string tag(is_short ? id : bt::to_string(tree_.category(node)));
    out_ += fmt::format("{}<{}", indent, tag);
    if (!is_short) out_ += text::xml_attribute("ID", id);
    out_ += is_subtree ? text::xml_attribute("_fullpath", paths_[node]) : text::xml_attribute("name", tree_.name(node));
    out_ += text::xml_attribute("_uid", std::to_string(uid_of(node)));
    for (const PortFact& port : tree_.ports(node)) out_ += text::xml_attribute(port.name, port.text);
    for (const auto& [name, script] : tree_.conditions(node)) out_ += text::xml_attribute(name, script);
    const auto children = tree_.children(node);
    if (is_subtree || children.empty()) {
      out_ += "/>\n";
      return;
    }
    out_ += ">\n";
    for (const NodeId child : children) write_node(child, depth + 1);
    out_ += fmt::format("{}</{}>\n", indent, tag);
  }

  const Tree& tree_;
  const std::vector<std::string> paths_;
  std::string out_;
};

/// A FlatBuffer (https://flatbuffers.dev/internals), written from its root on: what refers comes before what is
/// referred to. Fields of tables take four bytes each.
class FlatBuffer {
 public:
  using Position = std::size_t;

  FlatBuffer() { put(out_, 0, 4); }

  /// A table with `fields` fields of zero; `from` is made to refer to it.
  Position table(Position from, std::size_t fields) {
    const std::size_t vtable_size = 4 + 2 * fields;
    while ((out_.size() + vtable_size) % 4 != 0) out_ += '\0';
    const Position vtable = out_.size();
    put(out_, vtable_size, 2);
    put(out_, 4 + 4 * fields, 2);
    for (std::size_t i = 0; i < fields; ++i) put(out_, 4 + 4 * i, 2);
    const Position table = out_.size();
    link(from);
    put(out_, table - vtable, 4);
    out_.append(4 * fields, '\0');
    return table;
  }
  static Position field(Position table, std::size_t number) { return table + 4 + 4 * number; }
  void set(Position at, std::uint64_t number) {
    for (std::size_t i = 0; i < 4; ++i) out_[at + i] = static_cast<char>(number >> (8 * i) & 255);
  }
  void text(Position from, std::string_view text) {
    align();
    link(from);
    put(out_, text.size(), 4);
    out_ += text;
    out_ += '\0';
  }
  /// A vector of references; returns where they are.
  std::vector<Position> references(Position from, std::size_t count) {
    align();
    link(from);
    put(out_, count, 4);
    std::vector<Position> positions;
    for (std::size_t i = 0; i < count; ++i) {
      positions.push_back(out_.size());
      put(out_, 0, 4);
    }
    return positions;
  }
  void numbers16(Position from, const std::vector<std::uint64_t>& numbers) {
    align();
    link(from);
    put(out_, numbers.size(), 4);
    for (const std::uint64_t number : numbers) put(out_, number, 2);
  }
  [[nodiscard]] std::string take() { return std::move(out_); }

 private:
  void align() {
    while (out_.size() % 4 != 0) out_ += '\0';
  }
  void link(Position from) { set(from, out_.size() - from); }
  std::string out_;
};

// Groot 1's numbers.
std::uint64_t category_number(Category category) {
  switch (category) {
    case Category::kAction: return 1;
    case Category::kCondition: return 2;
    case Category::kControl: return 3;
    case Category::kDecorator: return 4;
    case Category::kSubTree: return 5;
  }
  return 0;
}
std::uint64_t direction_number(const PortFact& port) { return port.input && port.output ? 2 : port.output ? 1 : 0; }

// What nodes of one registration are: Groot 1 shows of a node only those ports that its registration has.
struct Registration {
  NodeId first = 0;
  std::vector<PortFact> ports;  // of all its nodes
};

// Groot 1 looks neither for missing texts nor for missing vectors, so all are there.
void write_flat(const Tree& tree, TreeImage& image) {
  FlatBuffer buffer;
  const auto uid = [&](NodeId node) { return std::uint64_t{image.base} + node + 1; };
  const auto root = buffer.table(0, 3);
  buffer.set(FlatBuffer::field(root, 0), uid(0));
  const auto nodes = buffer.references(FlatBuffer::field(root, 1), tree.size());
  std::map<std::string, Registration, std::less<>> registrations;
  for (NodeId node = 0; node < tree.size(); ++node) {
    Registration& registration = registrations.try_emplace(id_of(tree, node), Registration{node, {}}).first->second;
    const auto table = buffer.table(nodes[node], 6);
    buffer.set(FlatBuffer::field(table, 0), uid(node));
    image.status_at.push_back(FlatBuffer::field(table, 2));
    std::vector<std::uint64_t> children;
    for (const NodeId child : tree.children(node)) children.push_back(uid(child));
    buffer.numbers16(FlatBuffer::field(table, 1), children);
    buffer.text(FlatBuffer::field(table, 3), tree.name(node));
    buffer.text(FlatBuffer::field(table, 4), id_of(tree, node));
    const auto ports = tree.ports(node);
    const auto remaps = buffer.references(FlatBuffer::field(table, 5), ports.size());
    for (std::size_t i = 0; i < ports.size(); ++i) {
      const auto remap = buffer.table(remaps[i], 2);
      buffer.text(FlatBuffer::field(remap, 0), ports[i].name);
      buffer.text(FlatBuffer::field(remap, 1), ports[i].text);
      auto& all = registration.ports;
      if (std::none_of(all.begin(), all.end(), [&](const PortFact& known) { return known.name == ports[i].name; }))
        all.push_back(ports[i]);
    }
  }
  const auto models = buffer.references(FlatBuffer::field(root, 2), registrations.size());
  std::size_t next = 0;
  for (const auto& [id, registration] : registrations) {
    const auto model = buffer.table(models[next++], 3);
    buffer.text(FlatBuffer::field(model, 0), id);
    buffer.set(FlatBuffer::field(model, 1), category_number(tree.category(registration.first)));
    const auto& facts = registration.ports;
    const auto ports = buffer.references(FlatBuffer::field(model, 2), facts.size());
    for (std::size_t i = 0; i < facts.size(); ++i) {
      const auto port = buffer.table(ports[i], 4);
      buffer.text(FlatBuffer::field(port, 0), facts[i].name);
      buffer.set(FlatBuffer::field(port, 1), direction_number(facts[i]));
      buffer.text(FlatBuffer::field(port, 2), facts[i].type);
      buffer.text(FlatBuffer::field(port, 3), "");
    }
  }
  image.flat = buffer.take();
}

}  // namespace

std::vector<std::string> instance_paths(const Tree& tree) {
  std::vector<std::string> paths(tree.size());
  std::set<std::string, std::less<>> taken{""};
  for (NodeId node = 0; node < tree.size(); ++node) {
    if (tree.category(node) != Category::kSubTree) continue;
    const NodeId outer = tree.enclosing_subtree(node);
    const std::string before = outer != bt::kNoNode ? paths[outer] + "/" : std::string();
    const std::string numbered = fmt::format("{}::{}", id_of(tree, node), uid_of(node));
    const bool is_named = tree.name(node) != tree.registration(node) && !tree.name(node).empty();
    std::string path = before + (is_named ? std::string(tree.name(node)) : numbered);
    if (taken.contains(path)) path = before + numbered;
    while (!taken.insert(path).second) path += "'";
    paths[node] = std::move(path);
  }
  return paths;
}

std::string write_xml(const Tree& tree) { return XmlWriter(tree).write(); }

Result<TreeImage> describe(const Tree& tree, std::uint16_t base) {
  if (tree.size() > kNodesMax) {
    return fail("groot.too-many-nodes",
                fmt::format("the tree has {} nodes; Groot's formats number {}", tree.size(), kNodesMax));
  }
  TreeImage image;
  image.nodes = tree.size();
  image.base = static_cast<std::uint16_t>(std::min<std::size_t>(base, kNodesMax - tree.size()));
  image.xml = write_xml(tree);
  write_flat(tree, image);
  image.boards.push_back({std::string(tree.id()), ""});
  const auto paths = instance_paths(tree);
  for (NodeId node = 0; node < tree.size(); ++node) {
    if (!paths[node].empty()) image.boards.push_back({paths[node], bt::scope_path(tree, node)});
  }
  return image;
}

Value boards(const bt::Tree& tree, const bt::State& state) {
  Map scopes;
  for (const bt::EntryFact& fact : bt::blackboard(tree, state)) {
    Value& scope = scopes[fact.scope];
    if (scope.is_null()) scope = Map{};
    scope.as_map()->append(fact.name, *fact.value);
  }
  return scopes;
}

}  // namespace sentree::groot
