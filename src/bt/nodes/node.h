#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/assert.h"
#include "sentree/bt/detail/machine.h"
#include "sentree/bt/nodes/may.h"

namespace sentree::bt::nodes {

/// What is known of a node by its kind alone; each may say otherwise. Besides, a node has
///   enter(m, n, id)                      what its tick begins with
///   may_return(asked)                    which statuses it may return
/// and, by need,
///   child_done(m, n, id, [child,] status)  a child that it has ticked has returned
///   fire(m, n, id)                       its timer is due (`kStartsTimers`)
///   tick(m, n, id)                       `enter` where its children answer at once, if there is a shorter way then
struct AnyNode {
  /// Its words in State::memory_, which its functions index; IDLE, all are 0. `more_words` follow.
  static constexpr std::array<Word, 0> kWords{};
  static std::uint32_t more_words(std::uint32_t /*children*/) { return 0; }
  /// The first two words are the number of the last write that it has seen of the entry of `Node::data`.
  static constexpr bool kWaitsForWrites = false;
  /// Starts timers: a saved state may hold one of it.
  static constexpr bool kStartsTimers = false;
  /// Of its own accord it may halt the children from this on.
  static constexpr std::uint32_t kHaltsFrom = 0xFFFFFFFFU;
  /// Ticks its child again after it completed.
  static constexpr bool kRepeats = false;
  /// Sets itself RUNNING before its children, and stays so when it returns SKIPPED because of them.
  static constexpr bool kStaysRunning = true;
  /// The IDs under which every tree may use it, by format. None: it is made for what others define.
  static Manifests manifests() { return {}; }

  /// What of it makes every tick fail.
  static std::optional<may::Failing> always_fails(const may::Given& /*given*/) { return std::nullopt; }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) { m.reset_children(n); }
  static void fire(Machine& m, const Node& /*n*/, NodeId id) { m.stop_timer(id); }
};

/// The tick fails: what the node needs of a port is not there. The message ends with what is.
[[gnu::noinline, gnu::cold]] inline Next lacks(Machine& m, const Node& n, NodeId id, std::uint32_t port,
                                               std::string needs) {
  const Binding* const b = m.binding(n, port);
  if (b != nullptr) needs += "; " + m.read_error(*b, b->type).message;
  return m.fail(id, "bt.missing-port", std::move(needs));
}

template <std::size_t kCount>
inline void clear(std::int32_t* mem, const std::array<Word, kCount>& /*words*/) {
  std::fill_n(mem, kCount, 0);
}

}  // namespace sentree::bt::nodes
