#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sentree/design/tree_edit.h"

namespace sentree::design {

/// A part of a requirement's sentence that can be written anew by itself.
struct SentencePart {
  std::string part;  ///< "open", "close", "p", "q", "r", "bound", "times", "assuming".
  std::size_t from = 0;
  std::size_t to = 0;
  std::string text;  ///< As written.
};

/// A requirement as its text has it.
struct Sentence {
  std::string name;
  std::string prose;
  std::string scope;    ///< "globally", "before", "after", "between", "after-until" or "while".
  std::string pattern;  ///< As in `patterns()`.
  std::size_t from = 0;
  std::size_t to = 0;  ///< Behind its last part.
  std::vector<SentencePart> parts;
};

/// "always", "never", "eventually", "eventually-within", "respond", "respond-eventually", "immediately", "keep-for",
/// "keep-until", "not-for", "precedes", "precedes-within", "at-least-every", "at-most", "at-most-per", "holds-for".
[[nodiscard]] const std::vector<std::string>& patterns();

/// The requirements of a file. Errors: the first of `monitor::parse_requirements`.
[[nodiscard]] Result<std::vector<Sentence>> sentences_of(std::string_view text, const std::string& file = {});

/// Writes a part anew. "assuming" can be added, and with an empty text taken away.
struct SetPart {
  std::string requirement;
  std::string part;
  std::string text;
};
/// What the new scope needs and the old one does not have is "true".
struct SetScope {
  std::string requirement;
  std::string scope;
};
/// Conditions and bounds that both patterns have stay; a bound that is new is one second.
struct SetPattern {
  std::string requirement;
  std::string pattern;
};
using RequirementGesture = std::variant<SetPart, SetScope, SetPattern>;

/// A change of a requirement as edits of its text: words that do not change stay byte for byte, with their lines.
/// Errors: those of `sentences_of`, of the text and of what it would become; design.no-such-node,
/// design.nothing-to-do.
[[nodiscard]] Result<GestureResult> edit_requirement(std::string_view text, const RequirementGesture& gesture,
                                                     const std::string& file = {});

}  // namespace sentree::design
