#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sentree/project/project.h"
#include "sentree/verify/explore.h"
#include "sentree/verify/judge.h"

namespace sentree::verify {

/// Times that a loop is gone round in a scenario, unless its duration is changed.
inline constexpr std::uint64_t kLoopRounds = 3;

/// A behaviour that refutes, or that leaves something open (`left_open`), as something that a run can be made to do
/// again: with choices, orders, faults and what is expected.
/// @param judgement  With a path.
/// @param scenario   Whose project and timeline were explored.
[[nodiscard]] project::Scenario counterexample(const Graph& graph, const Judgement& judgement,
                                               const project::Scenario& scenario);

/// Takes away orders, choices and faults, one by one, without which `violates` still holds: what is left differs from
/// virtual time, the first alternatives and the scenario that was explored as little as can be had so.
/// @param scenario  As it was given to `counterexample`.
void simplify(project::Scenario& example, const project::Scenario& scenario,
              const std::function<bool(const project::Scenario&)>& violates);

/// Alternatives of one choice that are told.
inline constexpr std::uint64_t kAlternativesToldMax = 8;

/// Executes the scenario's project with its choices and orders, without a clock, up to its duration. Each tick: what
/// was observed in it, and what was chosen.
struct Told {
  std::uint64_t tick = 0;
  /// Of the tick, which is the last that happens in it; behind the last one, when the mission ended.
  TimePoint at{};
  std::vector<Message> messages;
  /// What models chose, in the order of the observations MODEL.choice.
  struct Choice {
    std::uint64_t number = 0;               ///< Among those of its model.
    std::vector<std::string> alternatives;  ///< As JSON, at most kAlternativesToldMax.
    std::uint64_t count = 0;
  };
  std::vector<Choice> choices;
  /// Of deliveries that were due at one instant the scenario says who came first: before which of `messages`.
  struct First {
    std::size_t message = 0;
    std::string part;  ///< A leaf, a model or the mission.
  };
  std::vector<First> firsts;
};
[[nodiscard]] Result<std::vector<Told>> retell(const project::Plan& plan);

}  // namespace sentree::verify
