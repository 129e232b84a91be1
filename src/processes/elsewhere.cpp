#include "sentree/processes/elsewhere.h"

#include <algorithm>
#include <atomic>
#include <deque>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/processes/control.h"
#include "sentree/processes/detail/memory_client.h"
#include "sentree/processes/detail/observation_socket.h"
#include "sentree/processes/detail/remote_chart.h"
#include "sentree/processes/environment.h"
#include "sentree/processes/executive.h"
#include "sentree/processes/remote_observer.h"
#include "sentree/processes/remote_service.h"
#include "sentree/processes/remote_skill.h"
#include "sentree/processes/supervisor.h"
#include "sentree/rpc/middleware.h"
#include "sentree/sim/services.h"

namespace sentree::processes {

using runtime::ProcessEvent;
using runtime::Services;

namespace {

// Requests of others whose outcome has not come.
constexpr std::size_t kOverheardMax = 256;
// Of the 107 octets that a socket's path may have, the rest is for the names in the folder: those of processes and
// observers.
constexpr std::size_t kSocketFolderMax = 60;
// What a run's processes get to end in order.
constexpr std::chrono::seconds kEndPatience{2};

void replace_all(std::string& text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size())) {
    text.replace(at, what.size(), with);
  }
}

// Of a leaf: the mission has it, and whoever ends the run's threads.
class SharedLeaf final : public runtime::LeafDriver {
 public:
  explicit SharedLeaf(std::shared_ptr<RemoteLeafDriver> leaf) : leaf_(std::move(leaf)) {}
  void tick(mission::TickSkill what, TimePoint asked) override { leaf_->tick(std::move(what), asked); }
  void halt(TimePoint asked) override { leaf_->halt(asked); }
  void cancel(TimePoint asked) override { leaf_->cancel(asked); }

 private:
  const std::shared_ptr<RemoteLeafDriver> leaf_;
};

class PartsElsewhere final : public runtime::Elsewhere {
 public:
  PartsElsewhere(ElsewhereOptions options, Surroundings run)
      : options_(std::move(options)), run_(std::move(run)), scenario_(run_.plan.scenario) {}
  ~PartsElsewhere() override { close(Closed::kWhole); }

  std::optional<std::string> start(Services& services) override {
    if (auto error = make_folder()) return error;
    if (auto error = start_components()) return error;
    for (auto& [name, service] : services) service.at = resolved(service.at);
    if (auto error = start_skills(services)) return error;
    return connect_observers();
  }

  std::optional<std::string> subscribe(const Services& services) override {
    for (const auto& [name, service] : services) {
      if (!service.observed.empty()) {
        if (auto error = overhear(service)) return error;
        continue;
      }
      const auto address = rpc::Address::parse(service.at);
      if (!address || address->kind != rpc::Address::Kind::kOther) continue;
      if (!rpc::middleware_of(*address).is_source(*address, service.service.get())) {
        // Others may connect what is published on before anything is.
        auto published = rpc::connect(*address, service.service, {.target = name, .problem = run_.problem});
        if (!published) return published.error().message;
        published_.push_back(std::move(*published));
        continue;
      }
      const auto came = std::make_shared<std::atomic<bool>>(false);
      auto opened =
          rpc::middleware_of(*address).subscribe(*address, service.service,
                                                 [this, name = name, came](const idl::Method& method, Value arguments) {
                                                   *came = true;
                                                   publish_request(name, method, std::move(arguments));
                                                 },
                                                 {.target = name, .problem = run_.problem});
      if (!opened) return opened.error().message;
      sources_.push_back(std::move(*opened));
      await(name, service.at, service.service, came);
    }
    return std::nullopt;
  }

  const std::vector<std::unique_ptr<runtime::Observer>>& observers() const override { return observers_; }

  Result<std::unique_ptr<runtime::LeafDriver>> make_leaf(std::size_t index, runtime::LeafReplies replies) override {
    const project::LeafPlan& leaf = run_.plan.leaves[index];
    const auto interface = skill_interface();
    if (!interface) return tl::unexpected(interface.error());
    auto address = rpc::Address::parse(resolved(leaf.at));
    if (!address) return tl::unexpected(address.error());
    const project::Deadlines& deadlines = scenario_.project.deadlines;
    auto driver = make_remote_skill({.leaf = leaf.name,
                                     .condition = leaf.condition,
                                     .address = *address,
                                     .interface = *interface,
                                     .memory_interface = served_skill_interface().value_or(nullptr),
                                     .tick_deadline = leaf.condition ? deadlines.condition : deadlines.unresponsive,
                                     .halt_deadline = deadlines.halt},
                                    std::move(replies));
    if (!driver) return tl::unexpected(driver.error());
    leaves_.emplace_back(index, std::move(*driver));
    return std::make_unique<SharedLeaf>(leaves_.back().second);
  }

  Result<std::unique_ptr<mission::ChartElsewhere>> make_chart(std::size_t index) override {
    const project::LeafPlan& leaf = run_.plan.leaves[index];
    auto address = rpc::Address::parse(resolved(leaf.at));
    if (!address) return tl::unexpected(address.error());
    const auto entry = std::find_if(
        scenario_.processes.begin(), scenario_.processes.end(),
        [&](const project::ProcessEntry& process) { return leaf.at == fmt::format("{{{}}}", process.name); });
    const std::string process = entry != scenario_.processes.end() ? entry->name : "";
    return make_remote_chart({.leaf = leaf.name,
                              .chart = *leaf.chart,
                              .address = *address,
                              // Others may have the processors meanwhile.
                              .step_deadline = 3 * scenario_.project.deadlines.script,
                              .hangs = [this, process] { kill(process); },
                              .problem = run_.problem});
  }

  std::unique_ptr<runtime::ServicePort> make_port(const project::ServicePlan& service, Duration deadline) override {
    auto address = rpc::Address::parse(service.at);
    SENTREE_ASSERT(address.has_value());  // checked when the plan was prepared
    auto port = make_remote_port(*address, service.service, service.name, deadline);
    if (port) return std::move(*port);
    run_.problem(fmt::format("service {} cannot be called: {}", service.name, port.error().message));
    return nullptr;
  }

  mission::CallOutcome call(const std::string& at, const idl::ServicePtr& interface, const std::string& name,
                            const std::string& method, const Value& args, Duration patience) override {
    const auto address = rpc::Address::parse(at);
    if (address) return call_once(*address, interface, name, method, args, patience);
    return mission::CallOutcome::failed(rpc::CallErrorKind::kUnreachable,
                                        fmt::format("nothing in the run serves \"{}\"", name));
  }

  // Test control is served beside the simulated services, wherever that is.
  std::string control_address(const Services& services, const std::string& control) const override {
    if (!component_.empty()) return supervisor_->address(component_);
    for (const auto& [name, service] : services) {
      if (sim::find_service(service.interface) == nullptr) continue;
      if (auto address = rpc::Address::parse(service.at))
        return to_string(rpc::middleware_of(*address).beside(*address, name, control));
    }
    return {};
  }

  void take_observations() override {
    if (inbox_) inbox_->drain();
  }

  std::size_t ask_memories(std::function<void(std::size_t, runtime::ToldMemory)> told) override {
    for (const auto& [leaf, driver] : leaves_)
      driver->remember([told, leaf = leaf](runtime::ToldMemory memory) { told(leaf, std::move(memory)); });
    if (component_.empty()) return leaves_.size();
    if (!simulator_) {
      const auto address = rpc::Address::parse(supervisor_->address(component_));
      auto interface = kept_simulation_interface();
      if (address && interface && run_.plan.world) {
        simulator_ = std::make_unique<MemoryClient>(*address, std::move(*interface),
                                                    project::test_control_names(*run_.plan.world).front());
      }
    }
    const auto of_simulator = [told](runtime::ToldMemory memory) { told(kSimulator, std::move(memory)); };
    if (simulator_)
      simulator_->ask(Map(), of_simulator);
    else
      of_simulator({runtime::ToldMemory::Kind::kNever, {}});
    return leaves_.size() + 1;
  }

  void serve_control(runtime::ControlHandler handler) override {
    auto server = start_control(std::move(handler));
    if (server)
      control_server_ = std::move(*server);
    else
      run_.problem(fmt::format("no control socket: {}", to_string(server.error())));
  }

  std::vector<runtime::ProcessReport> processes() const override {
    std::vector<runtime::ProcessReport> all;
    if (!supervisor_) return all;
    for (const auto& process : supervisor_->all()) {
      if (process.pid > 0) all.push_back({process.name, process.pid});
    }
    return all;
  }

  List parts() const override {
    List parts;
    if (!supervisor_) return parts;
    for (const auto& process : supervisor_->all()) {
      parts.push_back(Map{{"name", process.name},
                          {"pid", static_cast<std::int64_t>(process.pid)},
                          {"begun", static_cast<std::int64_t>(process_begun(process.pid))},
                          {"address", process.address},
                          {"folder", parts_folder_.string()}});
    }
    return parts;
  }

  void kill(const std::string& process) override {
    if (supervisor_) supervisor_->kill(process);
  }
  bool restart(const std::string& process) override { return supervisor_ && supervisor_->restart(process); }

  void end_speaking() override {
    control_server_.reset();
    if (supervisor_) {
      std::vector<std::string> publishing;
      for (const project::ProcessEntry& entry : scenario_.processes) {
        if (entry.monitor.empty()) publishing.push_back(entry.name);
      }
      supervisor_->end(publishing, kEndPatience);
    }
    for (const Awaited& each : awaited_) {
      if (*each.came) continue;
      const auto address = rpc::Address::parse(each.at);
      const std::string why = rpc::middleware_of(*address).why_silent(*address, *each.interface, each.service);
      run_.problem(fmt::format("nothing came of {} from {}{}{}", each.service, each.at, why.empty() ? "" : ": ", why));
    }
    awaited_.clear();
    sources_.clear();
    observer_servers_.clear();
    if (inbox_) inbox_->close();
  }

  void end() override {
    if (supervisor_) supervisor_->end(kEndPatience);
    if (!parts_folder_.empty() && !run_.only_looks) {
      std::error_code unremoved;
      std::filesystem::remove_all(parts_folder_, unremoved);
    }
  }

  void close(Closed how) override {
    control_server_.reset();
    sources_.clear();
    published_.clear();
    observer_servers_.clear();
    supervisor_.reset();
    if (inbox_) inbox_->close();
    if (how == Closed::kButLeftBehind) return;
    observers_.clear();
    for (const auto& [index, leaf] : leaves_) leaf->close();
    leaves_.clear();
    if (simulator_) simulator_->close();
  }

 private:
  // A topic of others, and whether anything has come of it.
  struct Awaited {
    std::string service;
    std::string at;
    idl::ServicePtr interface;
    std::shared_ptr<std::atomic<bool>> came;
  };

  // In virtual time there is nobody else.
  std::optional<std::string> overhear(const project::ServicePlan& service) {
    if (scenario_.virtual_time) return std::nullopt;
    const auto address = rpc::Address::parse(service.observed);
    if (!address) return address.error().message;
    rpc::Middleware::Hearing hearing;
    // What was asked belongs to its outcome; calls of the middleware come one after the other.
    const auto asked = std::make_shared<std::deque<std::pair<std::uint64_t, Value>>>();
    const auto came = std::make_shared<std::atomic<bool>>(false);
    hearing.request = [this, asked, came, name = service.name](const idl::Method& method, Value arguments) {
      *came = true;
      if (!method.oneway) asked->emplace_back(0, arguments);
      const std::uint64_t call = publish_request(name, method, std::move(arguments));
      if (!method.oneway) asked->back().first = call;
      if (asked->size() > kOverheardMax) asked->pop_front();
      return call;
    };
    hearing.outcome = [this, asked, name = service.name](std::uint64_t call, const idl::Method& method,
                                                         rpc::Outcome outcome) {
      Message reply;
      reply.kind = outcome ? MessageKind::kReply : MessageKind::kError;
      reply.source = name;
      reply.target = name;
      reply.name = fmt::format("{}.{}{}", name, method.name, outcome ? ".reply" : ".error");
      reply.call = call != 0 ? call : run_.publisher.next_call();
      Map data;
      const auto of = std::find_if(asked->begin(), asked->end(), [&](const auto& each) { return each.first == call; });
      if (of != asked->end()) {
        data.append("args", std::move(of->second));
        asked->erase(of);
      }
      mission::CallOutcome told = to_call_outcome(std::move(outcome));
      if (told.ok) {
        data.append("result", std::move(told.result));
      } else {
        data.append("kind", told.kind_word());
        data.append("message", std::move(told.message));
        if (!told.result.is_null()) data.append("exception", std::move(told.result));
      }
      reply.data = std::move(data);
      run_.publish(std::move(reply));
    };
    auto opened = rpc::middleware_of(*address).overhear(*address, service.service, std::move(hearing),
                                                        {.target = service.name, .problem = run_.problem});
    if (!opened) return opened.error().message;
    sources_.push_back(std::move(*opened));
    await(service.name, service.observed, service.service, came);
    return std::nullopt;
  }

  // What is called, or may be, can have nothing to say.
  void await(const std::string& name, const std::string& at, const idl::ServicePtr& service,
             const std::shared_ptr<std::atomic<bool>>& came) {
    const auto& methods = service->methods;
    if (std::all_of(methods.begin(), methods.end(), [](const idl::Method* method) { return method->oneway; }))
      awaited_.push_back({name, at, service, came});
  }

  // Of a call that has been made elsewhere; its number.
  std::uint64_t publish_request(const std::string& name, const idl::Method& method, Value arguments) {
    Message request;
    request.kind = MessageKind::kRequest;
    request.source = name;
    request.target = name;
    request.name = fmt::format("{}.{}.request", name, method.name);
    request.call = run_.publisher.next_call();
    request.data = Map{{"args", std::move(arguments)}};
    const std::uint64_t call = request.call;
    run_.publish(std::move(request));
    return call;
  }

  bool is_durable() const { return !run_.journal.empty(); }

  bool anything_remote() const {
    const auto& leaves = run_.plan.leaves;
    return !options_.listen.empty() || !scenario_.processes.empty() ||
           std::any_of(leaves.begin(), leaves.end(), [](const project::LeafPlan& leaf) { return !leaf.at.empty(); });
  }

  std::optional<std::string> make_folder() {
    if (!anything_remote()) return std::nullopt;
    if (!is_durable()) {
      folder_.emplace("run", kSocketFolderMax);
      if (folder_->path().empty()) return "no folder for its sockets can be made; TMPDIR names where";
      return std::nullopt;
    }
    // Where who resumes the run finds them.
    parts_folder_ = run_.journal;
    parts_folder_.replace_extension(".parts");
    for (const Value& part : left_behind_parts()) parts_folder_ = part.find("folder")->text();
    return std::nullopt;
  }

  // "{name}" stands for the address of a process of the scenario, "{run}" for the run's private folder.
  std::string resolved(std::string text) const {
    if (folder_) replace_all(text, "{run}", folder_->path().string());
    if (!parts_folder_.empty()) replace_all(text, "{run}", parts_folder_.string());
    for (const Value& part : left_behind_parts())
      replace_all(text, fmt::format("{{{}}}", part.find("name")->text()), std::string(part.find("address")->text()));
    if (supervisor_) {
      for (const auto& process : supervisor_->all())
        replace_all(text, fmt::format("{{{}}}", process.name), process.address);
    }
    return text;
  }

  std::optional<std::string> start_process(const project::ProcessEntry& entry, std::vector<std::string> arguments) {
    if (entry.monitor.empty()) {
      arguments.insert(arguments.end(),
                       {"--seed", std::to_string(scenario_.seed), "--factor", shortest_decimal(scenario_.factor)});
    }
    if (!supervisor_) {
      supervisor_ = std::make_unique<Supervisor>(options_.program.empty() ? own_program() : options_.program,
                                                 [this](const ProcessEvent& event) { run_.happened(event); });
    }
    if (is_durable()) {
      // Before any is found again that looks there.
      std::error_code error;
      std::filesystem::create_directories(parts_folder_, error);
      const auto file = std::filesystem::absolute(parts_folder_, error) / "executive";
      if (auto noted = note_executive(file); !noted) return noted.error().message;
      arguments.insert(arguments.end(), {"--of-run", file.string()});
    }
    ProcessSpec spec{.name = entry.name,
                     .arguments = std::move(arguments),
                     .listen = resolved(entry.listen),
                     .restarts = entry.restarts,
                     .survives = is_durable()};
    std::int64_t died = 0;
    if (is_found_again(spec, died)) return std::nullopt;
    const auto started = supervisor_->start(std::move(spec));
    if (!started) return started.error().message;
    tell_new(entry.name, died);
    return std::nullopt;
  }

  // Of a run that is resumed: it has another process for that part than before, `died`; 0: it had none.
  void tell_new(const std::string& name, std::int64_t died) {
    const auto all = left_behind_parts();
    const bool is_new =
        std::none_of(all.begin(), all.end(), [&](const Value& part) { return part.find("name")->text() == name; });
    if (is_new) return;
    // That of one that ended beside its executive has been told.
    if (died != 0)
      run_.happened({ProcessEvent::Kind::kExited, name, died, "how is not known, since its run was gone too"});
    for (const auto& process : supervisor_->all()) {
      if (process.name == name) run_.happened({ProcessEvent::Kind::kRestarted, name, process.pid, {}});
    }
  }

  // Of a run that is resumed: the process that it had for this part, if it lives; `spec.listen` becomes its address.
  // @param died  The number of the one that it had and that is gone.
  bool is_found_again(ProcessSpec& spec, std::int64_t& died) {
    if (run_.left_behind.empty()) return false;
    for (const Value& part : left_behind_parts()) {
      if (part.find("name")->text() != spec.name) continue;
      spec.listen = part.find("address")->text();
      const auto number = [&](const char* key) { return *part.find(key)->as_int(); };
      if (supervisor_->adopt(spec, static_cast<pid_t>(number("pid")), static_cast<std::uint64_t>(number("begun"))))
        return true;
      died = number("pid");
    }
    // One that was being started again when the executive died, which had no time to write that down. It may be the
    // last of several.
    std::vector<std::string> last{spec.arguments.end() - 2, spec.arguments.end()};
    last.insert(last.end(), {"--listen", spec.listen});
    for (const pid_t unknown : processes_with(last)) {
      if (!supervisor_->adopt(spec, unknown, process_begun(unknown))) continue;
      tell_new(spec.name, died);
      return true;
    }
    return false;
  }

  // The processes of the run that is resumed, those of them that are told whole.
  List left_behind_parts() const {
    List parts;
    for (const Value& part : run_.left_behind) {
      const auto is_number = [&](const char* key) {
        return part.find(key) != nullptr && part.find(key)->as_int() != nullptr;
      };
      const bool is_named = part.find("name") != nullptr && part.find("address") != nullptr;
      if (is_named && part.find("folder") != nullptr && is_number("pid") && is_number("begun")) parts.push_back(part);
    }
    return parts;
  }

  std::optional<std::string> start_components() {
    for (const project::ProcessEntry& entry : scenario_.processes) {
      // Whoever only looks where the run was calls nobody.
      if (entry.component.empty() || run_.only_looks) continue;
      if (auto error = start_process(entry, {"component", entry.component, "--project", scenario_.file})) return error;
      component_ = entry.name;
    }
    return std::nullopt;
  }

  std::optional<std::string> start_skills(const Services& services) {
    if (!anything_remote() || run_.only_looks) return std::nullopt;
    const std::string address = resolved("unix:{run}/observer.sock");
    // What skills of a durable run do is observed in the run itself.
    if (!is_durable()) {
      auto inbox = ObservationInbox::open(observation_path((folder_->path() / "observer.sock").string()), run_.publish,
                                          run_.problem);
      if (!inbox) return inbox.error().message;
      inbox_ = std::move(*inbox);
      if (auto error = serve_observer(address)) return error;
      if (!options_.listen.empty()) {
        if (auto error = serve_observer(options_.listen)) return error;
      }
    }
    for (const project::ProcessEntry& entry : scenario_.processes) {
      if (entry.skill.empty()) continue;
      std::vector<std::string> arguments{"skill", scenario_.file, entry.skill};
      if (!is_durable()) arguments.insert(arguments.end(), {"--observer", address});
      for (const auto& [name, service] : services)
        arguments.insert(arguments.end(), {"--at", fmt::format("{}={}", name, service.at)});
      if (auto error = start_process(entry, std::move(arguments))) return error;
    }
    return std::nullopt;
  }

  // Where skills in other processes publish.
  std::optional<std::string> serve_observer(const std::string& listen) {
    auto interface = observer_interface();
    if (!interface) return interface.error().message;
    const auto address = rpc::Address::parse(listen);
    if (!address) return address.error().message;
    rpc::ServerOptions options;
    options.insecure = options_.insecure;
    options.tls = environment_tls();
    auto server =
        rpc::serve(*address, {{"observer", make_observer_service(*interface, run_.publisher)}}, std::move(options));
    if (!server) return fmt::format("--listen, where skills in other processes publish: {}", server.error().message);
    observer_servers_.push_back(std::move(*server));
    return std::nullopt;
  }

  std::optional<std::string> connect_observers() {
    for (const project::ProcessEntry& entry : scenario_.processes) {
      if (entry.monitor.empty()) continue;
      if (auto error = start_process(entry, {"monitor", "--project", scenario_.file, "--name", entry.monitor}))
        return error;
    }
    if (run_.plan.observers.empty()) return std::nullopt;
    const auto interface = is_durable() ? kept_observer_interface() : observer_interface();
    if (!interface) return interface.error().message;
    for (const project::ObserverPlan& plan : run_.plan.observers) {
      const auto address = rpc::Address::parse(resolved(plan.at));
      if (!address) return address.error().message;
      RemoteObserver::Callbacks callbacks;
      callbacks.problem = run_.problem;
      callbacks.decision = [this, name = plan.name](const monitor::Decision& decision) {
        run_.decided(name, decision);
      };
      auto observer = RemoteObserver::connect(plan.name, *address, *interface, std::move(callbacks), is_durable());
      if (!observer) return observer.error().message;
      if (is_durable() && !(*observer)->gates().empty())
        return fmt::format("\"{}\" gates requests from another process: what it says there is no part of a durable run",
                           plan.name);
      observers_.push_back(std::move(*observer));
    }
    return std::nullopt;
  }

  const ElsewhereOptions options_;
  const Surroundings run_;
  const project::Scenario& scenario_;
  std::optional<TemporaryFolder> folder_;    // for sockets
  std::filesystem::path parts_folder_;       // the same, of a durable run
  std::unique_ptr<ObservationInbox> inbox_;  // null: no skill runs elsewhere
  std::unique_ptr<Supervisor> supervisor_;   // null: there is no process
  std::string component_;                    // name of the process that runs the simulator; empty: none does
  std::vector<std::unique_ptr<runtime::Observer>> observers_;
  std::vector<std::unique_ptr<rpc::Opened>> observer_servers_;
  std::vector<std::unique_ptr<rpc::Opened>> sources_;    // of topics
  std::vector<Awaited> awaited_;                         // whom they are of
  std::vector<std::unique_ptr<rpc::Caller>> published_;  // where topics go
  std::unique_ptr<rpc::Server> control_server_;
  std::vector<std::pair<std::size_t, std::shared_ptr<RemoteLeafDriver>>> leaves_;  // and which of the plan they are
  std::unique_ptr<MemoryClient> simulator_;                                        // null: it has not been asked yet
};

}  // namespace

std::function<std::unique_ptr<runtime::Elsewhere>(runtime::Elsewhere::Surroundings)> elsewhere(
    ElsewhereOptions options) {
  return [options = std::move(options)](runtime::Elsewhere::Surroundings run) {
    return std::make_unique<PartsElsewhere>(options, std::move(run));
  };
}

}  // namespace sentree::processes
