#include "sentree/processes/remote_service.h"

#include <atomic>
#include <functional>
#include <mutex>
#include <utility>

#include "sentree/base/json.h"
#include "sentree/processes/environment.h"
#include "sentree/rpc/middleware.h"

namespace sentree::processes {

using runtime::ServicePort;

mission::CallOutcome to_call_outcome(rpc::Outcome outcome) {
  if (outcome) return {.ok = true, .result = std::move(*outcome), .kind = {}, .message = {}};
  rpc::CallError& error = outcome.error();
  mission::CallOutcome failed{
      .ok = false, .result = {}, .kind = std::string(to_string(error.kind)), .message = std::move(error.message)};
  if (error.exception.empty()) return failed;
  failed.message += " " + to_json(error.data);
  failed.result = Map{{error.exception, std::move(error.data)}};
  return failed;
}

namespace {

using MakeCaller = std::function<Result<std::unique_ptr<rpc::Caller>>()>;

bool is_unknown(const rpc::Outcome& outcome) { return !outcome && outcome.error().unknown_method; }

rpc::ClientOptions options_for(std::string name) {
  rpc::ClientOptions options;
  options.target = std::move(name);
  options.tls = environment_tls();
  return options;
}

class RemotePort final : public ServicePort {
 public:
  /// @param alone  Calls a service that is the only one at its address and knows no name; null: it has one.
  RemotePort(std::unique_ptr<rpc::Caller> client, MakeCaller alone, Duration deadline)
      : deadline_(deadline), make_alone_(std::move(alone)), client_(std::move(client)) {
    is_settled_ = make_alone_ == nullptr;
  }

  void call(const idl::Method& method, Value args, Done done) override {
    const rpc::Deadline until = std::chrono::steady_clock::now() + deadline_;
    const auto answered = [done = std::move(done)](rpc::Outcome outcome) { done(to_call_outcome(std::move(outcome))); };
    if (is_settled_) return asked()->call(method, std::move(args), until, answered);
    Value again = args;
    client_->call(method, std::move(args), until,
                  [this, &method, again, until, answered](rpc::Outcome outcome) mutable {
                    rpc::Caller* const alone = is_unknown(outcome) ? this->alone() : nullptr;
                    if (alone == nullptr) {
                      is_settled_ = is_settled_ || outcome || outcome.error().kind == rpc::CallErrorKind::kException;
                      return answered(std::move(outcome));
                    }
                    alone->call(method, std::move(again), until,
                                [this, first = std::move(outcome), answered](rpc::Outcome second) {
                                  if (is_unknown(second)) return answered(first);
                                  is_alone_ = true;
                                  is_settled_ = true;
                                  answered(std::move(second));
                                });
                  });
  }

 private:
  rpc::Caller* asked() { return is_alone_ ? alone() : client_.get(); }
  rpc::Caller* alone() {
    const std::lock_guard lock(mutex_);
    if (alone_ == nullptr) {
      if (auto made = make_alone_()) alone_ = std::move(*made);
    }
    return alone_.get();
  }

  const Duration deadline_;
  const MakeCaller make_alone_;
  std::atomic<bool> is_settled_ = false;  // it is known by which name it answers
  std::atomic<bool> is_alone_ = false;
  std::mutex mutex_;
  std::unique_ptr<rpc::Caller> alone_;
  const std::unique_ptr<rpc::Caller> client_;  // ends before what it calls
};

}  // namespace

Result<std::unique_ptr<ServicePort>> make_remote_port(const rpc::Address& address, idl::ServicePtr interface,
                                                      std::string name, Duration deadline) {
  rpc::Address target = address;
  if (target.service.empty()) target.service = name;
  MakeCaller alone;
  if (address.service.empty())
    alone = [address, interface, name] { return rpc::connect(address, interface, options_for(name)); };
  auto client = rpc::connect(target, std::move(interface), options_for(std::move(name)));
  if (!client) return tl::unexpected(client.error());
  return std::unique_ptr<ServicePort>(std::make_unique<RemotePort>(std::move(*client), std::move(alone), deadline));
}

mission::CallOutcome call_once(const rpc::Address& address, const idl::ServicePtr& interface, const std::string& name,
                               const std::string& method, const Value& args, Duration deadline) {
  const rpc::Deadline until = std::chrono::steady_clock::now() + deadline;
  const auto ask = [&](const rpc::Address& at) -> rpc::Outcome {
    const auto client = rpc::connect(at, interface, options_for(name));
    if (!client)
      return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kUnreachable, client.error().message, {}, {}});
    return rpc::call_and_wait(**client, method, args, until);
  };
  rpc::Address named = address;
  if (named.service.empty()) named.service = name;
  rpc::Outcome outcome = ask(named);
  if (is_unknown(outcome) && address.service.empty() && !name.empty()) {
    rpc::Outcome alone = ask(address);
    if (!is_unknown(alone)) outcome = std::move(alone);
  }
  return to_call_outcome(std::move(outcome));
}

Result<Probe> Probe::to(const rpc::Address& address, std::string name) {
  const auto schema = idl::Schema::load("service Probe { void sentree_ping() }", "probe.thrift");
  auto caller = rpc::connect(address, schema.value->service("Probe"), options_for(std::move(name)));
  if (!caller) return tl::unexpected(caller.error());
  return Probe(std::move(*caller));
}

std::optional<std::string> Probe::ask(rpc::Deadline deadline) {
  const auto outcome = rpc::call_and_wait(*caller_, "sentree_ping", Map(), deadline);
  if (outcome || outcome.error().kind == rpc::CallErrorKind::kProtocol) return std::nullopt;
  return outcome.error().message;
}

}  // namespace sentree::processes
