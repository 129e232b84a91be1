#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sentree/lsp/index.h"

namespace sentree::lsp {

/// As the protocol numbers them.
enum class ItemKind : std::uint8_t {
  kText = 1,
  kMethod = 2,
  kFunction = 3,
  kField = 5,
  kVariable = 6,
  kClass = 7,
  kInterface = 8,
  kProperty = 10,
  kUnit = 11,
  kValue = 12,
  kKeyword = 14,
  kFile = 17,
  kReference = 18,
  kEnumMember = 20,
  kEvent = 23,
};

struct Item {
  std::string label;
  ItemKind kind = ItemKind::kText;
  std::string detail;
  std::string documentation;
  std::string insert;  ///< Empty: the label.
};

/// What may stand at a byte of a file, in place of `from` to `to`; the editor keeps what fits what has been typed.
struct Completion {
  std::size_t from = 0;
  std::size_t to = 0;
  std::vector<Item> items;
};

/// Items of one answer.
inline constexpr std::size_t kItemsMax = 2'000;

/// Cost: O(the file up to there + the answer).
[[nodiscard]] Completion complete(const Index& index, const std::string& file, std::size_t offset);

}  // namespace sentree::lsp
