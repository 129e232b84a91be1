#include "sentree/cli/serve.h"

#include <fmt/format.h>

#include <pthread.h>
#include <signal.h>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/processes/environment.h"
#include "sentree/processes/executive.h"
#include "sentree/processes/supervisor.h"
#include "sentree/rpc/middleware.h"

namespace sentree::cli {

int serve_until_signal(const std::string& listen, std::vector<rpc::NamedService> services, bool insecure,
                       const std::string& of_run) {
  const auto address = rpc::Address::parse(listen);
  if (!address) {
    say("--listen: " + address.error().message);
    return kUsage;
  }
  // Blocked before the server's threads begin, so that they inherit it.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  if (!of_run.empty()) processes::outlive_parent();
  rpc::ServerOptions options;
  options.insecure = insecure;
  options.tls = processes::environment_tls();
  options.on_peer_error = [](const std::string& message) { say(message); };
  auto server = rpc::serve(*address, std::move(services), std::move(options));
  if (!server) {
    say("--listen: " + to_string(server.error()));
    return kEnvironment;
  }
  print(fmt::format("listening on {}\n", (*server)->address()));
  processes::ExecutiveWatch executive(of_run);
  const timespec look{1, 0};
  while (sigtimedwait(&signals, nullptr, &look) < 0) {
    if (!executive.is_missed()) continue;
    say(fmt::format("nobody resumed the run of {} in time; this process ends", of_run));
    break;
  }
  // The server would wait for a thread that hangs in a script.
  const int code = leave(kOk);
  (*server)->stop();
  return code;
}

}  // namespace sentree::cli
