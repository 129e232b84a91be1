#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sentree/rpc/address.h"
#include "sentree/rpc/call.h"
#include "sentree/rpc/caller.h"
#include "sentree/runtime/services.h"

namespace sentree::processes {

/// A service at an address, called through the middleware of its scheme: the caller never waits. An address that names
/// no service may be of several, of which one has this name, or of one alone: which it is, the first connection finds
/// out, by one exchange more. Each call has `deadline` [wall time] from the moment it was asked for. The error of a
/// service that does not exist yet or is gone is kind unreachable.
[[nodiscard]] Result<std::unique_ptr<runtime::ServicePort>> make_remote_port(const rpc::Address& address,
                                                                             idl::ServicePtr interface,
                                                                             std::string name, Duration deadline);

/// What an rpc outcome is for a chart.
[[nodiscard]] mission::CallOutcome to_call_outcome(rpc::Outcome outcome);

/// One synchronous call, for injections and the command line. An address without service is meant likewise.
/// @param problem  As of `rpc::ClientOptions`.
[[nodiscard]] mission::CallOutcome call_once(const rpc::Address& address, const idl::ServicePtr& interface,
                                             const std::string& name, const std::string& method, const Value& args,
                                             Duration deadline,
                                             const std::function<void(const std::string&)>& problem = {});

/// Asks a server for what nobody serves, which any server says, and so shows that it lives.
class Probe {
 public:
  /// Errors: as of rpc::connect.
  [[nodiscard]] static Result<Probe> to(const rpc::Address& address, std::string name);
  /// Connects at first. Nothing: it lives; else why it is not known to.
  [[nodiscard]] std::optional<std::string> ask(rpc::Deadline deadline);

 private:
  explicit Probe(std::unique_ptr<rpc::Caller> caller) : caller_(std::move(caller)) {}
  std::unique_ptr<rpc::Caller> caller_;
};

}  // namespace sentree::processes
