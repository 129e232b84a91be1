#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree::campaign {

/// What of a project runs have reached.
///
/// Things that can be reached: SUCCESS and FAILURE of each node, and RUNNING of actions; each state and transition of
/// the charts of skills that run in this process; each condition of these transitions true and false (one that cannot
/// be evaluated is false); of each method that these charts call a reply, an error and a late answer; each requirement
/// or monitor put to the test. Some may be impossible in a correct project.
class Coverage {
 public:
  /// What of a plan was met, by the plan's indices.
  struct Met {
    explicit Met(const project::Plan& plan);
    std::vector<std::set<std::string>> nodes;                   ///< Statuses by node.
    std::vector<std::set<scxml::StateIndex>> states;            ///< By leaf; what holds them is met too,
    std::vector<std::set<scxml::TransitionIndex>> transitions;  ///< and so are source and targets.
    std::vector<std::set<std::pair<scxml::TransitionIndex, bool>>> guards;
    std::set<std::pair<std::string, std::string>> calls;  ///< "SERVICE.METHOD" and "reply", "error" or "late".
    std::set<std::string> tested;                         ///< Requirements and monitors.
  };

  enum class Kind : std::uint8_t { kNode, kState, kTransition, kGuard, kMethod, kRequirement };
  struct Thing {
    Kind kind;
    std::string of;    ///< The node's path, the chart's file, the call, the requirement.
    std::string what;  ///< Status, state, transition, condition and value, outcome; empty: put to the test.
    std::string at;    ///< "file:line", where there is one.
    friend auto operator<=>(const Thing&, const Thing&) = default;
  };

  /// Adds what of the plan can be reached.
  void add(const project::Plan& plan);
  /// What other runs could reach can be reached, and what they reached is.
  void add(const Coverage& other);
  void reach(const Thing& thing);
  void reach(const project::Plan& plan, const Met& met);
  /// What is reached here of the things of `known`, by their place among those.
  [[nodiscard]] std::vector<std::uint32_t> reached_of(const Coverage& known) const;
  /// By place among `things`; what lies beyond them is none.
  void reach(std::span<const std::uint32_t> things);
  [[nodiscard]] const std::map<Thing, bool>& things() const { return things_; }
  struct Count {
    std::size_t reached = 0;
    std::size_t of = 0;
  };
  [[nodiscard]] Count count(Kind kind) const;
  [[nodiscard]] Count all() const;
  [[nodiscard]] Value to_value() const;
  /// A line a kind, and what has not been reached.
  [[nodiscard]] std::string to_text() const;

 private:
  std::map<Thing, bool> things_;
};
[[nodiscard]] std::string_view to_string(Coverage::Kind kind);

/// Looks on at one run and notes what it reaches.
class CoverageWatch {
 public:
  /// Sees the run through `options`, which it adds to. All are borrowed.
  CoverageWatch(const project::Plan& plan, Coverage& coverage, runtime::RunOptions& options);
  ~CoverageWatch();
  CoverageWatch(const CoverageWatch&) = delete;
  CoverageWatch& operator=(const CoverageWatch&) = delete;

  /// Brings what the run has reached so far into the coverage, but for requirements: whether they were put to the test
  /// is known at its end. From any thread, one at a time, while nobody else looks at the coverage.
  void look();
  /// After the run.
  void finish(const runtime::RunReport& report);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::campaign
