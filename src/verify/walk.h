#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/rng.h"
#include "sentree/verify/monitor_memory.h"
#include "sentree/verify/periods.h"

namespace sentree::verify {

/// The generator of run `number` of a seed; no two of them, of any seeds, have anything in common.
[[nodiscard]] inline Rng rng_of(std::uint64_t seed, std::uint64_t number) {
  return Rng(hash_combine(hash_combine(0, seed), number));
}

/// A probability for each alternative, or a die: which alternative comes.
[[nodiscard]] std::uint64_t thrown(Rng& rng, std::uint64_t count, const mission::Choice* choice);

/// Runs by chance as walks: states of mission and monitors are numbers, and where a period leads with what is drawn is
/// found out once. What nobody gives a probability is thrown by a die. One thread at a time.
class Walk {
 public:
  struct Step {
    std::uint32_t to = 0;
    std::uint32_t seen = 0;
    Duration took{};
    Duration judged{};  ///< As `Periods::Way` has it.
  };

  /// @param plan   Without `obstacles`; borrowed.
  /// @param score  Asked once of each state of the mission; empty: nothing is scored.
  Walk(const project::Plan& plan, Order order, std::function<Result<double>(const Frontier&)> score = {});

  /// Forgets everything. Errors: those of `Periods::begin`.
  Result<void> begin();
  /// Goes on by one period. Errors: those of `Periods::go_on`.
  Result<Step> go_on(std::uint32_t from, Rng& rng);
  /// No period follows before `end`. A mission that is over comes to its end.
  [[nodiscard]] bool is_at_end(std::uint32_t at, TimePoint now, TimePoint end) const {
    return ended(at) || (!states_[at].over && now + states_[at].until_planned >= end);
  }
  [[nodiscard]] bool ended(std::uint32_t at) const { return periods_->graph().nodes[at].ended; }
  [[nodiscard]] double score(std::uint32_t at) const { return states_[at].score; }

  [[nodiscard]] std::size_t monitors() const { return monitors_.size(); }
  [[nodiscard]] MonitorMemory& monitor(std::size_t i) { return *monitors_[i]; }
  [[nodiscard]] std::uint32_t first(std::size_t monitor) const { return first_[monitor]; }

  /// About.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  // A decision that is made in a period, or where the period leads: a number of `ways_`.
  struct Fork {
    std::uint32_t count = 0;
    std::uint32_t next = 0;           // index of the first of its alternatives in `next_`
    std::uint32_t probability = kNo;  // likewise in `probabilities_`
  };
  struct State {
    std::uint32_t first = kNo;  // as in `next_`
    bool over = false;
    Duration until_planned{};
    double score = 0;
  };
  static constexpr std::uint32_t kNo = UINT32_MAX;
  static constexpr std::uint32_t kIsWay = 1U << 31U;

  [[nodiscard]] std::uint32_t last_known(std::uint32_t from, std::size_t depth) const;

  const project::Plan& plan_;
  Options options_;
  std::function<Result<double>(const Frontier&)> score_;
  std::optional<Periods> periods_;
  std::vector<std::unique_ptr<MonitorMemory>> monitors_;
  std::vector<std::uint32_t> first_;  // state of each monitor
  std::vector<Fork> forks_;
  std::vector<std::uint32_t> next_;  // by fork and alternative: a fork, a way, or nothing that is known
  std::vector<double> probabilities_;
  std::vector<Step> ways_;
  std::vector<State> states_;
  double score_now_ = 0;  // of the latest state that was new
  std::optional<Diagnostic> no_score_;
  std::vector<std::uint32_t> script_;
  std::vector<std::uint32_t> met_;
};

}  // namespace sentree::verify
