#pragma once

#include <string>
#include <string_view>

#include "sentree/lsp/index.h"

namespace sentree::lsp {

/// "ReturnCode stopNavigation(i64 goal_id)", with units where they are told: "double x [m]".
[[nodiscard]] std::string signature_of(const idl::Method& method);
/// "double percentage [ratio]".
[[nodiscard]] std::string declaration_of(const idl::Field& field);
/// What a comment says of what is declared at a byte: the one behind it on its line, else those on the lines above it.
/// Without the marks of comments; empty: none.
[[nodiscard]] std::string comment_at(std::string_view text, std::size_t offset);

/// The fields of what `path` ("result.target.pose.", what is behind the last '.' left out) leads to in the data of an
/// observation; a type that has no fields gives none.
struct Fields {
  std::vector<const idl::Field*> fields;
  const idl::Type* result = nullptr;  ///< Also "result", of this type.
  bool arguments = false;             ///< Also "args".
};
[[nodiscard]] Fields fields_at(const Observed& observation, std::string_view path);
/// The type of the last name of a path; null: none, or not known.
[[nodiscard]] const idl::Type* type_at(const Observed& observation, std::string_view path, const idl::Field** field);

/// What people read of what stands at a byte, in Markdown; empty: nothing is known of it.
/// @param from, to  Get its place.
[[nodiscard]] std::string hover_at(const Index& index, const std::string& file, std::size_t offset, std::size_t& from,
                                   std::size_t& to);

/// The event of the <transition> around a byte of a chart, or of the event that is being handled there.
[[nodiscard]] std::string event_around(const IndexedFile& file, std::size_t offset);

}  // namespace sentree::lsp
