#pragma once

#include <set>
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
/// Also: public headers (all but those in a folder detail/) must not include heavy third-party ones, no other library
/// includes private ones, our headers are included as "sentree/<library>/<header>", and they exist.
[[nodiscard]] std::vector<std::string> violations(const std::vector<SourceFile>& files);

/// Public headers that no other library includes, directly or by one that it does include: their place is detail/.
/// @param for_embedders  Public nevertheless, for programs that embed ours.
[[nodiscard]] std::set<std::string> needlessly_public(const std::vector<SourceFile>& files,
                                                      std::vector<std::string> for_embedders);

}  // namespace sentree::layers
