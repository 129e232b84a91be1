#pragma once

#include <span>
#include <string_view>

namespace sentree::studio {

/// A file of the page, built from web/ and part of the program.
struct Asset {
  std::string_view path;  ///< "/index.html"
  std::string_view media_type;
  std::string_view content;
  bool gzipped = false;
};

/// Empty if the page was not built with the program.
[[nodiscard]] std::span<const Asset> assets();
/// The same, in the file that is made of the page when the program is built.
[[nodiscard]] std::span<const Asset> embedded_assets();

}  // namespace sentree::studio
