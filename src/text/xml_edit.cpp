#include <algorithm>
#include <utility>

#include "sentree/text/encoding.h"
#include "sentree/text/xml.h"

namespace sentree::text {

namespace {

bool is_blank(char c) { return c == ' ' || c == '\t'; }

// The start of the run of white space that ends at `offset`.
std::size_t space_before(const std::string& source, std::size_t offset) {
  while (offset > 0 && (is_blank(source[offset - 1]) || source[offset - 1] == '\n' || source[offset - 1] == '\r'))
    --offset;
  return offset;
}

// The blanks that `offset`'s line begins with, if nothing else stands before it.
std::string indentation(const std::string& source, std::size_t offset) {
  std::size_t begin = offset;
  while (begin > 0 && is_blank(source[begin - 1])) --begin;
  return begin == 0 || source[begin - 1] == '\n' ? source.substr(begin, offset - begin) : std::string();
}

// As an attribute value in the quotes that it will stand in.
std::string escape_value(std::string_view value, char quote) {
  std::string escaped = xml_escape(value);
  if (quote == '"') return escaped;
  std::string out;
  for (const char c : escaped) out += c == '\'' ? "&apos;" : std::string(1, c);
  return out;
}

}  // namespace

void XmlEdit::set_attribute(const XmlElement& element, std::string_view name, std::string_view value) {
  const std::string& source = document_.source();
  const auto places = element.attribute_places();
  for (const XmlAttributePlace& place : places) {
    if (std::string_view(source).substr(place.name_begin, place.name_end - place.name_begin) != name) continue;
    patches_.push_back({place.value_begin, place.value_end, escape_value(value, source[place.value_begin - 1])});
    return;
  }
  const std::size_t at = places.empty() ? element.offset() + 1 + element.name().size() : places.back().value_end + 1;
  patches_.push_back({at, at, xml_attribute(name, value)});
}

void XmlEdit::remove_attribute(const XmlElement& element, std::string_view name) {
  const std::string& source = document_.source();
  for (const XmlAttributePlace& place : element.attribute_places()) {
    if (std::string_view(source).substr(place.name_begin, place.name_end - place.name_begin) != name) continue;
    patches_.push_back({space_before(source, place.name_begin), place.value_end + 1, ""});
  }
}

void XmlEdit::replace(const XmlElement& element, std::string_view xml) {
  patches_.push_back({element.offset(), element.end_offset(), std::string(xml)});
}

void XmlEdit::remove(const XmlElement& element) {
  patches_.push_back({space_before(document_.source(), element.offset()), element.end_offset(), ""});
}

void XmlEdit::append_child(const XmlElement& parent, std::string_view xml) {
  const std::string& source = document_.source();
  const std::string outer = indentation(source, parent.offset());
  const auto children = parent.children();
  const std::string inner = children.empty() ? outer + "  " : indentation(source, children.back().offset());
  const std::string line = "\n" + inner + std::string(xml);
  if (!children.empty()) {
    const std::size_t at = children.back().end_offset();
    patches_.push_back({at, at, line});
  } else if (source[parent.end_offset() - 2] == '/') {
    // <a/> becomes <a> … </a>.
    std::size_t slash = parent.end_offset() - 2;
    slash = space_before(source, slash);
    patches_.push_back(
        {slash, parent.end_offset(), ">" + line + "\n" + outer + "</" + std::string(parent.name()) + ">"});
  } else {
    const auto inside =
        static_cast<std::size_t>(parent.inner_source().data() - source.data()) + parent.inner_source().size();
    const std::size_t at = space_before(source, inside);
    patches_.push_back({at, inside, line + "\n" + outer});
  }
}

void XmlEdit::insert_before(const XmlElement& sibling, std::string_view xml) {
  const std::size_t at = sibling.offset();
  patches_.push_back({at, at, std::string(xml) + "\n" + indentation(document_.source(), at)});
}

void XmlEdit::replace_text(std::size_t begin, std::size_t end, std::string text) {
  patches_.push_back({begin, end, std::move(text)});
}

Result<std::string> XmlEdit::apply() const {
  std::vector<Patch> patches = patches_;
  std::stable_sort(patches.begin(), patches.end(), [](const Patch& a, const Patch& b) { return a.begin < b.begin; });
  const std::string& source = document_.source();
  std::string out;
  std::size_t at = 0;
  for (const Patch& patch : patches) {
    if (patch.begin < at)
      return fail("xml.overlapping-edits", "two edits touch the same place", document_.span_at(patch.begin));
    out.append(source, at, patch.begin - at);
    out += with_line_ends_of(source, patch.text);
    at = patch.end;
  }
  out.append(source, at);
  return out;
}

}  // namespace sentree::text
