#pragma once

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/rpc/address.h"

namespace sentree::cli {

/// Whether `method` sends a goal of an action, whose end is then published.
[[nodiscard]] bool sends_goal(const rpc::Address& address, const idl::Service& interface, std::string_view method);

/// Sends it and shows its result on standard output once it has ended, however long that takes; an interrupt cancels
/// it. Returns an exit code: `kOk` if it succeeded, `kFindings` if it was refused or ended otherwise.
/// @param deadline  Until it is accepted.
/// @param feedback  Show that too, line by line.
[[nodiscard]] int call_goal(const rpc::Address& address, const idl::ServicePtr& interface, const Value& goal,
                            Duration deadline, bool feedback);

}  // namespace sentree::cli
