#include "sentree/processes/remote_service.h"

#include "sentree/processes/environment.h"
#include "sentree/rpc/middleware.h"

namespace sentree::processes {

using runtime::ServicePort;

mission::CallOutcome to_call_outcome(rpc::Outcome outcome) {
  if (outcome) return {.ok = true, .result = std::move(*outcome), .kind = {}, .message = {}};
  const rpc::CallError& error = outcome.error();
  return {.ok = false, .result = {}, .kind = std::string(to_string(error.kind)), .message = error.message};
}

namespace {

class RemotePort final : public ServicePort {
 public:
  RemotePort(std::unique_ptr<rpc::Caller> client, Duration deadline)
      : deadline_(deadline), client_(std::move(client)) {}

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
  rpc::ClientOptions options;
  options.target = std::move(name);
  options.tls = environment_tls();
  auto client = rpc::connect(address, std::move(interface), std::move(options));
  if (!client) return tl::unexpected(client.error());
  return std::unique_ptr<ServicePort>(std::make_unique<RemotePort>(std::move(*client), deadline));
}

mission::CallOutcome call_once(const rpc::Address& address, const idl::ServicePtr& interface, const std::string& name,
                               const std::string& method, const Value& args, Duration deadline) {
  rpc::Address target = address;
  if (target.service.empty()) target.service = name;
  rpc::ClientOptions options;
  options.target = name;
  options.tls = environment_tls();
  const auto client = rpc::connect(target, interface, std::move(options));
  if (!client) return {.ok = false, .result = {}, .kind = "unreachable", .message = client.error().message};
  return to_call_outcome(rpc::call_and_wait(**client, method, args, std::chrono::steady_clock::now() + deadline));
}

Result<Probe> Probe::to(const rpc::Address& address, std::string name) {
  const auto schema = idl::Schema::load("service Probe { void sentree_ping() }", "probe.thrift");
  rpc::ClientOptions options;
  options.target = std::move(name);
  options.tls = environment_tls();
  auto caller = rpc::connect(address, schema.value->service("Probe"), std::move(options));
  if (!caller) return tl::unexpected(caller.error());
  return Probe(std::move(*caller));
}

std::optional<std::string> Probe::ask(rpc::Deadline deadline) {
  const auto outcome = rpc::call_and_wait(*caller_, "sentree_ping", Map(), deadline);
  if (outcome || outcome.error().kind == rpc::CallErrorKind::kProtocol) return std::nullopt;
  return outcome.error().message;
}

}  // namespace sentree::processes
