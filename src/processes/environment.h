#pragma once

#include "sentree/rpc/transport.h"

namespace sentree::processes {

/// The certificate files that this process uses for tls:// addresses: SENTREE_TLS_AUTHORITY, SENTREE_TLS_CERTIFICATE
/// and SENTREE_TLS_KEY (PEM). Empty where they are not set; a tls:// address is then refused with a message that names
/// them.
[[nodiscard]] rpc::TlsFiles environment_tls();

}  // namespace sentree::processes
