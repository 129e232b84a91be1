#include "sentree/yarp/detail/listen.h"

#include <fmt/format.h>

#include <utility>

#include "sentree/rpc/address.h"

namespace sentree::yarp {

Result<rpc::Listener> listen(HostPort& at, bool insecure) {
  rpc::Address address;
  address.kind = rpc::Address::Kind::kTcp;
  address.host = at.host;
  address.port = at.port;
  auto listener = rpc::Listener::open(address, insecure);
  if (!listener && listener.error().code == "rpc.not-loopback") {
    return fail("rpc.not-loopback",
                fmt::format("{} can be reached from other machines, and YARP has no authentication: whoever reaches it "
                            "can do everything; listen on 127.0.0.1, or allow it with --insecure",
                            at.port == 0 ? at.host : to_string(at)));
  }
  at = {address.host, address.port};
  return listener;
}

}  // namespace sentree::yarp
