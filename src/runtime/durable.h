#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sentree/mission/state.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/journal.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/services.h"

namespace sentree::runtime {

class SkillActor;

/// What makes a run durable: its journal, and the calls that are on their way out of it. All of it in the thread of the
/// run, which executes its parts one after the other.
class Durability final : public Chronicle {
 public:
  /// @param plan, scheduler  Borrowed.
  /// @param skill  Of a leaf.
  Durability(const project::Plan& plan, Scheduler& scheduler, const DurableOptions& options,
             std::function<SkillActor*(std::size_t leaf)> skill);

  /// Why runs of this plan cannot be durable; empty: they can.
  [[nodiscard]] static std::string obstacle(const project::Plan& plan);

  void instant(TimePoint now) override { journal_.instant(now); }
  void entered(TimePoint when, const mission::Delivery& what) override;
  /// A port to a service outside the run, whose calls are kept account of.
  [[nodiscard]] std::unique_ptr<ServicePort> guard(std::unique_ptr<ServicePort> port);
  /// What somebody does to the run, before it is done.
  void intervention(const project::Intervention& what, const std::string& source);
  /// The whole run as of now.
  void snapshot(mission::State state);

  /// Until `resumed`, the run is executed again: no call leaves it.
  /// Errors: mission.bad-state.
  Result<void> begin_again(const Journaled& journaled);
  [[nodiscard]] bool catching_up() const { return catching_up_; }
  /// The last instant is reached. Calls that may have been executed, and must not be twice, end as interrupted; the
  /// others are left to `ask_again`. The skills' deadlines are put off by `lost`.
  void resumed(const Gap& gap, Duration lost);
  void ask_again();

  [[nodiscard]] const std::vector<Gap>& gaps() const { return gaps_; }
  [[nodiscard]] Journal& journal() { return journal_; }

 private:
  class Port;
  struct Open {
    std::size_t leaf = 0;
    mission::Shared<mission::Call> call;
    bool sent = false;
  };
  void make(std::size_t leaf, const mission::Shared<mission::Call>& call, ServicePort& port);
  [[nodiscard]] const idl::Method& method_of(const mission::Call& call) const;
  [[nodiscard]] bool is_idempotent(const mission::Call& call) const;

  const project::Plan& plan_;
  Scheduler& scheduler_;
  std::function<SkillActor*(std::size_t)> skill_;
  std::function<void()> settle_;
  Journal journal_;
  std::map<std::uint64_t, Open> open_;  // by call
  std::set<std::uint64_t> sent_;        // before the run was resumed
  std::set<std::uint64_t> answered_;    // likewise
  std::vector<Gap> gaps_;
  bool catching_up_ = false;
  bool is_first_ = true;  // no state has been written
};

}  // namespace sentree::runtime
