#include "sentree/text/xml.h"

#include <algorithm>

#include "sentree/text/detail/xml_scan.h"

namespace sentree::text {

Result<XmlDocument> XmlDocument::parse(std::string source, std::string file, const XmlOptions& options) {
  auto tree = std::make_unique<XmlTree>();
  tree->source = std::move(source);
  tree->file = std::move(file);
  tree->lines = LineIndex(tree->source);
  const auto diagnostic = [&](const XmlScan::Finding& finding, Severity severity) {
    const auto at = tree->lines.position(finding.offset);
    return Diagnostic{severity, finding.code, finding.message, {tree->file, at.line, at.column, 0}};
  };
  XmlScan scan = scan_xml(tree->source, options);
  if (scan.error) return tl::unexpected(diagnostic(*scan.error, Severity::kError));
  for (const auto& finding : scan.warnings) tree->warnings.push_back(diagnostic(finding, Severity::kWarning));
  tree->elements = std::move(scan.elements);
  tree->attributes = std::move(scan.attributes);
  tree->resolved = std::move(scan.resolved);
  return XmlDocument(std::move(tree));
}

SourceSpan XmlDocument::span_at(std::size_t offset) const {
  const auto at = tree_->lines.position(offset);
  return {tree_->file, at.line, at.column, 0};
}

std::string_view XmlElement::local_name() const {
  const std::string_view full = name();
  const auto colon = full.find(':');
  return colon == std::string_view::npos ? full : full.substr(colon + 1);
}

std::string_view XmlElement::namespace_uri() const {
  const std::string_view full = name();
  const auto colon = full.find(':');
  if (full.starts_with("xml:")) return "http://www.w3.org/XML/1998/namespace";
  std::string declaration = "xmlns";
  if (colon != std::string_view::npos) declaration += ":" + std::string(full.substr(0, colon));
  for (XmlElement e = *this; e; e = e.parent()) {
    if (const auto uri = e.attribute(declaration)) return *uri;
  }
  return {};
}

std::vector<XmlElement> XmlElement::children() const {
  std::vector<XmlElement> elements;
  for (XmlElement e = first_child(); e; e = e.next_sibling()) elements.push_back(e);
  return elements;
}

XmlElement XmlElement::child(std::string_view local) const {
  for (XmlElement e = first_child(); e; e = e.next_sibling()) {
    if (e.local_name() == local) return e;
  }
  return {};
}

std::vector<XmlAttribute> XmlElement::attributes() const {
  std::vector<XmlAttribute> all;
  for_each_attribute([&](std::string_view name, std::string_view value) { all.push_back({name, value}); });
  return all;
}

namespace {

/// The character data of a well-formed stretch without elements.
void append_text(std::string_view source, std::string& text) {
  constexpr std::string_view kCdata = "<![CDATA[";
  while (!source.empty()) {
    if (source.front() != '<') {
      const std::string_view data = source.substr(0, source.find('<'));
      source.remove_prefix(data.size());
      if (data.find_first_not_of(" \t\r\n") != std::string_view::npos) text += resolve_text(data);
      continue;
    }
    const bool cdata = source.starts_with(kCdata);
    const bool comment = source.starts_with("<!--");
    const std::string_view close = cdata ? "]]>" : comment ? "-->" : "?>";
    const std::size_t begin = cdata ? kCdata.size() : comment ? 4 : 2;
    const std::size_t end = source.find(close, begin);
    if (cdata) text += resolve_line_ends(source.substr(begin, end - begin));
    source.remove_prefix(end + close.size());
  }
}

}  // namespace

std::string XmlElement::text() const {
  std::string text;
  if (tree_ == nullptr) return text;
  const std::string_view source = tree_->source;
  std::size_t at = place().open_end;
  for (XmlElement child = first_child(); child; child = child.next_sibling()) {
    append_text(source.substr(at, child.offset() - at), text);
    at = child.end_offset();
  }
  append_text(source.substr(at, place().close_begin - at), text);
  return text;
}

std::string_view XmlElement::inner_source() const {
  if (tree_ == nullptr) return {};
  return std::string_view(tree_->source).substr(place().open_end, place().close_begin - place().open_end);
}

SourceSpan XmlElement::span_at(std::size_t begin, std::size_t length) const {
  const auto at = tree_->lines.position(begin);
  return {tree_->file, at.line, at.column, static_cast<int>(length)};
}

SourceSpan XmlElement::span() const { return span_at(offset(), name().size() + 1); }

std::size_t XmlElement::attribute_value_offset(std::string_view name) const {
  const XmlAttributePlace* const found = find(name);
  return found != nullptr ? found->value_begin : offset();
}

SourceSpan XmlElement::attribute_span(std::string_view name) const {
  const XmlAttributePlace* const found = find(name);
  return found != nullptr ? span_at(found->name_begin, name.size()) : span();
}

SourceSpan XmlElement::attribute_value_span(std::string_view name) const {
  const XmlAttributePlace* const found = find(name);
  return found != nullptr ? span_at(found->value_begin, found->value_end - found->value_begin) : span();
}

std::string xml_attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + xml_escape(value) + "\"";
}

std::string xml_escape(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\n': out += "&#10;"; break;
      case '\t': out += "&#9;"; break;
      case '\r': out += "&#13;"; break;
      default: out += c;
    }
  }
  return out;
}

}  // namespace sentree::text
