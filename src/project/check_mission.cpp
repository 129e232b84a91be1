#include "sentree/project/detail/check_mission.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include <fmt/format.h>

#include "sentree/bt/types.h"
#include "sentree/text/xml.h"

namespace sentree::project {

namespace {

void warn(Diagnostics& diagnostics, std::string code, std::string message, SourceSpan span) {
  diagnostics.push_back({Severity::kWarning, std::move(code), std::move(message), std::move(span)});
}

// Text between nodes: a tag that has lost its bracket.
void check_text(const text::XmlElement& element, Diagnostics& diagnostics) {
  if (element.local_name().ends_with("_port")) return;  // what it is for
  std::string text = element.text();
  text.erase(0, text.find_first_not_of(" \t\r\n"));
  if (!text.empty()) {
    text.resize(std::min(text.size(), text.find_first_of(" \t\r\n")));
    warn(diagnostics, "check.text", fmt::format("text inside <{}> means nothing: \"{}\"", element.name(), text),
         element.span());
  }
  // The parser bounds nesting.
  for (text::XmlElement child = element.first_child(); child; child = child.next_sibling())
    check_text(child, diagnostics);
}

void check_root(const text::XmlElement& root, Diagnostics& diagnostics) {
  static const std::vector<std::string> kKnown{"BTCPP_format", "main_tree_to_execute", "project_name"};
  for (const auto& attribute : root.attributes()) {
    const std::string name(attribute.name);
    if (name.find(':') != std::string::npos || name.starts_with("xmlns")) continue;
    if (std::find(kKnown.begin(), kKnown.end(), name) != kKnown.end()) continue;
    const std::string near = did_you_mean(name, kKnown);
    warn(diagnostics, "check.unknown-attribute", fmt::format("attribute \"{}\" of <root> says nothing{}", name, near),
         root.attribute_span(name));
  }
}

// Which tree is executed may be said in sentree.yaml too; what the file says must be one all the same.
void check_main_tree(const std::vector<text::XmlDocument>& documents, Diagnostics& diagnostics) {
  std::vector<std::string> trees;
  for (const text::XmlDocument& document : documents) {
    for (text::XmlElement tree = document.root().first_child(); tree; tree = tree.next_sibling()) {
      if (tree.name() == "BehaviorTree") trees.emplace_back(tree.attribute("ID").value_or(""));
    }
  }
  for (const text::XmlDocument& document : documents) {
    const auto main = document.root().attribute("main_tree_to_execute");
    if (!main || main->empty() || std::find(trees.begin(), trees.end(), *main) != trees.end()) continue;
    const std::string near = did_you_mean(*main, trees);
    if (near.empty()) continue;  // it may lie in a file that is included
    warn(diagnostics, "check.main-tree", fmt::format("there is no BehaviorTree \"{}\"{}", *main, near),
         document.root().attribute_span("main_tree_to_execute"));
  }
}

// Types are free: they are only told where they are nearly one that is known.
void check_types(const text::XmlElement& model, Diagnostics& diagnostics) {
  static const std::vector<std::string> kKnown{"bool",  "int",    "int64_t",     "unsigned", "uint64_t",
                                               "float", "double", "std::string", "string",   "BT::NodeStatus"};
  static const std::vector<std::string> kKinds{"Action", "Condition", "Control", "Decorator", "SubTree"};
  for (text::XmlElement node = model.first_child(); node; node = node.next_sibling()) {
    const std::string kind(node.local_name());
    if (kind != "SubTreePlus" && std::find(kKinds.begin(), kKinds.end(), kind) == kKinds.end()) {
      warn(diagnostics, "check.unknown-model",
           fmt::format("<{}> declares no node; there are Action, Condition, Control, Decorator and SubTree{}", kind,
                       did_you_mean(kind, kKinds)),
           node.span());
    } else if (!node.attribute("ID")) {
      warn(diagnostics, "check.unknown-model", fmt::format("<{}> declares a node without an ID", kind), node.span());
    }
    for (text::XmlElement port = node.first_child(); port; port = port.next_sibling()) {
      static const std::vector<std::string> kAttributes{"name", "type", "default"};
      for (const text::XmlAttribute& attribute : port.attributes()) {
        const std::string name(attribute.name);
        if (std::find(kAttributes.begin(), kAttributes.end(), name) != kAttributes.end()) continue;
        const std::string near = did_you_mean(name, kAttributes);
        if (!near.empty())
          warn(diagnostics, "check.unknown-attribute",
               fmt::format("attribute \"{}\" of a port means nothing{}", name, near), port.attribute_span(name));
      }
      const std::string type(port.attribute("type").value_or(""));
      if (type.empty() || bt::type_named(type) != nullptr) continue;
      const bool is_std = type.starts_with("std::") && type.find('<') == std::string::npos;
      const std::string near = did_you_mean(type, kKnown);
      if (near.empty() && !is_std) continue;
      warn(diagnostics, "check.unknown-type", fmt::format("no type is called \"{}\"{}", type, near), port.span());
    }
  }
}

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.'; }

bool is_subtree(const text::XmlElement& element) {
  return element.name() == "SubTree" || element.name() == "SubTreePlus";
}

// Words that may name entries: those of values, and the names that a SubTree's attributes have inside.
void add_words(const text::XmlElement& element, std::set<std::string>& words) {
  for (const text::XmlAttribute& attribute : element.attributes()) {
    const std::string value(attribute.value);
    for (std::size_t at = 0; at < value.size();) {
      const auto end = std::find_if_not(value.begin() + static_cast<std::ptrdiff_t>(at), value.end(), is_word);
      const auto length = static_cast<std::size_t>(end - value.begin()) - at;
      if (length > 0) words.insert(value.substr(at, length));
      at += length + 1;
    }
    if (is_subtree(element)) words.emplace(attribute.name);
  }
  for (text::XmlElement child = element.first_child(); child; child = child.next_sibling()) add_words(child, words);
}

// What a tree is given goes by the names that it has inside, so another name reaches nothing.
class SubTreeInputs {
 public:
  explicit SubTreeInputs(const std::vector<text::XmlDocument>& documents) {
    for (const text::XmlDocument& document : documents) {
      for (text::XmlElement tree = document.root().first_child(); tree; tree = tree.next_sibling()) {
        if (tree.name() == "BehaviorTree") add_words(tree, words_[std::string(tree.attribute("ID").value_or(""))]);
      }
    }
  }

  void check(const text::XmlElement& element, Diagnostics& diagnostics) const {
    for (const text::XmlAttribute& attribute : element.attributes()) {
      if (attribute.value == "{}") {
        warn(diagnostics, "check.no-entry",
             fmt::format(
                 "\"{{}}\" names no entry of the blackboard, so it is a text of two brackets; write {}=\"{{name}}\"",
                 attribute.name),
             element.attribute_span(attribute.name));
      }
    }
    if (is_subtree(element)) check_names(element, diagnostics);
    check_own_name(element, diagnostics);
    for (text::XmlElement child = element.first_child(); child; child = child.next_sibling()) check(child, diagnostics);
  }

 private:
  // Other signs have a meaning nowhere that names of nodes are written, or stand for '_' there.
  static void check_own_name(const text::XmlElement& element, Diagnostics& diagnostics) {
    const std::string name(element.attribute("name").value_or(""));
    const char* const why = name.find('.') != std::string::npos   ? "a '.' is between the parts of a path"
                            : name.find('*') != std::string::npos ? "a '*' stands for any text where nodes are named"
                            : name.starts_with('{') && name.ends_with('}')
                                ? "a name is text, and no entry of the blackboard takes its place"
                                : nullptr;
    if (why == nullptr || element.name() == "BehaviorTree") return;
    warn(diagnostics, "check.node-name", fmt::format("name=\"{}\": {}; give the node another name", name, why),
         element.attribute_span("name"));
  }

  void check_names(const text::XmlElement& element, Diagnostics& diagnostics) const {
    const auto inside = words_.find(std::string(element.attribute("ID").value_or("")));
    if (inside == words_.end()) return;  // elsewhere
    for (const text::XmlAttribute& attribute : element.attributes()) {
      const std::string name(attribute.name);
      if (name == "ID" || name == "name" || name.starts_with("_") || inside->second.contains(name)) continue;
      std::vector<std::string> known(inside->second.begin(), inside->second.end());
      known.insert(known.end(), {"ID", "name", "_autoremap"});
      const std::string near = did_you_mean(name, known);
      if (near.empty()) continue;  // it may be given for those who read it later
      warn(diagnostics, "check.unused-input",
           fmt::format("nothing in tree \"{}\" reads or writes \"{}\"{}", inside->first, name, near),
           element.attribute_span(name));
    }
  }

  std::map<std::string, std::set<std::string>> words_;  // by tree
};

void check_declared(const bt::Tree& tree, const std::set<std::string>& declared, Diagnostics& diagnostics) {
  std::set<std::string> used;
  for (bt::NodeId node = 0; node < tree.size(); ++node) used.emplace(tree.registration(node));
  std::vector<std::string> unused;
  std::set_difference(declared.begin(), declared.end(), used.begin(), used.end(), std::back_inserter(unused));
  for (const bt::NodeId leaf : tree.external_leaves()) {
    const std::string id(tree.registration(leaf));
    if (declared.contains(id)) continue;
    const std::string near = did_you_mean(id, unused);
    if (near.empty()) continue;
    warn(diagnostics, "check.undeclared-leaf",
         fmt::format("leaf \"{}\" is not in the TreeNodesModel, and one that is there is used nowhere{}", id, near),
         tree.span(leaf));
  }
}

}  // namespace

void check_mission(const bt::Tree& tree, const std::vector<MissionSource>& files, Diagnostics& diagnostics) {
  std::optional<std::set<std::string>> declared;  // in all files together
  std::vector<text::XmlDocument> documents;
  for (const MissionSource& file : files) {
    if (auto document = text::XmlDocument::parse(file.text, file.shown)) documents.push_back(std::move(*document));
  }
  check_main_tree(documents, diagnostics);
  const SubTreeInputs inputs(documents);
  for (const text::XmlDocument& document : documents) {
    check_root(document.root(), diagnostics);
    for (text::XmlElement child = document.root().first_child(); child; child = child.next_sibling()) {
      if (child.local_name() == "BehaviorTree" || child.local_name() == "TreeNodesModel")
        check_text(child, diagnostics);
      if (child.local_name() == "BehaviorTree") inputs.check(child, diagnostics);
      if (child.local_name() != "TreeNodesModel") continue;
      check_types(child, diagnostics);
      if (!declared) declared.emplace();
      for (text::XmlElement node = child.first_child(); node; node = node.next_sibling())
        declared->emplace(node.attribute("ID").value_or(""));
    }
  }
  if (declared) check_declared(tree, *declared, diagnostics);
}

}  // namespace sentree::project
