#include "sentree/text/xml.h"

#include <algorithm>
#include <cstring>
#include <pugixml.hpp>

#include "sentree/base/assert.h"
#include "sentree/text/xml_scan.h"

namespace sentree::text {

struct XmlDocument::Impl {
  std::string source;
  std::string file;
  std::string buffer;     // pugixml's, changed by parsing in place; views of names and values point here
  std::size_t shift = 0;  // of `buffer` against `source`
  pugi::xml_document document;
  std::vector<XmlExtent> extents;
  LineIndex lines;
  Diagnostics warnings;

  /// Of the '<': pugixml tells the place of the name, one behind it.
  std::size_t begin(pugi::xml_node_struct* node) const {
    return static_cast<std::size_t>(pugi::xml_node(node).offset_debug()) + shift - 1;
  }

  const XmlExtent& extent(pugi::xml_node_struct* node) const {
    const std::size_t begin = this->begin(node);
    const auto found =
        std::lower_bound(extents.begin(), extents.end(), begin,
                         [](const XmlExtent& extent, std::size_t offset) { return extent.begin < offset; });
    SENTREE_ASSERT(found != extents.end() && found->begin == begin);
    return *found;
  }
};

namespace {

pugi::xml_node first_element(pugi::xml_node node) {
  while (node && node.type() != pugi::node_element) node = node.next_sibling();
  return node;
}

}  // namespace

XmlDocument::XmlDocument(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
XmlDocument::XmlDocument(XmlDocument&&) noexcept = default;
XmlDocument& XmlDocument::operator=(XmlDocument&&) noexcept = default;
XmlDocument::~XmlDocument() = default;

Result<XmlDocument> XmlDocument::parse(std::string source, std::string file, const XmlOptions& options) {
  auto impl = std::make_unique<Impl>();
  impl->source = std::move(source);
  impl->file = std::move(file);
  impl->lines = LineIndex(impl->source);
  const auto diagnostic = [&](const XmlScan::Finding& finding, Severity severity) {
    const auto at = impl->lines.position(finding.offset);
    return Diagnostic{severity, finding.code, finding.message, {impl->file, at.line, at.column, 0}};
  };
  XmlScan scan = scan_xml(impl->source, options);
  if (scan.error) return tl::unexpected(diagnostic(*scan.error, Severity::kError));
  for (const auto& finding : scan.warnings) impl->warnings.push_back(diagnostic(finding, Severity::kWarning));
  impl->extents = std::move(scan.extents);

  impl->shift = impl->source.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  impl->buffer = impl->source.substr(impl->shift);
  const auto parsed = impl->document.load_buffer_inplace(
      impl->buffer.data(), impl->buffer.size(),
      pugi::parse_cdata | pugi::parse_escapes | pugi::parse_wconv_attribute | pugi::parse_eol, pugi::encoding_utf8);
  if (!parsed) {
    const auto at = impl->lines.position(static_cast<std::size_t>(parsed.offset) + impl->shift);
    return fail("xml.syntax", std::string("not XML: ") + parsed.description(), {impl->file, at.line, at.column, 0});
  }
  return XmlDocument(std::move(impl));
}

XmlElement XmlDocument::root() const { return {this, first_element(impl_->document.first_child()).internal_object()}; }
const std::string& XmlDocument::source() const { return impl_->source; }
const std::string& XmlDocument::file() const { return impl_->file; }
const LineIndex& XmlDocument::lines() const { return impl_->lines; }
const Diagnostics& XmlDocument::warnings() const { return impl_->warnings; }
SourceSpan XmlDocument::span_at(std::size_t offset) const {
  const auto at = impl_->lines.position(offset);
  return {impl_->file, at.line, at.column, 0};
}

std::string_view XmlElement::name() const { return pugi::xml_node(node_).name(); }

std::string_view XmlElement::local_name() const {
  const std::string_view full = name();
  const auto colon = full.find(':');
  return colon == std::string_view::npos ? full : full.substr(colon + 1);
}

std::string_view XmlElement::namespace_uri() const {
  const std::string_view full = name();
  const auto colon = full.find(':');
  std::string declaration = "xmlns";
  if (colon != std::string_view::npos) declaration += ":" + std::string(full.substr(0, colon));
  for (XmlElement e = *this; e; e = e.parent()) {
    if (const auto uri = e.attribute(declaration)) return *uri;
  }
  return {};
}

XmlElement XmlElement::parent() const {
  const pugi::xml_node parent = pugi::xml_node(node_).parent();
  return parent.type() == pugi::node_element ? XmlElement(document_, parent.internal_object()) : XmlElement();
}

XmlElement XmlElement::first_child() const {
  return {document_, first_element(pugi::xml_node(node_).first_child()).internal_object()};
}
XmlElement XmlElement::next_sibling() const {
  return {document_, first_element(pugi::xml_node(node_).next_sibling()).internal_object()};
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

pugi::xml_attribute_struct* XmlElement::first_attribute_raw() const {
  return pugi::xml_node(node_).first_attribute().internal_object();
}
pugi::xml_attribute_struct* XmlElement::next_attribute_raw(pugi::xml_attribute_struct* attribute) {
  return pugi::xml_attribute(attribute).next_attribute().internal_object();
}
std::string_view XmlElement::name_of(pugi::xml_attribute_struct* attribute) {
  return pugi::xml_attribute(attribute).name();
}
std::string_view XmlElement::value_of(pugi::xml_attribute_struct* attribute) {
  return pugi::xml_attribute(attribute).value();
}

std::vector<XmlAttribute> XmlElement::attributes() const {
  std::vector<XmlAttribute> all;
  for_each_attribute([&](std::string_view name, std::string_view value) { all.push_back({name, value}); });
  return all;
}

std::optional<std::string_view> XmlElement::attribute(std::string_view name) const {
  auto* const a = attribute_raw(name);
  return a != nullptr ? std::optional(value_of(a)) : std::nullopt;
}

pugi::xml_attribute_struct* XmlElement::attribute_raw(std::string_view name) const {
  for (pugi::xml_attribute a = pugi::xml_node(node_).first_attribute(); a; a = a.next_attribute()) {
    const char* const written = a.name();
    if (!name.empty() && *written != name.front()) continue;
    if (std::strncmp(written, name.data(), name.size()) == 0 && written[name.size()] == '\0')
      return a.internal_object();
  }
  return nullptr;
}

// Parsing in place keeps names and values where they begin in the source.
std::size_t XmlElement::attribute_value_offset(std::string_view name) const {
  auto* const a = attribute_raw(name);
  if (a == nullptr) return offset();
  const XmlDocument::Impl& impl = *document_->impl_;
  return static_cast<std::size_t>(pugi::xml_attribute(a).value() - impl.buffer.data()) + impl.shift;
}

std::string XmlElement::text() const {
  std::string text;
  for (const pugi::xml_node child : pugi::xml_node(node_).children()) {
    if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) text += child.value();
  }
  return text;
}

std::string_view XmlElement::inner_source() const {
  if (node_ == nullptr) return {};
  const XmlExtent& extent = document_->impl_->extent(node_);
  return std::string_view(document_->impl_->source).substr(extent.open_end, extent.close_begin - extent.open_end);
}

std::size_t XmlElement::offset() const { return document_->impl_->begin(node_); }
std::size_t XmlElement::size() const {
  const auto& extents = document_->impl_->extents;
  const XmlExtent& own = document_->impl_->extent(node_);
  const auto end = std::lower_bound(extents.begin(), extents.end(), own.end,
                                    [](const XmlExtent& extent, std::size_t offset) { return extent.begin < offset; });
  return static_cast<std::size_t>(end - extents.begin()) - static_cast<std::size_t>(&own - extents.data());
}
std::size_t XmlElement::end_offset() const { return document_->impl_->extent(node_).end; }
SourceSpan XmlElement::span() const {
  SourceSpan span = document_->span_at(offset());
  span.length = static_cast<int>(name().size()) + 1;
  return span;
}

namespace {

std::optional<XmlAttributeExtent> find_attribute(const std::string& source, std::size_t tag, std::string_view name) {
  for (const XmlAttributeExtent& extent : scan_attributes(source, tag)) {
    if (std::string_view(source).substr(extent.name_begin, extent.name_end - extent.name_begin) == name) return extent;
  }
  return std::nullopt;
}

}  // namespace

SourceSpan XmlElement::attribute_span(std::string_view name) const {
  const auto extent = find_attribute(document_->source(), offset(), name);
  if (!extent) return span();
  SourceSpan place = document_->span_at(extent->name_begin);
  place.length = static_cast<int>(name.size());
  return place;
}

SourceSpan XmlElement::attribute_value_span(std::string_view name) const {
  const auto extent = find_attribute(document_->source(), offset(), name);
  if (!extent) return span();
  SourceSpan place = document_->span_at(extent->value_begin);
  place.length = static_cast<int>(extent->value_end - extent->value_begin);
  return place;
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
