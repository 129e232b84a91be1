#include "sentree/bt/groot.h"

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "sentree/bt/model.h"
#include "sentree/bt/write.h"
#include "sentree/text/xml.h"

namespace sentree::bt {

namespace {

// Little-endian, of so many bytes.
void put(std::string& out, std::uint64_t number, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) out += static_cast<char>(number >> (8 * i) & 255);
}

std::uint64_t uid(NodeId node) { return node + 1; }

Result<void> check_size(const Tree& tree) {
  if (tree.size() <= kGrootNodesMax) return {};
  return fail("bt.too-many-nodes", "the tree has " + std::to_string(tree.size()) + " nodes; Groot's formats number " +
                                       std::to_string(kGrootNodesMax));
}

std::string attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + text::xml_escape(value) + "\"";
}

// What a node is called by where it is registered; a SubTree, by its definition.
std::string id_of(const Tree& tree, NodeId node) {
  return std::string(tree.category(node) == Category::kSubTree ? tree.subtree_id(node) : tree.registration(node));
}

void write_node(std::string& out, const Tree& tree, NodeId node, const std::string& indent) {
  const std::string id = id_of(tree, node);
  const bool is_builtin = find_builtin(id, 4) != nullptr;
  const bool is_subtree = tree.category(node) == Category::kSubTree;
  const std::string tag(is_builtin && !is_subtree ? id : to_string(tree.category(node)));
  out += indent + "<" + tag;
  if (!is_builtin || is_subtree) out += attribute("ID", id);
  out += attribute("name", tree.name(node)) + attribute("_uid", std::to_string(uid(node)));
  if (is_subtree) out += attribute("_fullpath", tree.path(node));
  for (const PortFact& port : tree.ports(node)) out += attribute(port.name, port.text);
  for (const auto& [name, script] : tree.conditions(node)) out += attribute(name, script);
  const auto children = tree.children(node);
  if (is_subtree || children.empty()) {
    out += "/>\n";
    return;
  }
  out += ">\n";
  for (const NodeId child : children) write_node(out, tree, child, indent + "  ");
  out += indent + "</" + tag + ">\n";
}

void write_tree(std::string& out, const Tree& tree, std::string_view id, const std::string& path, NodeId root) {
  out += "  <BehaviorTree" + attribute("ID", id) + attribute("_fullpath", path) + ">\n";
  write_node(out, tree, root, "    ");
  out += "  </BehaviorTree>\n";
}

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
  [[nodiscard]] const std::string& bytes() const { return out_; }

 private:
  void align() {
    while (out_.size() % 4 != 0) out_ += '\0';
  }
  void link(Position from) { set(from, out_.size() - from); }
  std::string out_;
};

// Groot 1's numbers.
std::uint64_t status_number(Status status) {
  return status == Status::kSkipped ? static_cast<std::uint64_t>(Status::kIdle) : static_cast<std::uint64_t>(status);
}
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

// Groot 1 looks neither for missing texts nor for missing vectors, so all are there.
std::string groot1_tree(const Tree& tree) {
  FlatBuffer buffer;
  const auto root = buffer.table(0, 3);
  buffer.set(FlatBuffer::field(root, 0), uid(0));
  const auto nodes = buffer.references(FlatBuffer::field(root, 1), tree.size());
  std::map<std::string, NodeId, std::less<>> registrations;  // with a node of each
  for (NodeId node = 0; node < tree.size(); ++node) {
    registrations.emplace(id_of(tree, node), node);
    const auto table = buffer.table(nodes[node], 6);
    buffer.set(FlatBuffer::field(table, 0), uid(node));
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
    }
  }
  const auto models = buffer.references(FlatBuffer::field(root, 2), registrations.size());
  std::size_t next = 0;
  for (const auto& [registration, node] : registrations) {
    const auto model = buffer.table(models[next++], 3);
    buffer.text(FlatBuffer::field(model, 0), registration);
    buffer.set(FlatBuffer::field(model, 1), category_number(tree.category(node)));
    const auto facts = tree.ports(node);
    const auto ports = buffer.references(FlatBuffer::field(model, 2), facts.size());
    for (std::size_t i = 0; i < facts.size(); ++i) {
      const auto port = buffer.table(ports[i], 4);
      buffer.text(FlatBuffer::field(port, 0), facts[i].name);
      buffer.set(FlatBuffer::field(port, 1), direction_number(facts[i]));
      buffer.text(FlatBuffer::field(port, 2), facts[i].type);
      buffer.text(FlatBuffer::field(port, 3), "");
    }
  }
  return buffer.bytes();
}

std::int64_t micros(TimePoint time) { return time.time_since_epoch().count() / 1000; }

}  // namespace

std::string write_groot2_xml(const Tree& tree) {
  std::string out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<root BTCPP_format=\"4\"" +
                    attribute("main_tree_to_execute", tree.id()) + ">\n";
  write_tree(out, tree, tree.id(), "", 0);
  for (NodeId node = 0; node < tree.size(); ++node) {
    if (tree.category(node) == Category::kSubTree && !tree.is_unknown(node))
      write_tree(out, tree, id_of(tree, node), tree.path(node), tree.children(node)[0]);
  }
  std::vector<NodeModel> all = models(Registry(), true);
  std::set<std::string, std::less<>> described;
  for (const NodeModel& model : all) described.insert(model.id);
  for (NodeId node = 0; node < tree.size(); ++node) {
    const Manifest& manifest = tree.model().manifest(node);
    if (tree.category(node) == Category::kSubTree || !described.insert(manifest.id).second) continue;
    all.push_back({manifest.id, manifest.category, manifest.ports, manifest.description});
  }
  return out + write_models(all) + "</root>\n";
}

Result<std::string> write_btlog(const Tree& tree, std::span<const Transition> transitions, std::int64_t began_us) {
  if (auto fits = check_size(tree); !fits) return tl::unexpected(fits.error());
  std::string out = "BTCPP4-FileLogger2";
  out += '\x01';
  const std::string xml = write_groot2_xml(tree);
  put(out, xml.size(), 4);
  out += xml;
  put(out, static_cast<std::uint64_t>(began_us), 8);
  for (const Transition& transition : transitions) {
    put(out, static_cast<std::uint64_t>(micros(transition.time)), 6);
    put(out, uid(transition.node), 2);
    put(out, static_cast<std::uint64_t>(transition.to), 1);
  }
  return out;
}

Result<std::string> write_fbl(const Tree& tree, std::span<const Transition> transitions, std::int64_t began_us) {
  if (auto fits = check_size(tree); !fits) return tl::unexpected(fits.error());
  const std::string described = groot1_tree(tree);
  std::string out;
  put(out, described.size(), 4);
  out += described;
  for (const Transition& transition : transitions) {
    const auto at = static_cast<std::uint64_t>(began_us + micros(transition.time));
    put(out, at / 1'000'000, 4);
    put(out, at % 1'000'000, 4);
    put(out, uid(transition.node), 2);
    put(out, status_number(transition.from), 1);
    put(out, status_number(transition.to), 1);
  }
  return out;
}

}  // namespace sentree::bt
