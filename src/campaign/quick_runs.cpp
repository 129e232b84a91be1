#include "sentree/campaign/quick_runs.h"

#include <algorithm>
#include <deque>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sentree/base/present.h"
#include "sentree/campaign/detail/quick_monitors.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/instant.h"
#include "sentree/mission/part_memory.h"
#include "sentree/project/intervention.h"
#include "sentree/scxml/enabled.h"
#include "sentree/sim/plan_memo.h"
#include "sentree/sim/scan_memo.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::campaign {

namespace {

// Of what is remembered; more is forgotten before the next run.
constexpr std::uint64_t kMemoryMax = 64U << 20U;
constexpr std::size_t kCoresMax = 20'000;

bool has_quick_parts(const project::Plan& plan) {
  const project::Scenario& scenario = plan.scenario;
  if (!plan.models.empty() || !plan.gates.empty() || !plan.observers.empty() || !scenario.processes.empty() ||
      !scenario.delays.empty() || !scenario.orders.empty() || !plan.world)
    return false;
  const bool services = std::all_of(plan.services.begin(), plan.services.end(),
                                    [](const auto& service) { return service.second.at == "sim"; });
  const bool publishes = std::any_of(scenario.project.services.begin(), scenario.project.services.end(),
                                     [](const project::ServiceEntry& service) { return !service.publish.empty(); });
  if (!services || plan.services.empty() || publishes) return false;
  // In scripts that need an interpreter a run could hang, which only those who watch it would see.
  const bool leaves = std::all_of(plan.leaves.begin(), plan.leaves.end(), [](const project::LeafPlan& leaf) {
    return leaf.chart && leaf.at.empty() && !leaf.protocol && leaf.subscribes.empty() && scxml::is_native(*leaf.chart);
  });
  const bool monitors = std::all_of(plan.monitors.begin(), plan.monitors.end(), [](const monitor::Model& model) {
    // What is decided is observed, but not here.
    return QuickMonitors::fits(model) && !model.listens_to("monitor.satisfied");
  });
  return leaves && monitors && mission::PartMemory::remembers(plan);
}

}  // namespace

class QuickRuns::Impl final : private mission::PartMemory::Outside {
 public:
  explicit Impl(const project::Plan& plan)
      : plan_(plan), deadlines_(plan.scenario.project.deadlines), monitors_(plan.monitors) {
    remember_anew();
  }

  std::optional<Done> run(const project::Scenario& scenario, const sim::World& world) {
    if (!std::all_of(scenario.timeline.begin(), scenario.timeline.end(),
                     [&](const project::Injection& injection) { return can_be_done(injection.what, world); }) ||
        !has_deadlines_of(scenario) || !pays())
      return std::nullopt;
    if (memory_->bytes() > kMemoryMax || monitors_.known() > kCoresMax) remember_anew();
    world_ = &world;
    state_ = sim::initial_state(world, scenario.seed);
    sim::ScanMemo scans;
    const Present<sim::ScanMemo> remembers_scans(scans);
    const Present<sim::PlanMemo> remembers_plans(plans_);
    now_ = {};
    tick_ = 0;
    observations_ = 0;
    goes_well_ = true;
    done_ = {};
    monitors_.begin();
    run_ = memory_->begin();
    const std::uint64_t executed = memory_->executed();
    const std::uint64_t known = memory_->looked_up();
    auto done = execute(scenario) ? report(scenario) : std::nullopt;
    ++tried_;
    if (done) ++went_well_;
    executed_lately_ = memory_->executed() - executed;
    known_lately_ = memory_->looked_up() - known;
    return done;
  }

  std::uint64_t steps_executed() const { return executed_before_ + memory_->executed(); }

 private:
  // Where most runs end otherwise, or hardly a step comes again, it is only more work.
  bool pays() const {
    constexpr std::uint64_t kTriedMin = 20;
    return tried_ < kTriedMin || (went_well_ * 10 >= tried_ && executed_lately_ * 4 <= known_lately_);
  }

  bool execute(const project::Scenario& scenario) {
    std::vector<const project::Injection*> timeline;
    for (const project::Injection& injection : scenario.timeline) timeline.push_back(&injection);
    std::stable_sort(timeline.begin(), timeline.end(), [](const auto* a, const auto* b) { return a->at < b->at; });
    std::size_t injection = 0;
    mission::Instant instant(plan_.leaves.size() + 1);
    while (!memory_->ended(run_)) {
      const TimePoint next = mission::PartMemory::next(run_);
      if (next == kNever || next >= TimePoint(scenario.duration)) return false;
      if (next != now_) instant.begin();
      if (!instant.admits(run_.queue.size())) return false;
      if (injection < timeline.size() && timeline[injection]->at <= next) {
        now_ = run_.now = timeline[injection]->at;
        if (!apply(*timeline[injection++])) return false;
        continue;
      }
      now_ = next;
      memory_->step(run_, *this);
      if (!goes_well() || memory_->error()) return false;
    }
    return memory_->root(run_) == bt::Status::kSuccess;
  }

  std::optional<Done> report(const project::Scenario& scenario) {
    look();
    monitors_.finish(now_);
    if (!goes_well()) return std::nullopt;
    runtime::RunReport& report = done_.report;
    report.scenario = scenario.name;
    report.virtual_time = true;
    report.seed = scenario.seed;
    report.mission = bt::Status::kSuccess;
    report.ended = now_;
    report.monitors = monitors_.reports();
    // That one was decided is observed.
    report.observations = observations_ + monitors_.decided();
    return std::move(done_);
  }

  void remember_anew() {
    if (memory_) executed_before_ += memory_->executed();
    memory_ = std::make_unique<mission::PartMemory>(plan_, mission::PartMemory::FaultsFrom::kNowhere);
    known_.clear();
    told_.clear();
    served_.clear();
    monitors_.forget();
  }

  bool has_deadlines_of(const project::Scenario& scenario) const {
    const project::Deadlines& a = deadlines_;
    const project::Deadlines& b = scenario.project.deadlines;
    return a.call == b.call && a.condition == b.condition && a.budget == b.budget && a.halt == b.halt &&
           a.unresponsive == b.unresponsive && scenario.delays.empty() && scenario.orders.empty();
  }

  bool can_be_done(const project::Intervention& what, const sim::World& world) const {
    using namespace project::intervention;
    const std::string* part = nullptr;
    if (const auto* kill = std::get_if<Kill>(&what)) part = &kill->part;
    if (const auto* restart = std::get_if<Restart>(&what)) part = &restart->part;
    if (part != nullptr) {
      return std::any_of(plan_.leaves.begin(), plan_.leaves.end(),
                         [&](const project::LeafPlan& leaf) { return leaf.name == *part; });
    }
    const auto* call = std::get_if<Call>(&what);
    if (call == nullptr) return false;
    const auto service = service_of(call->method, world);
    const idl::Method* method = service ? service->interface->find(service->method) : nullptr;
    return method != nullptr && !method->oneway;
  }

  struct Called {
    idl::ServicePtr interface;
    std::string robot;
    std::string method;
  };
  std::optional<Called> service_of(const std::string& call, const sim::World& world) const {
    const std::size_t dot = call.rfind('.');
    if (dot == std::string::npos) return std::nullopt;
    const std::string name = call.substr(0, dot);
    if (const auto robot = project::test_control_of(name, world); robot && plan_.test_control)
      return Called{plan_.test_control, *robot, call.substr(dot + 1)};
    const auto service = plan_.services.find(name);
    if (service == plan_.services.end()) return std::nullopt;
    return Called{service->second.service, service->second.robot, call.substr(dot + 1)};
  }

  bool apply(const project::Injection& injection) {
    const auto* call = std::get_if<project::intervention::Call>(&injection.what);
    if (call == nullptr) return memory_->inject(run_, injection.what, *this).has_value() && goes_well();
    hear(project::injection_message(injection.what, injection.source, 0));
    const auto service = service_of(call->method, *world_);
    const idl::Method& method = *service->interface->find(service->method);
    const auto args = idl::conform_arguments(method, call->args);
    if (!args || !idl::check_ranges(method, *args)) return true;  // it is refused, and told
    (void)sim::call_uncast(*world_, state_,
                           {.service = service->interface->name,
                            .method = service->method,
                            .args = *args->as_map(),
                            .robot = service->robot},
                           now_);
    return goes_well();
  }

  void look() {
    sim::advance_uncast(*world_, state_, now_);
    double charge = 1.0;
    for (const sim::RobotState& robot : state_.robots) charge = std::min(charge, robot.battery.charge);
    done_.battery_end = charge;
    done_.battery_least = std::min(done_.battery_least, charge);
  }

  // An observation that is not remembered.
  void hear(Message message) {
    ++observations_;
    if (monitors_.hears(message.name)) observe(QuickMonitors::kOnce, message, false);
  }

  void observe(std::uint32_t number, Message& message, bool varies) {
    message.time = now_;
    message.tick = tick_;
    monitors_.observe(number, message, varies);
  }

  // ---- the run, as the memory tells it
  struct Known {
    bool is_known = false;
    bool is_tick = false;
    bool is_answer = false;
    Message* told = nullptr;  // if it is heard; of an answer and a tick with what is told at present
    Value* varies = nullptr;  // of these, in `told`: the result, and the number
  };

  void observed(std::uint32_t number, TimePoint, const Message& message) override {
    ++observations_;
    if (number >= known_.size()) known_.resize(number + 1);
    Known& known = known_[number];
    if (!known.is_known) {
      known.is_known = true;
      known.is_tick = message.name == "mission.tick";
      known.is_answer = memory_->is_answer(number);
      if (monitors_.hears(message.name)) {
        known.told = &told_.emplace_back(message);
        if (known.is_answer || known.is_tick)
          known.varies = known.told->data.as_map()->find(known.is_tick ? "tick" : "result");
      }
    }
    if (known.is_tick) {
      ++tick_;
      look();
    }
    if (known.told == nullptr) return;
    if (known.is_tick) *known.varies = static_cast<std::int64_t>(tick_);
    Value* const result = known.is_answer ? memory_->result() : nullptr;
    if (result == nullptr) return observe(number, *known.told, false);
    // One that is true or false comes as it came before. Others are lent for as long as they are looked at.
    if (result->as_bool() != nullptr) return observe(number, *known.told, false);
    lend(*known.varies, *result);
    observe(number, *known.told, true);
    lend(*known.varies, *result);
  }
  // Most are maps, which change places more quickly than values do.
  static void lend(Value& a, Value& b) {
    if (a.as_map() != nullptr && b.as_map() != nullptr)
      std::swap(*a.as_map(), *b.as_map());
    else
      std::swap(a, b);
  }
  std::uint64_t choose(std::uint32_t, const mission::Choice&) override {
    goes_well_ = false;
    return 0;
  }
  std::size_t order(std::span<const std::uint32_t>) override { return 0; }
  std::optional<mission::Veto> judge(const Message&) override { return std::nullopt; }
  void taken(std::size_t, scxml::TransitionIndex) override {}
  void problem(const std::string&) override { goes_well_ = false; }
  void refused(const Diagnostic&) override { goes_well_ = false; }
  mission::CallOutcome serve(std::size_t, const mission::Call& call) override {
    Served& served = served_[&call];
    if (served.service == nullptr) served.service = &plan_.services.at(call.service);
    const project::ServicePlan& service = *served.service;
    static const Map kNone;
    const Map* args = call.args.as_map();
    auto result = sim::call_uncast(*world_, state_,
                                   {.service = service.interface,
                                    .method = call.method,
                                    .args = args != nullptr ? *args : kNone,
                                    .robot = service.robot,
                                    .former = std::exchange(served.former, Value())},
                                   now_);
    if (!result) return mission::CallOutcome::failed(idl::CallErrorKind::kException, result.error().message);
    return mission::CallOutcome::returned(std::move(*result));
  }

  void served(const mission::Call& call, Value&& result) override { served_[&call].former = std::move(result); }

  bool goes_well() const { return goes_well_ && monitors_.go_well(); }

  const project::Plan& plan_;
  const project::Deadlines deadlines_;
  std::unique_ptr<mission::PartMemory> memory_;
  std::uint64_t executed_before_ = 0;
  std::vector<Known> known_;  // by the number of an observation
  std::deque<Message> told_;
  struct Served {
    const project::ServicePlan* service = nullptr;
    Value former;  // what was answered last
  };
  std::unordered_map<const mission::Call*, Served> served_;  // calls that the memory has
  QuickMonitors monitors_;
  sim::PlanMemo plans_;

  // Of the run that goes on.
  const sim::World* world_ = nullptr;
  sim::State state_;
  mission::PartMemory::Run run_;
  TimePoint now_{};
  std::uint64_t tick_ = 0;
  std::uint64_t observations_ = 0;
  bool goes_well_ = true;
  Done done_;
  // What shows whether it pays.
  std::uint64_t tried_ = 0;
  std::uint64_t went_well_ = 0;
  std::uint64_t executed_lately_ = 0;  // steps of the last run
  std::uint64_t known_lately_ = 0;
};

QuickRuns::QuickRuns(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
QuickRuns::~QuickRuns() = default;

std::unique_ptr<QuickRuns> QuickRuns::of(const project::Plan& plan) {
  if (!has_quick_parts(plan)) return nullptr;
  return std::unique_ptr<QuickRuns>(new QuickRuns(std::make_unique<Impl>(plan)));
}

std::optional<QuickRuns::Done> QuickRuns::run(const project::Scenario& scenario, const sim::World& world) {
  return impl_->run(scenario, world);
}

std::uint64_t QuickRuns::steps_executed() const { return impl_->steps_executed(); }

}  // namespace sentree::campaign
