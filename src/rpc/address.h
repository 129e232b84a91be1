#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::rpc {

/// Where a service is served.
///
///   unix:/run/robot/battery.sock          a Unix socket; the path is absolute or relative to the working directory
///   tcp://10.0.0.5:9090                   port 0: a server takes a free one; IPv6 in brackets
///   tls://navigation:9090                 with certificates on both sides
///   local:battery                         in this process
///   yarp:/battery/rpc:i                   as the middleware of that scheme has it (`rpc/middleware.h`)
///
/// `/name` after the port, or `#name` after a socket's path, picks one of several services of one server (Thrift's
/// multiplexed protocol). `?protocol=compact` and `?transport=framed`, joined by `&`, at the end are for clients of
/// servers that demand them; a server understands all four without being told.
struct Address {
  enum class Kind : std::uint8_t { kLocal, kUnix, kTcp, kTls, kOther };
  enum class Protocol : std::uint8_t { kBinary, kCompact };

  Kind kind = Kind::kLocal;
  std::string host;  ///< kTcp, kTls; without brackets.
  std::uint16_t port = 0;
  std::string path;         ///< kUnix: the socket; kLocal: the name; kOther: all behind the scheme's colon.
  std::string service;      ///< Multiplexed name; empty: the server's only service.
  std::string scheme = {};  ///< kOther: of the middleware.
  Protocol protocol = Protocol::kBinary;
  bool framed = false;

  /// Errors: rpc.address, naming what is wrong and the forms there are; for other schemes as their middleware says.
  [[nodiscard]] static Result<Address> parse(std::string_view text);

  friend bool operator==(const Address&, const Address&) = default;
};

/// The text that `parse` reads back.
[[nodiscard]] std::string to_string(const Address& address);

/// One of those behind an address's question mark.
struct AddressOption {
  std::string_view text;   ///< As it stands there: "protocol=compact".
  std::string_view value;  ///< Behind its first equals sign; empty without one.
};
/// Takes the question mark and what is behind it off an address, of any middleware.
[[nodiscard]] std::vector<AddressOption> cut_options(std::string_view& address);
/// "gives domain twice: domain=1 and domain=2" of the first such name; empty: none is.
[[nodiscard]] std::string given_twice(const std::vector<AddressOption>& options);

}  // namespace sentree::rpc
