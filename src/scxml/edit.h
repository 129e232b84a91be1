#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/scxml/chart.h"
#include "sentree/text/xml.h"

namespace sentree::scxml {

/// A place of a document that names a state in an expression or a script.
struct StateInScript {
  std::string id;        ///< As it is meant: references resolved.
  std::size_t from = 0;  ///< Bytes of the document, without the quotes.
  std::size_t to = 0;
};
/// Every In('ID') of the element's expressions and of the script that it holds, as they are written: with blanks,
/// references and CDATA. Not those of elements inside of it.
[[nodiscard]] std::vector<StateInScript> states_in_scripts(const text::XmlDocument& document,
                                                           const text::XmlElement& element);

/// What else of them may name a state: texts, of which the ids in those places are some, and every `In` that asks for a
/// state by an expression.
struct TextInScript {
  std::string text;       ///< As it is meant: references resolved.
  bool computed = false;  ///< `In` of an expression.
  std::size_t from = 0;   ///< Bytes of the document, without the quotes.
  std::size_t to = 0;
};
[[nodiscard]] std::vector<TextInScript> texts_in_scripts(const text::XmlDocument& document,
                                                         const text::XmlElement& element);

/// Gives states other ids wherever the element, or what is inside of it, names them: targets, initial states,
/// done.state.ID events, In('ID') in expressions and scripts. Not the states' own `id`. `names`: new ids by old ones.
void rename_states(const text::XmlDocument& document, const text::XmlElement& element,
                   const std::map<std::string, std::string, std::less<>>& names, text::XmlEdit& edit);

/// Changes to a chart's document. What is not touched stays as it was written, byte for byte: comments, the order of
/// attributes, and what other tools keep in them (Qt Creator's qt:editorinfo).
///
///     ChartEdit edit(chart);
///     edit.set_attribute(edit.of_state(*chart.find("open")), "qt:editorinfo", "geometry:10;20");
///     edit.rename_state(*chart.find("open"), "opened");
///     auto text = edit.apply();   // then `load` it again
///
/// An edit sees the chart as it was loaded; edits of one element's same place clash.
class ChartEdit {
 public:
  using Element = text::XmlElement;

  explicit ChartEdit(const Chart& chart);

  /// The element of a state (0: <scxml>), of a transition, or of anything else that has a place. A transition that the
  /// document does not have (an initial="…") gives the element that holds it. False: nothing begins there.
  [[nodiscard]] Element of_state(StateIndex state) const { return at(chart_.states()[state].place); }
  [[nodiscard]] Element of_transition(TransitionIndex transition) const;
  [[nodiscard]] Element at(const Place& place) const;

  void set_attribute(const Element& element, std::string_view name, std::string_view value);
  void remove_attribute(const Element& element, std::string_view name);
  /// `xml` is SCXML; it comes behind the last child, on a line of its own.
  void append_child(const Element& parent, std::string_view xml);
  void insert_before(const Element& sibling, std::string_view xml);
  void remove(const Element& element);
  /// Bytes of the document.
  void replace_text(std::size_t begin, std::size_t end, std::string text) {
    edit_.replace_text(begin, end, std::move(text));
  }

  [[nodiscard]] const text::XmlDocument& document() const { return document_; }

  /// The state's id, and everything that names it, as `rename_states`.
  /// Errors: scxml.duplicate-id, scxml.bad-attribute (no id, or white space in it).
  Result<void> rename_state(StateIndex state, std::string_view new_id);

  /// The edited document. Errors: xml.overlapping-edits, and what `load` finds wrong with it.
  [[nodiscard]] Result<std::string> apply() const;

 private:
  Chart chart_;
  text::XmlDocument document_;
  text::XmlEdit edit_;
};

}  // namespace sentree::scxml
