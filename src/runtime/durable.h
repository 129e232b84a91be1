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
             std::function<SkillActor*(std::size_t leaf)> skill, std::vector<Gap> gaps);

  /// Why runs of this plan cannot be durable; empty: they can.
  [[nodiscard]] static std::string obstacle(const project::Plan& plan);
  /// What is done again when a run of this plan is resumed, though it was done before; empty: nothing.
  [[nodiscard]] static std::string done_again(const project::Plan& plan);

  void instant(TimePoint now) override { journal_.instant(now); }
  void entered(const Place& where, const mission::Delivery& what) override;
  /// A port to a service outside the run, whose calls are kept account of.
  [[nodiscard]] std::unique_ptr<ServicePort> guard(std::unique_ptr<ServicePort> port);
  /// What somebody does to the run, before it is done.
  void intervention(const project::Intervention& what, const std::string& source);
  /// Has a step of a chart executed elsewhere; that nobody did it is kept, so that it is so again.
  [[nodiscard]] tl::expected<Value, mission::ChartElsewhere::Away> execute(mission::ChartElsewhere& chart,
                                                                           const scxml::Session& session,
                                                                           const scxml::StepOrder& order);
  /// Something that is published of the run's processes, before it is; and what that was, of an input that is such.
  void observed(const Message& message);
  [[nodiscard]] static std::optional<Message> observed(const Value& input);
  /// What a monitor elsewhere has decided, before that is told; and what it was, of an input that is such.
  void decided(const std::string& monitor, const monitor::Decision& decision);
  [[nodiscard]] static std::optional<std::pair<std::string, monitor::Decision>> decided(const Value& input);
  /// The whole run as of now, and what else has to be known of it: entries of `Journaled::open` without a call.
  /// @param timeline_to  Up to where the scenario's timeline has happened: what fell into a gap comes behind it.
  void snapshot(mission::State state, List beside, TimePoint timeline_to);
  [[nodiscard]] static std::optional<TimePoint> timeline_to(const Journaled& journaled);

  /// What came from outside, each with how it is scheduled again.
  using Again = std::vector<std::pair<Place, std::function<void()>>>;
  /// Until `resumed`, the run is executed again: no call leaves it. Adds to `again` what came in for its skills.
  /// Errors: mission.bad-state.
  Result<void> begin_again(const Journaled& journaled, Again& again);
  [[nodiscard]] bool catching_up() const { return catching_up_; }
  /// The last instant is reached. Calls that may have been executed, and must not be twice, end as interrupted; the
  /// others are left to `ask_again`. The skills' deadlines are put off by `lost`.
  void resumed(const Gap& gap, Duration lost);
  void ask_again();
  /// Instead of `resumed`: the calls that are on their way at the last instant, as `Journaled::open` has them.
  [[nodiscard]] List reached();

  [[nodiscard]] const std::vector<Gap>& gaps() const { return gaps_; }
  /// Wall time in which the run did nothing but wait for who executes steps elsewhere.
  [[nodiscard]] Duration waited_for_charts() const { return waited_for_charts_; }
  [[nodiscard]] Journal& journal() { return journal_; }

 private:
  class Port;
  struct Open {
    std::size_t leaf = 0;
    mission::Shared<mission::Call> call;
    bool sent = false;
  };
  void make(std::size_t leaf, const mission::Shared<mission::Call>& call, ServicePort& port);
  [[nodiscard]] List open() const;
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
  std::uint64_t chart_steps_ = 0;       // elsewhere, since the run began
  std::set<std::uint64_t> lost_;        // of these, before the run was resumed
  bool executes_here_ = false;          // what is executed again, since its processes are gone
  std::vector<Gap> gaps_;
  Duration waited_for_charts_{};
  bool catching_up_ = false;
  bool is_first_ = true;  // no state has been written
};

/// What a person is told of a durable run that was held up [wall time], and of what.
[[nodiscard]] std::string behind_the_clock(Duration behind, Duration for_charts, Duration for_disk);

/// What a durable run was, and goes on as with another project.
struct Replaced {
  Journaled journaled;               ///< For `RunOptions::resume` with the new plan.
  std::vector<std::string> changes;  ///< See `mission::Carried`.
  /// What the recording of the run that died has not: tells it to `listeners` and `on_decision`, in its order.
  std::vector<std::function<void(const struct RunOptions&)>> untold;
};

/// Brings the run of a journal to its last instant with the plan that it had, and carries it over to another plan.
/// Nothing is written and nothing leaves the run.
/// @param known  The last observation that its recording holds.
/// Codes: those of `mission::carry`; run.ended (it had ended), journal.*, mission.*.
[[nodiscard]] Loaded<Replaced> replace_plan(const project::Plan& before, const Journaled& journaled,
                                            std::uint64_t known, const project::Plan& after);

}  // namespace sentree::runtime
