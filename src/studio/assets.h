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

}  // namespace sentree::studio
