#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/yarp/address.h"

namespace sentree::yarp {

class Inbox;

/// One item of a bottle.
struct Item {
  enum class Form : std::uint8_t { kInteger, kReal, kVocab, kText, kOctets, kList };

  Form form = Form::kInteger;
  std::int64_t integer = 0;
  double real = 0;
  std::string text;  ///< kText, kOctets; kVocab: its letters.
  std::vector<Item> items;

  [[nodiscard]] static Item of(std::int64_t number);
  [[nodiscard]] static Item of(std::string text);
  [[nodiscard]] static Item word(std::string letters);
  [[nodiscard]] static Item list(std::vector<Item> items);
  [[nodiscard]] bool is_word(std::string_view letters) const { return form == Form::kVocab && text == letters; }

  friend bool operator==(const Item&, const Item&) = default;
};

/// Lists inside each other that are read.
inline constexpr int kBottleNestingMax = 32;
/// Items that are read of one bottle.
inline constexpr std::size_t kBottleItemsMax = 100'000;

/// As tools print and people type it: hello 42 3.5 (a b) [ok] {1 2 3}. Words that could be taken for something else
/// stand in quotes.
[[nodiscard]] std::string to_text(const std::vector<Item>& items);
/// Error: yarp.bottle.
[[nodiscard]] Result<std::vector<Item>> parse_text(std::string_view text);

/// In octets; items of one type share its tag, as YARP's own writers have it.
void write_bottle(std::vector<std::uint8_t>& out, const std::vector<Item>& items, Version version);
/// Throws the library's `Broken`.
[[nodiscard]] std::vector<Item> read_bottle(Inbox& in, Version version);

}  // namespace sentree::yarp
