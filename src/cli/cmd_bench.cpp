#include <fmt/format.h>

#include <algorithm>

#include "sentree/base/temporary_folder.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/serve.h"
#include "sentree/rpc/client.h"
#include "sentree/runtime/supervisor.h"

namespace sentree::cli {

namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr int kWarmUp = 1000;

idl::ServicePtr empty_interface() {
  const auto schema = idl::Schema::load("service Empty { void nothing() }", "empty.thrift");
  return schema.value->service("Empty");
}

double microseconds(SteadyClock::duration duration) { return seconds(duration) * 1e6; }

}  // namespace

int bench_rpc(const BenchRpcCommand& command) {
  const idl::ServicePtr interface = empty_interface();
  if (!command.listen.empty()) {
    auto service = std::make_shared<rpc::FunctionService>(
        interface, [](const idl::Method&, const Value&) -> rpc::Outcome { return Value(); });
    return serve_until_signal(command.listen, {{"empty", std::move(service)}}, false);
  }
  const TemporaryFolder folder("bench");
  if (folder.path().empty()) {
    say("no temporary folder can be made; TMPDIR names where");
    return kEnvironment;
  }
  int code = kOk;
  runtime::Supervisor server(runtime::own_program(), [](const runtime::ProcessEvent&) {});
  const auto address = server.start({.name = "server",
                                     .arguments = {"bench", "rpc"},
                                     .listen = "unix:" + (folder.path() / "empty.sock").string(),
                                     .restarts = 0});
  const auto client =
      address ? rpc::Client::remote(*rpc::Address::parse(*address), interface) : tl::unexpected(address.error());
  if (!client) {
    say(to_string(client.error()));
    code = kEnvironment;
  } else {
    std::vector<double> taken;
    const idl::Method& nothing = *interface->find("nothing");
    for (int i = 0; i < kWarmUp + command.calls && code == kOk; ++i) {
      const auto from = SteadyClock::now();
      const auto outcome = (*client)->call(nothing, Value());
      if (i >= kWarmUp) taken.push_back(microseconds(SteadyClock::now() - from));
      if (outcome) continue;
      say(outcome.error().message);
      code = kEnvironment;
    }
    if (code == kOk) {
      std::sort(taken.begin(), taken.end());
      const double median = taken[taken.size() / 2];
      const double p99 = taken[taken.size() * 99 / 100];
      if (command.json) {
        print(to_json(Value(Map{{"median_us", median}, {"p99_us", p99}, {"calls", command.calls}})) + "\n");
      } else {
        print(fmt::format(
            "an empty call between two processes over a Unix socket: {:.1f} µs (median), {:.1f} µs (99 %) of {}\n",
            median, p99, command.calls));
      }
    }
  }
  return code;
}

}  // namespace sentree::cli
