#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>
#include <vector>

namespace sentree {

/// Numbers by keys that never go away: open addressing in one array without gaps in its slots, three fifths to three
/// quarters full. For tables of millions of small keys, in which a node for each would cost more than what it holds.
/// @tparam Key   A plain value whose octets are equal where it is.
/// @tparam Hash  Spreads keys over all 64 bits.
template <class Key, class Hash>
class FlatMap {
  static_assert(std::has_unique_object_representations_v<Key>);

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
    std::memcpy(slot.key.data(), &key, sizeof(Key));
    slot.value = value;
    return {&slot.value, true};
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  // The octets of the key, which needs no alignment so.
  struct Slot {
    std::array<std::byte, sizeof(Key)> key{};
    std::uint32_t value = kNone;
  };

  [[nodiscard]] std::size_t place_of(const Key& key) const {
    // The upper half of the hash, as a fraction of the array (Lemire 2019), which may so have any length.
    std::size_t place = static_cast<std::size_t>(((Hash()(key) >> 32U) * slots_.size()) >> 32U);
    while (slots_[place].value != kNone && std::memcmp(slots_[place].key.data(), &key, sizeof(Key)) != 0) {
      if (++place == slots_.size()) place = 0;
    }
    return place;
  }
  void grow() {
    constexpr std::size_t kFirst = 1024;
    std::vector<Slot> old(slots_.empty() ? kFirst : slots_.size() + slots_.size() / 4);
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.value == kNone) continue;
      Key key;
      std::memcpy(&key, slot.key.data(), sizeof(Key));
      slots_[place_of(key)] = slot;
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
