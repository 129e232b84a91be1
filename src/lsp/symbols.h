#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/text/xml.h"
#include "sentree/text/yaml.h"

namespace sentree::lsp {

enum class SymbolKind : std::uint8_t {
  kSkill,      ///< ID of leaves.
  kNode,       ///< A node of a tree, by its name.
  kTree,       ///< A <BehaviorTree>.
  kService,    ///< A name of `services:`.
  kInterface,  ///< FILE#SERVICE; likewise the next three.
  kMethod,     ///< FILE#SERVICE.METHOD
  kType,
  kState,  ///< Of a chart: FILE#ID; likewise the next.
  kData,
  kDefinition,  ///< `let` of a .req file: FILE#NAME, which may have dots; likewise the next.
  kEvent,
  kRequirement,  ///< A monitor, by its name.
  kLocation,     ///< Of the world, areas too.
};

/// Something that files name.
struct Symbol {
  SymbolKind kind = SymbolKind::kNode;
  std::string name;
  friend auto operator<=>(const Symbol&, const Symbol&) = default;
};

/// A place that names it: bytes of a file.
struct Occurrence {
  Symbol symbol;
  std::size_t from = 0;
  std::size_t to = 0;
  bool defines = false;
  bool in_message = false;  ///< Of a node: written as `bt::event_name` makes it.
  bool escaped = false;     ///< Written with references of XML: another text, which means the name.
};

/// What a project's files call things: what a name in one of them means is told by the others.
struct Names {
  struct Service {
    std::string file;       ///< Interface file, absolute.
    std::string interface;  ///< Its service in there.
    idl::ServicePtr service;
    friend bool operator==(const Service&, const Service&) = default;
  };
  std::map<std::string, Service, std::less<>> services;
  std::set<std::string, std::less<>> skills;                 ///< IDs.
  std::set<std::string, std::less<>> nodes;                  ///< Names that nodes of trees are given.
  std::map<std::string, std::string, std::less<>> spelled;   ///< Those that read otherwise in messages, by how.
  std::set<std::string, std::less<>> trees;                  ///< IDs.
  std::set<std::string, std::less<>> builtins;               ///< IDs of nodes that every tree may use.
  std::map<std::string, std::string, std::less<>> charts;    ///< Absolute file of a skill's chart, and the skill.
  std::map<std::string, std::string, std::less<>> leaves;    ///< Leaf, by name or ID, and the chart that it runs.
  std::map<std::string, std::string, std::less<>> monitors;  ///< Monitor, and the chart that it is; empty: none.
  std::set<std::string, std::less<>> locations;
  std::set<std::string, std::less<>> answering;  ///< States that a protocol of skills names.
  std::set<std::string, std::less<>> members;    ///< Fields of messages and arguments of calls.
  friend bool operator==(const Names&, const Names&) = default;
};

/// What is named in a file, by kind of file. `file` is its absolute path. What cannot be told is left out.
using Occurrences = std::vector<Occurrence>;
[[nodiscard]] Occurrences occurrences_in_tree(const text::XmlDocument& document, const Names& names);
[[nodiscard]] Occurrences occurrences_in_chart(const text::XmlDocument& document, const std::string& file,
                                               const Names& names);
[[nodiscard]] Occurrences occurrences_in_requirements(std::string_view text, const std::string& file,
                                                      const Names& names);
/// sentree.yaml and scenarios; `is_project`: the former.
[[nodiscard]] Occurrences occurrences_in_yaml(std::string_view text, const text::YamlNode& root, bool is_project,
                                              const std::string& folder, const Names& names);
/// Locations and areas.
[[nodiscard]] Occurrences occurrences_in_world(std::string_view text, const text::YamlNode& root);
[[nodiscard]] Occurrences occurrences_in_interface(std::string_view text, const idl::Schema& schema,
                                                   const std::string& file);

/// The name as it is written at a place of the symbol, but for `Occurrence::in_message`.
[[nodiscard]] std::string written_name(const Symbol& symbol);

/// Whether the language of requirements takes a name for one of its words.
[[nodiscard]] bool is_word_of_requirements(const std::string& name);

/// The symbol of a method: where it is declared, its base's file too.
[[nodiscard]] Symbol method_symbol(const idl::Method& method, const std::string& file);

/// An observation's name taken apart: SERVICE.METHOD.KIND or NODE.KIND.
struct Observed {
  const Names::Service* service = nullptr;
  std::string_view service_name;
  std::string_view method_name;  ///< Of a service; empty: none.
  const idl::Method* method = nullptr;
  std::string_view kind;
};
[[nodiscard]] Observed observed(std::string_view name, const Names& names);

}  // namespace sentree::lsp
