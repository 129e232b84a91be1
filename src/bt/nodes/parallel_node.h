#pragma once

#include <algorithm>
#include <array>

#include "sentree/bt/nodes/child.h"

// What Parallel and ParallelAll share. A negative threshold t means children + 1 + t.

namespace sentree::bt::nodes {

/// The words of a Parallel; one bit per child follows: it has completed.
struct ParallelNode : AnyNode {
  enum : std::size_t {
    kCurrent,
    kSucceeded,
    kFailed,
    kSkipped,           ///< In this tick.
    kSuccessThreshold,  ///< In children; read anew at each tick.
    kFailureThreshold,
    kSkippedSucceeds,  ///< The success threshold was written negative.
  };
  static constexpr std::array kWords{Word{Word::Lives::kInTick, Word::Range::kChildOrEnd},
                                     Word{},
                                     Word{},
                                     Word{Word::Lives::kInTick},
                                     Word{Word::Lives::kInTick},
                                     Word{Word::Lives::kInTick},
                                     Word{Word::Lives::kInTick}};
  static std::uint32_t more_words(std::uint32_t children) { return (children + 31) / 32; }
  static may::Mask may_return(const may::Asked& asked) {
    return (asked.any & (may::kSuccess | may::kFailure | may::kRunning)) | asked.all | may::kRunning;
  }

  /// A threshold that is a literal and more than there are children.
  static std::optional<may::Failing> too_many(const may::Given& given, std::size_t port) {
    return given.greater(port, given.children, "bt.threshold");
  }

  static void count(std::int32_t* mem, Status status);
  static void clear(Machine& m, const Node& n);
  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    clear(m, n);
    m.reset_children(n);
  }
};

inline std::int32_t threshold(std::int64_t written, std::uint32_t children) {
  const std::int64_t wanted = written < 0 ? std::max<std::int64_t>(written, INT32_MIN) + children + 1 : written;
  return static_cast<std::int32_t>(std::clamp<std::int64_t>(wanted, 0, INT32_MAX));
}

/// Behind the memory of a Parallel.
struct ParallelBits {
  std::uint32_t* words;
  explicit ParallelBits(std::int32_t* mem)
      : words(reinterpret_cast<std::uint32_t*>(mem + ParallelNode::kWords.size())) {}
  [[nodiscard]] bool get(std::uint32_t i) const { return (words[i / 32] >> (i % 32) & 1U) != 0; }
  /// Of the 32 children from `first` on, those from `from` on whose bits are not set.
  [[nodiscard]] std::uint32_t left(std::uint32_t first, std::uint32_t from, std::uint32_t children) const {
    std::uint32_t bits = ~words[first / 32];
    if (from > first) bits &= ~0U << (from - first);
    if (children - first < 32) bits &= (1U << (children - first)) - 1;
    return bits;
  }
  void set(std::uint32_t i) { words[i / 32] |= 1U << (i % 32); }
  void clear(std::uint32_t children) {
    words[0] = 0;  // The usual case, without a call.
    if (children > 32) std::fill_n(words, (children + 31) / 32, 0U);
  }
};

inline void ParallelNode::count(std::int32_t* mem, Status status) {
  ParallelBits(mem).set(static_cast<std::uint32_t>(mem[kCurrent]));
  ++mem[status == Status::kSuccess ? kSucceeded : kFailed];
}
inline void ParallelNode::clear(Machine& m, const Node& n) {
  std::int32_t* const mem = m.memory(n);
  std::fill_n(mem, kWords.size(), 0);
  ParallelBits(mem).clear(n.child_count);
}

}  // namespace sentree::bt::nodes
