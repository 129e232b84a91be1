#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sentree/scxml/chart.h"

namespace sentree::scxml {

/// The states that are active, as a set in document order. Charts of up to 128 states take no memory beside it.
class StateSet {
 public:
  StateSet() = default;
  explicit StateSet(std::size_t states) : words_((states + 63) / 64) {
    if (words_ > kInside) outside_.resize(words_);
  }

  [[nodiscard]] bool contains(StateIndex s) const { return (data()[s / 64] >> (s % 64) & 1U) != 0; }
  void insert(StateIndex s) { data()[s / 64] |= std::uint64_t{1} << (s % 64); }
  void erase(StateIndex s) { data()[s / 64] &= ~(std::uint64_t{1} << (s % 64)); }
  void clear() { std::fill_n(data(), words_, 0); }
  [[nodiscard]] bool empty() const {
    return std::all_of(data(), data() + words_, [](std::uint64_t word) { return word == 0; });
  }
  [[nodiscard]] std::size_t words() const { return words_; }
  [[nodiscard]] std::uint64_t word(std::size_t i) const { return data()[i]; }
  [[nodiscard]] std::uint64_t& word(std::size_t i) { return data()[i]; }
  /// Calls `visit(state)` in document order; `visit` must not change the set.
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (std::size_t i = 0; i < words_; ++i) {
      for (std::uint64_t word = data()[i]; word != 0; word &= word - 1) {
        visit(static_cast<StateIndex>(i * 64 + static_cast<unsigned>(std::countr_zero(word))));
      }
    }
  }
  friend bool operator==(const StateSet&, const StateSet&) = default;

 private:
  static constexpr std::size_t kInside = 2;
  [[nodiscard]] const std::uint64_t* data() const { return words_ > kInside ? outside_.data() : inside_.data(); }
  [[nodiscard]] std::uint64_t* data() { return words_ > kInside ? outside_.data() : inside_.data(); }

  std::size_t words_ = 0;
  std::array<std::uint64_t, kInside> inside_{};
  std::vector<std::uint64_t> outside_;
};

/// For `archive`: its words.
[[nodiscard]] inline std::vector<std::uint64_t> archived(const StateSet& set) {
  std::vector<std::uint64_t> words;
  for (std::size_t i = 0; i < set.words(); ++i) words.push_back(set.word(i));
  return words;
}
inline void unarchive(std::vector<std::uint64_t>&& words, StateSet& set) {
  set = StateSet(words.size() * 64);
  for (std::size_t i = 0; i < words.size(); ++i) set.word(i) = words[i];
}

}  // namespace sentree::scxml
