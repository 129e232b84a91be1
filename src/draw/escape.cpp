#include "sentree/draw/detail/escape.h"

#include "sentree/draw/detail/text.h"

namespace sentree::draw {
namespace {

std::string entities(std::string_view text, std::string_view characters, std::string_view open) {
  std::string out;
  for (const char c : printable(text)) {
    if (characters.find(c) == std::string_view::npos) {
      out += c;
    } else {
      out += std::string(open) + std::to_string(static_cast<int>(c)) + ";";
    }
  }
  return out;
}

}  // namespace

std::string dot_escape(std::string_view text) {
  std::string out;
  for (const char c : printable(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

// Mermaid writes entities as #35; where HTML has &#35;.
std::string mermaid_escape(std::string_view text) { return entities(text, "\"#&<>\\`{}[]()|*_;", "#"); }
std::string mermaid_state_escape(std::string_view text) { return entities(text, "\"#&<>\\`{}[]()|*;:%-~/=+", "#"); }
std::string plantuml_escape(std::string_view text) { return entities(text, "\"&<>\\*_~`'{}[]|#/-=", "&#"); }

}  // namespace sentree::draw
