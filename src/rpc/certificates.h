#pragma once

#include <string>

#include "sentree/base/result.h"
#include "sentree/rpc/transport.h"

namespace sentree::rpc {

/// What a part shows of itself over `tls://`.
struct Certificate {
  std::string names;  ///< The hosts that it may be reached as: "DNS:navigation, IP Address:10.0.0.5"; may be empty.
  int days_left = 0;  ///< Until it expires.
};

/// Reads the files as a server or client would, and checks the certificate against the authority, as a peer with the
/// same authority would. Its host name is not checked. Code: rpc.tls.
[[nodiscard]] Result<Certificate> examine(const TlsFiles& files);

}  // namespace sentree::rpc
