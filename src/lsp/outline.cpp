#include "sentree/lsp/detail/outline.h"

#include <algorithm>

#include "sentree/text/xml.h"

namespace sentree::lsp {

namespace {

using text::XmlElement;

enum Kind : std::uint8_t {
  kModule = 2,
  kClass = 5,
  kMethod = 6,
  kProperty = 7,
  kEnum = 10,
  kInterface = 11,
  kFunction = 12,
  kVariable = 13,
  kObject = 19,
  kEvent = 24
};

// The parts that `take` makes of elements, those of others passed on to their ancestors. Nesting is that of XML.
template <class Take>
void collect(const XmlElement& element, std::vector<OutlinePart>& into, Take&& take) {
  for (XmlElement child = element.first_child(); child; child = child.next_sibling()) {
    OutlinePart part;
    if (!take(child, part)) {
      collect(child, into, take);
      continue;
    }
    part.from = child.offset();
    part.to = child.end_offset();
    part.name_from = child.offset() + 1;
    part.name_to = part.name_from + child.name().size();
    collect(child, part.children, take);
    into.push_back(std::move(part));
  }
}

bool take_state(const XmlElement& element, OutlinePart& part) {
  const std::string_view tag = element.local_name();
  if (tag != "state" && tag != "parallel" && tag != "final" && tag != "history") return false;
  part.name = std::string(element.attribute("id").value_or(tag));
  part.detail = std::string(tag);
  part.kind = tag == "final" ? kEvent : kClass;
  return true;
}

bool take_node(const XmlElement& element, OutlinePart& part) {
  const std::string_view tag = element.local_name();
  if (tag == "TreeNodesModel" || tag.ends_with("_port") || element.parent().local_name() == "TreeNodesModel")
    return false;
  part.kind = tag == "BehaviorTree" ? kModule : element.first_child() ? kObject : kFunction;
  const std::string id(element.attribute("ID").value_or(tag));
  part.name = std::string(element.attribute("name").value_or(id));
  part.detail = part.name == id ? "" : id;
  if (part.name.empty()) part.name = id.empty() ? std::string(tag) : id;
  return true;
}

std::uint8_t kind_of(SymbolKind kind) {
  switch (kind) {
    case SymbolKind::kService:
    case SymbolKind::kInterface: return kInterface;
    case SymbolKind::kMethod: return kMethod;
    case SymbolKind::kType: return kClass;
    case SymbolKind::kRequirement: return kProperty;
    default: return kVariable;
  }
}

}  // namespace

std::vector<OutlinePart> outline_of(const IndexedFile& file) {
  std::vector<OutlinePart> parts;
  if (!file.readable) return parts;
  if (file.kind == FileKind::kTree || file.kind == FileKind::kChart) {
    const auto document = text::XmlDocument::parse(file.text, {}, {.lenient = true});
    if (document) collect(document->root(), parts, file.kind == FileKind::kTree ? take_node : take_state);
    return parts;
  }
  for (const Occurrence& occurrence : file.occurrences) {
    if (!occurrence.defines || occurrence.to > file.text.size()) continue;
    OutlinePart part;
    part.name = written_name(occurrence.symbol);
    part.kind = kind_of(occurrence.symbol.kind);
    part.from = part.name_from = occurrence.from;
    part.name_to = occurrence.to;
    part.to = std::min(file.text.find('\n', occurrence.to), file.text.size());
    parts.push_back(std::move(part));
  }
  return parts;
}

}  // namespace sentree::lsp
