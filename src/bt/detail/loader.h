#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/load.h"
#include "sentree/bt/model.h"
#include "sentree/text/xml.h"

namespace sentree::bt {

/// Reads files into definitions, one per BehaviorTree, then makes instances of them. For the files of this library.
class Loader {
 public:
  explicit Loader(const LoadOptions& options) : options_(options), model_(std::make_unique<Model>()) {}

  [[nodiscard]] Loaded<Tree> load(std::string xml, const std::string& file);

 private:
  static constexpr std::size_t kHintsMax = 200;
  static constexpr std::uint32_t kSameName = kNone - 1;  ///< {=}: the entry is called like the port.
  static constexpr std::uint32_t kUnknownText = kNone - 2;
  struct Document {
    text::XmlDocument xml;
    std::filesystem::path path;
    std::uint32_t file = 0;  ///< In Model::files.
    bool found = false;      ///< Not included: it has a SubTree that another file names.
  };
  struct DefinedPort {
    std::uint32_t name = 0, text = 0;  ///< In Model::strings.
    std::uint16_t declared = 0xFFFF;
    Binding::Kind kind = Binding::Kind::kAbsent;
    bool from_default = false;
    std::uint32_t target = kNone;  ///< kLiteral: in Model::literals; kEntry: name of the entry, in Model::strings.
    const PortType* type = nullptr;
  };
  struct DefinedNode {
    std::uint32_t manifest = 0;
    std::uint32_t parent = kNone;  ///< In the definition.
    std::uint32_t child_count = 0;
    std::uint32_t first_port = 0;  ///< In Definition::ports.
    std::uint16_t port_count = 0;
    bool autoremap = false;
    bool shared = false;
    bool plain_names = false;          ///< Format 3's SubTree: the values are names, without braces.
    std::uint32_t conditions = kNone;  ///< In Definition::conditions.
    std::uint32_t data = kNone;        ///< Script: in Model::scripts; SubTree: definitions_; Loop: Model::queues.
    std::uint32_t name_offset = 0, name_length = 0;
    text::XmlElement element;
  };
  struct Definition {
    std::string id;
    text::XmlElement element;
    std::uint32_t document = 0;
    std::vector<DefinedNode> nodes;
    std::vector<DefinedPort> ports;
    std::vector<Conditions> conditions;  ///< Of scripts, not uses.
    bool reached = false;
    bool expanding = false;
    bool defined = false;
  };
  /// How the ports of the tree use the entry that lives in a cell.
  struct EntryUse {
    const PortType* type = nullptr;    ///< Of the first port, which decides in BehaviorTree.CPP.
    const PortType* strong = nullptr;  ///< Of the first port that has a strong type.
    std::uint32_t manifest = kNone;    ///< The first port's node; kNone: nobody yet.
    std::uint32_t port = 0;            ///< Its name, in Model::strings.
    std::uint32_t constant = kNone;    ///< That a SubTree gives it; in Model::constants.
    bool declared = false;             ///< Listed in Model::initial, by this very cell.
  };
  struct NodeResult {
    std::uint8_t own = 0;       ///< What its kind and its children may give; bits of corners.cpp.
    std::uint8_t total = 0;     ///< With its pre-conditions.
    std::uint32_t reached = 0;  ///< Children that can be.
  };
  struct Results {
    std::vector<NodeResult> nodes;
    bool open = false;  ///< Being found.
  };
  struct SubTreePorts {
    Ports ports;
    SourceSpan span;
  };

  // load.cpp: files, the root element, models.
  bool read_document(std::string xml, std::string file, const std::filesystem::path& path, bool found = false);
  void read_root(std::uint32_t document);
  void read_include(std::uint32_t document, const text::XmlElement& element);
  /// Reads a file that others name, unless that has been done. The error says why it cannot be had.
  Result<void> read_other(const std::filesystem::path& path, const SourceSpan& place, bool found);
  /// The definition of that ID, which may lie in another file.
  [[nodiscard]] std::uint32_t find_definition(std::string_view id, const SourceSpan& place);
  void read_models(const text::XmlElement& models);
  /// A type that takes part in no check counts as none; a default that the port's type cannot read is documentation.
  void settle_port(PortInfo& info) const;
  void read_tree(std::uint32_t document, const text::XmlElement& element);
  [[nodiscard]] int detect_format(const text::XmlElement& root);
  [[nodiscard]] std::uint32_t main_definition(const text::XmlElement& root);
  /// Of several trees none of which is said to be the main one: the first that no other uses.
  [[nodiscard]] std::uint32_t likely_main() const;

  // define.cpp: elements to definitions.
  void define(Definition& definition);
  bool define_node(Definition& definition, const text::XmlElement& element, std::uint32_t parent, std::size_t depth);
  void define_attributes(Definition& definition, DefinedNode& node, bool is_explicit);
  void define_ports(Definition& definition, DefinedNode& node, const Manifest& manifest,
                    const std::vector<text::XmlAttribute>& given);
  void define_subtree(Definition& definition, DefinedNode& node, const std::vector<text::XmlAttribute>& given);
  /// @param name  In Model::strings.
  void define_port(DefinedPort& port, const Manifest& manifest, const text::XmlElement& element, std::uint32_t name,
                   std::string_view text, const PortInfo* info);
  /// What a port's text stands for: the entry of that name (in Model::strings), kSameName, or kNone for a literal.
  std::uint32_t entry_of(std::uint32_t text);
  std::uint32_t define_script(std::string_view text, const text::XmlElement& element, std::string_view attribute);
  /// Place of a byte of a script in its file; of the script's first byte where references stand in it.
  [[nodiscard]] SourceSpan script_place(std::string_view text, const text::XmlElement& element,
                                        std::string_view attribute, std::size_t offset) const;
  void check_children(const Definition& definition, std::uint32_t index);
  /// Format 3 loads leaves with children, unless the tag says that they are leaves.
  [[nodiscard]] bool keeps_no_children(const Manifest& manifest, bool is_explicit) const;
  [[nodiscard]] std::uint32_t find_manifest(const text::XmlElement& element, bool& is_explicit);
  /// What the standard, the registry, the file or a palette says of an ID; nothing: none of them knows it.
  /// @param made  Where it is put together, if it has to be.
  [[nodiscard]] const Manifest* known_manifest(std::string_view tag, std::string_view id, Manifest& made);
  /// What an ID that they do not know is taken for; nothing: it is told why that is an error.
  [[nodiscard]] const Manifest* guessed_manifest(const text::XmlElement& element, std::string_view id, bool is_explicit,
                                                 Manifest& made);
  void tell_unknown(const text::XmlElement& element, std::string_view id, const SourceSpan& place);
  /// A node that nobody declares, as far as its element tells what it is.
  [[nodiscard]] Manifest unknown_manifest(const text::XmlElement& element, std::string_view id,
                                          const SourceSpan& place);
  /// Makes the SubTree a closed box, since its BehaviorTree is not there.
  void define_closed(Definition& definition, DefinedNode& node, std::string_view id);
  std::uint32_t add_manifest(const Manifest& manifest);
  [[nodiscard]] std::vector<std::string> known_ids() const;
  [[nodiscard]] std::vector<std::string> tree_ids() const;
  /// "did you mean", for the first findings: the search goes through all candidates each time.
  [[nodiscard]] std::string hint(std::string_view name, const std::vector<std::string>& candidates) const;
  void unknown_attribute(const text::XmlElement& element, const Manifest& manifest, std::string_view name);

  // instantiate.cpp: definitions to the model.
  /// The main tree is in a file that is not here: a closed box stands for it.
  void box_main(const text::XmlElement& root);
  bool instantiate(std::uint32_t definition, NodeId subtree, std::uint32_t scope, std::size_t depth);
  NodeId add_node(const Definition& definition, const DefinedNode& defined, NodeId parent, std::uint32_t tree);
  void bind_ports(const Definition& definition, const DefinedNode& defined, NodeId id, std::uint32_t scope);
  void bind_special(const DefinedNode& defined, NodeId id, std::uint32_t scope);
  void bind_thresholds(Node& node);
  void bind_cases(Node& node);
  void note_ticks();
  std::uint32_t bind_script(std::uint32_t script, std::uint32_t scope);
  std::uint32_t open_scope(const Definition& definition, const DefinedNode& defined, NodeId id, std::uint32_t parent);
  std::uint32_t cell(std::uint32_t scope, std::uint32_t name);
  std::uint32_t add_test_node(const Substitution::TestNode& test, const text::XmlElement& element, std::uint32_t scope);
  bool substitute(DefinedNode& defined, NodeId subtree, std::uint32_t scope, std::uint32_t& test);
  void check_substitutions(const text::XmlElement& root);
  static void bind_test(Conditions& conditions, const NumberStep& step);
  void bind_conditions(const Conditions& scripts, NodeId id, std::uint32_t scope);
  [[nodiscard]] SourceSpan span_of(NodeId id) const;
  [[nodiscard]] const std::vector<std::string>& known_skills() const { return options_.skills; }
  void declare_entry(std::uint32_t cell, const DefinedNode& defined, const DefinedPort& port);
  /// The SubTree that gives the constant, for messages: by its name, else by its ID.
  [[nodiscard]] std::string constant_of(const EntryUse& use) const;
  [[nodiscard]] SourceSpan place_of_constant(const EntryUse& use) const;
  /// Text for a port that cannot read it.
  void check_constant(const EntryUse& use, const DefinedNode& defined, const DefinedPort& port);
  /// How a number becomes one of the port's type, for messages.
  [[nodiscard]] std::string way_to_type(const EntryUse& use, const PortType& type) const;
  /// Who declared an entry first, for messages.
  [[nodiscard]] std::string declared_by(const EntryUse& use) const;
  [[nodiscard]] EntryUse& entry_use(std::uint32_t cell) {
    if (entry_uses_.size() < model_->cells.size()) entry_uses_.resize(model_->cells.size());
    return entry_uses_[cell];
  }
  [[nodiscard]] bool is_constant(std::uint32_t cell) const {
    return cell < entry_uses_.size() && entry_uses_[cell].constant != kNone;
  }
  /// Names of the enclosing SubTrees and of the node; with the node's number where the name is the ID alone.
  [[nodiscard]] std::string path_of(NodeId id, bool numbered) const;
  /// Gives leaves that are called alike their numbers, and finds those that stay alike.
  void check_leaf_names();
  void name_scopes();
  /// Makes the entries that are there before the first tick, as the ports that name them have them.
  void start_entries();
  /// What is known of a BehaviorTree that is nowhere, behind a message.
  [[nodiscard]] std::string where(std::string_view id) const {
    return options_.where_tree ? options_.where_tree(id) : "";
  }

  // check.cpp: what loads, and still deserves a word.
  [[nodiscard]] std::set<std::uint32_t> named_by_broken() const;
  void check_missing_format(std::uint32_t document);
  void check_definitions();
  void check_tree_names();
  void check_entries();
  /// What the entries of each cell hold, where everybody who writes one agrees; asked through their owner.
  void check_literal_outputs();
  void find_unwritten(const std::vector<bool>& written, const std::vector<bool>& open,
                      const std::function<std::uint32_t(std::uint32_t)>& owner);
  [[nodiscard]] std::vector<ScriptType> entry_types(const std::function<std::uint32_t(std::uint32_t)>& owner) const;

  // corners.cpp: what the nodes may return, and what a tree depends on.
  void check_corners(std::uint32_t definition);
  void check_arity(const DefinedNode& node, const Manifest& own);
  /// Ports that make every tick fail: missing, or literals that cannot be.
  void check_braces(const DefinedNode& node);
  void check_literals(const Definition& definition, const DefinedNode& node, const Manifest& own);
  std::uint8_t tree_result(std::uint32_t definition);
  void find_results(std::uint32_t definition);
  std::uint8_t result_of(const Definition& definition, const DefinedNode& node, std::span<const std::uint8_t> children,
                         std::size_t& reached);

  std::uint32_t string(std::string_view text);
  void report(Severity severity, std::string code, std::string message, SourceSpan span);
  /// An error, or a warning where the tree is only looked at.
  void missing(std::string code, std::string message, SourceSpan span) {
    report(options_.partial ? Severity::kWarning : Severity::kError, std::move(code), std::move(message),
           std::move(span));
  }
  /// How bad a wrong port is: what a palette says of somebody's node may be out of date.
  [[nodiscard]] Severity severity_of(const Manifest& manifest) const {
    return lenient_ || (options_.partial && manifest.external) ? Severity::kWarning : Severity::kError;
  }
  void error(std::string code, std::string message, SourceSpan span) {
    report(Severity::kError, std::move(code), std::move(message), std::move(span));
  }
  void warn(std::string code, std::string message, SourceSpan span) {
    report(Severity::kWarning, std::move(code), std::move(message), std::move(span));
  }

  const LoadOptions& options_;
  std::unique_ptr<Model> model_;
  Diagnostics diagnostics_;
  bool unlisted_error_ = false;
  std::vector<std::unique_ptr<Document>> documents_;
  std::set<std::string> open_files_;  ///< Being read: an include of one is a cycle.
  std::set<std::string> read_files_;
  std::size_t include_bytes_ = 0;
  std::deque<Definition> definitions_;  ///< A deque: files are read while one is in hand.
  std::map<std::string, std::uint32_t, std::less<>> definition_index_;
  std::map<std::string, Manifest, std::less<>> declared_;  ///< Action, Condition … of the TreeNodesModel.
  std::map<std::string, SubTreePorts, std::less<>> subtree_ports_;
  std::unordered_map<std::string_view, std::uint32_t> manifest_index_;
  std::map<std::tuple<std::string, Kind, Category>, std::uint32_t> same_manifest_;
  std::vector<EntryUse> entry_uses_;                    ///< By cell.
  std::vector<text::XmlElement> constant_elements_;     ///< By constant: the SubTree's.
  std::vector<std::vector<std::uint32_t>> port_names_;  ///< By manifest: its ports' names, in Model::strings.
  std::vector<std::uint32_t> entry_of_;                 ///< By string: see entry_of; kUnknownText until it is asked.
  std::vector<text::XmlAttribute> given_;               ///< Of the element in hand.
  std::vector<bool> used_;
  std::vector<Results> results_;  ///< By definition.
  std::size_t results_depth_ = 0;
  std::uint32_t document_ = 0;  ///< Of the definition in hand.
  std::string_view last_tag_;   ///< Nodes of one kind stand together.
  std::uint32_t last_manifest_ = kNone;
  std::unordered_map<std::string, std::uint32_t> script_index_;
  std::unordered_map<std::uint64_t, std::uint32_t> use_of_;  ///< Of a script in a scope: in Model::uses.
  bool missing_files_ = false;                               ///< An include is not there, or what another file has.
  bool is_cut_ = false;                                      ///< A substitution has taken the place of a branch.
  std::vector<bool> rules_used_;  ///< By LoadOptions::substitutions: some node is one that it means.
  bool lenient_ = false;          ///< In a tree that is not reached, findings about ports and scripts are warnings.
};

/// What editors keep in a file for themselves; no node.
[[nodiscard]] bool is_metadata(std::string_view tag);

/// The name inside "{entry}"; nothing if the text is a literal. Spaces around and inside the braces do not count.
[[nodiscard]] std::optional<std::string_view> entry_name(std::string_view text);

}  // namespace sentree::bt
