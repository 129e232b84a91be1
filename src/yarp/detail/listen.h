#pragma once

#include "sentree/base/result.h"
#include "sentree/rpc/listener.h"
#include "sentree/yarp/address.h"

/// Private to the library.
namespace sentree::yarp {

/// Listens there; a port 0 becomes the one that was taken. Beyond loopback only if that is allowed: YARP has no
/// authentication. Errors: rpc.not-loopback, and those of `rpc::Listener::open`.
[[nodiscard]] Result<rpc::Listener> listen(HostPort& at, bool insecure);

}  // namespace sentree::yarp
