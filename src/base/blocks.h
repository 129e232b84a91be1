#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace sentree {

/// A sequence that never changes, in blocks that it shares with another one: of many that differ little from each
/// other, each takes memory only for where it does.
///
/// @tparam T  Equal ones can stand for each other.
/// Cost: O(n) to make one and to read it whole; memory for the blocks that differ, and a pointer for each other one.
template <class T>
class Blocks {
 public:
  /// About 2 KB: a pointer to a block is little beside it, and so is a block beside long sequences.
  static constexpr std::size_t kLength = std::max<std::size_t>(16, 2048 / sizeof(T));

  Blocks() = default;
  /// @param like  Shares with it the blocks that are equal at the same place; null: none.
  Blocks(std::vector<T>&& whole, const Blocks* like) : size_(whole.size()) {
    blocks_.reserve((size_ + kLength - 1) / kLength);
    for (std::size_t from = 0; from < size_; from += kLength) {
      const std::size_t length = length_at(from);
      const auto first = whole.begin() + static_cast<std::ptrdiff_t>(from);
      const auto last = first + static_cast<std::ptrdiff_t>(length);
      const std::size_t at = from / kLength;
      if (like != nullptr && from < like->size_ && like->length_at(from) == length &&
          are_equal(&*first, like->blocks_[at].get(), length)) {
        blocks_.push_back(like->blocks_[at]);
      } else {
        auto block = std::make_shared<T[]>(length);
        std::move(first, last, block.get());
        blocks_.push_back(std::move(block));
      }
    }
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const T& operator[](std::size_t i) const { return blocks_[i / kLength][i % kLength]; }
  [[nodiscard]] std::vector<T> whole() const {
    std::vector<T> whole;
    whole.reserve(size_);
    for (std::size_t at = 0; at < blocks_.size(); ++at)
      whole.insert(whole.end(), blocks_[at].get(), blocks_[at].get() + length_at(at * kLength));
    return whole;
  }
  /// What it takes beside the other one.
  /// @param held  What a T holds outside of itself.
  template <class Held>
  [[nodiscard]] std::size_t bytes_beside(const Blocks* like, const Held& held) const {
    std::size_t bytes = blocks_.size() * sizeof(blocks_[0]);
    for (std::size_t at = 0; at < blocks_.size(); ++at) {
      if (like != nullptr && at < like->blocks_.size() && like->blocks_[at] == blocks_[at]) continue;
      const std::size_t length = length_at(at * kLength);
      bytes += length * sizeof(T);
      for (std::size_t i = 0; i < length; ++i) bytes += held(blocks_[at][i]);
    }
    return bytes;
  }
  [[nodiscard]] std::size_t bytes_beside(const Blocks* like) const {
    return bytes_beside(like, [](const T&) { return std::size_t{0}; });
  }

 private:
  static bool are_equal(const T* a, const T* b, std::size_t length) {
    if constexpr (std::has_unique_object_representations_v<T>)
      return std::memcmp(a, b, length * sizeof(T)) == 0;
    else
      return std::equal(a, a + length, b);
  }
  [[nodiscard]] std::size_t length_at(std::size_t from) const { return std::min(kLength, size_ - from); }

  std::size_t size_ = 0;
  std::vector<std::shared_ptr<const T[]>> blocks_;
};

}  // namespace sentree
