#include "sentree/ros/middleware.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include "sentree/base/diagnostic.h"
#include "sentree/idl/conform.h"
#include "sentree/ros/address.h"
#include "sentree/ros/detail/action.h"
#include "sentree/ros/detail/mapping.h"
#include "sentree/ros/detail/node.h"
#include "sentree/ros/detail/overhear.h"
#include "sentree/ros/detail/service.h"

namespace sentree::ros {
namespace {

using rpc::Address;
using rpc::CallErrorKind;
using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kCallsMax = 256;
// The method by which `sentree ping` asks whether anybody is there.
constexpr std::string_view kProbe = "sentree_ping";
constexpr std::chrono::milliseconds kLook{20};

rpc::Outcome refused(CallErrorKind kind, std::string why) {
  return tl::unexpected(rpc::CallError{kind, std::move(why), {}, {}});
}

ServiceName service_name(const Carried& c) { return {c.name, c.request_type, c.reply_type}; }

// What it says, and what it would be else.
const char* release_of(const GraphAddress& address) {
  const bool is_humble = address.release_or_environment() == Release::kHumble;
  if (address.release) return is_humble ? "release=humble" : "a release from Iron on";
  return is_humble ? "no release, which means Humble here" : "no release, which means one from Iron on here";
}

// Whether the options are of what the interface is.
Result<void> check_options(const std::string& text, const GraphAddress& address, const idl::Service& interface) {
  const auto wrong = [&](std::string_view option, std::string_view what, std::string_view of) {
    return fail("rpc.address",
                fmt::format("\"{}\" has {}, {}, and {} is {}; leave it out", text, option, what, interface.name, of));
  };
  const Form form = form_of(interface);
  if (form == Form::kService || form == Form::kAction) {
    const char* const of = form == Form::kService ? "a service" : "an action";
    if (address.publish) return wrong("publish", "which is of topics", of);
    if (!address.qos.empty()) return wrong("qos=" + address.qos, "which is of topics", of);
  }
  if (form == Form::kMessage && address.requests)
    return wrong("requests", "which services and actions have", "a topic");
  return {};
}

// Whether a method can be called, and is not only heard.
Result<void> check_method(const GraphAddress& address, const std::string& base, const idl::Service& interface,
                          const idl::Method& method) {
  if (!method.oneway) return {};
  if (form_of(interface) == Form::kAction) {
    return fail("rpc.address", fmt::format("\"{}\" is what the action ros:{} tells of its goals, and is not called; "
                                           "send_goal and cancel_goal are",
                                           method.name, base));
  }
  if (!is_data(interface) || address.publish) return {};
  return fail("rpc.address", fmt::format("\"ros:{}\" is read from; write ros:{}?publish to publish there", base, base));
}

using Problem = std::function<void(const std::string&)>;

// What is wrong with those who read what is published: told to each who wants to know, whoever came first.
class Misfits {
 public:
  void note(const std::string& what) {
    const std::lock_guard lock(mutex_);
    if (what.empty() || all_.size() >= kMax || !all_.insert(what).second) return;
    for (const auto& [whom, problem] : problems_) problem(what);
  }
  void tell(const void* whom, const Problem& problem) {
    const std::lock_guard lock(mutex_);
    problems_[whom] = problem;
    for (const std::string& what : all_) problem(what);
  }
  void forget(const void* whom) {
    const std::lock_guard lock(mutex_);
    problems_.erase(whom);
  }

 private:
  static constexpr std::size_t kMax = 64;
  std::mutex mutex_;
  std::set<std::string> all_;
  std::map<const void*, Problem> problems_;
};

// The one writer of a topic in this process.
struct Publisher {
  std::shared_ptr<Misfits> misfits;
  ToldPtr told;

  [[nodiscard]] dds::Writer& writer() const { return *told->writer(); }
};

// Calls one service, each after the other, in a thread of its own.
class RosCaller final : public rpc::Caller {
 public:
  RosCaller(std::shared_ptr<Node> node, idl::ServicePtr interface, rpc::ClientOptions options)
      : node_(std::move(node)), interface_(std::move(interface)), options_(std::move(options)) {}
  ~RosCaller() override { end(); }

  Result<void> begin(const GraphAddress& address, const std::string& base) {
    name_ = base;
    if (form_of(*interface_) == Form::kAction) {
      auto action = ActionClient::of(node_, interface_, base);
      if (!action) return tl::unexpected(std::move(action.error()));
      action_ = std::move(*action);
    } else {
      for (const idl::Method* method : interface_->methods) {
        if (method->name == kProbe) continue;
        auto carried = Carried::make(*interface_, *method, base);
        if (!carried) return tl::unexpected(std::move(carried.error()));
        Way way{*carried, nullptr, nullptr};
        if (method->oneway) {
          if (auto can_be = check_method(address, base, *interface_, *method); !can_be)
            return tl::unexpected(std::move(can_be.error()));
          auto writer = topic(**carried, address.qos_of(true));
          if (!writer) return tl::unexpected(std::move(writer.error()));
          way.writer = std::move(*writer);
          if (options_.problem) way.writer->misfits->tell(this, options_.problem);
        } else {
          auto client = ServiceClient::of(node_, service_name(**carried));
          if (!client) return tl::unexpected(std::move(client.error()));
          way.client = std::move(*client);
        }
        ways_.emplace(method, std::move(way));
      }
    }
    try {
      thread_ = std::thread([this] { run(); });
    } catch (const std::system_error& e) {
      return fail("rpc.exhausted", std::string("no thread is left for a client: ") + e.what());
    }
    return {};
  }

  // While discovery may go on, so that the first call finds its server.
  void settle() {
    std::unique_lock lock(mutex_);
    while (!is_found() && !node_->is_settled()) changed_.wait_for(lock, kLook);
  }

  const idl::Service& interface() const override { return *interface_; }
  using Caller::call;

  void call(const idl::Method& method, Value arguments, rpc::Deadline deadline, Done done) override {
    if (action_ != nullptr && method.oneway) {
      const auto can_be = check_method({}, name_, *interface_, method);
      return done(refused(CallErrorKind::kArguments, can_be.error().message));
    }
    if (arguments.is_null()) arguments = Value(Map());
    if (!idl::conforms_arguments(method, arguments)) {
      auto conformed = idl::conform_arguments(method, std::move(arguments));
      if (!conformed) return done(refused(CallErrorKind::kArguments, conformed.error().message));
      arguments = std::move(*conformed);
    }
    calls_.fetch_add(1);
    std::unique_lock lock(mutex_);
    if (closed_ || waiting_.size() >= kCallsMax) {
      const bool closed = closed_;
      lock.unlock();
      return finish(
          {&method, {}, deadline, std::move(done)},
          refused(CallErrorKind::kUnreachable,
                  closed ? "the client has been closed" : fmt::format("{} calls are waiting already", kCallsMax)));
    }
    waiting_.push_back({&method, std::move(arguments), deadline, std::move(done)});
    lock.unlock();
    changed_.notify_one();
  }

  void close() override {
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(closed_, true)) return;
    }
    changed_.notify_all();
    if (action_ != nullptr) action_->wake();
    for (const auto& [method, way] : ways_) {
      if (way.client != nullptr) way.client->wake();
    }
  }
  void end() override {
    close();
    const std::lock_guard lock(join_mutex_);
    if (thread_.joinable()) thread_.join();
    for (const auto& [method, way] : ways_) {
      if (way.writer == nullptr) continue;
      way.writer->writer().flush();
      way.writer->misfits->forget(this);
    }
    if (action_ != nullptr) action_->cancel_now(std::exchange(goals_, {}));
  }

  rpc::ClientCounters counters() const override {
    rpc::ClientCounters out;
    out.calls = calls_.load();
    out.errors = errors_.load();
    out.late = late_.load();
    return out;
  }

 private:
  struct Way {
    std::shared_ptr<const Carried> carried;
    std::shared_ptr<ServiceClient> client;
    std::shared_ptr<Publisher> writer;
  };
  struct Job {
    const idl::Method* method = nullptr;
    Value arguments;
    rpc::Deadline deadline;
    Done done;
  };

  // One writer of a topic serves everybody in this process who publishes there.
  Result<std::shared_ptr<Publisher>> topic(const Carried& carried, const dds::Qos& qos) {
    return node_->shared<Publisher>(
        fmt::format("topic {} {}", carried.name, carried.type), [&]() -> Result<std::shared_ptr<Publisher>> {
          auto out = std::make_shared<Publisher>(Publisher{std::make_shared<Misfits>(), nullptr});
          auto made = node_->write({"rt" + carried.name, carried.type, qos},
                                   [misfits = out->misfits](const std::string& what) { misfits->note(what); });
          if (!made) return tl::unexpected(std::move(made.error()));
          out->told = std::move(*made);
          return out;
        });
  }

  void finish(const Job& job, rpc::Outcome outcome) {
    if (!outcome && outcome.error().kind != CallErrorKind::kException) {
      errors_.fetch_add(1);
      if (outcome.error().kind == CallErrorKind::kLate) late_.fetch_add(1);
    }
    job.done(std::move(outcome));
  }

  bool is_closed() {
    const std::lock_guard lock(mutex_);
    return closed_;
  }

  void run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return closed_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      Job job = std::move(waiting_.front());
      waiting_.pop_front();
      const bool closed = closed_;
      lock.unlock();
      rpc::Outcome out = closed ? refused(CallErrorKind::kUnreachable, "the client has been closed") : make(job);
      finish(job, std::move(out));
      lock.lock();
    }
  }

  rpc::Outcome make(const Job& job) {
    const auto interrupted = [this] { return is_closed(); };
    if (job.method->name == kProbe) return probe(job.deadline);
    if (SteadyClock::now() >= job.deadline)
      return refused(CallErrorKind::kLate, fmt::format("other calls of {} took the time", options_.target));
    if (action_ != nullptr) {
      rpc::Outcome out = action_->call(*job.method, job.arguments, job.deadline, interrupted);
      if (out && job.method->name == "send_goal") remember(*out);
      return out;
    }
    const Way& way = ways_.at(job.method);
    std::vector<std::uint8_t> message;
    begin_message(message);
    if (auto written = way.carried->write_arguments(message, job.arguments); !written)
      return refused(CallErrorKind::kArguments,
                     fmt::format("{}.{}: {}", job.method->service, job.method->name, written.error().message));
    if (way.writer != nullptr) {
      await_readers(*way.writer, std::min(job.deadline, found_by_));
      if (way.writer->writer().write(message, nullptr) != 0) return Value();
      return refused(CallErrorKind::kUnreachable, "nothing more can be published on " + way.carried->name);
    }
    if (!way.client->wait_available(job.deadline, interrupted))
      return refused(
          CallErrorKind::kUnreachable,
          fmt::format("no server of {} ({}) is there, in domain {}{}; sentree services --on ros: lists what is",
                      way.carried->name, ros_name(way.carried->request_type), node_->domain(),
                      node_->other_type(fmt::format("rq{}Request", way.carried->name), way.carried->request_type)));
    const auto key = way.client->send(message);
    if (!key) return refused(CallErrorKind::kUnreachable, fmt::format("the server of {} has gone", way.carried->name));
    const auto reply = way.client->wait(*key, job.deadline, interrupted);
    if (reply) return way.carried->read_outcome(*reply, options_.limits);
    if (interrupted()) return refused(CallErrorKind::kUnreachable, "the client has been closed");
    if (SteadyClock::now() < job.deadline)
      return refused(CallErrorKind::kUnreachable, fmt::format("the server of {} has gone", way.carried->name));
    return refused(CallErrorKind::kLate, way.carried->name + " did not answer in time");
  }

  // What is published before anybody has been discovered reaches nobody.
  void await_readers(Publisher& writer, rpc::Deadline until) {
    std::unique_lock lock(mutex_);
    while (!closed_ && SteadyClock::now() < until && writer.writer().matched().empty()) changed_.wait_for(lock, kLook);
  }

  // Whether whoever is asked has been discovered.
  bool is_found() const {
    if (interface_->find(kProbe) != nullptr) return has_name();
    if (action_ != nullptr) return action_->is_available();
    return std::all_of(ways_.begin(), ways_.end(), [](const auto& entry) {
      return entry.second.client == nullptr || entry.second.client->is_available();
    });
  }
  // Whether anybody has anything of this name.
  bool has_name() const {
    const std::string within = name_.ends_with('/') ? name_ : name_ + "/";
    const std::vector<dds::Endpoint> all = node_->endpoints();
    return std::any_of(all.begin(), all.end(), [&](const dds::Endpoint& each) {
      const std::string name = shown(each).first;
      return !name.empty() && (name == name_ || name.starts_with(within));
    });
  }

  // As in Thrift, the answer is that there is no such method.
  rpc::Outcome probe(rpc::Deadline deadline) {
    for (;;) {
      if (has_name()) return refused(CallErrorKind::kProtocol, name_ + " is there");
      std::unique_lock lock(mutex_);
      if (closed_ || SteadyClock::now() >= deadline) break;
      changed_.wait_for(lock, kLook);
    }
    return refused(CallErrorKind::kUnreachable,
                   fmt::format("nobody has anything named {} in domain {}", name_, node_->domain()));
  }

  // Those that have ended are not kept.
  void remember(const Value& reply) {
    if (reply.find("accepted") == nullptr || !*reply.find("accepted")->as_bool()) return;
    std::erase_if(goals_, [&](const std::string& id) { return !action_->is_open(id); });
    goals_.emplace_back(reply.find("goal_id")->text());
  }

  const std::shared_ptr<Node> node_;
  const idl::ServicePtr interface_;
  const rpc::ClientOptions options_;
  const SteadyClock::time_point found_by_ = SteadyClock::now() + Settling::kAtLeast;
  std::string name_;
  std::map<const idl::Method*, Way> ways_;
  std::shared_ptr<ActionClient> action_;
  std::vector<std::string> goals_;  // of the thread; of whoever has joined it
  std::atomic<std::uint64_t> calls_{0};
  std::atomic<std::uint64_t> errors_{0};
  std::atomic<std::uint64_t> late_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool closed_ = false;
  std::deque<Job> waiting_;
  std::mutex join_mutex_;
  std::thread thread_;
};

// Those who publish there; whether all keep what they said for who comes late, or some do.
struct Latched {
  bool all = false;
  bool some = false;
};
Latched latched(const Node& node, const std::string& name) {
  Latched out;
  bool others = false;
  for (const dds::Endpoint& each : node.endpoints()) {
    if (each.is_writer && each.topic == "rt" + name) (each.transient_local ? out.some : others) = true;
  }
  out.all = out.some && !others;
  return out;
}
constexpr const char* kAskForLatched =
    "its publisher is transient local, and sends what it has said already only to who asks for that: write "
    "?qos=transient_local";

// Readers of topics, and what they hear, in a thread of its own.
class Listening final : public rpc::Opened {
 public:
  explicit Listening(std::string address) : address_(std::move(address)) {}
  ~Listening() override { stop(); }
  std::string address() const override { return address_; }
  void stop() override {
    std::vector<Reading> readings;
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
      readings.swap(readings_);
    }
    changed_.notify_all();
    if (looks_.joinable()) looks_.join();
    readings.clear();
    worker_.stop();
    if (action_ != nullptr && number_ != 0) action_->forget(std::exchange(number_, 0));
  }

  Result<void> hear(const std::shared_ptr<Node>& node, const std::shared_ptr<const Carried>& carried,
                    const dds::Qos& qos, const idl::ServicePtr& interface, rpc::Middleware::Take take,
                    const Problem& problem) {
    const auto told = std::make_shared<std::atomic<bool>>(false);
    const auto once = [told, problem](const std::string& what) {
      if (problem && !told->exchange(true)) problem(what);
    };
    auto on_sample = [this, carried, interface, take = std::move(take), once](dds::Sample sample) {
      auto kept = std::make_shared<std::vector<std::uint8_t>>(std::move(sample.octets));
      const bool fits = worker_.post([carried, interface, take, once, kept] {
        auto arguments = carried->read_arguments(*kept, {});
        if (arguments) return take(*carried->method, std::move(*arguments));
        once(fmt::format("a message of {} cannot be read as {}: {}", carried->name, interface->name,
                         arguments.error().message));
      });
      if (!fits)
        once(fmt::format("messages of {} come faster than they are heard: the oldest are lost", carried->name));
    };
    auto reader =
        node->read({"rt" + carried->name, carried->type, qos}, std::move(on_sample), [once](const std::string& misfit) {
          if (!misfit.empty()) once(misfit);
        });
    if (!reader) return tl::unexpected(std::move(reader.error()));
    const std::lock_guard lock(mutex_);
    readings_.push_back({carried->name, carried->type, std::move(*reader), told, problem});
    return {};
  }

  /// Says of each topic that nobody publishes once everybody has been discovered, with what is near it.
  Result<void> tell_unpublished(const std::shared_ptr<Node>& node) {
    try {
      looks_ = std::thread([this, node] {
        std::unique_lock lock(mutex_);
        while (!changed_.wait_for(lock, kLook, [&] { return stopped_; })) {
          if (!node->is_settled()) continue;
          for (const Reading& each : readings_) {
            if (each.problem && !*each.told && each.reader->reader()->matched().empty())
              each.problem(fmt::format("nobody publishes ros:{} yet, in domain {}{}", each.name, node->domain(),
                                       near_names(*node, each.name, "topic", each.type)));
          }
          return;
        }
      });
    } catch (const std::system_error& e) {
      return fail("rpc.exhausted", std::string("no thread is left to look for publishers: ") + e.what());
    }
    return {};
  }

  Result<void> hear_action(const std::shared_ptr<Node>& node, const idl::ServicePtr& interface, const std::string& name,
                           rpc::Middleware::Take take, const Problem& problem) {
    auto action = ActionClient::of(node, interface, name);
    if (!action) return tl::unexpected(std::move(action.error()));
    action_ = std::move(*action);
    number_ = action_->hear(std::move(take), problem);
    return {};
  }
  // So that the first goal finds its server.
  void settle(Node& node) {
    std::unique_lock lock(mutex_);
    while (!action_->is_available() && !node.is_settled()) changed_.wait_for(lock, kLook);
  }

 private:
  struct Reading {
    std::string name;
    std::string type;
    ToldPtr reader;
    std::shared_ptr<std::atomic<bool>> told;  // what does not fit
    Problem problem;
  };

  const std::string address_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::vector<Reading> readings_;
  std::thread looks_;
  std::shared_ptr<ActionClient> action_;
  int number_ = 0;
  Worker worker_;
};

// Services of ours.
class Serving final : public rpc::Opened {
 public:
  Serving(std::string address, Problem problem) : address_(std::move(address)), problem_(std::move(problem)) {}
  ~Serving() override { stop(); }
  std::string address() const override { return address_; }
  void stop() override {
    std::vector<std::unique_ptr<ServiceServer>> servers;
    servers.swap(servers_);
    servers.clear();
    if (topics_ != nullptr) topics_->stop();
    worker_.stop();
  }

  Result<void> add(const std::shared_ptr<Node>& node, const GraphAddress& address, const std::string& base,
                   const std::shared_ptr<rpc::Service>& service, const rpc::Limits& limits) {
    const idl::Service& interface = service->interface();
    if (form_of(interface) == Form::kAction)
      return fail("rpc.address", fmt::format("\"{}\": actions are called, but cannot be served", address_));
    for (const idl::Method* method : interface.methods) {
      auto carried = Carried::make(interface, *method, base);
      // What has no form in ROS cannot be asked there; the rest can.
      if (!carried) {
        if (problem_) problem_(fmt::format("{}; {} is served without it", carried.error().message, base));
        continue;
      }
      if (method->oneway) {
        if (topics_ == nullptr) topics_ = std::make_unique<Listening>(address_);
        auto done = topics_->hear(
            node, *carried, address.qos_of(false), idl::ServicePtr(service, &interface),
            [service](const idl::Method& of, const Value& arguments) {
              static_cast<void>(service->call(of, arguments));
            },
            problem_);
        if (!done) return done;
        continue;
      }
      auto server =
          ServiceServer::open(node, service_name(**carried), worker_, handler(*carried, service, limits), problem_);
      if (!server) return tl::unexpected(std::move(server.error()));
      servers_.push_back(std::move(*server));
    }
    return {};
  }

 private:
  ServiceServer::Handle handler(std::shared_ptr<const Carried> carried, std::shared_ptr<rpc::Service> service,
                                rpc::Limits limits) const {
    return [carried = std::move(carried), service = std::move(service), limits, problem = problem_](
               std::vector<std::uint8_t> request, ServiceServer::Answer answer) {
      const auto reply = [carried, answer = std::move(answer), problem](rpc::Outcome outcome, bool) {
        std::vector<std::uint8_t> message;
        begin_message(message);
        outcome = rpc::checked(*carried->method, std::move(outcome));
        const auto written = carried->write_outcome(message, outcome);
        if (written && *written) return answer(message);
        // A reply of ROS has no place for an error: who asked hears nothing.
        if (problem)
          problem(fmt::format("{} gives no answer: {}", carried->name,
                              written ? outcome.error().message : written.error().message));
      };
      auto arguments = carried->read_arguments(request, limits);
      if (!arguments) {
        return reply(refused(CallErrorKind::kProtocol, "the request cannot be read: " + arguments.error().message),
                     false);
      }
      service->serve(*carried->method, *arguments, rpc::Reply(reply));
    };
  }

  const std::string address_;
  const Problem problem_;
  std::vector<std::unique_ptr<ServiceServer>> servers_;
  std::unique_ptr<Listening> topics_;
  Worker worker_;
};

// A topic as text: first its type is discovered, then its definition looked up.
class Watching final : public rpc::Opened {
 public:
  Watching(std::shared_ptr<Node> node, GraphAddress address, std::string text, Options find,
           std::function<void(const std::string&)> take, Problem problem)
      : node_(std::move(node)),
        address_(std::move(address)),
        text_(std::move(text)),
        find_(std::move(find)),
        take_(std::move(take)),
        problem_(std::move(problem)) {
    // What an action is made of is told as the action.
    address_.name.resize(std::min(address_.name.find("/_action/"), address_.name.size()));
    thread_ = std::thread([this] { look(); });
  }
  ~Watching() override { stop(); }
  std::string address() const override { return text_; }
  void stop() override {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
    if (listening_ != nullptr) listening_->stop();
  }

 private:
  void look() {
    std::unique_lock lock(mutex_);
    bool told = false;
    const auto patience = SteadyClock::now() + std::chrono::seconds(3);
    while (!stopped_) {
      lock.unlock();
      const std::string kind = kind_there();
      if (!kind.empty()) return listen(kind);
      lock.lock();
      if (!std::exchange(told, told || SteadyClock::now() > patience) && told && problem_)
        problem_(fmt::format("nobody publishes on {} yet, in domain {}{}", address_.name, node_->domain(),
                             near_names(*node_, address_.name, "topic", "")));
      changed_.wait_for(lock, kLook, [&] { return stopped_; });
    }
  }
  // "topic std_msgs/msg/String"; empty: nobody is there yet.
  std::string kind_there() const {
    for (const dds::Endpoint& each : node_->endpoints()) {
      const auto [name, kind] = shown(each);
      if (name == address_.name && (each.is_writer || !kind.starts_with("topic "))) return kind;
    }
    return {};
  }
  void listen(const std::string& kind) {
    const auto say = [&](const std::string& what) {
      if (problem_) problem_(what);
    };
    const bool is_topic = kind.starts_with("topic ");
    const std::string type = kind.substr(kind.find(' ') + 1);
    if (!find_.find) return say(fmt::format("the type {} is not known here", type));
    const auto schema = find_.find(type);
    if (!schema.ok()) {
      const std::string why =
          schema.diagnostics.empty() ? "" : fmt::format(": {}", to_string(schema.diagnostics.front()));
      const std::string_view end = is_topic ? "msg" : kind.substr(0, kind.find(' ')) == "action" ? "action" : "srv";
      return say(fmt::format(
          "{} is of type {}, whose definition is not here; set AMENT_PREFIX_PATH, or put it in interfaces/{}.{}{}",
          address_.name, type, type, end, why));
    }
    const idl::ServicePtr interface = schema.value->service(type.substr(type.rfind('/') + 1));
    // Who publishes nothing any more is still to be heard.
    const Latched there = is_topic ? latched(*node_, address_.name) : Latched();
    if (there.all && address_.qos.empty())
      address_.qos = "transient_local";
    else if (there.some && !address_.qos_of(false).transient_local)
      say(fmt::format("ros:{}: {}", address_.name, kAskForLatched));
    // Of what has several kinds of messages, each is told with its kind.
    const auto text = [is_topic](const idl::Method& method, const std::string& what, const Value& data) {
      return to_json(is_topic ? data : Value(Map{{method.name + what, data}}));
    };
    Hearing hearing;
    hearing.request = [take = take_, text](const idl::Method& method, const Value& arguments) -> std::uint64_t {
      take(text(method, method.oneway ? "" : ".request", arguments));
      return 1;
    };
    hearing.outcome = [take = take_, text](std::uint64_t, const idl::Method& method, const rpc::Outcome& outcome) {
      if (outcome)
        take(text(method, ".reply", *outcome));
      else
        take(text(method, ".error", Value(outcome.error().message)));
    };
    auto listening = overhear(node_, address_, interface, address_.name, text_, std::move(hearing), problem_);
    if (!listening) return say(listening.error().message);
    const std::lock_guard lock(mutex_);
    listening_ = std::move(*listening);
  }

  using Hearing = rpc::Middleware::Hearing;

  const std::shared_ptr<Node> node_;
  GraphAddress address_;  // read only once the thread has begun
  const std::string text_;
  const Options find_;
  const std::function<void(const std::string&)> take_;
  const Problem problem_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::unique_ptr<rpc::Opened> listening_;
  std::thread thread_;
};

// With peers every interface is listened on: other machines are not looked for, but can reach us.
std::string who_reaches(const dds::ParticipantOptions& opened) {
  if (opened.peers.empty()) return opened.localhost ? "all programs of this machine" : "all machines of the network";
  return fmt::format("all machines of the network (looked for: {} and {})", opened.localhost ? "this one" : "all",
                     fmt::join(opened.peers, ", "));
}

std::string where_looked(const dds::ParticipantOptions& opened) {
  const char* const here = opened.localhost ? "this machine" : "the network";
  return opened.peers.empty() ? here : fmt::format("{} and {}", here, fmt::join(opened.peers, ", "));
}

class Ros final : public rpc::Middleware {
 public:
  explicit Ros(Options options) : options_(std::move(options)) {}

  std::vector<std::string> schemes() const override { return {"ros"}; }
  std::vector<std::string> forms() const override { return {"ros:/name"}; }

  std::string about() const override {
    if (std::string missing = lacks(); !missing.empty()) return missing;
    const GraphAddress here = *GraphAddress::parse("");
    return fmt::format("ROS 2 by Fast DDS, without authentication; domain {}{}{}{}", here.domain_or_environment(),
                       ", " + who_reaches(here.participant()),
                       here.release_or_environment() == Release::kHumble ? ", messages between nodes as in Humble"
                                                                         : ", messages between nodes as from Iron on",
                       oddities_of_environment());
  }

  std::string lacks() const override {
    if (const auto can_be_meant = GraphAddress::parse("")->check_environment(); !can_be_meant)
      return can_be_meant.error().message;
    const auto there = load_dds();
    return there ? std::string() : there.error().message;
  }

  Result<void> check(const Address& address) const override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    return {};
  }

  Result<void> check_beside(const Address& address, const Address& other) const override {
    const auto one = GraphAddress::parse(address.path);
    const auto two = GraphAddress::parse(other.path);
    if (!one || !two || one->participant() != two->participant() ||
        one->release_or_environment() == two->release_or_environment())
      return {};
    const auto said = [](const GraphAddress& each) { return std::string(release_of(each)); };
    return fail(
        "rpc.address",
        fmt::format("\"{}\" is of {}, and \"{}\" of {}, but all addresses of domain {} are one node, which tells of "
                    "itself as one release does; write the same release= at both, or set ROS_DISTRO and leave it out",
                    to_string(address), said(*one), to_string(other), said(*two), one->domain_or_environment()));
  }

  Result<void> check_service(const Address& address, const idl::Service& interface) const override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    if (auto fits = check_options(to_string(address), *parsed, interface); !fits || !parsed->requests) return fits;
    return fail("rpc.address",
                fmt::format("\"{}\" has requests, which is of what others ask each other and stands under observe:; "
                            "leave it out",
                            to_string(address)));
  }

  Result<void> check_called(const Address& address, const idl::Service& interface,
                            const idl::Method& method) const override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    return check_method(*parsed, parsed->name_of(address.service), interface, method);
  }

  bool is_source(const Address& address, const idl::Service* interface) const override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return false;
    if (interface != nullptr && form_of(*interface) == Form::kAction) return true;
    return !parsed->publish && (interface == nullptr || is_data(*interface));
  }

  Address beside(const Address& address, const std::string& service, const std::string& other) const override {
    Address out = address;
    out.service = other;
    const auto question = std::min(out.path.find('?'), out.path.size());
    if (out.path.substr(0, question).ends_with("/" + service))
      out.path.replace(question - service.size(), service.size(), other);
    return out;
  }

  Result<std::unique_ptr<rpc::Caller>> connect(const Address& address, idl::ServicePtr interface,
                                               rpc::ClientOptions options) override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    auto node = open_node(*parsed);
    if (!node) return tl::unexpected(std::move(node.error()));
    if (options.target.empty()) options.target = interface->name;
    const std::string base = parsed->name_of(address.service.empty() ? options.target : address.service);
    const bool is_probe = interface->find(kProbe) != nullptr;
    auto out = std::make_unique<RosCaller>(*node, std::move(interface), std::move(options));
    if (auto opened = out->begin(*parsed, is_probe ? parsed->name : base); !opened)
      return tl::unexpected(std::move(opened.error()));
    out->settle();
    return std::unique_ptr<rpc::Caller>(std::move(out));
  }

  Result<std::unique_ptr<rpc::Opened>> serve(const Address& address, std::vector<rpc::NamedService> services,
                                             rpc::ServerOptions options) override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    if (services.size() > 1 && !parsed->name.ends_with('/')) {
      return fail(
          "rpc.address",
          fmt::format(
              "\"{}\" is one name, but there are {} services; give what their names begin with, such as ros:/ for /{}",
              to_string(address), services.size(), services.front().name));
    }
    auto node = open_node(*parsed, options.on_peer_error, true);
    if (!node) return tl::unexpected(std::move(node.error()));
    auto out = std::make_unique<Serving>(to_string(address), options.on_peer_error);
    for (const rpc::NamedService& each : services) {
      if (auto added = out->add(*node, *parsed, parsed->name_of(each.name), each.service, options.limits); !added)
        return tl::unexpected(std::move(added.error()));
    }
    return std::unique_ptr<rpc::Opened>(std::move(out));
  }

  Result<std::unique_ptr<rpc::Opened>> subscribe(const Address& address, idl::ServicePtr interface, Take take,
                                                 SubscribeOptions options) override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    auto node = open_node(*parsed, options.problem);
    if (!node) return tl::unexpected(std::move(node.error()));
    const std::string base = parsed->name_of(options.target);
    auto out = std::make_unique<Listening>(to_string(address));
    if (form_of(*interface) == Form::kAction) {
      if (auto heard = out->hear_action(*node, interface, base, std::move(take), options.problem); !heard)
        return tl::unexpected(std::move(heard.error()));
      out->settle(**node);
      return std::unique_ptr<rpc::Opened>(std::move(out));
    }
    for (const idl::Method* method : interface->methods) {
      auto carried = Carried::make(*interface, *method, base);
      if (!carried) return tl::unexpected(std::move(carried.error()));
      if (auto heard = out->hear(*node, *carried, parsed->qos_of(false), interface, take, options.problem); !heard)
        return tl::unexpected(std::move(heard.error()));
    }
    if (options.optional) return std::unique_ptr<rpc::Opened>(std::move(out));
    if (auto looked = out->tell_unpublished(*node); !looked) return tl::unexpected(std::move(looked.error()));
    return std::unique_ptr<rpc::Opened>(std::move(out));
  }

  std::string why_silent(const Address& address, const idl::Service& interface, const std::string& target) override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed || parsed->qos_of(false).transient_local || !is_data(interface)) return {};
    const auto node = open_node(*parsed);
    if (!node) return {};
    for (const idl::Method* method : interface.methods) {
      const auto carried = Carried::make(interface, *method, parsed->name_of(target));
      if (carried && latched(**node, (*carried)->name).some) return kAskForLatched;
    }
    return {};
  }

  Result<void> check_overheard(const Address& address, const idl::Service& interface) const override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    if (auto fits = check_options(to_string(address), *parsed, interface); !fits || !parsed->publish) return fits;
    return fail(
        "rpc.address",
        fmt::format("\"{}\" is a topic of ours; to hear what others say there, leave out publish", to_string(address)));
  }

  Result<std::unique_ptr<rpc::Opened>> overhear(const Address& address, idl::ServicePtr interface, Hearing hearing,
                                                SubscribeOptions options) override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    auto node = open_node(*parsed, options.problem);
    if (!node) return tl::unexpected(std::move(node.error()));
    return ros::overhear(*node, *parsed, interface, parsed->name_of(options.target), to_string(address),
                         std::move(hearing), options.problem);
  }

  Result<std::unique_ptr<rpc::Opened>> watch(const Address& address, std::function<void(const std::string&)> take,
                                             SubscribeOptions options) override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    auto node = open_node(*parsed);
    if (!node) return tl::unexpected(std::move(node.error()));
    return std::unique_ptr<rpc::Opened>(std::make_unique<Watching>(*node, *parsed, to_string(address), options_,
                                                                   std::move(take), std::move(options.problem)));
  }

  Result<std::vector<rpc::NetworkEntry>> list(const Address& address, std::chrono::milliseconds patience) override {
    const auto parsed = GraphAddress::parse(address.path);
    if (!parsed) return tl::unexpected(parsed.error());
    auto node = open_node(*parsed);
    if (!node) return tl::unexpected(std::move(node.error()));
    const auto until = SteadyClock::now() + patience;
    std::mutex mutex;
    std::condition_variable never;
    std::unique_lock lock(mutex);
    while (SteadyClock::now() < until || !(*node)->is_settled()) never.wait_for(lock, kLook);
    std::map<std::string, std::string> found;
    for (const dds::Endpoint& each : (*node)->endpoints()) {
      const auto [name, kind] = shown(each);
      if (!name.empty() && name.starts_with(parsed->name)) found[name] = kind;
    }
    std::vector<rpc::NetworkEntry> out;
    for (const auto& [name, kind] : found) out.push_back({name, "ros:" + name, kind});
    if (!out.empty()) return out;
    const bool is_all = parsed->name == "/";
    return fail(
        "rpc.address",
        fmt::format("nobody offers anything{} in domain {} of ROS 2 on {}; domain= and range= behind the address "
                    "look elsewhere, and so do ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE",
                    is_all ? "" : " whose name begins with " + parsed->name, parsed->domain_or_environment(),
                    where_looked(parsed->participant())));
  }

 private:
  // Says once of each domain who reaches it: where others of the network do, and where something is served.
  Result<std::shared_ptr<Node>> open_node(const GraphAddress& address, const Problem& problem = {},
                                          bool serves = false) {
    auto node = Node::of(address);
    if (!node) return node;
    const Problem& tell = problem ? problem : options_.warn;
    if (!tell) return node;
    const dds::ParticipantOptions opened = address.participant();
    bool is_news = !opened.localhost || !opened.peers.empty() || serves;
    std::string odd = oddities_of_environment();
    {
      const std::lock_guard lock(mutex_);
      is_news = is_news && opened_.insert(opened).second;
      if (std::exchange(odd_told_, true)) odd.clear();
    }
    if (!odd.empty()) tell(odd.substr(2));
    if (is_news) {
      tell(
          fmt::format("domain {} of ROS 2 is open to {}; whoever reaches it can do everything, DDS is used without "
                      "authentication",
                      opened.domain, who_reaches(opened)));
    }
    return node;
  }

  std::mutex mutex_;
  std::set<dds::ParticipantOptions> opened_;
  bool odd_told_ = false;  // what is odd about the environment
  const Options options_;
};

}  // namespace

std::unique_ptr<rpc::Middleware> make_middleware(Options options) { return std::make_unique<Ros>(std::move(options)); }

}  // namespace sentree::ros
