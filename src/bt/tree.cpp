#include "sentree/bt/tree.h"

#include <algorithm>

#include "sentree/bt/model.h"

namespace sentree::bt {

bool is_explicit_tag(std::string_view tag) {
  return tag == "Action" || tag == "Condition" || tag == "Control" || tag == "Decorator";
}

std::string_view to_string(Category category) {
  switch (category) {
    case Category::kControl: return "Control";
    case Category::kDecorator: return "Decorator";
    case Category::kAction: return "Action";
    case Category::kCondition: return "Condition";
    case Category::kSubTree: return "SubTree";
  }
  return "Action";
}

std::optional<std::int64_t> Model::enum_value(std::string_view name) const {
  const auto found = std::find_if(enums.begin(), enums.end(), [name](const auto& e) { return e.first == name; });
  return found != enums.end() ? std::optional(found->second) : std::nullopt;
}

Tree::Tree(std::unique_ptr<const Model> model) : model_(std::move(model)) {}
Tree::Tree(Tree&&) noexcept = default;
Tree& Tree::operator=(Tree&&) noexcept = default;
Tree::~Tree() = default;

std::size_t Tree::size() const { return model_->nodes.size(); }
std::string_view Tree::id() const { return model_->id; }
int Tree::format() const { return model_->format; }
Category Tree::category(NodeId node) const { return model_->manifest(node).category; }
std::string_view Tree::registration(NodeId node) const { return model_->manifest(node).id; }
std::string_view Tree::name(NodeId node) const { return model_->name(node); }
NodeId Tree::parent(NodeId node) const { return model_->nodes[node].parent; }

std::string Tree::path(NodeId node) const {
  if (const auto own = model_->numbered.find(node); own != model_->numbered.end()) return own->second;
  std::vector<NodeId> parts{node};
  for (NodeId at = enclosing_subtree(node); at != kNoNode; at = enclosing_subtree(at)) parts.push_back(at);
  std::string path;
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    if (!path.empty()) path += '.';
    path += name(*part);
  }
  return path;
}

std::span<const NodeId> Tree::children(NodeId node) const {
  const Node& n = model_->nodes[node];
  return std::span(model_->children).subspan(n.first_child, n.child_count);
}

NodeId Tree::subtree_end(NodeId node) const {
  while (!children(node).empty()) node = children(node).back();
  return node + 1;
}

std::string_view Tree::definition(NodeId node) const {
  return model_->strings[model_->trees[model_->infos[node].tree].id];
}
NodeId Tree::enclosing_subtree(NodeId node) const { return model_->trees[model_->infos[node].tree].subtree; }

SourceSpan Tree::span(NodeId node) const {
  const NodeInfo& info = model_->infos[node];
  const auto [line, column] = model_->lines[info.file].position(info.offset);
  return {model_->files[info.file], line, column, 0};
}

std::vector<PortFact> Tree::ports(NodeId node) const {
  const Node& n = model_->nodes[node];
  const Manifest& manifest = model_->manifest(node);
  std::vector<PortFact> facts;
  for (std::uint32_t i = 0; i < n.port_count; ++i) {
    const Binding& b = model_->bindings[n.ports + i];
    if (b.kind == Binding::Kind::kAbsent) continue;
    PortFact fact;
    fact.name = model_->strings[b.name];
    fact.text = model_->strings[b.text];
    if (b.declared != 0xFFFF) {
      const PortInfo& port = manifest.ports[b.declared];
      fact.declared = true;
      fact.type = !port.declared_type.empty() ? std::string_view(port.declared_type)
                  : port.type != nullptr      ? std::string_view(port.type->name)
                                              : std::string_view();
      fact.input = port.direction != PortDirection::kOutput;
      fact.output = port.direction != PortDirection::kInput;
    } else {
      fact.output = b.kind == Binding::Kind::kEntry;
    }
    facts.push_back(fact);
  }
  return facts;
}

std::vector<std::pair<std::string_view, std::string_view>> Tree::conditions(NodeId node) const {
  std::vector<std::pair<std::string_view, std::string_view>> out;
  const Node& n = model_->nodes[node];
  if (n.conditions == kNone) return out;
  for (std::size_t i = 0; i < Conditions::kCount; ++i) {
    const std::uint32_t use = model_->conditions[n.conditions].use[i];
    if (use != kNone) out.emplace_back(kConditionNames[i], model_->scripts[model_->uses[use].script].text);
  }
  return out;
}

bool Tree::is_unknown(NodeId node) const { return model_->nodes[node].kind == Kind::kUnknown; }

std::string_view Tree::subtree_id(NodeId node) const {
  if (category(node) != Category::kSubTree) return {};
  if (is_unknown(node)) return model_->strings[model_->nodes[node].data];
  return definition(children(node).front());
}

bool Tree::is_user(NodeId node) const { return model_->nodes[node].kind == Kind::kUser; }
bool Tree::is_external(NodeId node) const {
  const Kind kind = model_->nodes[node].kind;
  return kind == Kind::kExternalAction || kind == Kind::kExternalCondition;
}

std::span<const NodeId> Tree::external_leaves() const { return model_->externals; }

std::string Tree::event_name(NodeId leaf) const { return bt::event_name(path(leaf)); }

NodeId Tree::find(std::string_view wanted) const {
  for (NodeId node = 0; node < size(); ++node) {
    // The name is the end of the path: most nodes need no path made.
    if (!wanted.ends_with(name(node)) && !model_->numbered.contains(node)) continue;
    if (path(node) == wanted) return node;
  }
  return kNoNode;
}

std::string event_name(std::string_view path) {
  std::string name(path);
  for (char& c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool kept = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                      c == '-' || c == '.' || byte >= 0x80;
    if (!kept) c = '_';
  }
  return name;
}

}  // namespace sentree::bt
