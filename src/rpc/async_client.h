#pragma once

#include <memory>

#include "sentree/rpc/client.h"
#include "sentree/rpc/line.h"

namespace sentree::rpc {

/// Calls of one AsyncClient that wait for those before them.
inline constexpr std::size_t kAsyncCallsMax = 256;

/// Calls one service in another process over a stream.
///
/// A request is sent in the caller's thread where the connection stands and is free, and never waits there. A thread of
/// the client's own does the rest: it connects, reads the replies, keeps the deadlines and calls `done`; so a call
/// costs one thread's waking, when the reply comes. Thread-safe.
class AsyncClient final : public Caller {
 public:
  /// Connects with the first call. Errors: rpc.address (not Thrift's), rpc.tls, rpc.exhausted (no descriptor or thread
  /// left).
  [[nodiscard]] static Result<std::unique_ptr<AsyncClient>> remote(const Address& address, idl::ServicePtr interface,
                                                                   ClientOptions options = {});
  /// The same over the line of another middleware. Errors: rpc.exhausted.
  [[nodiscard]] static Result<std::unique_ptr<AsyncClient>> over(std::unique_ptr<Line> line, idl::ServicePtr interface);
  /// Closes, and waits for a `done` in progress.
  ~AsyncClient() override;
  AsyncClient(const AsyncClient&) = delete;
  AsyncClient& operator=(const AsyncClient&) = delete;

  [[nodiscard]] const idl::Service& interface() const override;
  using Caller::call;
  void call(const idl::Method& method, Value arguments, Deadline deadline, Done done) override;
  void open(Deadline deadline, const Done& done) override;
  void close() override;
  void end() override;
  [[nodiscard]] ClientCounters counters() const override;

 private:
  class Impl;
  explicit AsyncClient(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::rpc
