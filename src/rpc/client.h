#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/call.h"
#include "sentree/rpc/caller.h"
#include "sentree/rpc/service.h"
#include "sentree/rpc/transport.h"

namespace sentree::rpc {

/// Late replies that one connection may owe before it is given up and made anew.
inline constexpr std::size_t kLateRepliesMax = 8;
/// A late reply is waited for this long; then the connection is given up.
inline constexpr std::chrono::seconds kLateWaitMax{30};
/// Waits between attempts to connect double from the first to the last; calls meanwhile fail at once.
inline constexpr std::chrono::milliseconds kBackoffFirst{10};
inline constexpr std::chrono::milliseconds kBackoffLast{2000};

struct ClientOptions {
  std::string target;  ///< The service's name in the project, for messages; default: the interface's name.
  /// By which it is asked for at an address that names none, where several share one (Thrift's multiplexed protocol). A
  /// server of one service, as generated ones are, has no use for it: the first connection finds out which it is, by a
  /// method that nobody has. Empty: it is alone.
  std::string service = {};
  Limits limits;
  TlsFiles tls;
  std::chrono::milliseconds late_wait{kLateWaitMax};
  std::chrono::milliseconds backoff_last{kBackoffLast};
  /// What is the matter where calls succeed all the same: those who hear what is published expect something else. From
  /// any thread, each thing once; empty: nobody wants to know.
  std::function<void(const std::string&)> problem = {};
};

/// Calls one service of another process. Thread-safe: calls from several threads are made one after the other.
///
/// Over a socket the connection is made by the first call, kept, and made anew after an error. No call blocks
/// beyond its deadline (waiting for another thread's call included). A reply that comes after it reaches nobody.
class Client {
 public:
  /// Over a socket; connects with the first call, so the peer may come later. Errors: rpc.address (kLocal), rpc.tls.
  [[nodiscard]] static Result<std::unique_ptr<Client>> remote(const Address& address, idl::ServicePtr interface,
                                                              ClientOptions options = {});
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  [[nodiscard]] const idl::Service& interface() const;

  /// `method` is of `interface()`. `arguments` is a map of names, or null for none; missing ones take their default.
  [[nodiscard]] Outcome call(const idl::Method& method, Value arguments, Deadline deadline = kNoDeadline);
  /// By name; an unknown one is kArguments with the nearest name.
  [[nodiscard]] Outcome call(std::string_view method, Value arguments, Deadline deadline = kNoDeadline);

  /// Fails the call in progress as kUnreachable, from another thread; later calls connect anew. Late replies still owed
  /// are lost.
  void interrupt();
  /// As `interrupt`, for good. Idempotent.
  void close();

  [[nodiscard]] ClientCounters counters() const;

 private:
  class Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::rpc
