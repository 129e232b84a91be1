#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/design/text_edit.h"
#include "sentree/text/xml.h"

namespace sentree::design {

/// What was copied elsewhere, as what is inside of a root of those attributes (` a="b"`). Lines end with LF, and the
/// first is indented as the last is. `what`: "nodes". Error: design.no-nodes.
[[nodiscard]] Result<text::XmlDocument> pasted(std::string xml, std::string_view what,
                                               std::string_view attributes = {});

/// "GoToDesk" of GoToDesk_2.
[[nodiscard]] std::string_view unnumbered(std::string_view name);

/// Edits of a document that put elements in, take them out and move them, each on a line of its own where its
/// neighbours have one, indented like them; the second in a line gets one, and the first too. All are of the text as it
/// was; they do not see each other.
class ElementEdits {
 public:
  /// `document` outlives this.
  explicit ElementEdits(const text::XmlDocument& document) : document_(document) {}

  /// Before child `index` of the parent; behind all if it has fewer. Lines of `xml` after the first are indented as the
  /// first is.
  void put(const text::XmlElement& parent, std::size_t index, const std::string& xml);
  /// Copies of `nodes`, each with its `changes` of the document's text, as `put`.
  struct Copy {
    text::XmlElement node;
    TextEdits changes;
  };
  void put_copies(const text::XmlElement& parent, std::size_t index, const std::vector<Copy>& nodes);
  /// With its line, if it has one to itself. Its parent is written as one without content if it was all of it.
  void take_out(const text::XmlElement& node);
  /// `nodes` are neighbours, in their order; `open` and `close` are tags.
  void wrap(const std::vector<text::XmlElement>& nodes, const std::string& open, const std::string& close);
  /// What is in it takes its place.
  void unwrap(const text::XmlElement& node);
  /// The tag's name where it starts and where it ends.
  void rename(const text::XmlElement& node, const std::string& name);
  /// Lines after the first are indented as the element is.
  void replace(const text::XmlElement& node, const std::string& xml);

  /// As written but for `changes`, its lines after the first without the element's indentation.
  [[nodiscard]] std::string text_of(const text::XmlElement& node, const TextEdits& changes = {}) const;

  /// How much further inside than the element its children stand, as the document does it.
  [[nodiscard]] std::string indentation_step(const text::XmlElement& element) const;

  /// All of them, in order.
  [[nodiscard]] TextEdits take();

 private:
  [[nodiscard]] std::string_view source() const { return document_.source(); }
  [[nodiscard]] std::string eol() const;
  [[nodiscard]] std::size_t line_begin(std::size_t offset) const;
  [[nodiscard]] std::string indentation(std::size_t offset) const;
  [[nodiscard]] bool starts_line(std::size_t offset) const;
  [[nodiscard]] bool is_alone_on_its_line(const text::XmlElement& node) const;
  [[nodiscard]] std::vector<std::size_t> line_starts(const text::XmlElement& node, std::size_t from,
                                                     std::size_t to) const;
  [[nodiscard]] std::string indented(const text::XmlElement& node, const std::string& to,
                                     const TextEdits& changes) const;
  [[nodiscard]] std::string indented(const std::string& xml, const std::string& indentation) const;
  [[nodiscard]] std::size_t end_with_comment(std::size_t tag_end) const;
  void close_emptied();
  template <class Text>
  void put_text(const text::XmlElement& parent, std::size_t index, const Text& text_at);

  const text::XmlDocument& document_;
  TextEdits edits_;
  std::vector<text::XmlElement> taken_;
};

}  // namespace sentree::design
