#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/service.h"
#include "sentree/rpc/transport.h"

namespace sentree::rpc {

/// A service under the name by which multiplexed clients ask for it.
struct NamedService {
  std::string name;
  std::shared_ptr<Service> service;
};

struct ServerOptions {
  std::size_t connections_max = 64;  ///< One more is closed at once. Over TLS, half of them before their handshake.
  Limits limits;
  TlsFiles tls;
  bool insecure = false;  ///< Allows other machines to connect without TLS.
  /// A message that has begun must end within this time; so must TLS's handshake, and a reply be taken.
  std::chrono::milliseconds message_time_max{5000};
  /// A connection on which nothing comes for this long is closed when its place is needed for another.
  std::chrono::milliseconds idle_before_eviction{10000};
  /// Told of each peer that broke a rule: who and how. From the connection's thread.
  std::function<void(const std::string& message)> on_peer_error;
};

struct ServerCounters {
  std::uint64_t connections = 0;  ///< Accepted so far.
  std::uint64_t refused = 0;      ///< Closed because of `connections_max`.
  std::uint64_t calls = 0;
  std::uint64_t peer_errors = 0;  ///< Connections closed because the peer broke a rule.
};

/// Serves one or several services on an address, a thread per connection. Binary and compact protocol, framed and
/// unframed, plain and multiplexed are told apart by a connection's first bytes; plain calls go to the first service.
class Server {
 public:
  /// Listens when it returns. A stale Unix socket file is replaced, a live one is not.
  /// Errors: rpc.address, rpc.port-taken, rpc.not-loopback (no TLS and not `insecure`), rpc.tls (files that cannot be
  /// used, or a certificate that is not valid now).
  [[nodiscard]] static Result<std::unique_ptr<Server>> start(const Address& address, std::vector<NamedService> services,
                                                             ServerOptions options = {});
  /// Stops.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// With the port that was taken.
  [[nodiscard]] const Address& address() const;

  /// Closes all connections, waits for the calls in progress, removes the Unix socket file. Idempotent.
  void stop();

  [[nodiscard]] ServerCounters counters() const;

 private:
  class Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::rpc
