#include "sentree/ros/detail/overhear.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "sentree/ros/detail/action_type.h"
#include "sentree/ros/detail/goal_id.h"
#include "sentree/ros/detail/mapping.h"

namespace sentree::ros {
namespace {

using Octets = std::vector<std::uint8_t>;
using Hearing = rpc::Middleware::Hearing;
using Trouble = std::function<void(const std::string&)>;

// How often it is looked whether a server is there.
constexpr std::chrono::milliseconds kLookForServers{50};
// Requests that wait for their reply, and replies whose request has not come: it may be sent again on its way.
constexpr std::size_t kUnpairedMax = 256;

// Who asked, and the number of the request.
using Pairing = std::pair<dds::Guid, std::int64_t>;

// A request, as it is remembered until the reply comes.
struct Asked {
  std::uint64_t call = 0;
  std::string goal_id;
};

// One service: what is asked there, and what is answered.
class ServiceEar {
 public:
  /// Nothing: it cannot be read.
  using OnRequest = std::function<std::optional<Asked>(const Octets& request)>;
  using OnReply = std::function<void(const Asked& asked, const Octets& reply)>;

  /// @param hears_requests  Else replies only, of which it is not known what they answer.
  ServiceEar(std::shared_ptr<Node> node, ServiceName service, bool hears_requests, Worker& worker, OnRequest on_request,
             OnReply on_reply, Trouble trouble)
      : hears_requests_(hears_requests),
        node_(std::move(node)),
        service_(std::move(service)),
        worker_(worker),
        on_request_(std::move(on_request)),
        on_reply_(std::move(on_reply)),
        trouble_(std::move(trouble)) {}

  // Opens what is needed to listen while a server is there, and closes it afterwards. By one thread only.
  void look() {
    const std::string asked = fmt::format("rq{}Request", service_.name);
    const std::string answered = fmt::format("rr{}Reply", service_.name);
    bool reads = false;
    bool writes = false;
    bool is_cyclone = false;
    for (const dds::Endpoint& each : node_->endpoints()) {
      if (each.overhears) continue;
      if (!each.is_writer && each.topic == asked) {
        if (each.type != service_.request_type) {
          trouble_(fmt::format("{} is {} there, and {} here, so nothing of it is heard", service_.name,
                               ros_name(each.type), ros_name(service_.request_type)));
          continue;
        }
        reads = true;
        is_cyclone = is_cyclone || dds::is_cyclone(each.guid);
      }
      writes = writes || (each.is_writer && each.topic == answered && each.type == service_.reply_type);
    }
    servers_are_cyclone_ = is_cyclone;
    std::string error;
    auto& graph = node_->participant();
    const auto nothing = [](const std::string&) {};
    if (!hears_requests_) {
      if (replies_ != nullptr) return;
      replies_ = graph.read(
          {answered, service_.reply_type, {}}, [this](dds::Sample s) { post(false, std::move(s)); }, nothing, error);
      if (replies_ == nullptr) trouble_(fmt::format("nothing can be heard of {}: {}", service_.name, error));
      return;
    }
    if ((reads && writes) == (requests_ != nullptr)) return;
    if (requests_ != nullptr) return close();
    const std::string mark(dds::kOverhears);
    replies_ = graph.read(
        {answered, service_.reply_type, {}}, [this](dds::Sample s) { post(false, std::move(s)); }, nothing, error);
    silent_ = graph.write({answered, service_.reply_type, {}, mark}, nothing, error);
    requests_ = graph.read(
        {asked, service_.request_type, {}, mark}, [this](dds::Sample s) { post(true, std::move(s)); }, nothing, error);
    if (replies_ != nullptr && silent_ != nullptr && requests_ != nullptr) return;
    close();
    trouble_(fmt::format("nothing can be heard of {}: {}", service_.name, error));
  }

  void close() {
    requests_.reset();
    silent_.reset();
    replies_.reset();
  }

 private:
  void post(bool is_request, dds::Sample sample) {
    auto kept = std::make_shared<dds::Sample>(std::move(sample));
    const bool fits = worker_.post([this, is_request, kept] {
      if (is_request)
        request(std::move(*kept));
      else
        reply(std::move(*kept));
    });
    if (!fits)
      trouble_(fmt::format("what is said at {} comes faster than it is heard: the oldest is lost", service_.name));
  }

  // Behind the head of the message, where rmw_cyclonedds has it; taken away.
  static std::optional<Pairing> cut_identity(Octets& octets) {
    constexpr std::size_t kIdentity = 16;
    if (octets.size() < kEncapsulation + kIdentity) return std::nullopt;
    const bool little = octets[1] == 1;
    Pairing out;
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      out.first[i] = octets[kEncapsulation + (little ? i : 7 - i)];
      number |= static_cast<std::uint64_t>(octets[kEncapsulation + 8 + i]) << (8 * (little ? i : 7 - i));
    }
    out.second = static_cast<std::int64_t>(number);
    octets.erase(octets.begin() + kEncapsulation, octets.begin() + kEncapsulation + kIdentity);
    return out;
  }

  void request(dds::Sample sample) {
    if (sample.octets.size() < kEncapsulation) return;
    std::optional<Pairing> key;
    // A client of ours writes for a server of Cyclone as Cyclone does.
    if (dds::is_cyclone(sample.id.writer) || (!sample.related.is_known() && servers_are_cyclone_))
      key = cut_identity(sample.octets);
    else
      key = {sample.related.is_known() ? sample.related.writer : sample.id.writer, sample.id.sequence};
    if (!key) return;
    const auto asked = on_request_(sample.octets);
    if (!asked) return;
    const auto early = std::find_if(early_.begin(), early_.end(), [&](const auto& each) { return each.first == *key; });
    if (early != early_.end()) {
      on_reply_(*asked, early->second);
      early_.erase(early);
      return;
    }
    if (asked_.size() >= kUnpairedMax) asked_.pop_front();
    asked_.emplace_back(*key, *asked);
  }

  void reply(dds::Sample sample) {
    if (sample.octets.size() < kEncapsulation) return;
    const auto key = sample.related.is_known() ? Pairing{sample.related.writer, sample.related.sequence}
                                               : cut_identity(sample.octets);
    if (!key) return;
    if (!hears_requests_) return on_reply_({}, sample.octets);
    const auto asked = std::find_if(asked_.begin(), asked_.end(), [&](const auto& each) { return each.first == *key; });
    if (asked != asked_.end()) {
      const Asked found = std::move(asked->second);
      asked_.erase(asked);
      return on_reply_(found, sample.octets);
    }
    if (early_.size() >= kUnpairedMax) early_.pop_front();
    early_.emplace_back(*key, std::move(sample.octets));
  }

  const bool hears_requests_;
  const std::shared_ptr<Node> node_;
  const ServiceName service_;
  Worker& worker_;
  const OnRequest on_request_;
  const OnReply on_reply_;
  const Trouble trouble_;
  std::atomic<bool> servers_are_cyclone_{false};
  // Of the worker.
  std::deque<std::pair<Pairing, Asked>> asked_;
  std::deque<std::pair<Pairing, Octets>> early_;
  // Of who looks.
  std::unique_ptr<dds::Reader> replies_;
  std::unique_ptr<dds::Writer> silent_;
  std::unique_ptr<dds::Reader> requests_;
};

class Overhearing final : public rpc::Opened {
 public:
  Overhearing(std::shared_ptr<Node> node, idl::ServicePtr interface, std::string text, Hearing hearing, Trouble problem)
      : node_(std::move(node)),
        interface_(std::move(interface)),
        text_(std::move(text)),
        hearing_(std::move(hearing)),
        problem_(std::move(problem)) {}
  ~Overhearing() override { stop(); }

  std::string address() const override { return text_; }
  void stop() override {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    const std::lock_guard lock(join_mutex_);
    if (looker_.joinable()) looker_.join();
    topics_.clear();
    for (const auto& ear : services_) ear->close();
    worker_.stop();
  }

  Result<void> open(const GraphAddress& address, const std::string& base) {
    hears_requests_ = address.requests;
    auto listening = form_of(*interface_) == Form::kAction ? action(base) : methods(address, base);
    if (!listening) return listening;
    try {
      looker_ = std::thread([this] { look(); });
    } catch (const std::system_error& e) {
      return fail("rpc.exhausted", std::string("no thread is left: ") + e.what());
    }
    return {};
  }

 private:
  void look() {
    bool is_told = false;
    std::unique_lock lock(mutex_);
    while (!stopped_) {
      lock.unlock();
      for (const auto& ear : services_) ear->look();
      if (!is_told && node_->is_settled()) {
        tell_missing();
        is_told = true;
      }
      lock.lock();
      if (is_told && services_.empty()) return;
      changed_.wait_for(lock, kLookForServers, [&] { return stopped_; });
    }
  }

  // Once everybody has been discovered: what is to be heard and nobody has.
  void tell_missing() {
    const std::vector<dds::Endpoint> all = node_->endpoints();
    for (const Expected& each : expected_) {
      const bool is_there = std::any_of(all.begin(), all.end(), [&](const dds::Endpoint& one) {
        const auto [name, kind] = shown(one);
        // Of one with another type it is told what that is.
        return name == each.name && kind.starts_with(each.kind + " ") && (one.is_writer || each.kind != "topic");
      });
      if (is_there) continue;
      trouble(fmt::format("{} ros:{} yet, in domain {}{}",
                          each.kind == "topic" ? "nobody publishes" : fmt::format("nobody serves the {}", each.kind),
                          each.name, node_->domain(), near_names(*node_, each.name, each.kind, each.type)));
      // The others are methods of the same service.
      if (form_of(*interface_) == Form::kThrift) return;
    }
  }

  // Each thing once: it would be said with each message.
  void trouble(const std::string& what) {
    {
      const std::lock_guard lock(told_mutex_);
      if (told_.size() >= kToldMax || std::find(told_.begin(), told_.end(), what) != told_.end()) return;
      told_.push_back(what);
    }
    if (problem_) problem_(what);
  }

  Result<void> topic(const dds::Channel& channel, std::function<void(const Octets&)> take) {
    auto reader = node_->read(
        channel,
        [this, take = std::move(take), name = channel.topic](dds::Sample sample) {
          auto kept = std::make_shared<Octets>(std::move(sample.octets));
          if (!worker_.post([take, kept] { take(*kept); }))
            trouble(fmt::format("messages of {} come faster than they are heard: the oldest are lost", name.substr(2)));
        },
        [this](const std::string& misfit) {
          if (!misfit.empty()) trouble(misfit);
        });
    if (!reader) return tl::unexpected(std::move(reader.error()));
    topics_.push_back(std::move(*reader));
    return {};
  }

  void service(const ServiceName& name, ServiceEar::OnRequest on_request, ServiceEar::OnReply on_reply) {
    services_.push_back(std::make_unique<ServiceEar>(node_, name, hears_requests_, worker_, std::move(on_request),
                                                     std::move(on_reply),
                                                     [this](const std::string& what) { trouble(what); }));
  }

  Result<void> methods(const GraphAddress& address, const std::string& base) {
    for (const idl::Method* method : interface_->methods) {
      auto made = Carried::make(*interface_, *method, base);
      if (!made) return tl::unexpected(std::move(made.error()));
      const auto request = [this, carried = *made](const Octets& message) -> std::optional<Asked> {
        auto arguments = carried->read_arguments(message, {});
        if (arguments) return Asked{hearing_.request(*carried->method, std::move(*arguments)), {}};
        trouble(fmt::format("a message of {} cannot be read as {}: {}", carried->name, interface_->name,
                            arguments.error().message));
        return std::nullopt;
      };
      if (method->oneway) {
        auto heard = topic({"rt" + (*made)->name, (*made)->type, address.qos_of(false)},
                           [request](const Octets& message) { static_cast<void>(request(message)); });
        if (!heard) return heard;
        expected_.push_back({"topic", (*made)->name, (*made)->type});
        continue;
      }
      expected_.push_back({"service", (*made)->name, (*made)->request_type});
      service({(*made)->name, (*made)->request_type, (*made)->reply_type}, request,
              [this, carried = *made](const Asked& asked, const Octets& reply) {
                hearing_.outcome(asked.call, *carried->method, carried->read_outcome(reply, {}));
              });
    }
    return {};
  }

  Result<void> action(const std::string& base) {
    auto type = ActionType::make(interface_, base);
    if (!type) return tl::unexpected(std::move(type.error()));
    action_.emplace(std::move(*type));
    expected_.push_back({"action", base, action_->send_goal.request_type});
    const auto method = [this](const char* name) -> const idl::Method& { return *interface_->find(name); };
    const auto tell = [this, method](const char* name, Result<Map> arguments) {
      if (arguments)
        static_cast<void>(hearing_.request(method(name), Value(std::move(*arguments))));
      else
        trouble(arguments.error().message);
    };
    const auto id_of = [](const Octets& request) {
      return request.size() < kEncapsulation + kGoalIdSize ? std::string() : goal_id_at(request, kEncapsulation);
    };
    service(
        action_->send_goal,
        [this, id_of, method](const Octets& request) -> std::optional<Asked> {
          auto goal = action_->read_goal(request);
          if (goal) return Asked{hearing_.request(method("send_goal"), std::move(*goal)), id_of(request)};
          trouble(goal.error().message);
          return std::nullopt;
        },
        [this, method](const Asked& asked, const Octets& reply) {
          if (reply.size() <= kEncapsulation) return;
          hearing_.outcome(asked.call, method("send_goal"),
                           Value(Map{{"accepted", reply[kEncapsulation] != 0}, {"goal_id", asked.goal_id}}));
        });
    service(
        action_->cancel_goal,
        [this, id_of, method](const Octets& request) -> std::optional<Asked> {
          std::string id = id_of(request);
          // Nobody's: all goals.
          if (id.find_first_not_of('0') == std::string::npos) id.clear();
          return Asked{hearing_.request(method("cancel_goal"), Value(Map{{"goal_id", id}})), {}};
        },
        [this, method](const Asked& asked, const Octets& reply) {
          if (auto cancelled = ActionType::read_cancelled(reply))
            hearing_.outcome(asked.call, method("cancel_goal"), std::move(*cancelled));
        });
    service(
        action_->get_result,
        [id_of](const Octets& request) -> std::optional<Asked> {
          return Asked{0, id_of(request)};
        },
        [this, tell](const Asked& asked, const Octets& reply) {
          if (reply.size() > kEncapsulation) tell("result", action_->read_result(asked.goal_id, reply));
        });
    if (auto heard = topic(action_->feedback_topic,
                           [this, tell](const Octets& message) {
                             if (message.size() >= kEncapsulation + kGoalIdSize)
                               tell("feedback", action_->read_feedback(message));
                           });
        !heard)
      return heard;
    return topic(action_->status_topic, [this, tell](const Octets& message) {
      for (Map& told : action_->read_statuses(message, statuses_)) tell("status", std::move(told));
    });
  }

  // Of whom something is to be heard.
  struct Expected {
    std::string kind;  // "topic", "service", "action"
    std::string name;
    std::string type;  // in DDS
  };

  static constexpr std::size_t kToldMax = 64;
  bool hears_requests_ = false;

  const std::shared_ptr<Node> node_;
  const idl::ServicePtr interface_;
  const std::string text_;
  const Hearing hearing_;
  const Trouble problem_;
  std::optional<ActionType> action_;
  std::map<std::string, std::string> statuses_;  // of the worker
  std::vector<Expected> expected_;
  std::mutex told_mutex_;
  std::vector<std::string> told_;
  std::vector<ToldPtr> topics_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopped_ = false;
  std::vector<std::unique_ptr<ServiceEar>> services_;
  Worker worker_;
  std::mutex join_mutex_;
  std::thread looker_;
};

}  // namespace

Result<std::unique_ptr<rpc::Opened>> overhear(const std::shared_ptr<Node>& node, const GraphAddress& address,
                                              const idl::ServicePtr& interface, const std::string& base,
                                              const std::string& text, Hearing hearing, Trouble problem) {
  auto out = std::make_unique<Overhearing>(node, interface, text, std::move(hearing), std::move(problem));
  if (auto opened = out->open(address, base); !opened) return tl::unexpected(std::move(opened.error()));
  return std::unique_ptr<rpc::Opened>(std::move(out));
}

}  // namespace sentree::ros
