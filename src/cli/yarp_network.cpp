#include "sentree/cli/yarp_network.h"

#include <fmt/format.h>

#include <cstdlib>

#include "sentree/cli/output.h"

namespace sentree::cli {

namespace {

constexpr std::chrono::milliseconds kServerPatience{300};

Result<yarp::HostPort> name_server_at(const std::string& where) {
  if (where.empty() || where == "true") {
    if (auto can_be_meant = yarp::check_name_server(); !can_be_meant)
      return tl::unexpected(std::move(can_be_meant.error()));
    return yarp::configured_name_server();
  }
  return yarp::parse_host_port(where);
}

void use_name_server(const std::string& at) {
  // Its threads do not look at the environment, and what is started later has it too.
  // NOLINTNEXTLINE(concurrency-mt-unsafe)
  ::setenv("SENTREE_YARP_SERVER", at.c_str(), 1);
}

}  // namespace

Result<std::unique_ptr<yarp::NameServer>> start_name_server(const std::string& where, bool insecure) {
  auto listen = name_server_at(where);
  if (!listen) return tl::unexpected(listen.error());
  yarp::NameServerOptions options;
  options.listen = std::move(*listen);
  options.insecure = insecure;
  options.on_peer_error = [](const std::string& what) { say("! " + what); };
  auto server = yarp::NameServer::start(std::move(options));
  if (!server) return tl::unexpected(server.error());
  const std::string at = to_string((*server)->at());
  use_name_server(at);
  say(fmt::format("name server of YARP at {}; whoever reaches it can do everything, there is no authentication", at));
  return server;
}

Result<std::unique_ptr<yarp::NameServer>> ensure_name_server(const std::string& where, bool insecure) {
  const auto at = name_server_at(where);
  if (!at) return tl::unexpected(at.error());
  if (!yarp::answers(*at, kServerPatience)) return start_name_server(where, insecure);
  use_name_server(to_string(*at));
  return std::unique_ptr<yarp::NameServer>();
}

}  // namespace sentree::cli
