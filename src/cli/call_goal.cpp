#include "sentree/cli/call_goal.h"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <string>

#include "sentree/cli/commands.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/rpc/call.h"
#include "sentree/rpc/middleware.h"
#include "sentree/text/json.h"

namespace sentree::cli {
namespace {

constexpr std::chrono::milliseconds kLook{100};
// Between the cancellation and the end of the goal.
constexpr std::chrono::seconds kEndPatience{5};

rpc::Deadline in(Duration time) { return std::chrono::steady_clock::now() + time; }

// What comes of goals, whoever sent them.
class Goals {
 public:
  explicit Goals(bool feedback) : feedback_(feedback) {}

  void take(const idl::Method& method, const Value& arguments) {
    const Value* const id = arguments.find("goal_id");
    const Value* const feedback = arguments.find("feedback");
    const std::lock_guard lock(mutex_);
    if (id == nullptr) return;
    if (method.name == "result") results_.insert_or_assign(std::string(id->text()), arguments);
    if (feedback_ && feedback != nullptr && id->text() == own_) print(to_json(*feedback) + "\n");
    changed_.notify_all();
  }
  void own(const std::string& id) {
    const std::lock_guard lock(mutex_);
    own_ = id;
  }
  /// The result of the own goal. Null: it was interrupted, or `until` has passed.
  Value wait(rpc::Deadline until, bool interrupts) {
    std::unique_lock lock(mutex_);
    while (!results_.contains(own_) && !(interrupts && is_interrupted()) && std::chrono::steady_clock::now() < until)
      changed_.wait_for(lock, kLook);
    const auto found = results_.find(own_);
    return found != results_.end() ? found->second : Value();
  }

 private:
  const bool feedback_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string own_;
  std::map<std::string, Value> results_;
};

int failed(const rpc::CallError& error) {
  say(fmt::format("{}: {}", rpc::to_string(error.kind), error.message));
  return error.kind == rpc::CallErrorKind::kArguments ? kUsage : kEnvironment;
}

}  // namespace

bool sends_goal(const rpc::Address& address, const idl::Service& interface, std::string_view method) {
  const idl::Method* const result = interface.find("result");
  return method == "send_goal" && interface.find("send_goal") != nullptr && interface.find("cancel_goal") != nullptr &&
         result != nullptr && result->oneway && rpc::middleware_of(address).is_source(address, &interface);
}

int call_goal(const rpc::Address& address, const idl::ServicePtr& interface, const Value& goal, Duration deadline,
              bool feedback) {
  const Interrupts interrupts;
  const std::string target = address.service.empty() ? interface->name : address.service;
  Goals goals(feedback);
  const auto heard = rpc::middleware_of(address).subscribe(
      address, interface, [&](const idl::Method& method, const Value& arguments) { goals.take(method, arguments); },
      {.target = target, .problem = [](const std::string& what) { say("! " + what); }});
  if (!heard) {
    say(to_string(heard.error()));
    return kEnvironment;
  }
  rpc::ClientOptions options;
  options.target = target;
  const auto client = rpc::connect(address, interface, options);
  if (!client) {
    say(to_string(client.error()));
    return kEnvironment;
  }
  const auto accepted = rpc::call_and_wait(**client, "send_goal", goal, in(deadline));
  if (!accepted) return failed(accepted.error());
  const Value* const is_accepted = accepted->find("accepted");
  if (is_accepted == nullptr || is_accepted->as_bool() == nullptr || !*is_accepted->as_bool()) {
    print(to_json(*accepted) + "\n");
    say("the goal was refused");
    return kFindings;
  }
  const std::string id(accepted->find("goal_id")->text());
  goals.own(id);
  say(fmt::format("goal {} was accepted; its result is waited for, Ctrl-C cancels it", id));
  Value result = goals.wait(rpc::Deadline::max(), true);
  const bool is_cancelled = result.is_null();
  if (is_cancelled) {
    say("the goal is cancelled");
    if (const auto asked = rpc::call_and_wait(**client, "cancel_goal", Map{{"goal_id", id}}, in(deadline)); !asked)
      return failed(asked.error());
    result = goals.wait(in(kEndPatience), false);
  }
  if (result.is_null()) {
    say("it has not ended yet");
    return kInterrupted;
  }
  print(to_json(result) + "\n");
  return is_cancelled ? kInterrupted : result.find("status")->text() == "SUCCEEDED" ? kOk : kFindings;
}

}  // namespace sentree::cli
