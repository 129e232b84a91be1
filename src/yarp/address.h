#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "sentree/base/result.h"

namespace sentree::yarp {

/// Bytes of a port's name.
inline constexpr std::size_t kNameMax = 1000;

/// The encodings of real numbers: those of YARP 3, and those of YARP 4.
enum class Version : std::uint8_t { kYarp3, kYarp4 };

/// tcp confirms every message, fast_tcp none.
enum class Carrier : std::uint8_t { kTcp, kFastTcp };

[[nodiscard]] std::string_view to_string(Carrier carrier);

/// A host and a port of TCP.
struct HostPort {
  std::string host;
  std::uint16_t port = 0;

  friend bool operator==(const HostPort&, const HostPort&) = default;
};
/// "HOST:PORT".
[[nodiscard]] Result<HostPort> parse_host_port(std::string_view text);
[[nodiscard]] std::string to_string(const HostPort& at);

/// Where a port is.
///
///   yarp:/battery/rpc:i                     its name, as the name server knows it
///   yarp:/robot/                            what names begin with: service battery is /robot/battery/rpc:i there
///   yarp://10.0.0.5:10012/battery/rpc:i     its host and port too: nobody is asked
///
/// Behind that `?` and, joined by `&`: `carrier=tcp|fast_tcp`, `yarp=3|4`, `server=HOST:PORT` (the name server), `open`
/// (a port for data that is ours: others connect it), `read` (data are read from it, whatever its name), `listen=HOST`
/// (what it listens on, beyond loopback only with
/// --insecure), `named` (data begin with the method's name, though the interface has one method only).
struct PortAddress {
  std::string name;  ///< With its slash. One at its end: what names begin with.
  HostPort direct;   ///< Empty: the name server knows.
  HostPort server;   ///< Of the name server; empty: the one that is configured.
  Carrier carrier = Carrier::kTcp;
  Version version = Version::kYarp3;
  std::string listen = "127.0.0.1";
  bool open = false;
  bool read = false;
  bool named = false;

  /// @param text  What stands behind "yarp:". Error: rpc.address.
  [[nodiscard]] static Result<PortAddress> parse(std::string_view text);
  /// The port of that service.
  [[nodiscard]] std::string name_of(const std::string& service) const {
    return name.ends_with('/') ? name + service + "/rpc:i" : name;
  }
  /// A port that data are read from, not written to.
  [[nodiscard]] bool is_source() const;
  /// Its name does not say whether it is written to or read from.
  [[nodiscard]] bool says_no_direction() const {
    return !open && !name.ends_with('/') && !name.ends_with(":i") && !name.ends_with(":o");
  }
};
/// The text that `parse` reads back, with its scheme.
[[nodiscard]] std::string to_string(const PortAddress& address);

}  // namespace sentree::yarp
