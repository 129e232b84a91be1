#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace sentree {

/// Numbers by keys that never go away: open addressing in one array, at most three quarters full. For tables of
/// millions of small keys, in which a node for each would cost more than what it holds.
/// @tparam Key   A plain value.
/// @tparam Hash  Spreads keys over all bits.
template <class Key, class Hash>
class FlatMap {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  /// Of a key; kNone: it is not there.
  [[nodiscard]] std::uint32_t find(const Key& key) const {
    return slots_.empty() ? kNone : slots_[place_of(key)].value;
  }
  /// As `std::unordered_map::try_emplace`. `value` is below kNone. The pointer holds until the next call.
  std::pair<std::uint32_t*, bool> try_emplace(const Key& key, std::uint32_t value) {
    if (size_ * 4 >= slots_.size() * 3) grow();
    Slot& slot = slots_[place_of(key)];
    if (slot.value != kNone) return {&slot.value, false};
    ++size_;
    slot = {key, value};
    return {&slot.value, true};
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  struct Slot {
    Key key{};
    std::uint32_t value = kNone;
  };

  [[nodiscard]] std::size_t place_of(const Key& key) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t place = Hash()(key) & mask;
    while (slots_[place].value != kNone && !(slots_[place].key == key)) place = (place + 1) & mask;
    return place;
  }
  void grow() {
    constexpr std::size_t kFirst = 1024;
    std::vector<Slot> old(slots_.empty() ? kFirst : slots_.size() * 2);
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.value != kNone) slots_[place_of(slot.key)] = slot;
    }
  }

  std::vector<Slot> slots_;
  std::size_t size_ = 0;
};

/// Spreads pairs of numbers, as SplitMix64 does.
struct WordHash {
  std::size_t operator()(std::uint64_t word) const {
    word = (word ^ (word >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    word = (word ^ (word >> 27U)) * 0x94D049BB133111EBULL;
    return static_cast<std::size_t>(word ^ (word >> 31U));
  }
};

}  // namespace sentree
