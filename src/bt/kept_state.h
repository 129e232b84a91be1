#pragma once

#include <cstddef>
#include <cstdint>

#include "sentree/base/blocks.h"
#include "sentree/bt/state.h"

namespace sentree::bt {

/// A state that is put aside, beside many that it differs little from: it shares with one of them what they have in
/// common. Never changes.
class KeptState {
 public:
  KeptState() = default;
  /// @param like  Of the same tree; null: there is none. Cost: O(nodes + entries), and memory for what differs.
  KeptState(State&& state, const KeptState* like);

  /// The state that was put aside. Cost: a copy of it.
  [[nodiscard]] State state() const;
  /// About, what it takes beside the other one.
  [[nodiscard]] std::size_t bytes_beside(const KeptState* like) const;

 private:
  Blocks<Status> status_;
  Blocks<std::int32_t> memory_;
  Blocks<std::uint32_t> links_;
  Blocks<State::Entry> entries_;
  Blocks<State::DynamicCell> dynamic_;
  State rest_;
};

}  // namespace sentree::bt
