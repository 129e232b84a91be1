#include "sentree/processes/remote_observer.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <future>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "sentree/base/packed.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/processes/detail/worker.h"
#include "sentree/processes/environment.h"
#include "sentree/processes/wire_message.h"
#include "sentree/project/project.h"
#include "sentree/rpc/client.h"
#include "sentree/runtime/monitors.h"
#include "sentree/text/json.h"

namespace sentree::processes {

using runtime::Stream;

namespace {

std::vector<std::string> texts(const Value& map, std::string_view key) {
  std::vector<std::string> all;
  const Value* value = map.find(key);
  if (value == nullptr || value->as_list() == nullptr) return all;
  for (const Value& each : *value->as_list()) all.emplace_back(each.text());
  return all;
}

bool matches_any(const std::vector<std::string>& patterns, std::string_view text) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::string& pattern) { return project::matches_pattern(pattern, text); });
}

rpc::Deadline in_time() { return std::chrono::steady_clock::now() + kObserverPatience; }

bool is_true(const Value& map, std::string_view key) {
  const Value* value = map.find(key);
  return value != nullptr && value->as_bool() != nullptr && *value->as_bool();
}

std::optional<monitor::Decision> decision_of(const Value& verdict, const Message* message, TimePoint at) {
  const std::string text = text_of(verdict, "verdict");
  monitor::Decision decision;
  if (text == to_string(monitor::Verdict::kViolated))
    decision.verdict = monitor::Verdict::kViolated;
  else if (text == to_string(monitor::Verdict::kSatisfied))
    decision.verdict = monitor::Verdict::kSatisfied;
  else
    return std::nullopt;
  const std::uint64_t at_ns = number_of(verdict, "decided_at_ns");
  decision.at = at_ns != 0 ? TimePoint(Duration(static_cast<std::int64_t>(at_ns))) : at;
  decision.state = text_of(verdict, "state");
  if (message != nullptr && decision.at == message->time) decision.deciding = *message;
  const auto witness = text::parse_json(text_of(verdict, "witness"));
  if (witness && witness->as_list() != nullptr) {
    for (const Value& each : *witness->as_list()) decision.witness.push_back(message_from_json(each));
  }
  decision.witness_complete = is_true(verdict, "witness_complete");
  decision.witness_minimal = is_true(verdict, "witness_minimal");
  return decision;
}

// How often one that is away is asked again.
constexpr std::chrono::milliseconds kObserverRetry{10};

// Of one that is `kept`, once its process is there again.
rpc::Outcome call_when_there(rpc::Client& client, std::string_view method, const Value& arguments, bool kept) {
  const auto until = std::chrono::steady_clock::now() + kObserverReturn;
  for (;;) {
    auto outcome = client.call(method, arguments, in_time());
    const bool is_away = !outcome && outcome.error().kind == rpc::CallErrorKind::kUnreachable;
    if (!kept || !is_away || std::chrono::steady_clock::now() > until) return outcome;
    std::this_thread::sleep_for(kObserverRetry);
  }
}

}  // namespace

class RemoteObserver::Impl {
 public:
  Impl(std::string name, std::unique_ptr<rpc::Client> client, const Value& info, Callbacks callbacks, bool kept)
      : name_(std::move(name)),
        client_(std::move(client)),
        observes_(texts(info, "observes")),
        gates_(texts(info, "gates")),
        callbacks_(std::move(callbacks)),
        kept_(kept),
        worker_(kObserverQueueMax) {}
  ~Impl() {
    closing_ = true;
    client_->close();
  }

  bool is_gate_of(std::string_view call) const { return matches_any(gates_, call); }
  const std::vector<std::string>& gates() const { return gates_; }

  void observe(const Message& message) {
    if (!matches_any(observes_, message.name)) return;
    if (kept_) return keep(std::make_shared<const Message>(message));
    const bool taken = worker_.post([this, message] { send(message); });
    if (!taken && lost_++ == 0)
      callbacks_.problem(
          fmt::format("observer {} does not keep up; from message {} on it does not see all", name_, message.sequence));
  }

  void ask(const Message& request, Stream::Decided decided) {
    const auto told = std::make_shared<Stream::Decided>(std::move(decided));
    const bool taken = worker_.post([this, request, told] {
      const auto verdict = client_->call("observe", Map{{"message", to_wire(request)}}, in_time());
      if (!verdict) {
        (*told)({mission::Veto{name_, "it cannot be asked: " + verdict.error().message}});
        return;
      }
      const Value* accept = verdict->find("accept");
      const bool accepted = accept == nullptr || accept->as_bool() == nullptr || *accept->as_bool();
      (*told)(accepted ? mission::Admission{} : mission::Admission{mission::Veto{name_, text_of(*verdict, "reason")}});
    });
    if (!taken) (*told)({mission::Veto{name_, "it does not keep up and cannot be asked"}});
  }

  std::optional<Value> remember(Duration patience) {
    if (is_gone_) return Value(false);
    const auto said = std::make_shared<std::promise<std::optional<Value>>>();
    std::future<std::optional<Value>> told = said->get_future();
    const bool taken = worker_.post([this, said] {
      auto memory = client_->call("remember", Map(), in_time());
      while (!memory && again(kAll)) memory = client_->call("remember", Map(), in_time());
      said->set_value(memory ? std::optional(std::move(*memory)) : std::nullopt);
    });
    if (!taken || told.wait_for(patience) != std::future_status::ready) return std::nullopt;
    auto memory = told.get();
    if (!memory) return is_gone_ ? std::optional<Value>(false) : std::nullopt;
    const std::lock_guard lock(kept_mutex_);
    memory_ = *memory;
    since_.clear();
    return memory;
  }

  Result<void> recall(const Value& memory) {
    if (memory.as_bool() != nullptr) {  // what it missed then is not known any more
      is_gone_ = true;
      return {};
    }
    memory_ = memory.as_bytes() != nullptr ? memory : Value(Bytes());
    const auto done = call_when_there(*client_, "recall", Map{{"memory", memory_}}, kept_);
    if (done) return {};
    return fail("observer.unreachable", fmt::format("observer \"{}\" cannot be taken back to where it was, which a "
                                                    "durable run needs (KeptObserver of observer.thrift): {}",
                                                    name_, done.error().message));
  }

  void finish(TimePoint end) {
    std::promise<void> promise;
    const std::future<void> done = promise.get_future();
    const bool taken = worker_.post([&] {
      const auto ask = [&] {
        return client_->call("finish", Map{{"time_ns", end.time_since_epoch().count()}}, in_time());
      };
      auto verdict = ask();
      while (!verdict && kept_ && !is_gone_ && again(kAll)) verdict = ask();
      if (verdict) take(*verdict, nullptr, end);
      promise.set_value();
    });
    // What is left to send ends with the connection, at the latest.
    const Duration patience = kObserverPatience + (kept_ ? kObserverReturn : std::chrono::seconds(0));
    if (taken && done.wait_for(patience) != std::future_status::ready) {
      closing_ = true;
      client_->close();
      done.wait();
    }
    if (lost_ > 0) callbacks_.problem(fmt::format("observer {} lost {} messages", name_, lost_));
  }

 private:
  using Kept = std::shared_ptr<const Message>;

  // In the thread of a durable run, which waits rather than that something is not seen.
  void keep(const Kept& message) {
    if (is_gone_) return;
    {
      const std::lock_guard lock(kept_mutex_);
      since_.push_back(message);
      if (since_.size() > kObserverKeptMax) since_.pop_front();
    }
    const auto until = std::chrono::steady_clock::now() + kObserverReturn;
    while (!worker_.post([this, message] { send(*message); })) {
      if (is_gone_ || std::chrono::steady_clock::now() > until) {
        ++lost_;
        return;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  static constexpr std::uint64_t kAll = static_cast<std::uint64_t>(-1);

  // Takes one that was started anew to where it was before that message. In the worker.
  bool again(std::uint64_t before) {
    const auto until = std::chrono::steady_clock::now() + kObserverReturn;
    while (!closing_ && std::chrono::steady_clock::now() < until) {
      std::deque<Kept> since;
      Value memory;
      {
        const std::lock_guard lock(kept_mutex_);
        since = since_;
        memory = memory_;
      }
      if (since.size() >= kObserverKeptMax) return false;
      bool whole = client_->call("recall", Map{{"memory", memory}}, in_time()).has_value();
      for (const Kept& message : since) {
        if (!whole || message->sequence >= before) break;
        const auto verdict = client_->call("observe", Map{{"message", to_wire(*message)}}, in_time());
        whole = verdict.has_value();
        if (whole) take(*verdict, message.get(), message->time);
      }
      if (whole) return true;
      std::this_thread::sleep_for(kObserverRetry);
    }
    return false;
  }

  void send(const Message& message) {
    if (is_gone_) return;
    auto verdict = client_->call("observe", Map{{"message", to_wire(message)}}, in_time());
    while (!verdict && kept_ && again(message.sequence))
      verdict = client_->call("observe", Map{{"message", to_wire(message)}}, in_time());
    if (!verdict && kept_) is_gone_ = true;
    if (!verdict) {
      if (lost_++ == 0) callbacks_.problem(fmt::format("observer {}: {}", name_, verdict.error().message));
      return;
    }
    take(*verdict, &message, message.time);
  }

  void take(const Value& verdict, const Message* message, TimePoint at) {
    if (decided_) return;
    const auto decision = decision_of(verdict, message, at);
    if (!decision) return;
    decided_ = true;
    callbacks_.decision(*decision);
  }

  const std::string name_;
  std::unique_ptr<rpc::Client> client_;
  const std::vector<std::string> observes_;
  const std::vector<std::string> gates_;
  const Callbacks callbacks_;
  std::atomic<std::uint64_t> lost_ = 0;
  bool decided_ = false;  // of the worker
  const bool kept_;
  std::atomic<bool> closing_ = false;
  std::atomic<bool> is_gone_ = false;  // kept, and not there any more
  std::mutex kept_mutex_;
  Value memory_ = Bytes();  // what it was when it was asked last
  std::deque<Kept> since_;  // handed on since then
  Worker worker_;           // last: its jobs use the others
};

RemoteObserver::RemoteObserver(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RemoteObserver::~RemoteObserver() = default;

Result<std::unique_ptr<RemoteObserver>> RemoteObserver::connect(std::string name, const rpc::Address& address,
                                                                const idl::ServicePtr& interface, Callbacks callbacks,
                                                                bool kept) {
  rpc::ClientOptions options;
  options.target = name;
  options.tls = environment_tls();
  if (kept) options.backoff_last = std::chrono::milliseconds(50);
  auto client = rpc::Client::remote(address, interface, std::move(options));
  if (!client) return tl::unexpected(client.error());
  const auto info = call_when_there(**client, "info", Map(), kept);
  if (!info) return fail("observer.unreachable", fmt::format("observer \"{}\": {}", name, info.error().message));
  return std::unique_ptr<RemoteObserver>(new RemoteObserver(
      std::make_unique<Impl>(std::move(name), std::move(*client), *info, std::move(callbacks), kept)));
}

void RemoteObserver::observe(const Message& message) { impl_->observe(message); }
bool RemoteObserver::is_gate_of(std::string_view call) const { return impl_->is_gate_of(call); }
const std::vector<std::string>& RemoteObserver::gates() const { return impl_->gates(); }
void RemoteObserver::ask(const Message& request, Stream::Decided decided) { impl_->ask(request, std::move(decided)); }
std::optional<Value> RemoteObserver::remember(Duration patience) { return impl_->remember(patience); }
Result<void> RemoteObserver::recall(const Value& memory) { return impl_->recall(memory); }
void RemoteObserver::finish(TimePoint end) { impl_->finish(end); }

namespace {

class MonitorService final : public rpc::Service {
 public:
  MonitorService(idl::ServicePtr interface, monitor::Model model, std::vector<std::string> gate,
                 std::function<void(const monitor::Decision&)> on_decision)
      : interface_(std::move(interface)),
        model_(std::move(model)),
        gate_(std::move(gate)),
        on_decision_(std::move(on_decision)),
        state_(monitor::start(model_, TimePoint{})) {}

  const idl::Service& interface() const override { return *interface_; }

  rpc::Outcome call(const idl::Method& method, const Value& arguments) override {
    const std::lock_guard lock(mutex_);
    if (method.name == "recall") return recall(text_in(arguments.find("memory")));
    if (method.name == "info") {
      state_ = monitor::start(model_, TimePoint{});
      begun_ = true;
      List gates;
      for (const std::string& pattern : gate_) gates.emplace_back(pattern);
      return Value(Map{{"name", model_.name()},
                       {"pid", static_cast<std::int64_t>(getpid())},
                       {"observes", List{"*"}},
                       {"gates", std::move(gates)}});
    }
    // A run would not know that what came before is missing.
    if (!begun_) return refused("it was started anew; recall comes first");
    if (method.name == "remember") return remember();
    if (method.name == "finish")
      return answer(monitor::advance(model_, state_,
                                     TimePoint(Duration(static_cast<std::int64_t>(number_of(arguments, "time_ns"))))));
    const Message message = from_wire(*arguments.find("message"));
    // Not yet in the run's order: a question, whether the request may be sent.
    if (message.sequence == 0) {
      const auto reason = monitor::veto(model_, state_, message);
      return Value(Map{{"accept", !reason}, {"reason", reason.value_or("")}});
    }
    if (!model_.listens_to(message.name)) return answer(monitor::advance(model_, state_, message.time - Duration(1)));
    return answer(monitor::observe(model_, state_, message));
  }

 private:
  // Of what led to the present state, so much is kept for witnesses.
  static constexpr std::size_t kRememberedMax = 256;

  static rpc::Outcome refused(std::string why) {
    return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, std::move(why), {}, {}});
  }

  rpc::Outcome recall(std::string_view memory) {
    begun_ = true;
    state_ = monitor::start(model_, TimePoint{});
    if (memory.empty()) return Value();
    const auto saved = unpack(memory);
    auto restored = saved ? monitor::restore(models_, *saved) : tl::unexpected(saved.error());
    if (!restored) return refused(restored.error().message);
    state_ = std::move(restored->states.front());
    return Value();
  }

  rpc::Outcome remember() const {
    monitor::MonitorSet::Memory memory;
    memory.states.push_back(state_);
    memory.states.front().trail.forget_all_but(kRememberedMax);
    const auto saved = monitor::save(models_, memory);
    if (!saved) return refused(saved.error().message);
    return octets_of(pack(*saved));
  }

  Value answer(const monitor::Decisions& decisions) const {
    if (decisions.empty()) return Map{{"accept", true}};
    for (const monitor::Decision& each : decisions) on_decision_(each);
    const monitor::Decision* decision = &decisions.back();
    List witness;
    for (const Message& message : decision->witness) witness.push_back(*text::parse_json(to_json(message)));
    return Map{{"accept", true},
               {"verdict", to_string(decision->verdict)},
               {"state", decision->state},
               {"decided_at_ns", decision->at.time_since_epoch().count()},
               {"witness", to_json(Value(std::move(witness)))},
               {"witness_complete", decision->witness_complete},
               {"witness_minimal", decision->witness_minimal}};
  }

  const idl::ServicePtr interface_;
  const monitor::Model model_;
  const std::vector<monitor::Model> models_{model_};
  bool begun_ = false;
  const std::vector<std::string> gate_;
  const std::function<void(const monitor::Decision&)> on_decision_;
  std::mutex mutex_;
  monitor::State state_;
};

}  // namespace

std::shared_ptr<rpc::Service> make_monitor_service(idl::ServicePtr interface, monitor::Model model,
                                                   std::vector<std::string> gate,
                                                   std::function<void(const monitor::Decision&)> on_decision) {
  return std::make_shared<MonitorService>(std::move(interface), std::move(model), std::move(gate),
                                          std::move(on_decision));
}

}  // namespace sentree::processes
