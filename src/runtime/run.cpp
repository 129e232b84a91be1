#include "sentree/runtime/run.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <map>
#include <set>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/runtime/control.h"
#include "sentree/runtime/local_skill.h"
#include "sentree/runtime/monitors.h"
#include "sentree/runtime/remote_service.h"
#include "sentree/runtime/remote_skill.h"
#include "sentree/runtime/services.h"
#include "sentree/runtime/supervisor.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::runtime {

namespace {

// The stream as callers see it, with the monitors that gate it.
class StreamPublisher final : public Publisher {
 public:
  /// @param patience  How long a gate may take [run time].
  StreamPublisher(Stream& stream, const Monitors& monitors, const Clock& clock, Duration patience)
      : stream_(stream), monitors_(monitors), clock_(clock), patience_(patience) {}

  void publish(Message message) override { stream_.publish(std::move(message)); }
  std::optional<Admission> request(Message message, Stream::Decided decided) override {
    if (!monitors_.is_gated(call_of(message))) {
      stream_.publish(std::move(message));
      return Admission{};
    }
    return stream_.publish_if(
        std::move(message), [this](const Message& request) { return monitors_.judge(request); },
        clock_.now() + patience_, std::move(decided));
  }
  std::uint64_t next_call() override { return stream_.next_call(); }

 private:
  Stream& stream_;
  const Monitors& monitors_;
  const Clock& clock_;
  Duration patience_;
};

// What a run's processes get to end in order.
constexpr std::chrono::seconds kEndPatience{2};

// A private folder for the sockets of one run.
class RunFolder {
 public:
  RunFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "sentree-run-XXXXXX").string();
    if (mkdtemp(pattern.data()) != nullptr) path_ = pattern;
  }
  ~RunFolder() {
    std::error_code error;
    if (!path_.empty()) std::filesystem::remove_all(path_, error);
  }
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

void replace_all(std::string& text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size())) {
    text.replace(at, what.size(), with);
  }
}

}  // namespace

bool RunReport::any_violated() const {
  return std::any_of(monitors.begin(), monitors.end(),
                     [](const MonitorReport& m) { return m.verdict == monitor::Verdict::kViolated; });
}

class Run::Impl final : public RunView {
 public:
  Impl(const Plan& plan, RunOptions options)
      : plan_(plan),
        scenario_(plan.scenario),
        options_(std::move(options)),
        delays_(scenario_.delays),
        scheduler_(scenario_.virtual_time ? make_virtual_scheduler() : make_real_scheduler(scenario_.factor)),
        stream_(*scheduler_),
        watchdog_(scenario_.project.deadlines.script),
        monitors_(plan, *scheduler_, stream_, watchdog_,
                  {.decided = [this](const MonitorReport& report) { on_decision(report); },
                   .given_up = [this](const std::string& why) { given_up(why); }}),
        publisher_(stream_, monitors_, *scheduler_, stretched(scenario_.project.deadlines.call)),
        director_(scheduler_->add_actor("director")) {
    services_ = plan.services;
    if (plan.world) sim_ = std::make_unique<SimHost>(plan.world, scenario_.seed, *scheduler_);
  }

  RunReport execute() {
    RunReport report;
    report.scenario = scenario_.name;
    report.virtual_time = scenario_.virtual_time;
    report.seed = scenario_.seed;
    if (auto error = prepare()) {
      report.error = *error;
      return report;
    }
    report.processes = processes();

    stream_.subscribe([this](const Message& message) { monitors_.observe(message); });
    for (const auto& listener : options_.listeners) stream_.subscribe(listener);
    monitors_.start();
    if (options_.on_view) options_.on_view(this);
    if (!scenario_.virtual_time) start_control_socket();
    schedule_timeline();
    scheduler_->at(director_, TimePoint(scenario_.duration), Rank::kInjection, [this] {
      timed_out_ = true;
      mission_->stop();
    });
    mission_->start([this] {
      ended_ = scheduler_->now();
      scheduler_->stop();
    });
    ready_ = mission_.get();
    if (interrupted_) mission_->stop();  // while the parts were started
    // In virtual time nothing goes on without a thread, so a script that never ends has ended the run.
    const auto hung = scenario_.virtual_time ? monitors_.hung() : std::nullopt;
    const auto error = hung ? hung : scheduler_->run();
    if (options_.on_view) options_.on_view(nullptr);
    // Other processes first: they still publish while they halt.
    control_server_.reset();
    if (supervisor_) supervisor_->end(kEndPatience);
    observer_server_.reset();
    if (scenario_.virtual_time && left_behind_) ended_ = scheduler_->now();
    monitors_.finish(ended_);

    report.error = error.value_or("");
    report.mission = mission_->status();
    report.reason = mission_->reason();
    report.ended = ended_;
    report.timed_out = timed_out_;
    report.interrupted = interrupted_;
    report.observations = stream_.published();
    report.timing = mission_->timing();
    report.monitors = monitors_.reports();
    {
      const std::lock_guard lock(problems_mutex_);
      report.problems = problems_;
      report.given_up = given_up_;
    }
    report.problems.insert(report.problems.end(), mission_->problems().begin(), mission_->problems().end());
    judge(scenario_, report);
    return report;
  }

  /// A thread still uses parts of this.
  [[nodiscard]] bool left_behind() const { return left_behind_; }

  void interrupt() {
    interrupted_ = true;
    if (scheduler_->is_virtual()) {
      scheduler_->stop();
    } else if (Mission* mission = ready_.load()) {
      mission->stop();
    }
  }

  TimePoint now() const override { return scheduler_->now(); }
  std::vector<ProcessReport> processes() override {
    std::vector<ProcessReport> all{{"run", static_cast<std::int64_t>(getpid())}};
    if (!supervisor_) return all;
    for (const auto& process : supervisor_->running()) all.push_back({process.name, process.pid});
    return all;
  }
  std::optional<sim::State> world() override {
    return sim_ ? std::optional<sim::State>(sim_->snapshot()) : std::nullopt;
  }

 private:
  std::optional<std::string> prepare() {
    if (auto error = start_components()) return error;
    if (auto error = start_skills()) return error;
    return make_mission();
  }

  bool anything_remote() const {
    return !scenario_.processes.empty() ||
           std::any_of(plan_.leaves.begin(), plan_.leaves.end(), [](const LeafPlan& leaf) { return !leaf.at.empty(); });
  }

  // "{name}" stands for the address of a process of the scenario, "{run}" for the run's private folder.
  std::string resolved(std::string text) {
    if (text.find("{run}") != std::string::npos) {
      if (!folder_) folder_ = std::make_unique<RunFolder>();
      replace_all(text, "{run}", folder_->path());
    }
    if (supervisor_) {
      for (const auto& process : supervisor_->running()) replace_all(text, "{" + process.name + "}", process.address);
    }
    return text;
  }

  std::optional<std::string> start_process(const ProcessEntry& entry, std::vector<std::string> arguments) {
    arguments.insert(arguments.end(),
                     {"--seed", std::to_string(scenario_.seed), "--factor", shortest_decimal(scenario_.factor)});
    if (!supervisor_) {
      supervisor_ = std::make_unique<Supervisor>(options_.program.empty() ? own_program() : options_.program,
                                                 [this](const ProcessEvent& event) { on_process(event); });
    }
    const auto started = supervisor_->start({.name = entry.name,
                                             .arguments = std::move(arguments),
                                             .listen = resolved(entry.listen),
                                             .restarts = entry.restarts});
    return started ? std::nullopt : std::optional(started.error().message);
  }

  void on_process(const ProcessEvent& event) {
    Message message;
    message.source = "run";
    message.target = event.process;
    message.data = Map{{"process", event.process}};
    switch (event.kind) {
      case ProcessEvent::Kind::kExited:
        message.name = "process.exited";
        message.data = Map{{"process", event.process}, {"pid", event.pid}, {"how", event.how}};
        problem("process " + event.process + " ended: " + event.how);
        break;
      case ProcessEvent::Kind::kRestarted:
        message.name = "process.restarted";
        message.data = Map{{"process", event.process}, {"pid", event.pid}};
        break;
      case ProcessEvent::Kind::kGivenUp:
        message.name = "process.given_up";
        problem("process " + event.process + " ended too often and is not started again");
        break;
    }
    stream_.publish(std::move(message));
  }

  std::optional<std::string> start_components() {
    for (const ProcessEntry& entry : scenario_.processes) {
      if (entry.component.empty()) continue;
      if (auto error = start_process(entry, {"component", entry.component, "--project", scenario_.file})) return error;
      component_ = entry.name;
    }
    for (auto& [name, service] : services_) service.at = resolved(service.at);
    return std::nullopt;
  }

  std::optional<std::string> start_skills() {
    if (!anything_remote()) return std::nullopt;
    auto interface = observer_interface();
    if (!interface) return interface.error().message;
    const auto address = rpc::Address::parse(resolved("unix:{run}/observer.sock"));
    auto server = rpc::Server::start(*address, {{"observer", make_observer_service(*interface, publisher_)}});
    if (!server) return server.error().message;
    observer_server_ = std::move(*server);
    for (const ProcessEntry& entry : scenario_.processes) {
      if (entry.skill.empty()) continue;
      std::vector<std::string> arguments{"skill", scenario_.file, entry.skill, "--observer", to_string(*address)};
      for (const auto& [name, service] : services_)
        arguments.insert(arguments.end(), {"--at", name + "=" + service.at});
      if (auto error = start_process(entry, std::move(arguments))) return error;
    }
    return std::nullopt;
  }

  std::unique_ptr<ServicePort> make_port(const ServicePlan& service) {
    if (service.at == "sim") {
      SENTREE_ASSERT(sim_ != nullptr);  // checked when the plan was prepared
      return make_sim_port(*sim_, service.interface, service.robot);
    }
    auto address = rpc::Address::parse(service.at);
    SENTREE_ASSERT(address.has_value());
    if (address->service.empty()) address->service = service.name;
    auto port = make_remote_port(*address, service.service, service.name, scenario_.project.deadlines.call);
    SENTREE_ASSERT(port.has_value());
    return std::move(*port);
  }

  std::optional<std::string> make_mission() {
    std::vector<std::unique_ptr<LeafDriver>> drivers;
    for (std::size_t i = 0; i < plan_.leaves.size(); ++i) {
      auto driver = plan_.leaves[i].at.empty() ? make_local(i) : make_remote(i);
      if (!driver) return driver.error().message;
      drivers.push_back(std::move(*driver));
    }
    const MissionOptions options{.period = scenario_.project.period,
                                 .repeat = scenario_.project.repeat,
                                 .deadlines = scenario_.project.deadlines,
                                 .factor = scenario_.factor};
    mission_ = std::make_unique<Mission>(plan_, options, *scheduler_, stream_, std::move(drivers));
    return std::nullopt;
  }

  struct LocalDriver final : LeafDriver {
    std::unique_ptr<SkillActor> skill;
    void tick(std::uint64_t tick, bool started, const Map& inputs) override { skill->tick(tick, started, inputs); }
    void halt() override { skill->halt(); }
    void cancel() override { skill->cancel(); }
  };

  Result<std::unique_ptr<LeafDriver>> make_local(std::size_t index) {
    const LeafPlan& leaf = plan_.leaves[index];
    SkillActor::Replies replies;
    replies.answered = [this, index](std::uint64_t tick, bt::Status status, Map outputs) {
      mission_->answered(index, tick, status, std::move(outputs));
    };
    replies.halted = [this, index] { mission_->halted(index); };
    replies.problem = [this](const std::string& what) { problem(what); };
    replies.given_up = [this](const std::string& why) { given_up(why); };
    replies.log = [this, name = leaf.name](const scxml::LogLine& line) {
      Message message;
      message.source = name;
      message.name = name + ".log";
      message.data = Map{{"label", line.label}, {"text", line.text}};
      stream_.publish(std::move(message));
    };
    auto driver = std::make_unique<LocalDriver>();
    driver->skill = std::make_unique<SkillActor>(
        *leaf.chart,
        SkillActor::Options{.name = leaf.name,
                            .condition = leaf.condition,
                            .halt_deadline = stretched(scenario_.project.deadlines.halt),
                            .seed = hash_combine(scenario_.seed, hash_bytes(leaf.name)),
                            .watchdog = &watchdog_},
        services_, [this](const ServicePlan& service) { return make_port(service); }, publisher_, *scheduler_, delays_,
        std::move(replies));
    return std::unique_ptr<LeafDriver>(std::move(driver));
  }

  Result<std::unique_ptr<LeafDriver>> make_remote(std::size_t index) {
    const LeafPlan& leaf = plan_.leaves[index];
    const auto interface = skill_interface();
    if (!interface) return tl::unexpected(interface.error());
    auto address = rpc::Address::parse(resolved(leaf.at));
    if (!address) return tl::unexpected(address.error());
    RemoteSkillReplies replies;
    replies.answered = [this, index](std::uint64_t tick, bt::Status status, Map outputs) {
      mission_->answered(index, tick, status, std::move(outputs));
    };
    replies.halted = [this, index] { mission_->halted(index); };
    replies.problem = [this](const std::string& what) { problem(what); };
    const Deadlines& deadlines = scenario_.project.deadlines;
    return make_remote_skill({.leaf = leaf.name,
                              .condition = leaf.condition,
                              .address = *address,
                              .interface = *interface,
                              .tick_deadline = leaf.condition ? deadlines.condition : deadlines.unresponsive,
                              .halt_deadline = deadlines.halt},
                             std::move(replies));
  }

  Duration stretched(Duration wall) const {
    return Duration(static_cast<std::int64_t>(static_cast<double>(wall.count()) * scenario_.factor));
  }

  void schedule_timeline() {
    for (const Injection& injection : scenario_.timeline) {
      scheduler_->at(director_, injection.at, Rank::kInjection, [this, &injection] { inject(injection); });
    }
  }

  void inject(const Injection& injection) {
    if (!injection.kill.empty()) {
      publish_injection("kill", injection.kill, Map{{"process", injection.kill}});
      supervisor_->kill(injection.kill);
      return;
    }
    publish_injection(injection.service + "." + injection.method, injection.service, Map{{"args", injection.args}});
    const CallOutcome outcome = call_service(injection.service, injection.method, injection.args);
    const bool accepted = outcome.ok && (outcome.result.as_string() == nullptr || outcome.result.text() == "OK");
    if (!accepted) {
      problem(to_string(injection.span) + ": " + injection.service + "." + injection.method + " answered " +
              (outcome.ok ? to_json(outcome.result) : outcome.message));
    }
  }

  // A call from outside the mission: by the scenario's timeline or through the control socket.
  CallOutcome call_service(const std::string& name, const std::string& method, const Value& arguments) {
    const auto controlled = plan_.world ? test_control_of(name, *plan_.world) : std::nullopt;
    const auto service = services_.find(name);
    const idl::ServicePtr interface = controlled                   ? plan_.test_control
                                      : service != services_.end() ? service->second.service
                                                                   : nullptr;
    if (!interface)
      return {.ok = false, .result = {}, .kind = "arguments", .message = "the run has no service \"" + name + "\""};
    const auto found = idl::find_method(*interface, method, name);
    if (!found) return {.ok = false, .result = {}, .kind = "arguments", .message = found.error().message};
    const auto args = idl::conform_arguments(**found, arguments);
    if (!args) return {.ok = false, .result = {}, .kind = "arguments", .message = args.error().message};
    std::string at = controlled ? "sim" : service->second.at;
    if (controlled && !component_.empty()) at = supervisor_->address(component_);
    if (at == "sim")
      return sim_->call(interface->name, method, *args, controlled ? *controlled : service->second.robot);
    return call_once(*rpc::Address::parse(at), interface, name, method, *args, std::chrono::seconds(1));
  }

  void start_control_socket() {
    ControlHandler handler;
    handler.scenario = [this] { return scenario_.name; };
    handler.now = [this] { return scheduler_->now(); };
    handler.services = [this] {
      std::vector<ControlHandler::ServiceEntry> entries;
      for (const auto& [name, service] : services_) entries.push_back({name, service.service});
      if (plan_.test_control && plan_.world) {
        for (const std::string& name : test_control_names(*plan_.world)) entries.push_back({name, plan_.test_control});
      }
      return entries;
    };
    handler.call = [this](const std::string& service, const std::string& method, const Value& arguments) {
      Message message;
      message.source = "control";
      message.target = service;
      message.name = "scenario.injection";
      message.data = Map{{"args", arguments}, {"what", service + "." + method}};
      stream_.publish(std::move(message));
      return call_service(service, method, arguments);
    };
    auto server = start_control(std::move(handler));
    if (server)
      control_server_ = std::move(*server);
    else
      problem("no control socket: " + to_string(server.error()));
  }

  void publish_injection(const std::string& what, const std::string& target, Map data) {
    Message message;
    message.kind = MessageKind::kEvent;
    message.source = "scenario";
    message.target = target;
    message.name = "scenario.injection";
    data["what"] = what;
    message.data = std::move(data);
    stream_.publish(std::move(message));
  }

  void on_decision(const MonitorReport& report) {
    if (options_.on_decision) options_.on_decision(report);
    if (scenario_.stop_when_violated && report.verdict == monitor::Verdict::kViolated) mission_->stop();
  }

  void given_up(const std::string& why) {
    left_behind_ = true;
    {
      const std::lock_guard lock(problems_mutex_);
      given_up_.push_back(why);
    }
    problem(why);
  }

  void problem(const std::string& what) {
    {
      const std::lock_guard lock(problems_mutex_);
      if (problems_.size() < kProblemsMax) problems_.push_back(what);
    }
    if (options_.on_problem) options_.on_problem(what);
  }

  const Plan& plan_;
  const Scenario& scenario_;
  RunOptions options_;
  Delays delays_;
  std::unique_ptr<RunFolder> folder_;
  std::unique_ptr<SimHost> sim_;
  std::map<std::string, ServicePlan> services_;
  std::unique_ptr<Scheduler> scheduler_;
  Stream stream_;
  Watchdog watchdog_;
  Monitors monitors_;
  StreamPublisher publisher_;
  ActorId director_;
  std::unique_ptr<Supervisor> supervisor_;  // null: everything runs in this process
  std::string component_;                   // name of the process that runs the simulator; empty: this one does
  std::unique_ptr<rpc::Server> observer_server_;
  std::unique_ptr<rpc::Server> control_server_;
  std::unique_ptr<Mission> mission_;
  std::atomic<Mission*> ready_ = nullptr;  // the mission, once it can be interrupted
  std::mutex problems_mutex_;
  std::vector<std::string> problems_;
  std::vector<std::string> given_up_;
  std::atomic<bool> left_behind_ = false;
  TimePoint ended_{};
  std::atomic<bool> timed_out_ = false;
  std::atomic<bool> interrupted_ = false;
};

Run::Run(const Plan& plan, RunOptions options) : impl_(std::make_unique<Impl>(plan, std::move(options))) {}
Run::~Run() {
  if (impl_->left_behind()) keep_for_ever(std::shared_ptr<Impl>(std::move(impl_)));
}
RunReport Run::execute() { return impl_->execute(); }
void Run::interrupt() { impl_->interrupt(); }

void judge(const Scenario& scenario, RunReport& report) {
  report.unmet.clear();
  for (const std::string& why : report.given_up) report.unmet.push_back(why);
  if (!report.error.empty() && report.given_up.empty())
    report.unmet.push_back("the run could not go on: " + report.error);
  if (scenario.mission && *scenario.mission != to_string(report.mission)) {
    report.unmet.push_back("mission status " + std::string(to_string(report.mission)) + ", expected " +
                           *scenario.mission + (report.reason.empty() ? "" : " (" + report.reason + ")"));
  }
  if (!scenario.mission_reason.empty() && report.reason.find(scenario.mission_reason) == std::string::npos) {
    report.unmet.push_back("reason \"" + report.reason + "\", expected \"" + scenario.mission_reason + "\" in it");
  }
  for (const MonitorReport& monitor : report.monitors) {
    const auto expected = scenario.verdicts.find(monitor.name);
    const bool said =
        std::find(report.given_up.begin(), report.given_up.end(), monitor.failure) != report.given_up.end();
    if (!monitor.failure.empty() && !said)
      report.unmet.push_back("monitor " + monitor.name + " was given up: " + monitor.failure);
    if (expected == scenario.verdicts.end() || expected->second == to_string(monitor.verdict)) continue;
    report.unmet.push_back("monitor " + monitor.name + " is " + std::string(to_string(monitor.verdict)) +
                           ", expected " + expected->second);
  }
  if (scenario.distinct_processes) {
    std::set<std::int64_t> pids;
    for (const ProcessReport& process : report.processes) pids.insert(process.pid);
    if (pids.size() != scenario.processes.size() + 1)
      report.unmet.push_back("its parts did not run in processes of their own");
  }
}

}  // namespace sentree::runtime
