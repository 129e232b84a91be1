#include "sentree/design/tree_edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "sentree/base/ascii.h"
#include "sentree/base/diagnostic.h"
#include "sentree/bt/model.h"
#include "sentree/bt/tree.h"
#include "sentree/bt/write.h"
#include "sentree/design/detail/element_edits.h"
#include "sentree/text/xml.h"

namespace sentree::design {

namespace {

using text::XmlDocument;
using text::XmlElement;

constexpr std::size_t kAnyNumber = 0xFFFFFFFFU;

bool is_subtree(std::string_view tag) { return tag == "SubTree" || tag == "SubTreePlus"; }

// The tag says the category, and the ID what it is.
std::optional<bt::Category> explicit_category(std::string_view tag) {
  if (tag == "Action") return bt::Category::kAction;
  if (tag == "Condition") return bt::Category::kCondition;
  if (tag == "Control") return bt::Category::kControl;
  if (tag == "Decorator") return bt::Category::kDecorator;
  return std::nullopt;
}

std::string id_of(const XmlElement& element) {
  if (is_subtree(element.name()) || explicit_category(element.name()))
    return std::string(element.attribute("ID").value_or(""));
  return std::string(element.name());
}

std::string shown(const XmlElement& element) {
  if (element.name() == "BehaviorTree") return fmt::format("tree {}", element.attribute("ID").value_or(""));
  return std::string(element.attribute("name").value_or(id_of(element)));
}

bool is_name(std::string_view name) {
  const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0 || c == '_' || c >= 0x80; };
  return !name.empty() && is_letter(static_cast<unsigned char>(name.front())) &&
         std::all_of(name.begin(), name.end(), [&](char c) {
           const auto u = static_cast<unsigned char>(c);
           return is_letter(u) || std::isdigit(u) != 0 || c == '-' || c == '.' || c == ':';
         });
}

// As a document of their own: the nodes are the children of `parent`.
struct Pasted {
  XmlDocument document;
  XmlElement parent;
};

Result<Pasted> pasted_nodes(std::string xml) {
  auto document = pasted(std::move(xml), "nodes");
  if (!document) return tl::unexpected(document.error());
  XmlElement parent = document->root();
  const auto trees_in = [](const XmlElement& element) {
    std::vector<XmlElement> trees;
    for (const XmlElement& child : element.children()) {
      if (child.name() == "BehaviorTree") trees.push_back(child);
    }
    return trees;
  };
  if (parent.first_child().name() == "root") parent = parent.first_child();
  const auto trees = trees_in(parent);
  if (trees.size() > 1)
    return fail("design.no-nodes", fmt::format("what was copied has {} trees; paste it into the text", trees.size()));
  if (trees.size() == 1) parent = trees.front();
  for (const XmlElement& node : parent.children()) {
    if (node.name() == "root" || node.name() == "BehaviorTree" || node.name() == "TreeNodesModel" ||
        node.name() == "scxml")
      return fail("design.no-nodes", fmt::format("<{}> is no node of a tree", node.name()));
  }
  if (parent.children().empty()) return fail("design.no-nodes", "there is no node in what was copied");
  return Pasted{std::move(*document), parent};
}

// Makes the edits of one document.
class TreeEditor {
 public:
  TreeEditor(XmlDocument document, const Kinds& kinds)
      : document_(std::move(document)), kinds_(kinds), edits_(document_) {
    std::vector<XmlElement> open{document_.root()};
    while (!open.empty()) {
      const XmlElement element = open.back();
      open.pop_back();
      elements_.push_back(element);
      const auto children = element.children();
      open.insert(open.end(), children.rbegin(), children.rend());
    }
  }

  Result<GestureResult> operator()(const InsertNode& insert) {
    if (insert.subtree ? insert.id.empty() : !is_name(insert.id))
      return fail("design.bad-name", fmt::format("\"{}\" is no name of a node", insert.id));
    const auto parent = parent_of(insert.at);
    if (!parent) return tl::unexpected(parent.error());
    if (auto room = check_room(*parent, 1, {}); !room) return tl::unexpected(room.error());
    if (insert.subtree) {
      if (auto ok = check_recursion(*parent, {insert.id}); !ok) return tl::unexpected(ok.error());
    }
    std::string xml = insert.subtree ? fmt::format("<SubTree ID=\"{}\"", text::xml_escape(insert.id)) : "<" + insert.id;
    const bool is_in_messages = insert.subtree || is_leaf_in_messages(insert.id, {});
    std::string called = insert.name;
    if (auto taken = names_in_tree_of(*parent);
        is_in_messages && !called.empty() && taken.contains(bt::event_name(called)))
      called = fmt::format("{}_{}", unnumbered(called), free_number(called, taken));
    if (!called.empty()) xml += fmt::format(" name=\"{}\"", text::xml_escape(called));
    for (const auto& [name, value] : insert.ports) {
      if (!is_name(name)) return fail("design.bad-name", fmt::format("\"{}\" is no name of a port", name));
      xml += fmt::format(" {}=\"{}\"", name, text::xml_escape(value));
    }
    xml += "/>";
    edits_.put(*parent, insert.at.index, xml);
    return done(fmt::format("add {} to {}", called.empty() ? insert.id : called, shown(*parent)));
  }

  Result<GestureResult> operator()(const DeleteNode& gesture) {
    const auto node = node_at(gesture.node);
    if (!node) return tl::unexpected(node.error());
    edits_.take_out(*node);
    return done("delete " + shown(*node));
  }

  Result<GestureResult> operator()(const MoveNode& move) {
    const auto node = node_at(move.node);
    if (!node) return tl::unexpected(node.error());
    const auto parent = parent_of(move.to);
    if (!parent) return tl::unexpected(parent.error());
    if (!move.copy && is_in(*parent, *node))
      return fail("design.inside-itself", shown(*node) + " cannot go into itself");
    const bool stays = !move.copy && node->parent() == *parent;
    if (stays) {
      const auto siblings = parent->children();
      const auto own = static_cast<std::size_t>(std::find(siblings.begin(), siblings.end(), *node) - siblings.begin());
      if (move.to.index == own || move.to.index == own + 1)
        return fail("design.nothing-to-do", shown(*node) + " is there already");
    } else if (auto room = check_room(*parent, 1, {}); !room) {
      return tl::unexpected(room.error());
    }
    if (auto ok = check_recursion(*parent, subtrees_in(*node)); !ok) return tl::unexpected(ok.error());
    auto taken = move.copy ? names_in_tree_of(*parent) : std::set<std::string>();
    edits_.put_copies(*parent, move.to.index, {{*node, move.copy ? free_names(document_, *node, taken) : TextEdits()}});
    if (!move.copy) edits_.take_out(*node);
    return done((move.copy ? "copy " : "move ") + shown(*node) + (stays ? " within " : " under ") + shown(*parent));
  }

  Result<GestureResult> operator()(const WrapNode& gesture) {
    const auto node = node_at(gesture.node);
    if (!node) return tl::unexpected(node.error());
    return wrap({*node}, gesture.id);
  }

  Result<GestureResult> operator()(const UnwrapNode& unwrap) {
    const auto node = node_at(unwrap.node);
    if (!node) return tl::unexpected(node.error());
    const auto children = node->children();
    if (children.empty())
      return fail("design.nothing-to-do", fmt::format("nothing is in {}; delete it instead", shown(*node)));
    if (auto room = check_room(node->parent(), children.size(), *node); !room) return tl::unexpected(room.error());
    edits_.unwrap(*node);
    return done("unwrap " + shown(*node));
  }

  // Where `sentree fmt` has a node's name: behind its ID, or what it is.
  [[nodiscard]] std::size_t name_place(const XmlElement& node) const {
    if (!node.attribute("ID")) return node.offset() + 1 + node.name().size();
    const std::size_t value = node.attribute_value_offset("ID");
    return source().find(source()[value - 1], value) + 1;
  }

  Result<GestureResult> operator()(const SetAttribute& set) {
    const auto node = node_at(set.node);
    if (!node) return tl::unexpected(node.error());
    if (!is_name(set.name)) return fail("design.bad-name", fmt::format("\"{}\" is no name of an attribute", set.name));
    if (set.value == node->attribute(set.name)) return fail("design.nothing-to-do", "it is so already");
    text::XmlEdit edit(document_);
    if (set.value && set.name == "name" && !node->attribute("name"))
      edit.replace_text(name_place(*node), name_place(*node),
                        fmt::format(" name=\"{}\"", text::xml_escape(*set.value)));
    else if (set.value)
      edit.set_attribute(*node, set.name, *set.value);
    else
      edit.remove_attribute(*node, set.name);
    const auto text = edit.apply();
    if (!text) return tl::unexpected(text.error());
    return GestureResult{edits_between(source(), *text),
                         set.name == "name" && set.value
                             ? fmt::format("rename {} to {}", shown(*node), *set.value)
                             : fmt::format("{}{} of {}", set.value ? "set " : "remove ", set.name, shown(*node))};
  }

  Result<GestureResult> operator()(const ExtractTree& extract) {
    const auto node = node_at(extract.node);
    if (!node) return tl::unexpected(node.error());
    if (auto free = check_new_tree(extract.id); !free) return tl::unexpected(free.error());
    XmlElement tree = node->parent();
    while (tree.name() != "BehaviorTree") tree = tree.parent();
    const std::string step = edits_.indentation_step(document_.root());
    std::string inner;
    for (const char c : edits_.text_of(*node)) inner += c == '\n' ? "\n" + step : std::string(1, c);
    const auto siblings = document_.root().children();
    const auto own = static_cast<std::size_t>(std::find(siblings.begin(), siblings.end(), tree) - siblings.begin());
    const bool format4 = document_.root().attribute("BTCPP_format").value_or("") == "4";
    edits_.replace(*node, fmt::format("<SubTree ID=\"{}\" {}_autoremap=\"true\"/>", extract.id, format4 ? "" : "_"));
    edits_.put(document_.root(), own + 1,
               fmt::format("<BehaviorTree ID=\"{}\">\n{}{}\n</BehaviorTree>", extract.id, step, inner));
    return done(fmt::format("make a tree {} of {}", extract.id, shown(*node)));
  }

  Result<GestureResult> operator()(const InlineTree& gesture) {
    const auto node = node_at(gesture.node);
    if (!node) return tl::unexpected(node.error());
    if (!is_subtree(node->name())) return fail("design.arity", shown(*node) + " is no SubTree");
    const std::string id = id_of(*node);
    const XmlElement tree = tree_of(id);
    if (!tree || !tree.first_child())
      return fail("design.no-such-node", fmt::format("the tree {} is not in this file, or empty", id));
    // What its entries are called inside is what they are called outside.
    const auto is_flag = [&](std::string_view name) {
      return node->attribute(name).value_or("") == "true" || node->attribute(name).value_or("") == "1";
    };
    bool renames = !is_flag("_autoremap") && !is_flag("__autoremap") && !is_flag("__shared_blackboard") &&
                   tree.inner_source().find('{') != std::string_view::npos;
    node->for_each_attribute([&](std::string_view name, std::string_view value) {
      const bool same = value == fmt::format("{{{}}}", name);
      renames = renames || (name != "ID" && name != "name" && !name.starts_with('_') && !same);
    });
    if (renames)
      return fail("design.arity", shown(*node) + " has entries of its own: remap them alike (_autoremap) first");
    std::size_t uses = 0;
    for (const XmlElement& element : elements_) uses += is_subtree(element.name()) && id_of(element) == id ? 1 : 0;
    auto taken = names_in_tree_of(*node);
    edits_.replace(*node, edits_.text_of(tree.first_child(), free_names(document_, tree.first_child(), taken)));
    const bool is_main = document_.root().attribute("main_tree_to_execute").value_or("") == id;
    if (uses == 1 && !is_main && tree.children().size() == 1 && !is_in(*node, tree)) edits_.take_out(tree);
    return done(fmt::format("put the tree {} in the place of {}", id, shown(*node)));
  }

  Result<GestureResult> operator()(const PasteNodes& paste) {
    const auto parent = parent_of(paste.at);
    if (!parent) return tl::unexpected(parent.error());
    const auto read = pasted_nodes(paste.xml);
    if (!read) return tl::unexpected(read.error());
    const auto nodes = read->parent.children();
    if (auto room = check_room(*parent, nodes.size(), {}); !room) return tl::unexpected(room.error());
    const ElementEdits written(read->document);
    auto taken = names_in_tree_of(*parent);
    std::string xml;
    for (const XmlElement& node : nodes) {
      if (auto ok = check_recursion(*parent, subtrees_in(node)); !ok) return tl::unexpected(ok.error());
      xml += (xml.empty() ? "" : "\n") + written.text_of(node, free_names(read->document, node, taken));
    }
    edits_.put(*parent, paste.at.index, xml);
    const std::string what = nodes.size() == 1 ? shown(nodes.front()) : fmt::format("{} nodes", nodes.size());
    return done(fmt::format("paste {} under {}", what, shown(*parent)));
  }

  Result<GestureResult> operator()(const AddTree& add) {
    if (auto free = check_new_tree(add.id); !free) return tl::unexpected(free.error());
    const auto siblings = document_.root().children();
    std::size_t behind = 0;
    for (std::size_t i = 0; i < siblings.size(); ++i) {
      if (siblings[i].name() == "BehaviorTree") behind = i + 1;
    }
    edits_.put(document_.root(), behind, fmt::format("<BehaviorTree ID=\"{}\"/>", add.id));
    return done("add a tree " + add.id);
  }

  Result<GestureResult> operator()(const DeleteTree& gesture) {
    const auto tree = element_at(gesture.tree);
    if (!tree) return tl::unexpected(tree.error());
    if (tree->name() != "BehaviorTree")
      return fail("design.no-such-node", fmt::format("<{}> is no tree", tree->name()));
    const std::string id(tree->attribute("ID").value_or(""));
    if (document_.root().attribute("main_tree_to_execute").value_or("") == id)
      return fail("design.used", fmt::format("the tree {} is the main one", id));
    const auto trees = document_.root().children();
    if (std::count_if(trees.begin(), trees.end(), [](const auto& one) { return one.name() == "BehaviorTree"; }) == 1)
      return fail("design.used", fmt::format("the tree {} is the only one of the file", id));
    std::size_t uses = 0;
    for (const XmlElement& element : elements_)
      uses += is_subtree(element.name()) && id_of(element) == id && !is_in(element, *tree) ? 1 : 0;
    if (uses > 0)
      return fail("design.used", fmt::format("{} SubTree{} of the tree {}; delete {} first", uses,
                                             uses == 1 ? " is" : "s are", id, uses == 1 ? "it" : "them"));
    edits_.take_out(*tree);
    return done("delete the tree " + id);
  }

  Result<GestureResult> operator()(const EditNodes& edit) {
    std::vector<std::uint32_t> numbers = edit.nodes;
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    if (numbers.empty()) return fail("design.nothing-to-do", "no node is chosen");
    for (const std::uint32_t number : numbers) {
      if (const auto node = node_at(number); !node) return tl::unexpected(node.error());
    }
    return std::visit([&](const auto& gesture) { return on_several(gesture, numbers); }, edit.gesture);
  }

 private:
  // The same gesture on each. From the last to the first: the numbers of those before it stay as they are.
  template <class Gesture>
  Result<GestureResult> on_each(Gesture gesture, const std::vector<std::uint32_t>& numbers, std::string name) const {
    std::string text(source());
    for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) {
      auto document = XmlDocument::parse(text, {}, {.lenient = true});
      if (!document) return tl::unexpected(document.error());
      gesture.node = *number;
      const auto edited = TreeEditor(std::move(*document), kinds_)(gesture);
      if (!edited) return tl::unexpected(edited.error());
      auto after = with_edits(text, edited->edits);
      if (!after) return tl::unexpected(after.error());
      text = std::move(*after);
    }
    return GestureResult{edits_between(source(), text), std::move(name)};
  }

  // What is inside of another one of them goes along with it.
  [[nodiscard]] std::vector<std::uint32_t> outermost(const std::vector<std::uint32_t>& numbers) const {
    std::vector<std::uint32_t> found;
    for (const std::uint32_t number : numbers) {
      if (found.empty() || number >= found.back() + elements_[found.back()].size()) found.push_back(number);
    }
    return found;
  }
  static std::string count_of(const std::vector<std::uint32_t>& numbers) {
    return fmt::format("{} nodes", numbers.size());
  }

  Result<GestureResult> on_several(const DeleteNode&, const std::vector<std::uint32_t>& all) {
    const auto numbers = outermost(all);
    if (numbers.size() == 1) return (*this)(DeleteNode{numbers.front()});
    for (const std::uint32_t number : numbers) edits_.take_out(elements_[number]);
    return done("delete " + count_of(numbers));
  }

  Result<GestureResult> on_several(const UnwrapNode& gesture, const std::vector<std::uint32_t>& numbers) {
    if (numbers.size() == 1) return (*this)(UnwrapNode{numbers.front()});
    return on_each(gesture, numbers, "unwrap " + count_of(numbers));
  }

  Result<GestureResult> on_several(SetAttribute set, std::vector<std::uint32_t> numbers) {
    if (numbers.size() > 1 && set.name == "name")
      return fail("design.bad-name", fmt::format("{} cannot have one name", count_of(numbers)));
    const auto has_it = [&](std::uint32_t number) { return elements_[number].attribute(set.name) == set.value; };
    if (!std::all_of(numbers.begin(), numbers.end(), has_it)) std::erase_if(numbers, has_it);
    if (numbers.size() == 1) {
      set.node = numbers.front();
      return (*this)(set);
    }
    auto done =
        on_each(set, numbers, fmt::format("{}{} of {}", set.value ? "set " : "remove ", set.name, count_of(numbers)));
    if (done) done->nodes = numbers;
    return done;
  }

  Result<GestureResult> on_several(const WrapNode& gesture, const std::vector<std::uint32_t>& all) {
    const auto numbers = outermost(all);
    const XmlElement parent = elements_[numbers.front()].parent();
    std::vector<XmlElement> nodes;
    for (const std::uint32_t number : numbers) {
      nodes.push_back(elements_[number]);
      if (elements_[number].parent() != parent)
        return fail("design.arity", fmt::format("{} and {} are in different nodes; what is wrapped stands side by side",
                                                shown(nodes.front()), shown(nodes.back())));
    }
    const auto siblings = parent.children();
    auto sibling = std::find(siblings.begin(), siblings.end(), nodes.front());
    for (const XmlElement& node : nodes) {
      if (*sibling != node)
        return fail("design.arity", fmt::format("{} stands between them; choose it too", shown(*sibling)));
      ++sibling;
    }
    auto done = wrap(nodes, gesture.id);
    if (done) done->nodes = {numbers.front()};
    return done;
  }

  Result<GestureResult> on_several(const MoveNode& move, const std::vector<std::uint32_t>& all) {
    const auto numbers = outermost(all);
    if (numbers.size() == 1) {
      MoveNode one = move;
      one.node = numbers.front();
      return (*this)(one);
    }
    const auto parent = parent_of(move.to);
    if (!parent) return tl::unexpected(parent.error());
    std::size_t more = 0;
    auto taken = move.copy ? names_in_tree_of(*parent) : std::set<std::string>();
    std::vector<ElementEdits::Copy> copies;
    for (const std::uint32_t number : numbers) {
      const XmlElement& node = elements_[number];
      if (!move.copy && is_in(*parent, node))
        return fail("design.inside-itself", shown(node) + " cannot go into itself");
      if (auto ok = check_recursion(*parent, subtrees_in(node)); !ok) return tl::unexpected(ok.error());
      more += move.copy || node.parent() != *parent ? 1 : 0;
      copies.push_back({node, move.copy ? free_names(document_, node, taken) : TextEdits()});
    }
    if (auto room = check_room(*parent, more, {}); more > 0 && !room) return tl::unexpected(room.error());
    const auto siblings = parent->children();
    if (more == 0) {
      const auto first = std::find(siblings.begin(), siblings.end(), elements_[numbers.front()]);
      const auto last = std::find(first, siblings.end(), elements_[numbers.back()]);
      const auto index = siblings.begin() + static_cast<std::ptrdiff_t>(move.to.index);
      if (last - first + 1 == std::ssize(numbers) && index >= first && index <= last + 1)
        return fail("design.nothing-to-do", "they are there already");
    }
    // Where the first of them comes to stand.
    std::uint32_t at = move.to.parent + 1;
    for (std::size_t i = 0; i < move.to.index; ++i) at += static_cast<std::uint32_t>(siblings[i].size());
    edits_.put_copies(*parent, move.to.index, copies);
    if (!move.copy) {
      std::uint32_t before = 0;  // what goes from before the place
      for (const std::uint32_t number : numbers) {
        edits_.take_out(elements_[number]);
        before += number < at ? static_cast<std::uint32_t>(elements_[number].size()) : 0;
      }
      at -= before;
    }
    auto result = done(fmt::format("{} {} under {}", move.copy ? "copy" : "move", count_of(numbers), shown(*parent)));
    for (const std::uint32_t number : numbers) {
      result.nodes.push_back(at);
      at += static_cast<std::uint32_t>(elements_[number].size());
    }
    return result;
  }

  Result<GestureResult> wrap(const std::vector<XmlElement>& nodes, const std::string& id) {
    if (!is_name(id)) return fail("design.bad-name", fmt::format("\"{}\" is no name of a node", id));
    const bt::NodeModel* model = kinds_.model(id);
    if (model == nullptr) return fail("design.no-such-node", fmt::format("nobody says what {} is", id));
    const std::size_t most = kinds_.kind(id, *model).children_max;
    if (most == 0) return fail("design.arity", id + " is a leaf: nothing can be in it");
    if (nodes.size() > most)
      return fail("design.arity",
                  most == 1 ? id + " takes one child only" : fmt::format("{} takes {} children at most", id, most));
    edits_.wrap(nodes, fmt::format("<{}>", id), fmt::format("</{}>", id));
    return done(fmt::format("wrap {} in {}",
                            nodes.size() == 1 ? shown(nodes.front()) : fmt::format("{} nodes", nodes.size()), id));
  }

  [[nodiscard]] std::string_view source() const { return document_.source(); }

  [[nodiscard]] XmlElement tree_of(std::string_view id) const {
    for (const XmlElement& tree : document_.root().children()) {
      if (tree.name() == "BehaviorTree" && tree.attribute("ID").value_or("") == id) return tree;
    }
    return {};
  }

  GestureResult done(std::string name) { return {edits_.take(), std::move(name)}; }

  Result<XmlElement> element_at(std::uint32_t number) const {
    if (number < elements_.size()) return elements_[number];
    return fail("design.no-such-node", "there is no such node in the text as it is now");
  }

  // A node of a tree, not the document around it.
  Result<XmlElement> node_at(std::uint32_t number) const {
    auto element = element_at(number);
    if (!element) return element;
    for (XmlElement above = element->parent(); above; above = above.parent()) {
      if (above.name() == "BehaviorTree") return element;
    }
    return fail("design.no-such-node", fmt::format("<{}> is no node of a tree", element->name()));
  }

  Result<XmlElement> parent_of(const Slot& slot) const {
    auto element = element_at(slot.parent);
    if (!element) return element;
    if (element->name() != "BehaviorTree") {
      element = node_at(slot.parent);
      if (!element) return element;
    }
    if (slot.index > element->children().size())
      return fail("design.no-such-node", shown(*element) + " has fewer children than that");
    return element;
  }

  static bool is_in(XmlElement element, const XmlElement& above) {
    for (; element; element = element.parent()) {
      if (element == above) return true;
    }
    return false;
  }

  // Whether `count` more children fit, `instead` of one that is there if it is given.
  Result<void> check_room(const XmlElement& parent, std::size_t count, const XmlElement& instead) const {
    const std::size_t there = parent.children().size() - (instead ? 1 : 0);
    if (parent.name() == "BehaviorTree") {
      if (there + count <= 1) return {};
      return fail("design.arity",
                  fmt::format("a tree has one root; wrap {} in a control node first", shown(parent.first_child())));
    }
    const std::string id = id_of(parent);
    if (is_subtree(parent.name()))
      return fail("design.arity", fmt::format("{} is a SubTree: its nodes are in the tree {}", shown(parent), id));
    const bt::NodeModel* model = kinds_.model(id);
    const auto category = explicit_category(parent.name());
    if (model == nullptr && (!category || *category == bt::Category::kAction || *category == bt::Category::kCondition))
      return fail("design.arity", shown(parent) + " takes no children, as far as anybody says");
    bt::NodeModel said;
    said.category = category.value_or(bt::Category::kControl);
    const Kinds::Kind kind = kinds_.kind(id, model != nullptr ? *model : said);
    if (there + count <= kind.children_max) return {};
    if (kind.children_max == 0) {
      return fail("design.arity", fmt::format("{} is {}: it has no children", shown(parent),
                                              kind.category == bt::Category::kCondition ? "a condition" : "an action"));
    }
    return fail("design.arity",
                fmt::format("{} takes {}{}", shown(parent),
                            kind.children_max == 1 ? "one child" : fmt::format("{} children", kind.children_max),
                            kind.children_max == 1 ? " only, and has it" : " at most"));
  }

  static std::set<std::string> subtrees_in(const XmlElement& node) {
    std::set<std::string> found;
    std::vector<XmlElement> open{node};
    while (!open.empty()) {
      const XmlElement element = open.back();
      open.pop_back();
      if (is_subtree(element.name())) found.insert(id_of(element));
      const auto children = element.children();
      open.insert(open.end(), children.begin(), children.end());
    }
    return found;
  }

  // Leaves that are no built-in nodes, by what they are.
  [[nodiscard]] bool is_leaf_in_messages(const std::string& id, std::optional<bt::Category> said) const {
    constexpr int kFormat = 4;
    if (bt::find_builtin(id, kFormat) != nullptr) return false;
    const bt::NodeModel* const model = kinds_.model(id);
    const bt::Category category = said.value_or(model != nullptr ? model->category : bt::Category::kAction);
    return category == bt::Category::kAction || category == bt::Category::kCondition;
  }
  // What messages are told apart by: names of such leaves, and of SubTrees.
  // BehaviorTree.CPP refuses a tree with the name of a node.
  [[nodiscard]] Result<void> check_new_tree(const std::string& id) const {
    if (!is_name(id)) return fail("design.bad-name", fmt::format("\"{}\" is no name of a tree", id));
    if (tree_of(id)) return fail("design.bad-name", fmt::format("there is a tree {} already", id));
    const bt::NodeModel* const model = kinds_.model(id);
    const bool is_used = std::any_of(elements_.begin(), elements_.end(), [&](const XmlElement& element) {
      return element.name() == id ||
             (explicit_category(element.name()) && element.name() != "SubTree" && id_of(element) == id);
    });
    if (is_subtree(id) || is_used || (model != nullptr && model->category != bt::Category::kSubTree))
      return fail("design.bad-name", fmt::format("{} is the name of a node; a tree needs another", id));
    return {};
  }

  [[nodiscard]] bool is_named_in_messages(const XmlElement& node) const {
    return is_subtree(node.name()) ||
           (!node.first_child() && is_leaf_in_messages(id_of(node), explicit_category(node.name())));
  }

  // As they read in messages.
  static std::set<std::string> names_in_tree_of(XmlElement node) {
    while (node.name() != "BehaviorTree") node = node.parent();
    std::set<std::string> names;
    text::for_each_element(node, [&](const XmlElement& one) { names.insert(bt::event_name(shown(one))); });
    return names;
  }

  // The first with which the name is free; it is taken then.
  static int free_number(std::string_view name, std::set<std::string>& taken) {
    int number = 2;
    while (!taken.insert(bt::event_name(fmt::format("{}_{}", unnumbered(name), number))).second) ++number;
    return number;
  }

  // Those of a copy that are `taken` already, followed by the first free number: GoToDesk_2.
  [[nodiscard]] TextEdits free_names(const XmlDocument& document, const XmlElement& copied,
                                     std::set<std::string>& taken) const {
    TextEdits edits;
    text::for_each_element(copied, [&](const XmlElement& node) {
      const auto name = node.attribute("name");
      if (!name || name->empty() || !is_named_in_messages(node)) return;
      if (taken.insert(bt::event_name(*name)).second) return;
      const int number = free_number(*name, taken);
      for (const text::XmlAttributePlace& place : node.attribute_places()) {
        const std::string_view all = document.source();
        if (all.substr(place.name_begin, place.name_end - place.name_begin) != "name") continue;
        const std::string_view written = all.substr(place.value_begin, place.value_end - place.value_begin);
        const std::size_t kept = place.value_begin + unnumbered(written).size();
        edits.push_back({kept, place.value_end, fmt::format("_{}", number)});
      }
    });
    return edits;
  }

  // Refuses that a tree contains itself, directly or through others of this file.
  Result<void> check_recursion(const XmlElement& parent, std::set<std::string> called) const {
    XmlElement tree = parent;
    while (tree && tree.name() != "BehaviorTree") tree = tree.parent();
    if (!tree) return {};
    const std::string own(tree.attribute("ID").value_or(""));
    for (bool grew = true; grew;) {
      grew = false;
      for (const XmlElement& other : document_.root().children()) {
        if (other.name() != "BehaviorTree" || !called.contains(std::string(other.attribute("ID").value_or(""))))
          continue;
        for (const std::string& id : subtrees_in(other)) grew = called.insert(id).second || grew;
      }
    }
    if (!called.contains(own)) return {};
    return fail("design.inside-itself", fmt::format("the tree {} would contain itself", own));
  }

  XmlDocument document_;
  const Kinds& kinds_;
  std::vector<XmlElement> elements_;
  ElementEdits edits_;
};

// What the file itself declares, before what the project says.
Kinds kinds_for(const XmlDocument& document, const Kinds& kinds) {
  std::vector<bt::NodeModel> models;
  for (const XmlElement& element : document.root().children()) {
    if (element.name() != "TreeNodesModel") continue;
    for (const XmlElement& described : element.children()) {
      if (auto model = bt::read_model(described)) models.push_back(std::move(*model));
    }
  }
  for (const auto& [id, model] : kinds.palette().nodes()) models.push_back(model);
  return Kinds(models);
}

Result<XmlDocument> parse_tree(std::string_view xml, const std::string& file) {
  auto document = XmlDocument::parse(std::string(xml), file, {.lenient = true});
  if (document && document->root().name() != "root")
    return fail("bt.not-a-tree", fmt::format("<{}> is no file of trees", document->root().name()), {file, 1});
  return document;
}

}  // namespace

Kinds::Kinds(const std::vector<bt::NodeModel>& own) {
  palette_.add(own);
  palette_.add(bt::models(bt::Registry(), true));
}

Kinds::Kind Kinds::kind(std::string_view id, const bt::NodeModel& model) const {
  Kind kind{model.category};
  constexpr int kFormat = 4;
  if (const bt::Manifest* builtin = bt::find_builtin(id, kFormat);
      builtin != nullptr && builtin->category == model.category) {
    kind.children_min = builtin->children_min;
    kind.children_max = builtin->children_max;
  } else if (model.category == bt::Category::kControl) {
    kind.children_min = 1;
    kind.children_max = kAnyNumber;
  } else if (model.category == bt::Category::kDecorator) {
    kind.children_min = kind.children_max = 1;
  }
  return kind;
}

Result<Outline> outline_of(std::string_view xml, const Kinds& given, const std::string& file) {
  const auto document = parse_tree(xml, file);
  if (!document) return tl::unexpected(document.error());
  const Kinds kinds = kinds_for(*document, given);
  Outline outline;
  outline.main = document->root().attribute("main_tree_to_execute").value_or("");
  struct Open {
    XmlElement element;
    int parent = -1;  // -2: no node of a tree
  };
  std::vector<Open> open{{document->root(), -2}};
  std::uint32_t number = 0;
  while (!open.empty()) {
    const auto [element, parent] = open.back();
    open.pop_back();
    const std::uint32_t own = number++;
    int inside = -2;
    if (element.name() == "BehaviorTree") {
      outline.trees.push_back(
          {own, std::string(element.attribute("ID").value_or("")), element.offset(), element.end_offset(), {}});
      inside = -1;
    } else if (parent != -2) {
      OutlineTree& tree = outline.trees.back();
      OutlineNode node;
      node.element = own;
      node.parent = parent;
      node.id = id_of(element);
      node.name = element.attribute("name").value_or("");
      const auto category = explicit_category(element.name());
      const bt::NodeModel* model = kinds.model(node.id);
      if (is_subtree(element.name())) {
        node.category = bt::Category::kSubTree;
      } else if (model != nullptr || category) {
        bt::NodeModel said;
        said.category = category.value_or(bt::Category::kAction);
        const Kinds::Kind kind = kinds.kind(node.id, model != nullptr ? *model : said);
        node.category = kind.category;
        node.children_min = kind.children_min;
        node.children_max = kind.children_max;
        node.known = model != nullptr;
      } else {
        node.known = false;
        if (element.first_child()) node.category = bt::Category::kControl;
      }
      node.from = element.offset();
      node.open_end = static_cast<std::size_t>(element.inner_source().data() - document->source().data());
      if (element.inner_source().empty()) node.open_end = std::min(node.open_end, element.end_offset());
      node.to = element.end_offset();
      element.for_each_attribute([&](std::string_view name, std::string_view value) {
        if (name != "ID" && name != "name") node.attributes.emplace_back(name, value);
      });
      inside = static_cast<int>(tree.nodes.size());
      tree.nodes.push_back(std::move(node));
    }
    const auto children = element.children();
    for (auto child = children.rbegin(); child != children.rend(); ++child) open.push_back({*child, inside});
  }
  return outline;
}

Result<GestureResult> edit_tree(std::string_view xml, const TreeGesture& gesture, const Kinds& given,
                                const std::string& file) {
  auto document = parse_tree(xml, file);
  if (!document) return tl::unexpected(document.error());
  const Kinds kinds = kinds_for(*document, given);
  return std::visit(TreeEditor(std::move(*document), kinds), gesture);
}

}  // namespace sentree::design
