#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sentree/scxml/chart.h"

namespace sentree::scxml {

/// The states that are active, as a set in document order.
class StateSet {
 public:
  StateSet() = default;
  explicit StateSet(std::size_t states) : words_((states + 63) / 64) {}

  [[nodiscard]] bool contains(StateIndex s) const { return (words_[s / 64] >> (s % 64) & 1U) != 0; }
  void insert(StateIndex s) { words_[s / 64] |= std::uint64_t{1} << (s % 64); }
  void erase(StateIndex s) { words_[s / 64] &= ~(std::uint64_t{1} << (s % 64)); }
  void clear() {
    for (auto& word : words_) word = 0;
  }
  [[nodiscard]] bool empty() const {
    for (const auto word : words_) {
      if (word != 0) return false;
    }
    return true;
  }
  [[nodiscard]] std::size_t words() const { return words_.size(); }
  [[nodiscard]] std::uint64_t word(std::size_t i) const { return words_[i]; }
  [[nodiscard]] std::uint64_t& word(std::size_t i) { return words_[i]; }
  /// Calls `visit(state)` in document order; `visit` must not change the set.
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (std::size_t i = 0; i < words_.size(); ++i) {
      for (std::uint64_t word = words_[i]; word != 0; word &= word - 1) {
        visit(static_cast<StateIndex>(i * 64 + static_cast<unsigned>(std::countr_zero(word))));
      }
    }
  }
  friend bool operator==(const StateSet&, const StateSet&) = default;

 private:
  std::vector<std::uint64_t> words_;
};

}  // namespace sentree::scxml
