#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "sentree/verify/explore.h"

namespace sentree::verify {

/// An edge between two pairs of a state of the mission and a state of a monitor, by their numbers.
struct Step {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::uint32_t edge = 0;   ///< Of the graph.
  bool discharged = false;  ///< On it nothing is owed for a moment.
};

/// Pairs, and decision by decision what leads from one to the next: what a period leaves open is decided in turn, and a
/// later decision is there only if the earlier ones lead to it. Who is offered what, and how likely it is, is known of
/// places, not of whole periods.
struct Branching {
  static constexpr std::uint32_t kNone = UINT32_MAX;
  struct Arc {
    std::uint32_t to = 0;        ///< A place.
    std::uint32_t step = kNone;  ///< By which the next pair is reached; kNone: another decision follows.
    std::uint32_t what = kNone;  ///< Of choices and faults: index in `Graph::choices`.
    double probability = -1;     ///< Below 0: nobody says.
  };
  struct Place {
    std::uint32_t first = 0;  ///< Its arcs stand beside each other.
    std::uint32_t count = 0;
    bool drawn = false;  ///< Which arc is taken has a probability; else somebody decides.
    std::uint32_t pair = 0;
  };
  std::vector<Place> places;  ///< First the pairs, by their numbers.
  std::vector<Arc> arcs;
};

/// @param steps  Those of a pair beside each other, in the order in which they were tried. What is drawn with
///               probability 0 leads nowhere.
[[nodiscard]] Branching branching(const Graph& graph, std::size_t pairs, const std::vector<Step>& steps);

/// Arcs that count, by their number.
using Allowed = std::vector<bool>;
using Places = std::vector<std::uint32_t>;

/// Finds components among places; what it needs for that is made once.
class Components {
 public:
  /// @param of  Borrowed.
  explicit Components(const Branching& of);

  /// Strongly connected ones by arcs that are allowed, with an arc inside (Tarjan 1972).
  [[nodiscard]] std::vector<Places> strong(const Places& among, const Allowed& allowed);
  /// In which one can stay for ever whatever is drawn: of a place at which something is drawn every arc is allowed and
  /// leads to the component (de Alfaro 1997: maximal end components).
  [[nodiscard]] std::vector<Places> end(Places among, const Allowed& allowed);
  /// Strong ones that are left when places are taken out of them until `bad` finds none.
  /// @param bad  Of a component and which places are inside: those that it cannot have.
  [[nodiscard]] std::vector<Places> without(
      Places among, const Allowed& allowed,
      const std::function<Places(const Places& component, const std::vector<bool>& inside)>& bad);
  /// Of a place at which something is drawn: an arc of it leads away, or is not allowed.
  [[nodiscard]] bool draws_away(std::uint32_t place, const Allowed& allowed, const std::vector<bool>& inside) const;

 private:
  const Branching& of_;
  std::vector<bool> among_;
  std::vector<bool> inside_;
  std::vector<bool> on_stack_;
  std::vector<std::uint32_t> index_;
  std::vector<std::uint32_t> low_;
};

}  // namespace sentree::verify
