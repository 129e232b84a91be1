#include "sentree/processes/environment.h"

#include <cstdlib>

namespace sentree::processes {

rpc::TlsFiles environment_tls() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value != nullptr ? value : "");
  };
  return {.authority = variable("SENTREE_TLS_AUTHORITY"),
          .certificate = variable("SENTREE_TLS_CERTIFICATE"),
          .key = variable("SENTREE_TLS_KEY")};
}

}  // namespace sentree::processes
