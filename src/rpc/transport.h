#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace sentree::rpc {

/// Bounds on what a peer may send; beyond one of them the connection is closed with one error.
struct Limits {
  std::size_t message_bytes = 16U << 20U;
  int nesting = 64;  ///< Structs and containers inside each other.
  std::size_t container_items = 1U << 20U;
  std::size_t values = 1U << 22U;  ///< Values in one message, all levels together.
};

/// PEM files for `tls://`. Both sides show a certificate and check the other's against `authority`.
struct TlsFiles {
  std::string authority;
  std::string certificate;
  std::string key;

  [[nodiscard]] bool empty() const { return authority.empty() && certificate.empty() && key.empty(); }
};

}  // namespace sentree::rpc
