#pragma once

#include <memory>

#include "sentree/rpc/address.h"
#include "sentree/rpc/call.h"
#include "sentree/runtime/services.h"

namespace sentree::processes {

/// A service at an address, called through the middleware of its scheme: the caller never waits. Each call has
/// `deadline` [wall time] from the moment it was asked for. The error of a service that does not exist yet or is gone
/// is kind unreachable.
[[nodiscard]] Result<std::unique_ptr<runtime::ServicePort>> make_remote_port(const rpc::Address& address,
                                                                             idl::ServicePtr interface,
                                                                             std::string name, Duration deadline);

/// What an rpc outcome is for a chart.
[[nodiscard]] mission::CallOutcome to_call_outcome(rpc::Outcome outcome);

/// One synchronous call, for injections and the command line. `address` without service name means `name`.
[[nodiscard]] mission::CallOutcome call_once(const rpc::Address& address, const idl::ServicePtr& interface,
                                             const std::string& name, const std::string& method, const Value& args,
                                             Duration deadline);

}  // namespace sentree::processes
