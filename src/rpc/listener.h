#pragma once

#include <string>

#include "sentree/rpc/stream.h"

namespace sentree::rpc {

/// A listening socket; removes its Unix socket file when it goes.
class Listener {
 public:
  /// Fills in a port of 0. Errors: rpc.address, rpc.port-taken, rpc.not-loopback.
  [[nodiscard]] static Result<Listener> open(Address& address, bool insecure);
  Listener(Listener&& other) noexcept : socket_(std::move(other.socket_)), file_(std::exchange(other.file_, {})) {}
  Listener& operator=(Listener&&) = delete;
  ~Listener();

  [[nodiscard]] int descriptor() const { return socket_.get(); }
  /// The next connection; not open if there is none. `exhausted` if the process has no descriptor left for it.
  [[nodiscard]] Descriptor accept(bool& exhausted) const;

 private:
  Listener() = default;
  Descriptor socket_;
  std::string file_;
};

}  // namespace sentree::rpc
