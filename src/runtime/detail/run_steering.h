#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/mission/apply.h"
#include "sentree/project/check_intervention.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/monitors.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/skill.h"
#include "sentree/runtime/standing.h"
#include "sentree/runtime/steering.h"

namespace sentree::runtime {

class SkillActor;

/// What steering needs of the run. The functions are called in the director's actor.
struct SteeredRun {
  const project::Plan* plan = nullptr;
  Scheduler* scheduler = nullptr;
  ActorId director = 0;
  std::function<void(Message)> publish;
  std::function<std::uint64_t()> tick;  ///< Number of the last root tick. From any thread.
  std::function<mission::CallOutcome(const std::string& service, const std::string& method, const Value& args)> call;
  std::function<void()> stop;
  std::function<void(const std::string& process)> kill_process;
  std::function<bool(const std::string& process)> restart_process;  ///< False: it has not ended.
  std::function<SkillActor*(std::size_t leaf)> skill;               ///< Null: in another process.
  /// Of a skill of this process, as was asked for at that time.
  std::function<void(std::size_t leaf, TimePoint asked)> kill_skill;
  std::function<void(std::size_t leaf, TimePoint asked)> restart_skill;
  std::function<const Monitors&()> monitors;
  std::function<void(const std::string&)> problem;
  /// What a person does, before it is done.
  std::function<void(const project::Intervention&, const std::string& source)> keep;
  ActorId observer = 0;  ///< Where `monitors` may be looked at.
};

/// Interventions of a person that one run takes; one more is refused.
inline constexpr std::size_t kInterventionsMax = 100'000;

/// Does to a run what its timeline says and what a person asks for.
class RunSteering final : public Steering, private mission::Intervened {
 public:
  explicit RunSteering(SteeredRun run);

  /// In the director's actor: does what an entry of the timeline says.
  void inject(const project::Injection& injection);
  /// In the director's actor: does once more what a person did.
  void again(const project::Intervention& what, const std::string& source) { (void)execute(what, source, By::kPerson); }
  Result<Applied> apply_for(const project::Intervention& what, const std::string& source) override;

  /// What stands; for the parts of the run that it concerns.
  [[nodiscard]] StandingFaults& faults() { return standing_; }
  // In the director's actor: its part of the state of a run.
  void save(mission::State& state) const;
  void load(const mission::State& state);

  /// The port of a service of this process that is unreachable while it is killed.
  /// @param part  That it is part of, and that can be killed too; empty: none.
  [[nodiscard]] std::unique_ptr<ServicePort> guard(const std::string& service, std::string_view part,
                                                   std::unique_ptr<ServicePort> port);

  // Breakpoints: a listener of the stream; in a skill's actor after each of its steps; where `monitors` are.
  void observed(const Message& message);
  void skill_stepped(std::size_t leaf, const Skill& skill);
  void monitor_stepped(std::size_t index);

  /// In the mission's actor: a root tick has been done.
  void tick_done(std::uint64_t tick);
  /// Nothing is executed any more: whoever waits is told.
  void finish();
  /// As `stop`, without waiting; for whoever wants the run to end. From any thread.
  void ask_to_stop(const std::string& source);

  Status status() const override;
  Status wait_paused() override;
  TimePoint time() const override { return run_.scheduler->view_time(); }
  Result<void> pause() override;
  Result<void> resume() override;
  Result<void> step(std::uint64_t ticks) override;
  Result<void> run_until(TimePoint time) override;
  Result<void> set_factor(double factor) override;
  std::vector<mission::StandingIntervention> standing() const override;
  std::vector<project::SteeredPart> parts() const override;
  Result<std::string> scenario() const override;

 private:
  // An answer that somebody waits for.
  struct Answer {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<Result<Applied>> result;
  };
  // Runs `work` in the director's actor and waits for what it returns.
  Result<Applied> in_director(std::function<Result<Applied>()> work);
  Result<void> refuse() const;
  enum class By : std::uint8_t { kTimeline, kPerson };
  // In the director's actor: publishes an intervention and does it.
  Result<Applied> execute(const project::Intervention& what, const std::string& source, By by);

  // What an intervention finds; of the director's actor.
  TimePoint now() const override { return run_.scheduler->now(); }
  void publish(Message message) override { run_.publish(std::move(message)); }
  void stop_mission() override { run_.stop(); }
  Result<mission::CallOutcome> call_service(const project::intervention::Call& what) override;
  Result<std::uint64_t> next_id() override;
  void stand(std::uint64_t id, const project::Intervention& what) override;
  Result<void> end_standing(std::uint64_t id) override;
  std::optional<bool> is_killed(const std::string& part) const override;
  void kill_part(const std::string& part, TimePoint asked) override;
  void restart_part(const std::string& part, TimePoint asked) override;
  bool is_process(const std::string& part) const override;
  bool restart_process(const std::string& part) override { return run_.restart_process(part); }
  // Whose skill runs in this process.
  std::optional<std::size_t> leaf_here(const std::string& part) const;

  // Notes which states of its chart are active, so that entering one can be told.
  void prime(const project::intervention::Breakpoint& breakpoint);
  void reached(const std::vector<std::uint64_t>& breakpoints, const std::string& what);
  void change_mind();
  void go_on();
  void hold();

  struct Down {
    std::atomic<bool> killed = false;
  };
  class GuardedPort;

  SteeredRun run_;
  const project::InterventionScope scope_;
  StandingFaults standing_;
  std::vector<std::string> chart_names_;           // "skill:LEAF" by leaf
  std::map<std::string, Down, std::less<>> down_;  // services of the simulator, and "sim"; keys are fixed
  std::vector<char> killed_skills_;                // by leaf; the director's
  By by_ = By::kTimeline;                          // what is executed; likewise
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::uint64_t step_until_ = 0;  // number of the tick after which it pauses; 0: it does not
  std::uint64_t until_ = 0;       // which `run_until` holds; each change of mind makes an older one void
  std::vector<std::weak_ptr<Answer>> open_;
  std::set<std::uint64_t> holding_;  // breakpoints of the person who steers: the run pauses at them
  std::uint64_t stopped_at_ = 0;     // the breakpoint
  std::string stopped_what_;
  std::vector<project::Injection> done_;  // interventions so far that are not of the timeline
};

}  // namespace sentree::runtime
