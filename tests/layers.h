#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace sentree::layers {

/// One file below src/, e.g. "bt/tree.h", and its text.
struct SourceFile {
  std::string path;
  std::string text;
};

/// Which libraries one library may include, besides itself.
struct LibraryRule {
  std::string_view library;
  std::vector<std::string_view> may_include;
};

/// Headers that some files of a library must not see, not even through others. Tests may.
struct SecrecyRule {
  std::string_view files;   ///< Start of the path, e.g. "sim/localization".
  std::string_view header;  ///< e.g. "sim/ground_truth.h".
  std::string_view why;
};

/// The design's table; ARCHITECTURE.md draws it.
[[nodiscard]] const std::vector<LibraryRule>& library_rules();
[[nodiscard]] const std::vector<SecrecyRule>& secrecy_rules();

/// One line per include that the rules do not allow: "file:line: …". Empty if all is well.
///
/// Also: public headers (all but those in a folder detail/) must not include heavy third-party ones, our headers are
/// included as "sentree/<library>/<header>", and they exist.
[[nodiscard]] std::vector<std::string> violations(const std::vector<SourceFile>& files);

}  // namespace sentree::layers
