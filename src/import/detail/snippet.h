#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sentree/import/detail/cpp_expression.h"
#include "sentree/import/import.h"

namespace sentree::import {

/// Executable content, and the call whose reply must come before what follows.
struct Piece {
  std::string xml;
  std::optional<RemoteCall> call;
  std::string result;  ///< Location that takes the call's result; empty: nobody does.
};

/// What a C++ snippet says in SCXML.
struct Snippet {
  std::vector<Piece> pieces;          ///< At least one; only the last has no call.
  std::vector<std::string> new_data;  ///< Variables of the snippet's own.
  std::vector<Finding> findings;
};

/// The four idioms of Qt SCXML skills, and what stands around them: a call of a service (a `<send type="thrift">`; one
/// whose result is used ends a piece), an event that is submitted (`<raise>`), a QTimer or an event with a delay (a
/// delayed `<send>`), enumerators (their names as text); assignments, declarations, `if`, `switch`, log streams. Every
/// other statement becomes a comment at its place and a finding. Names of the snippet's own are added to `names`.
/// `place` is where the source begins. Bound: `kNestingMax`. Cost: O(size · nesting).
[[nodiscard]] Snippet translate_snippet(const std::string& source, const SourceSpan& place, Names& names);

/// `<send type="thrift" …>` of a call; `id` may be empty.
[[nodiscard]] std::string send_of(const RemoteCall& call, const std::string& id);

/// An XML comment that holds any text.
[[nodiscard]] std::string comment_of(std::string_view text);

/// On one line, at most some hundred bytes.
[[nodiscard]] std::string shortened(std::string_view text);

}  // namespace sentree::import
