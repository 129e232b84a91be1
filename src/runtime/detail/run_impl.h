#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/mission/subscriptions.h"
#include "sentree/runtime/detail/model_actor.h"
#include "sentree/runtime/detail/node_watch.h"
#include "sentree/runtime/detail/run_steering.h"
#include "sentree/runtime/detail/stream_publisher.h"
#include "sentree/runtime/detail/telemetry.h"
#include "sentree/runtime/durable.h"
#include "sentree/runtime/elsewhere.h"
#include "sentree/runtime/local_skill.h"
#include "sentree/runtime/monitors.h"
#include "sentree/runtime/problems.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/services.h"
#include "sentree/runtime/tap.h"
#include "sentree/runtime/topics.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::runtime {

// Why parts elsewhere are refused by a run that was given no way to them (`RunOptions::elsewhere`).
inline constexpr const char* kOnlyHere = ", and everything runs in one process here";

/// What one run consists of, and what of it knows of one another.
class Run::Impl final : public RunView, private RunInside {
 public:
  Impl(const project::Plan& plan, RunOptions options);
  ~Impl() override;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  RunReport execute();
  void interrupt();
  void forget();
  /// A thread still uses parts of this.
  [[nodiscard]] bool left_behind() const { return left_behind_; }

  TimePoint now() const override { return scheduler_->now(); }
  std::vector<ProcessReport> processes() override;
  std::optional<sim::State> world() override;

 private:
  struct LocalDriver;

  // Of who takes part in the run.
  Scheduler& scheduler() override { return *scheduler_; }
  ActorId director() const override { return director_; }
  ActorId observer() const override { return stream_.actor(); }
  void publish(Message message) override { stream_.publish(std::move(message)); }
  std::uint64_t next_call() override { return publisher_.next_call(); }
  std::uint64_t published() const override { return stream_.published(); }
  SimHost* sim() override;
  const Mission& mission() const override { return *mission_; }
  const Monitors& monitors() const override { return monitors_; }
  SkillActor* skill(std::size_t leaf) override { return skills_[leaf]; }
  Steering& steering() override { return steering_; }
  void inject(const project::Injection& injection) override { steering_.inject(injection); }
  void fail_leaf(std::size_t leaf, const std::string& reason) override;
  void spare(Spared what) override { steering_.faults().spare(what); }
  Result<void> settle(std::chrono::milliseconds patience) override;
  mission::State capture() override;
  void capture_at_rest(CaptureTold told) override;
  void end() override;

  // run.cpp: how it begins, goes on and ends. An error is why it does not begin.
  [[nodiscard]] std::optional<std::string> prepare();
  void connect_stream();
  void start_clocks();
  void schedule_timeline();
  void note_owed();
  void start_parts();
  Result<void> begin_or_resume();
  void go_on_from(const mission::State& state);
  void finish();
  void fill(RunReport& report);
  // Ends, and waits for, the threads that call into this and that are not the scheduler's: before what they call goes,
  // and before whoever executes the run is told that it is over.
  void end_callers();
  void on_decision(const MonitorReport& report);
  void given_up(const std::string& why);
  void problem(const std::string& what);
  Duration stretched(Duration wall) const;

  // run_parts.cpp: how its parts are made.
  Monitors::Replies replies_of_monitors();
  SteeredRun what_is_steered();
  void make_durable();
  void follow_orders();
  void make_world();
  void make_models();
  [[nodiscard]] std::optional<std::string> make_mission();
  [[nodiscard]] Result<std::unique_ptr<LeafDriver>> make_local(std::size_t index);
  [[nodiscard]] Result<std::unique_ptr<LeafDriver>> make_remote(std::size_t index);
  ModelActor* model_of(const std::string& service) const;
  std::optional<std::uint64_t> chosen(const mission::Choice& choice);
  void watch_nodes();
  // A node in C++ never comes back.
  void give_up_mission(const std::string& why);
  // In a replay when the recording was.
  void stop_mission();
  // What the scenario decides and the run never came to.
  void tell_unasked(RunReport& report) const;
  void pass(std::size_t leaf, RunOptions::LeafMessage what, Scheduler::Task task);

  // run_calls.cpp: calls and topics.
  std::unique_ptr<ServicePort> make_port(const project::ServicePlan& service, const std::string& leaf);
  // Before the first tick, so that no call pays for connecting. At most kOpenPatience.
  void open_ports();
  // What anybody has published, whether in this process or elsewhere.
  void deliver(const Message& message);
  void deliver(std::size_t leaf, const ToldTopic& told);
  // A call to an address that nobody answered.
  void tell_unanswered(const Message& message);
  void schedule_telemetry();
  // A call from outside the mission: by the scenario's timeline or through the control socket.
  mission::CallOutcome call_service(const std::string& name, const std::string& method, const Value& arguments);
  bool serves_control() const;
  void serve_control();

  // run_elsewhere.cpp: parts in other processes.
  [[nodiscard]] std::optional<std::string> refuse_elsewhere() const;
  [[nodiscard]] std::optional<std::string> reach_elsewhere();
  const std::vector<std::unique_ptr<Observer>>& observers() const;
  void keep_parts();
  void on_process(const ProcessEvent& event);
  void observe_process(const ProcessEvent& event);
  // Of a durable run that goes on: what happened to its parts before it did.
  void tell_died_with_run();
  // What comes from another process must not be published before what that has observed.
  void take_observations();
  void on_decided_elsewhere(const std::string& name, const monitor::Decision& decision);
  bool is_decided_elsewhere();
  void take_decisions();
  void take_decision(const std::string& name, const monitor::Decision& decision);
  // Nothing: it is an observer that is no monitor of the project, or one of a run that goes on, and known.
  std::optional<MonitorReport> note_decision(const std::string& name, const monitor::Decision& decision);
  struct Gathered;
  // In the director's actor, once all parts elsewhere have said what they remember.
  tl::expected<mission::State, Uncaptured> whole(Gathered& gathered);

  // run_durable.cpp: what its journal says, and how it goes on from there.
  [[nodiscard]] std::optional<std::string> prepare_durability();
  // What happened since the journal's state is going to happen again.
  Result<void> execute_again(const Journaled& journaled);
  // It is where it was when its executive died: the time since then passes at once.
  void resumed(const Journaled& journaled);
  // Nobody was there to hear an answer, so nobody was late. What was to be done in that time is done now.
  void pass_lost_time(const Gap& gap, Duration lost);
  std::string recording_name() const;
  // Run time between two states in the journal.
  Duration journal_period() const;
  void keep_journal(TimePoint when);
  // At first and whenever it has doubled.
  void fell_behind(Duration behind);
  // Observers begin as they were at the journal's state, from which on everything is observed again.
  std::optional<std::string> recall_observers();
  // What becomes of decisions that have not been taken: they may be taken where the journal begins, since nothing of
  // this instant is executed again.
  enum class Untaken : std::uint8_t { kAreTaken, kGiveUp };
  // As they are now, for the journal. Nothing: one does not say it in time, or the untaken give up.
  std::optional<List> remember_observers(Duration patience, Untaken untaken);
  bool is_again() const { return durability_ && durability_->catching_up(); }
  // Observations of what is executed again were heard before, but for the last ones.
  bool is_heard(std::uint64_t sequence) const { return !is_again() || sequence > options_.durable->known; }

  const project::Plan& plan_;
  const project::Scenario& scenario_;
  RunOptions options_;
  Services services_;
  std::unique_ptr<Scheduler> scheduler_;
  std::unique_ptr<SimHost> sim_;  // after its clock: it keeps up with it until it goes
  Stream stream_;
  Watchdog watchdog_;
  Monitors monitors_;
  StreamPublisher publisher_;
  ActorId director_;
  Telemetry telemetry_{*scheduler_, publisher_, director_};
  RunSteering steering_;
  std::unique_ptr<Durability> durability_;  // null: the run is not durable
  std::optional<mission::State> resumed_from_;
  std::vector<MonitorReport> remote_reports_;  // of monitors elsewhere; under problems_mutex_
  std::vector<std::pair<std::string, monitor::Decision>> decided_elsewhere_;  // not yet taken; likewise
  std::vector<ProcessEvent> died_with_run_;                                   // and before it went on; likewise
  Tap tap_;
  std::unique_ptr<Elsewhere> elsewhere_;             // null: everything runs in this process
  std::vector<std::unique_ptr<ModelActor>> models_;  // as in the plan
  std::vector<SkillActor*> skills_;                  // by leaf; null: it runs elsewhere
  mission::Subscriptions subscriptions_{plan_};      // of parts in this process, once they are made
  std::unique_ptr<NodeWatch> node_watch_;            // null: the mission has no nodes in C++
  std::unique_ptr<Mission> mission_;
  std::atomic<Mission*> ready_ = nullptr;  // the mission, once it can be interrupted
  std::mutex problems_mutex_;
  Problems problems_;
  std::vector<std::string> given_up_;
  std::atomic<bool> left_behind_ = false;
  TimePoint ended_{};
  Duration tell_behind_ = std::chrono::seconds(1);
  bool is_over_ = false;  // and durable
  std::atomic<bool> timed_out_ = false;
  std::set<std::string> owed_;  // by monitors when the rounds of the scenario's loop were over
  /// What the timeline says up to there has happened. Of the director.
  TimePoint timeline_to_ = TimePoint::min();
  std::atomic<bool> interrupted_ = false;
  std::uint64_t orders_ = 0;  // the last instant at which the scenario was asked who comes first
};

}  // namespace sentree::runtime
