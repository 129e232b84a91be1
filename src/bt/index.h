#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sentree::bt {

/// Finds the numbers of things that a vector holds by what they are: open addressing, at most three quarters full, four
/// bytes a place. What is equal, and how a thing hashes, says who asks.
class Index {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  /// kNone: there is none for which `is` holds.
  template <class Is>
  [[nodiscard]] std::uint32_t find(std::size_t hash, const Is& is) const {
    if (places_.empty()) return kNone;
    const std::size_t mask = places_.size() - 1;
    for (std::size_t place = hash & mask; places_[place] != kNone; place = (place + 1) & mask) {
      if (is(places_[place])) return places_[place];
    }
    return kNone;
  }
  /// Adds a number that is not there.
  template <class HashOf>
  void add(std::uint32_t number, const HashOf& hash_of) {
    if (size_ * 4 >= places_.size() * 3) {
      constexpr std::size_t kFirst = 16;
      std::vector<std::uint32_t> old(places_.empty() ? kFirst : places_.size() * 2, kNone);
      old.swap(places_);
      for (const std::uint32_t one : old) {
        if (one != kNone) put(one, hash_of(one));
      }
    }
    put(number, hash_of(number));
    ++size_;
  }

 private:
  void put(std::uint32_t number, std::size_t hash) {
    const std::size_t mask = places_.size() - 1;
    std::size_t place = hash & mask;
    while (places_[place] != kNone) place = (place + 1) & mask;
    places_[place] = number;
  }

  std::vector<std::uint32_t> places_;
  std::size_t size_ = 0;
};

}  // namespace sentree::bt
