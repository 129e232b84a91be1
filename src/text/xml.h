#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"

namespace pugi {
struct xml_node_struct;
struct xml_attribute_struct;
}  // namespace pugi

namespace sentree::text {

/// Elements inside elements that `XmlDocument::parse` accepts.
inline constexpr int kXmlNestingMax = 1000;
/// Findings that lenient parsing lets pass in one document; one more is an error.
inline constexpr std::size_t kXmlWarningsMax = 10'000;

class XmlDocument;
class XmlElement;

/// An attribute, as written. Views live as long as the document.
struct XmlAttribute {
  std::string_view name;   ///< Qualified, e.g. "qt:editorinfo".
  std::string_view value;  ///< Entities and character references resolved, white space normalised (XML 1.0, 3.3.3).
};

/// A handle to an element: two pointers, cheap to copy; valid as long as the document.
/// A default-made handle is false and has no children.
class XmlElement {
 public:
  XmlElement() = default;
  [[nodiscard]] explicit operator bool() const { return node_ != nullptr; }
  friend bool operator==(const XmlElement&, const XmlElement&) = default;

  [[nodiscard]] std::string_view name() const;           ///< Qualified name.
  [[nodiscard]] std::string_view local_name() const;     ///< Without prefix.
  [[nodiscard]] std::string_view namespace_uri() const;  ///< Resolved through the ancestors' xmlns; empty if none.
  [[nodiscard]] XmlElement parent() const;

  [[nodiscard]] XmlElement first_child() const;            ///< First child element.
  [[nodiscard]] XmlElement next_sibling() const;           ///< Next sibling element.
  [[nodiscard]] std::vector<XmlElement> children() const;  ///< Child elements.
  [[nodiscard]] XmlElement child(std::string_view local_name) const;

  [[nodiscard]] std::vector<XmlAttribute> attributes() const;  ///< In the order written, xmlns included.
  /// By qualified name. No such attribute: nothing.
  [[nodiscard]] std::optional<std::string_view> attribute(std::string_view name) const;
  /// Calls `visit(name, value)` for each attribute without allocating.
  template <class Visitor>
  void for_each_attribute(Visitor&& visit) const {
    for (auto* a = first_attribute_raw(); a != nullptr; a = next_attribute_raw(a)) visit(name_of(a), value_of(a));
  }

  /// Character data directly inside, CDATA included, comments and elements left out; concatenated.
  [[nodiscard]] std::string text() const;
  /// The source bytes between the start and the end tag, as written.
  [[nodiscard]] std::string_view inner_source() const;

  [[nodiscard]] std::size_t size() const;        ///< Elements in it, itself included.
  [[nodiscard]] std::size_t offset() const;      ///< Byte offset of the '<'.
  [[nodiscard]] std::size_t end_offset() const;  ///< One past the '>' of the end tag.
  [[nodiscard]] SourceSpan span() const;         ///< Of the '<'.
  /// Of the value's first byte, in O(attributes); the element's own offset if it has no such attribute.
  [[nodiscard]] std::size_t attribute_value_offset(std::string_view name) const;
  [[nodiscard]] SourceSpan attribute_span(std::string_view name) const;        ///< Of the attribute's name.
  [[nodiscard]] SourceSpan attribute_value_span(std::string_view name) const;  ///< Of the value's first byte.

 private:
  friend class XmlDocument;
  friend class XmlEdit;
  XmlElement(const XmlDocument* document, pugi::xml_node_struct* node) : document_(document), node_(node) {}
  [[nodiscard]] pugi::xml_attribute_struct* first_attribute_raw() const;
  [[nodiscard]] pugi::xml_attribute_struct* attribute_raw(std::string_view name) const;
  [[nodiscard]] static pugi::xml_attribute_struct* next_attribute_raw(pugi::xml_attribute_struct* attribute);
  [[nodiscard]] static std::string_view name_of(pugi::xml_attribute_struct* attribute);
  [[nodiscard]] static std::string_view value_of(pugi::xml_attribute_struct* attribute);

  const XmlDocument* document_ = nullptr;
  pugi::xml_node_struct* node_ = nullptr;
};

struct XmlOptions {
  /// Accept what other readers of Behavior Trees accept, with a warning each: '<' and a bare '&' in attribute
  /// values, prefixes that no xmlns declares.
  bool lenient = false;
};

/// A parsed, well-formed XML document that remembers its source byte for byte.
///
/// Stricter than pugixml: one root, matching tags, no duplicate attribute, no '<' in values, only the
/// five predefined entities and character references (a DTD is skipped and its entities are refused, so
/// there is no entity expansion), valid UTF-8, bound prefixes, nesting up to `kXmlNestingMax`.
class XmlDocument {
 public:
  /// Errors: xml.syntax, xml.namespace, xml.too-deep, each with line and column. Only UTF-8 is read.
  /// Cost: O(size).
  [[nodiscard]] static Result<XmlDocument> parse(std::string source, std::string file = {},
                                                 const XmlOptions& options = {});

  XmlDocument(XmlDocument&&) noexcept;
  XmlDocument& operator=(XmlDocument&&) noexcept;
  ~XmlDocument();

  [[nodiscard]] XmlElement root() const;
  [[nodiscard]] const std::string& source() const;
  [[nodiscard]] const std::string& file() const;
  [[nodiscard]] SourceSpan span_at(std::size_t offset) const;
  [[nodiscard]] const LineIndex& lines() const;
  /// What was accepted only because of `XmlOptions::lenient`.
  [[nodiscard]] const Diagnostics& warnings() const;

 private:
  friend class XmlElement;
  struct Impl;
  explicit XmlDocument(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Changes to a document as patches of its source: what is not touched stays as written, byte for byte.
class XmlEdit {
 public:
  explicit XmlEdit(const XmlDocument& document) : document_(document) {}

  /// Replaces the value in place, or adds the attribute behind the last one.
  void set_attribute(const XmlElement& element, std::string_view name, std::string_view value);
  void remove_attribute(const XmlElement& element, std::string_view name);
  /// Replaces the whole element by `xml`, which the caller made well-formed.
  void replace(const XmlElement& element, std::string_view xml);
  /// Removes the element and the white space before it.
  void remove(const XmlElement& element);
  /// Adds `xml` as the last child, on a line of its own, indented like its new siblings.
  void append_child(const XmlElement& parent, std::string_view xml);
  /// Adds `xml` before `sibling`, on a line of its own with the same indentation.
  void insert_before(const XmlElement& sibling, std::string_view xml);

  /// The edited source. Error: xml.overlapping-edits.
  [[nodiscard]] Result<std::string> apply() const;

 private:
  struct Patch {
    std::size_t begin;
    std::size_t end;
    std::string text;
  };
  const XmlDocument& document_;
  std::vector<Patch> patches_;
};

/// Where and why a text cannot be part of an XML document (XML 1.0, 2.2): the first byte that is not UTF-8, or a control
/// character. Nothing: it can.
[[nodiscard]] std::optional<std::pair<std::size_t, std::string>> first_unreadable(std::string_view source);

/// Text as it must be written inside an attribute value or between tags.
[[nodiscard]] std::string xml_escape(std::string_view text);

}  // namespace sentree::text
