#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sentree/rpc/server.h"

namespace sentree::cli {

/// Serves until SIGINT or SIGTERM, having printed "listening on ADDRESS". `stop` is called then.
int serve_until_signal(const std::string& listen, std::vector<rpc::NamedService> services, bool insecure);

}  // namespace sentree::cli
