#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/design/text_edit.h"

namespace sentree::design {

/// A way out of a finding that one edit goes.
struct Fix {
  std::string title;  ///< "threshold", in place of what is written.
  TextEdit edit;
};

/// A finding where it stands in a text of the project.
struct Finding {
  Diagnostic diagnostic;
  std::string file;      ///< Inside the project; empty: elsewhere.
  std::size_t from = 0;  ///< Bytes of `file`'s text.
  std::size_t to = 0;
  std::vector<Fix> fixes;
};

/// The byte of a place as messages have it; the text's size where it has none such.
[[nodiscard]] std::size_t offset_of(std::string_view text, const SourceSpan& span);

/// Puts a finding into the text that it is of. What a "did you mean" names becomes a fix where the misspelt word stands
/// at the place, or behind it on its line.
[[nodiscard]] Finding locate(Diagnostic diagnostic, const std::filesystem::path& folder, std::string_view text);

/// The path inside `folder` of a file that a diagnostic names; empty: it is not there.
[[nodiscard]] std::string file_inside(const std::filesystem::path& folder, const std::string& shown);

}  // namespace sentree::design
