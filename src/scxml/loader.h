#pragma once

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/model.h"
#include "sentree/text/xml.h"

namespace sentree::scxml {

/// A document that a chart names, seen from the outermost chart's folder.
/// @param folder  Of the chart, as `Model::folder`.
[[nodiscard]] std::string seen_from(std::string_view folder, std::string_view uri);
/// What of it is the folder, with the "/" at its end; empty: there is none.
[[nodiscard]] std::string folder_of(std::string_view uri);
/// As `load`, of a chart in a folder.
[[nodiscard]] Loaded<Chart> load_in(std::string folder, std::string_view source, std::string file,
                                    const LoadOptions& options);

/// Builds a model from a document. The work behind `load`: states in load.cpp, executable content in
/// load_content.cpp, references between states in load_resolve.cpp.
class Loader {
 public:
  /// `folder`: of the document, seen from that of the outermost one, empty or with a "/" at its end; `depth`: of charts
  /// inside charts.
  Loader(const text::XmlDocument& document, const LoadOptions& options, std::string folder = {}, int depth = 0);

  /// Null if there were errors.
  std::shared_ptr<const Model> run();
  [[nodiscard]] Diagnostics take_diagnostics() { return std::move(diagnostics_); }

 private:
  using Element = text::XmlElement;
  struct Reference;

  // States (load.cpp).
  void load_root(const Element& root);
  void load_state(const Element& element, StateIndex parent, int depth);
  void load_state_child(const Element& element, StateIndex state, int depth);
  void load_history(const Element& element, StateIndex state);
  void load_initial(const Element& element, StateIndex state);
  /// `alternative`: the <target> inside that names the target, of drafts and dialects.
  TransitionIndex load_transition(const Element& element, StateIndex source, bool pseudo, const Element& alternative);
  void load_transitions(const Element& element, StateIndex source);
  bool load_foreign_child(const Element& element, StateIndex state);
  void load_datamodel(const Element& element, StateIndex state);
  void load_invoke(const Element& element, StateIndex state);
  void load_donedata(const Element& element, StateIndex state);
  StateIndex add_state(const Element& element, StateKind kind, StateIndex parent);
  TransitionIndex add_default(StateIndex source, std::string_view targets, const Place& place, bool initial);

  // Executable content (load_content.cpp).
  Block load_block(const Element& element, int depth);
  bool load_action(const Element& element, int depth, Block& block);
  If load_if(const Element& element, int depth);
  Send load_send(const Element& element);
  Payload load_payload(const Element& element, bool with_namelist, SendInfo* info);
  Param load_param(const Element& element, SendInfo* info);
  Assign load_assign(const Element& element);
  Script load_script(const Element& element);
  Text load_text(const Element& element, std::string_view name, std::string_view expr_name,
                 Place* constant_place = nullptr);
  ExpressionId load_expression(const Element& element, std::string_view attribute, ExpressionUse use);
  ExpressionId add_expression(std::string_view text, ExpressionUse use, const Place& place);
  std::optional<Value> inline_content(const Element& element);
  Result<std::string> read(std::string_view uri) const;

  // References (load_resolve.cpp).
  void resolve();
  void resolve_targets(const Reference& reference);
  void check_targets(TransitionIndex transition, const Place& place, bool initial);
  void add_default_initials();
  void add_default_histories();
  void choose_data_model();
  void compute_domains();
  void compile_expressions();
  void look_into_scripts();
  void load_children();
  void find_ambient();
  [[nodiscard]] bool is_history_default(TransitionIndex transition) const;

  // Attributes and messages.
  [[nodiscard]] Place place(const Element& element) const;
  [[nodiscard]] Place place_at(std::size_t offset, std::size_t length) const;
  [[nodiscard]] Place attribute_place(const Element& element, std::string_view name) const;
  [[nodiscard]] Place value_place(const Element& element, std::string_view name) const;
  [[nodiscard]] bool is_scxml(const Element& element) const;
  /// What an editor keeps in a chart (Qt Creator: where arrows bend); it is nobody's action.
  [[nodiscard]] static bool is_editor_data(const Element& element);
  /// No element but the root declares namespaces, so that a name without prefix is of the root's.
  [[nodiscard]] bool only_root_declares(const Element& root) const;
  /// Nothing also where the attribute is empty.
  [[nodiscard]] static std::optional<std::string_view> given(const Element& element, std::string_view name);
  [[nodiscard]] static bool has_prefixed_attribute(const Element& element);
  std::string_view required(const Element& element, std::string_view name);
  void know_attributes(const Element& element, std::initializer_list<std::string_view> names);
  /// Text where only elements count: a tag that has lost its bracket.
  void stray_text(const Element& element);
  void unknown_element(const Element& element, std::string_view inside,
                       std::initializer_list<std::string_view> allowed);
  void error(std::string code, std::string message, const Place& where);
  /// What another engine may understand: an error, or an obstacle and a warning where the chart is only looked at.
  void refuse(std::string code, std::string message, const Place& where);
  /// A mistake, unless the chart is of a dialect that is not known here.
  void wrong(std::string code, std::string message, const Place& where);
  void warn(std::string code, std::string message, const Place& where);
  [[nodiscard]] bool too_deep(const Element& element, int depth);

  struct Reference {
    TransitionIndex transition;
    std::string ids;
    Place place;
    bool initial;          // of a state: the targets must be its descendants
    bool foreign = false;  // of an element that nobody here knows
  };

  const text::XmlDocument& document_;
  const LoadOptions& options_;
  std::unique_ptr<Model> model_;
  Diagnostics diagnostics_;
  int depth_ = 0;
  std::string_view namespace_;
  bool root_decides_ = false;
  // The place that was asked for last.
  mutable std::size_t last_offset_ = 0;
  mutable std::size_t last_line_begin_ = 0;
  mutable int last_line_ = 1;
  std::vector<Reference> references_;
  StateIndex state_ = 0;         // whose content is being read
  bool has_data_model_ = false;  // the document names one
  bool in_parts_ = false;        // the document takes states from other files
};

/// Charts inside charts that are loaded with the document; deeper ones are loaded when they are invoked.
inline constexpr int kChildDepthMax = 8;

/// A CSS2 time as SCXML has it: "1.5s", ".5s", "100ms"; nothing if it is none. A number without unit is milliseconds,
/// as Commons SCXML, SCION and uscxml take it; `has_unit` tells.
[[nodiscard]] std::optional<Duration> parse_delay(std::string_view text, bool* has_unit = nullptr);

/// Runs of white space as one space, none at the ends.
[[nodiscard]] std::string normalize_space(std::string_view text);

/// What text becomes as a value (SCXML B.2): JSON where it is JSON, XML where it is XML, else a string with white space
/// normalised.
[[nodiscard]] Value value_of_text(std::string_view text);

/// Calls `visit` for each of the names that white space separates.
template <class Visitor>
void for_each_name(std::string_view text, Visitor&& visit) {
  constexpr std::string_view kSpace = " \t\r\n";
  for (std::size_t i = text.find_first_not_of(kSpace); i < text.size(); i = text.find_first_not_of(kSpace, i)) {
    const std::size_t end = std::min(text.find_first_of(kSpace, i), text.size());
    visit(text.substr(i, end - i));
    i = end;
  }
}

}  // namespace sentree::scxml
