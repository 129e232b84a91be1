#pragma once

namespace sentree::draw {

/// Colours of a drawing. kAuto follows the reader's system (prefers-color-scheme).
enum class Theme { kAuto, kLight, kDark };

/// Which way children lie from their parent.
enum class Direction { kDown, kRight };

struct SvgOptions {
  Theme theme = Theme::kAuto;
  /// A background rectangle; without it the drawing is transparent.
  bool background = true;
};

}  // namespace sentree::draw
