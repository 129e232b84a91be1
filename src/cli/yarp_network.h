#pragma once

#include <memory>
#include <string>

#include "sentree/base/result.h"
#include "sentree/yarp/name_server.h"

namespace sentree::cli {

/// A name server of YARP in this process, which it and the processes that it starts use from then on. Says where it is.
/// @param where  HOST:PORT; empty or "true": where one is configured.
[[nodiscard]] Result<std::unique_ptr<yarp::NameServer>> start_name_server(const std::string& where, bool insecure);

/// The same, if none answers there. Null: one does, and is used.
[[nodiscard]] Result<std::unique_ptr<yarp::NameServer>> ensure_name_server(const std::string& where, bool insecure);

}  // namespace sentree::cli
