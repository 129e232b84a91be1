#pragma once

#include <memory>

#include "sentree/rpc/middleware.h"

namespace sentree::yarp {

/// yarp: addresses, see `PortAddress`. A service is called, and served, as a port for calls; one whose methods are all
/// one-way is a port for data: written to at a name that ends with ":i", read from at one that ends with ":o", the
/// other way round for a port that is `open` here.
[[nodiscard]] std::unique_ptr<rpc::Middleware> make_middleware();

}  // namespace sentree::yarp
