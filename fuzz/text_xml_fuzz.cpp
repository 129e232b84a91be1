// Reads the bytes as XML, strictly and leniently, walks the whole document, and edits it: what was well-formed stays
// so.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "sentree/text/xml.h"

namespace {

using sentree::text::XmlDocument;
using sentree::text::XmlEdit;
using sentree::text::XmlElement;

void check(bool condition) {
  if (!condition) std::abort();
}

// In document order, without recursion.
XmlElement next(XmlElement element, const XmlElement& root) {
  if (const XmlElement child = element.first_child()) return child;
  while (element != root) {
    if (const XmlElement sibling = element.next_sibling()) return sibling;
    element = element.parent();
  }
  return {};
}

void walk(const XmlDocument& document) {
  const std::string& source = document.source();
  for (XmlElement e = document.root(); e; e = next(e, document.root())) {
    check(e.offset() < e.end_offset() && e.end_offset() <= source.size());
    check(source[e.offset()] == '<' && source[e.end_offset() - 1] == '>');
    check(e.span().line > 0 && !e.name().empty());
    static_cast<void>(e.namespace_uri());
    static_cast<void>(e.text());
    static_cast<void>(e.inner_source());
    for (const auto& attribute : e.attributes())
      check(e.attribute_span(attribute.name).line > 0 && e.attribute_value_span(attribute.name).line > 0);
  }
}

void edit(const XmlDocument& document) {
  XmlEdit edit(document);
  edit.set_attribute(document.root(), "added-by-fuzz", "a<b & \"c\"");
  edit.append_child(document.root(), "<added/>");
  const auto edited = edit.apply();
  check(edited.has_value());
  const auto again = XmlDocument::parse(*edited);
  check(again.has_value());
  check(again->root().attribute("added-by-fuzz") == "a<b & \"c\"");
  check(again->root().children().size() == document.root().children().size() + 1);
  const auto untouched = XmlEdit(document).apply();
  check(untouched.has_value() && *untouched == document.source());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string source(reinterpret_cast<const char*>(data), size);
  if (const auto document = XmlDocument::parse(source, "fuzz.xml", {.lenient = true})) walk(*document);
  if (const auto document = XmlDocument::parse(source, "fuzz.xml")) {
    walk(*document);
    if (!document->root().attribute("added-by-fuzz")) edit(*document);
  }
  return 0;
}
