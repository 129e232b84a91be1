#include "sentree/cli/yarp_network.h"

#include <fmt/format.h>

#include <cstdlib>

#include "sentree/cli/output.h"

namespace sentree::cli {

namespace {

constexpr std::chrono::milliseconds kServerPatience{300};

}  // namespace

Result<std::unique_ptr<yarp::NameServer>> start_name_server(const std::string& where, bool insecure) {
  yarp::NameServerOptions options;
  options.listen = yarp::configured_name_server();
  if (!where.empty() && where != "true") {
    auto given = yarp::parse_host_port(where);
    if (!given) return tl::unexpected(given.error());
    options.listen = std::move(*given);
  }
  options.insecure = insecure;
  options.on_peer_error = [](const std::string& what) { say("! " + what); };
  auto server = yarp::NameServer::start(std::move(options));
  if (!server) return tl::unexpected(server.error());
  const std::string at = to_string((*server)->at());
  // Its threads do not look at the environment, and what is started later has it too.
  // NOLINTNEXTLINE(concurrency-mt-unsafe)
  ::setenv("SENTREE_YARP_SERVER", at.c_str(), 1);
  say(fmt::format("name server of YARP at {}; whoever reaches it can do everything, there is no authentication", at));
  return server;
}

Result<std::unique_ptr<yarp::NameServer>> ensure_name_server(bool insecure) {
  if (yarp::answers(yarp::configured_name_server(), kServerPatience)) return std::unique_ptr<yarp::NameServer>();
  return start_name_server("", insecure);
}

}  // namespace sentree::cli
