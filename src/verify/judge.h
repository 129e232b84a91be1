#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/monitor/monitor.h"
#include "sentree/verify/explore.h"

namespace sentree::verify {

enum class Finding : std::uint8_t {
  kHolds,    ///< On every behaviour that was explored.
  kRefuted,  ///< Some behaviour violates it.
  kUnknown,  ///< Not refuted, and not everything was explored.
};
/// "holds", "refuted", "unknown".
[[nodiscard]] std::string_view to_string(Finding finding);

/// A behaviour: edges of the graph one after the other.
struct Path {
  std::vector<std::uint32_t> edges;
  /// Of a behaviour without end: the edge from which on the rest comes again and again.
  std::optional<std::size_t> loop;
};

/// What was found out of one requirement.
struct Judgement {
  std::string requirement;
  Finding finding = Finding::kUnknown;
  std::uint64_t states = 0;  ///< Of mission and monitor together.
  /// If refuted: one of the shortest behaviours that show it. A loop and the way to it have no fault without which
  /// there is such a loop too.
  std::optional<Path> path;
  TimePoint at{};                       ///< When it is violated on that path; of a loop, its first tick.
  std::string observation;              ///< Name of what violates it; empty: time that passed, or a loop.
  std::string state;                    ///< Of the monitor, then.
  std::string vacuous;                  ///< Why it says nothing that it holds; empty: it was put to the test.
  std::vector<std::string> never_seen;  ///< Observations that it speaks of, besides others, and that never come.
  /// A bounded obligation can be open when the mission ends, on one of the shortest such paths: no violation. Nothing
  /// is said of it where something is refuted.
  std::optional<Path> can_stay_open;
  TimePoint open_at{};            ///< When the mission ends on that path.
  std::vector<std::string> fair;  ///< Choices whose fairness it rests on, as `Owing` has them.
  /// Refuted only since these alternatives need never be taken, likewise.
  std::vector<std::string> avoided;
  struct Probability {
    double low = 0;
    double high = 1;
  };
  /// That it is ever violated, over all ways in which what is left open without a probability may be chosen; alike if
  /// nothing is. Nothing: nothing is drawn, not everything was explored, or `improbable_states` says why.
  std::optional<Probability> least;
  std::optional<Probability> greatest;
  /// So many states together with the mission's were too many for a probability (`JudgeOptions::probable_states`).
  std::optional<std::uint64_t> improbable_states;
  std::string error;  ///< It could not be judged.
  std::string limit;  ///< Why judging ended before it was known; empty: it did not.
};

/// How likely it is in words, from the least to the greatest, with no more digits than are known: "0.027", "0 to 0.5,
/// as what is left open is chosen", "at most 1e-14".
[[nodiscard]] std::string to_string(const Judgement::Probability& least, const Judgement::Probability& greatest);

/// What `can_stay_open` says, as something to show: its path is that one, at whose end the mission ends. Only where it
/// says anything.
[[nodiscard]] Judgement left_open(const Judgement& judgement);

struct JudgeOptions {
  /// Choices "MODEL.NAME" each alternative of which is taken again and again if it is offered again and again.
  std::vector<std::string> fair;
  bool all_fair = false;  ///< Also those without a name, each by where it stands.
  bool probabilities = true;
  /// Of a requirement with more states than these, together with the mission's, no probability is worked out: it takes
  /// a multiple of the time in which it is refuted.
  std::uint64_t probable_states = 1'000'000;
  bool vacuity = true;                ///< Of what holds, whether anything puts it to the test.
  std::function<bool()> interrupted;  ///< What is not decided then stays unknown; may be empty.
  /// Bytes that all requirements that are judged at a time may take together, about; likewise.
  std::uint64_t memory = UINT64_MAX;
  std::atomic<std::uint64_t>* taken = nullptr;  ///< By all of them; null: there is only one.
};

/// Steps a monitor along the graph: each of its states with each state of the mission once, breadth first. Obligations
/// without a bound are looked for on cycles, fair in the sense of Streett: an alternative that is offered on the cycle
/// again and again is taken on it.
[[nodiscard]] Judgement judge(const Graph& graph, const monitor::Model& model, const JudgeOptions& options);

}  // namespace sentree::verify
