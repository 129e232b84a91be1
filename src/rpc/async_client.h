#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include "sentree/rpc/client.h"

namespace sentree::rpc {

/// Calls of one AsyncClient that wait for those before them.
inline constexpr std::size_t kAsyncCallsMax = 256;

/// Calls one service in another process without waiting for it. Calls are made one after the other, in the order given;
/// all else is as `Client` does it over a socket.
///
/// A request is sent in the caller's thread where the connection stands and is free, and never waits there. A thread of
/// the client's own does the rest: it connects, reads the replies, keeps the deadlines and calls `done`; so a call
/// costs one thread's waking, when the reply comes. Thread-safe.
class AsyncClient {
 public:
  /// Called once for each call: before `call` returns (a veto, wrong arguments, too many calls, a closed client), or
  /// from the client's thread, which does nothing else meanwhile. It may call the client, but not destroy it.
  using Done = std::function<void(Outcome)>;

  /// Connects with the first call. Errors: rpc.address (kLocal), rpc.tls, rpc.exhausted (no descriptor or thread left).
  [[nodiscard]] static Result<std::unique_ptr<AsyncClient>> remote(const Address& address, idl::ServicePtr interface,
                                                                   ClientOptions options = {});
  /// Closes, and waits for a `done` in progress.
  ~AsyncClient();
  AsyncClient(const AsyncClient&) = delete;
  AsyncClient& operator=(const AsyncClient&) = delete;

  [[nodiscard]] const idl::Service& interface() const;

  /// `method` is of `interface()`; `arguments` as for `Client::call`.
  void call(const idl::Method& method, Value arguments, Deadline deadline, Done done);
  void call(std::string_view method, Value arguments, Deadline deadline, Done done);

  /// Fails all calls, now and later, as kUnreachable. Idempotent.
  void close();
  /// The same, and waits: once it returns, no `done` is in progress, and none is called for what was asked before.
  /// Not from a `done`.
  void end();

  [[nodiscard]] ClientCounters counters() const;

 private:
  class Impl;
  explicit AsyncClient(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::rpc
