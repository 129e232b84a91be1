#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/rpc/service.h"
#include "sentree/rpc/transport.h"
#include "sentree/yarp/address.h"

namespace sentree::yarp {

/// Outgoing connections of one port, and messages that wait for one that does not keep up; then the oldest go.
inline constexpr std::size_t kOutputsMax = 64;
inline constexpr std::size_t kOutputWaitingMax = 256;

struct PortOptions {
  std::string name;
  HostPort listen{"127.0.0.1", 0};
  bool insecure = false;  ///< Other machines may connect; there is no authentication.
  /// Who knows where other ports are; without a host nobody does, and the port is not made known.
  HostPort name_server;
  Version version = Version::kYarp3;
  rpc::Limits limits;
  std::size_t connections_max = 64;
  /// A message that has begun must end within this time, and a reply be taken.
  std::chrono::milliseconds message_time_max{5000};
  /// Told of each peer that broke a rule. From the connection's thread.
  std::function<void(const std::string&)> on_peer_error;
};

/// What a port is for: calls, data that come, data that go.
struct PortRole {
  /// Answers calls. Null: the port is for data.
  std::shared_ptr<rpc::Service> service;
  /// Data that come: one-way methods of `interface`; of `only` if they begin without a name.
  idl::ServicePtr interface;
  const idl::Method* only = nullptr;
  std::function<void(const idl::Method&, Value)> take;
  /// Where the data come from, for messages: "yarp:/battery:o". Empty: from whom others connect.
  std::string source = {};
  /// In its place: whatever comes, as text.
  std::function<void(const std::string&)> print;
  /// Data go from here to whom others connect it.
  bool sends = false;
};

struct PortCounters {
  std::uint64_t connections = 0;
  std::uint64_t refused = 0;
  std::uint64_t messages = 0;
  std::uint64_t peer_errors = 0;
  std::uint64_t lost = 0;  ///< Messages that no longer waited for a receiver that is too slow.
};

/// A port of YARP: a socket that speaks tcp, fast_tcp, text and text_ack, a thread for each connection, and for each
/// connection that it makes itself. It is not registered by itself, see `Registrar`.
///
/// A client made by yarpidl_thrift waits for ever on a reply that it did not expect. So a call that has no result is
/// answered with `fail` where the method returns a bool, with nothing where it returns nothing, and else by closing the
/// connection before the reply.
class Port {
 public:
  /// Listens when it returns. Errors: rpc.address, rpc.port-taken, rpc.not-loopback.
  [[nodiscard]] static Result<std::unique_ptr<Port>> open(PortOptions options, PortRole role);
  ~Port();
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  [[nodiscard]] const std::string& name() const;
  /// With the number that was taken.
  [[nodiscard]] const HostPort& at() const;

  /// Sends data to whoever is connected, without waiting. `arguments` conform.
  void write(const idl::Method& method, const Value& arguments, bool with_name);
  /// Connects it to another port, as `yarp connect` asks. Error: yarp.connect.
  [[nodiscard]] Result<void> add_output(const std::string& to, Carrier carrier);
  [[nodiscard]] std::vector<std::string> outputs() const;
  [[nodiscard]] std::vector<std::string> inputs() const;

  [[nodiscard]] PortCounters counters() const;
  /// Closes all connections and waits for what is in progress. Idempotent.
  void stop();

 private:
  class Impl;
  explicit Port(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Asks another port, as `yarp connect` does: a line in the text dialogue, and the lines before its acknowledgement.
/// Errors: yarp.connect.
[[nodiscard]] Result<std::string> ask_port(const HostPort& at, const std::string& admin_command,
                                           std::chrono::milliseconds patience);

}  // namespace sentree::yarp
