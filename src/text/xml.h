#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/text/xml_tree.h"

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

/// A handle to an element: a pointer and a number, cheap to copy; valid as long as the document, also while that moves.
/// A default-made handle is false and has no children.
class XmlElement {
 public:
  XmlElement() = default;
  [[nodiscard]] explicit operator bool() const { return tree_ != nullptr; }
  friend bool operator==(const XmlElement&, const XmlElement&) = default;

  [[nodiscard]] std::string_view name() const {  ///< Qualified name.
    return tree_ != nullptr ? tree_->name(index_) : std::string_view();
  }
  [[nodiscard]] std::string_view local_name() const;     ///< Without prefix.
  [[nodiscard]] std::string_view namespace_uri() const;  ///< Resolved through the ancestors' xmlns; empty if none.
  [[nodiscard]] XmlElement parent() const {
    return tree_ != nullptr && index_ != 0 ? XmlElement(tree_, place().parent) : XmlElement();
  }

  [[nodiscard]] XmlElement first_child() const {  ///< First child element.
    return tree_ != nullptr && place().subtree_end > index_ + 1 ? XmlElement(tree_, index_ + 1) : XmlElement();
  }
  [[nodiscard]] XmlElement next_sibling() const {  ///< Next sibling element.
    if (tree_ == nullptr) return {};
    const std::uint32_t next = place().subtree_end;
    return next < tree_->elements[place().parent].subtree_end ? XmlElement(tree_, next) : XmlElement();
  }
  [[nodiscard]] std::vector<XmlElement> children() const;  ///< Child elements.
  [[nodiscard]] XmlElement child(std::string_view local_name) const;

  [[nodiscard]] std::vector<XmlAttribute> attributes() const;  ///< In the order written, xmlns included.
  /// By qualified name. No such attribute: nothing.
  [[nodiscard]] std::optional<std::string_view> attribute(std::string_view name) const {
    const XmlAttributePlace* const found = find(name);
    return found != nullptr ? std::optional(tree_->value(*found)) : std::nullopt;
  }
  /// Calls `visit(name, value)` for each attribute without allocating.
  template <class Visitor>
  void for_each_attribute(Visitor&& visit) const {
    for (const XmlAttributePlace& place : attribute_places()) visit(tree_->name(place), tree_->value(place));
  }
  /// Where they stand in the source, in the order written.
  [[nodiscard]] std::span<const XmlAttributePlace> attribute_places() const {
    if (tree_ == nullptr) return {};
    return {tree_->attributes_begin(index_), tree_->attributes_end(index_)};
  }

  /// Character data directly inside, CDATA included, comments and elements left out; concatenated. White space alone
  /// between two of them does not count.
  [[nodiscard]] std::string text() const;
  /// The source bytes between the start and the end tag, as written.
  [[nodiscard]] std::string_view inner_source() const;

  [[nodiscard]] std::size_t size() const { return place().subtree_end - index_; }  ///< Elements in it, itself included.
  [[nodiscard]] std::size_t offset() const { return place().begin; }               ///< Byte offset of the '<'.
  [[nodiscard]] std::size_t end_offset() const { return place().end; }             ///< One past the '>' of the end tag.
  [[nodiscard]] SourceSpan span() const;                                           ///< Of the '<'.
  /// Of the value's first byte, in O(attributes); the element's own offset if it has no such attribute.
  [[nodiscard]] std::size_t attribute_value_offset(std::string_view name) const;
  [[nodiscard]] SourceSpan attribute_span(std::string_view name) const;        ///< Of the attribute's name.
  [[nodiscard]] SourceSpan attribute_value_span(std::string_view name) const;  ///< Of the value's first byte.

 private:
  friend class XmlDocument;
  XmlElement(const XmlTree* tree, std::uint32_t index) : tree_(tree), index_(index) {}
  [[nodiscard]] const XmlElementPlace& place() const { return tree_->elements[index_]; }
  [[nodiscard]] const XmlAttributePlace* find(std::string_view name) const {
    for (const XmlAttributePlace& place : attribute_places()) {
      if (tree_->name(place) == name) return &place;
    }
    return nullptr;
  }
  [[nodiscard]] SourceSpan span_at(std::size_t begin, std::size_t length) const;

  const XmlTree* tree_ = nullptr;
  std::uint32_t index_ = 0;
};

struct XmlOptions {
  /// Accept what other readers of Behavior Trees accept, with a warning each: '<' and a bare '&' in attribute
  /// values, prefixes that no xmlns declares, blank lines and comments before the XML declaration.
  bool lenient = false;
};

/// A parsed, well-formed XML document that remembers its source byte for byte.
///
/// One root, matching tags, no duplicate attribute, no '<' in values, only the five predefined entities and character
/// references (a DTD is skipped and its entities are refused, so there is no entity expansion), valid UTF-8, bound
/// prefixes, nesting up to `kXmlNestingMax`.
class XmlDocument {
 public:
  /// Errors: xml.syntax, xml.namespace, xml.too-deep, each with line and column. Only UTF-8 is read.
  /// Cost: O(size).
  [[nodiscard]] static Result<XmlDocument> parse(std::string source, std::string file = {},
                                                 const XmlOptions& options = {});

  [[nodiscard]] XmlElement root() const { return {tree_.get(), 0}; }
  [[nodiscard]] const std::string& source() const { return tree_->source; }
  [[nodiscard]] const std::string& file() const { return tree_->file; }
  [[nodiscard]] SourceSpan span_at(std::size_t offset) const;
  [[nodiscard]] const LineIndex& lines() const { return tree_->lines; }
  /// What was accepted only because of `XmlOptions::lenient`.
  [[nodiscard]] const Diagnostics& warnings() const { return tree_->warnings; }

 private:
  explicit XmlDocument(std::unique_ptr<const XmlTree> tree) : tree_(std::move(tree)) {}
  std::unique_ptr<const XmlTree> tree_;
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
  /// Replaces bytes of the source; where other edits begin, these come in the order made.
  void replace_text(std::size_t begin, std::size_t end, std::string text);

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

/// Where and why a text cannot be part of an XML document (XML 1.0, 2.2): the first byte that is not UTF-8, or a
/// control character. Nothing: it can.
[[nodiscard]] std::optional<std::pair<std::size_t, std::string>> first_unreadable(std::string_view source);

/// Text as it must be written inside an attribute value or between tags.
[[nodiscard]] std::string xml_escape(std::string_view text);
/// ` name="value"`, the value escaped.
[[nodiscard]] std::string xml_attribute(std::string_view name, std::string_view value);

/// Calls `visit` with the element and with every one inside of it, in document order.
template <class Visit>
void for_each_element(const XmlElement& element, Visit&& visit) {
  visit(element);
  for (XmlElement child = element.first_child(); child; child = child.next_sibling()) for_each_element(child, visit);
}

}  // namespace sentree::text
