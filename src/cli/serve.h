#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sentree/rpc/server.h"

namespace sentree::cli {

/// Serves until SIGINT or SIGTERM, having printed "listening on ADDRESS". `stop` is called then.
/// @param of_run  Names the durable run that it belongs to (processes/executive.h), and without which it ends in time;
///                empty: none.
int serve_until_signal(const std::string& listen, std::vector<rpc::NamedService> services, bool insecure,
                       const std::string& of_run = {});

}  // namespace sentree::cli
