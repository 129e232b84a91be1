#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sentree/lsp/index.h"

namespace sentree::lsp {

/// A part of a file, for an editor's outline. Kinds are as the protocol numbers them.
struct OutlinePart {
  std::string name;
  std::string detail;
  std::uint8_t kind = 13;
  std::size_t from = 0;  ///< Of the whole part.
  std::size_t to = 0;
  std::size_t name_from = 0;
  std::size_t name_to = 0;
  std::vector<OutlinePart> children;
};

/// Nodes of trees, states of charts, and of other files what they define. A file that cannot be read has none.
[[nodiscard]] std::vector<OutlinePart> outline_of(const IndexedFile& file);

}  // namespace sentree::lsp
