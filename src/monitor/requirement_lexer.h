#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::monitor {

/// A word of a requirement file.
struct RequirementToken {
  enum class Kind : std::uint8_t {
    kName,    ///< Dotted: "battery.level".
    kNumber,  ///< `number`.
    kString,  ///< `text` without quotes.
    kSymbol,  ///< `text`; "->" of a path is ".name" read as the symbol "." and a name.
    kStop,    ///< The full stop that ends a requirement.
    kEnd,
  };
  Kind kind = Kind::kEnd;
  std::string text;
  double number = 0;
  bool starts_line = false;
  bool adjacent = false;  ///< Nothing between it and the token before.
  SourceSpan span;
};

/// The words of a file, the last of kind kEnd; comments run from # to the end of the line.
/// Appends requirement.syntax for what is no word; reading goes on after it.
[[nodiscard]] std::vector<RequirementToken> lex_requirements(std::string_view source, const std::string& file,
                                                             Diagnostics& diagnostics);

}  // namespace sentree::monitor
