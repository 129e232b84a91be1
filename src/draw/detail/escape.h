#pragma once

#include <string>
#include <string_view>

namespace sentree::draw {

/// For the inside of a double-quoted DOT string.
[[nodiscard]] std::string dot_escape(std::string_view text);

/// For the inside of a double-quoted Mermaid label: what Mermaid or HTML would interpret, as numeric entities.
[[nodiscard]] std::string mermaid_escape(std::string_view text);

/// For Mermaid state diagrams, whose labels cannot be quoted: also `:`, `;` and the like as entities.
[[nodiscard]] std::string mermaid_state_escape(std::string_view text);

/// For PlantUML labels: Creole markup and comment marks as numeric entities.
[[nodiscard]] std::string plantuml_escape(std::string_view text);

}  // namespace sentree::draw
