#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/rpc/call.h"
#include "sentree/rpc/stream.h"
#include "sentree/yarp/address.h"

namespace sentree::yarp {

/// Where the name server is: SENTREE_YARP_SERVER (HOST:PORT) in the environment, else the first line of yarp.conf,
/// which `yarp conf` writes (in $YARP_CONFIG_HOME, $XDG_CONFIG_HOME/yarp or ~/.config/yarp), else 127.0.0.1:10000.
[[nodiscard]] HostPort configured_name_server();
/// Whether the first of these that says something can be meant. Error: yarp.environment, with the way out.
[[nodiscard]] Result<void> check_name_server();

struct Registration {
  std::string name;
  HostPort at;
  std::string carrier;
};

/// Ports that one name server may tell of.
inline constexpr std::size_t kRegistrationsMax = 100'000;

/// Asks a name server, a connection each time. From one thread.
class NameClient {
 public:
  explicit NameClient(HostPort server) : server_(std::move(server)) {}

  [[nodiscard]] const HostPort& server() const { return server_; }

  /// Errors: yarp.no-name-server, with the ways out; yarp.late.
  [[nodiscard]] Result<std::optional<Registration>> query(const std::string& name, rpc::Deadline deadline);
  [[nodiscard]] Result<std::vector<Registration>> list(rpc::Deadline deadline);
  /// Makes the port known there, under that name.
  [[nodiscard]] Result<Registration> enter(const std::string& name, const HostPort& at, rpc::Deadline deadline);
  [[nodiscard]] Result<void> remove(const std::string& name, rpc::Deadline deadline);

 private:
  /// The lines before the end line.
  [[nodiscard]] Result<std::vector<std::string>> ask(const std::vector<std::string>& words, rpc::Deadline deadline);
  [[nodiscard]] tl::unexpected<Diagnostic> no_server(const std::string& why) const;

  HostPort server_;
  rpc::Resolver resolver_;
};

/// "registration name /x ip 127.0.0.1 port 10003 type tcp"; nothing: it is none.
[[nodiscard]] std::optional<Registration> parse_registration(std::string_view line);
[[nodiscard]] std::string to_line(const Registration& registration);

}  // namespace sentree::yarp
