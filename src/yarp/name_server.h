#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sentree/yarp/names.h"

namespace sentree::yarp {

/// Names that a name server on board keeps, and values that it keeps of each.
inline constexpr std::size_t kNamesMax = 10'000;
inline constexpr std::size_t kPropertiesMax = 64;
/// The first number that it gives to a port which leaves the choice to it.
inline constexpr std::uint16_t kFirstPort = 10002;

/// What a name server knows and says: no sockets, no threads, no time.
class NameTable {
 public:
  explicit NameTable(HostPort own);

  /// The answer to one line, with its ends of lines. Anything unknown is answered with nothing but the end.
  [[nodiscard]] std::string answer(const std::string& line);
  [[nodiscard]] std::vector<Registration> all() const;

 private:
  struct Entry {
    Registration registration;
    std::vector<std::pair<std::string, std::vector<std::string>>> properties;
  };
  [[nodiscard]] Entry* find(const std::string& name);
  [[nodiscard]] std::string enter(const std::vector<std::string>& words);
  [[nodiscard]] std::string property(const std::vector<std::string>& words);
  [[nodiscard]] std::string bottle(const std::vector<std::string>& words);

  const HostPort own_;
  std::vector<Entry> entries_;
  std::uint16_t next_port_ = kFirstPort;
  std::uint64_t next_unnamed_ = 1;
};

struct NameServerOptions {
  HostPort listen{"127.0.0.1", 10000};
  bool insecure = false;  ///< Other machines may connect; there is no authentication.
  std::function<void(const std::string&)> on_peer_error;
};

/// A name server on a socket, for networks that have none.
class NameServer {
 public:
  /// Listens when it returns. Errors: rpc.address, rpc.port-taken, rpc.not-loopback.
  [[nodiscard]] static Result<std::unique_ptr<NameServer>> start(NameServerOptions options);
  ~NameServer();
  NameServer(const NameServer&) = delete;
  NameServer& operator=(const NameServer&) = delete;

  [[nodiscard]] const HostPort& at() const;
  [[nodiscard]] std::vector<Registration> all() const;
  void stop();

 private:
  class Impl;
  explicit NameServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Whether a name server of YARP answers there within that time.
[[nodiscard]] bool answers(const HostPort& server, std::chrono::milliseconds patience);

}  // namespace sentree::yarp
