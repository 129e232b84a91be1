#include "sentree/processes/remote_service.h"

#include <utility>

#include "sentree/processes/environment.h"
#include "sentree/rpc/middleware.h"

namespace sentree::processes {

using runtime::ServicePort;

mission::CallOutcome to_call_outcome(rpc::Outcome outcome) {
  if (outcome) return mission::CallOutcome::returned(std::move(*outcome));
  rpc::CallError& error = outcome.error();
  auto failed = mission::CallOutcome::failed(error.kind, std::move(error.message));
  if (error.exception.empty()) return failed;
  failed.result = Map{{error.exception, std::move(error.data)}};
  return failed;
}

namespace {

// @param at  An address that names no service may be of several, of which one has that name, or of one alone.
rpc::ClientOptions options_for(const rpc::Address& at, std::string name) {
  rpc::ClientOptions options;
  if (at.service.empty()) options.service = name;
  options.target = std::move(name);
  options.tls = environment_tls();
  return options;
}

// To connect before the first call: it is over before a run has waited for it, so that no call waits behind it.
constexpr std::chrono::milliseconds kOpenPatience{800};

class RemotePort final : public ServicePort {
 public:
  RemotePort(std::unique_ptr<rpc::Caller> client, Duration deadline)
      : deadline_(deadline), client_(std::move(client)) {}

  void open(const std::function<void()>& done) override {
    client_->open(std::chrono::steady_clock::now() + kOpenPatience, [done](const rpc::Outcome&) { done(); });
  }
  void call(const idl::Method& method, Value args, Done done) override {
    client_->call(method, std::move(args), std::chrono::steady_clock::now() + deadline_,
                  [done = std::move(done)](rpc::Outcome outcome) { done(to_call_outcome(std::move(outcome))); });
  }

 private:
  const Duration deadline_;
  const std::unique_ptr<rpc::Caller> client_;
};

}  // namespace

Result<std::unique_ptr<ServicePort>> make_remote_port(const rpc::Address& address, idl::ServicePtr interface,
                                                      std::string name, Duration deadline) {
  auto client = rpc::connect(address, std::move(interface), options_for(address, std::move(name)));
  if (!client) return tl::unexpected(client.error());
  return std::unique_ptr<ServicePort>(std::make_unique<RemotePort>(std::move(*client), deadline));
}

mission::CallOutcome call_once(const rpc::Address& address, const idl::ServicePtr& interface, const std::string& name,
                               const std::string& method, const Value& args, Duration deadline,
                               const std::function<void(const std::string&)>& problem) {
  rpc::ClientOptions options = options_for(address, name);
  options.problem = problem;
  const auto client = rpc::connect(address, interface, std::move(options));
  if (!client) return mission::CallOutcome::failed(rpc::CallErrorKind::kUnreachable, client.error().message);
  return to_call_outcome(rpc::call_and_wait(**client, method, args, std::chrono::steady_clock::now() + deadline));
}

Result<Probe> Probe::to(const rpc::Address& address, std::string name) {
  rpc::ClientOptions options;
  options.target = std::move(name);
  options.tls = environment_tls();
  auto caller = rpc::connect(address, rpc::nobodys_service(), std::move(options));
  if (!caller) return tl::unexpected(caller.error());
  return Probe(std::move(*caller));
}

std::optional<std::string> Probe::ask(rpc::Deadline deadline) {
  const auto outcome = rpc::call_and_wait(*caller_, rpc::nobodys_service()->methods.front()->name, Map(), deadline);
  if (outcome || outcome.error().kind == rpc::CallErrorKind::kProtocol) return std::nullopt;
  return outcome.error().message;
}

}  // namespace sentree::processes
