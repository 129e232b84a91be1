#pragma once

#include <tuple>
#include <type_traits>

#include "sentree/bt/carry.h"
#include "sentree/bt/encode.h"
#include "sentree/bt/state.h"

namespace sentree::bt {

/// The members of a state, once: comparison, hash, save, restore and the canonical form follow from these lists.
struct Snapshot {
  template <class S, class Of>
  static constexpr bool kIs = std::is_same_v<std::remove_const_t<S>, Of>;

  template <class S>
  requires kIs<S, State>
  static auto members(S& s) {
    return std::tie(s.status_, s.memory_, s.links_, s.entries_, s.dynamic_, s.objects_, s.timers_, s.halting_,
                    s.waiting_);
  }
  template <class S>
  requires kIs<S, State::Entry>
  static auto members(S& s) { return std::tie(s.datum, s.type, s.sequence, s.stamp, s.links); }
  template <class S>
  requires kIs<S, State::DynamicCell>
  static auto members(S& s) { return std::tie(s.scope, s.name, s.parent, s.link); }
  template <class S>
  requires kIs<S, State::Timer>
  static auto members(S& s) { return std::tie(s.due, s.node); }

  [[nodiscard]] static bool equal(const State& a, const State& b);
  [[nodiscard]] static Result<std::string> save(const Tree& tree, const State& state);
  [[nodiscard]] static Result<State> restore(const Tree& tree, std::string_view bytes);
  [[nodiscard]] static Loaded<Carried> carry(const Tree& before, const State& state, const Tree& after);
  /// Entries go where the SubTrees of their scopes have gone.
  static void carry_blackboard(const Tree& before, const State& state, const Tree& after, Carried& carried,
                               Diagnostics& diagnostics);
  [[nodiscard]] static Result<void> encode(const Tree& tree, const State& state, TimePoint now, std::string& out,
                                           Times times);
  /// Every index of the state leads somewhere, so that a damaged one cannot make a step read what is not there.
  [[nodiscard]] static bool consistent(const Model& model, const State& state);
};

}  // namespace sentree::bt
