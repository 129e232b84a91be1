#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace sentree::scxml {

using DescriptorId = std::uint32_t;

/// The event descriptors of one chart, numbered, so that an event's name is looked up once and transitions compare
/// numbers.
class DescriptorTable {
 public:
  /// The number of a descriptor; equal ones share it. Trailing ".*" and "." do not count.
  DescriptorId add(std::string_view descriptor);

  /// At most this many descriptors match one event; names with more tokens match by their first ones.
  static constexpr std::size_t kMatchesMax = 32;
  struct Matches {
    std::uint32_t count = 0;
    DescriptorId ids[kMatchesMax];
    [[nodiscard]] bool contains(DescriptorId id) const {
      for (std::uint32_t i = 0; i < count; ++i) {
        if (ids[i] == id) return true;
      }
      return false;
    }
  };
  /// The descriptors that match this event. O(length of the name); no allocation.
  void match(std::string_view event_name, Matches& matches) const;

  [[nodiscard]] const std::vector<std::string>& all() const { return names_; }

 private:
  void grow();
  [[nodiscard]] std::size_t find_slot(std::string_view name, std::uint32_t hash) const;

  std::vector<std::string> names_;
  std::vector<std::uint32_t> table_;  // open addressing, a quarter full at most; id + 1, 0: free
  std::vector<std::uint32_t> hashes_;
  DescriptorId star_ = 0xFFFFFFFFU;
};

}  // namespace sentree::scxml
