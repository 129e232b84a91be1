#include <fmt/format.h>

#include <algorithm>
#include <future>

#include "sentree/base/temporary_folder.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/serve.h"
#include "sentree/cli/yarp_network.h"
#include "sentree/processes/supervisor.h"
#include "sentree/rpc/middleware.h"

namespace sentree::cli {

namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr int kWarmUp = 1000;

idl::ServicePtr empty_interface() {
  const auto schema = idl::Schema::load("service Empty { void nothing() }", "empty.thrift");
  return schema.value->service("Empty");
}

double microseconds(SteadyClock::duration duration) { return seconds(duration) * 1e6; }

// Each call is made where the one before has ended, as charts make them.
class Measured {
 public:
  Measured(rpc::Caller& caller, const idl::Method& method, int calls)
      : caller_(caller), method_(method), calls_(calls) {
    taken_.reserve(static_cast<std::size_t>(calls));
  }
  std::vector<double> run() {
    next();
    over_.get_future().wait();
    return std::move(taken_);
  }
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  void next() {
    caller_.call(method_, Value(), rpc::kNoDeadline, [this, from = SteadyClock::now()](const rpc::Outcome& outcome) {
      taken_.push_back(microseconds(SteadyClock::now() - from));
      if (!outcome) error_ = outcome.error().message;
      if (!outcome || std::ssize(taken_) == calls_)
        over_.set_value();
      else
        next();
    });
  }

  rpc::Caller& caller_;
  const idl::Method& method_;
  const int calls_;
  std::vector<double> taken_;
  std::string error_;
  std::promise<void> over_;
};

std::uint16_t free_port() {
  const auto server = rpc::Server::start(*rpc::Address::parse("tcp://127.0.0.1:0"), {});
  return server ? (*server)->address().port : 0;
}

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
  std::string listen = "unix:" + (folder.path() / "empty.sock").string();
  std::unique_ptr<yarp::NameServer> names;
  if (command.over == "yarp") {
    auto started = start_name_server(fmt::format("127.0.0.1:{}", free_port()), false);
    if (!started) {
      say(to_string(started.error()));
      return kEnvironment;
    }
    names = std::move(*started);
    listen = "yarp:/sentree/bench/rpc:i";
  }
  processes::Supervisor server(processes::own_program(), [](const runtime::ProcessEvent&) {});
  const auto address = server.start({.name = "server", .arguments = {"bench", "rpc"}, .listen = listen, .restarts = 0});
  const auto client =
      address ? rpc::connect(*rpc::Address::parse(*address), interface) : tl::unexpected(address.error());
  if (!client) {
    say(to_string(client.error()));
    code = kEnvironment;
  } else {
    Measured measured(**client, *interface->find("nothing"), kWarmUp + command.calls);
    std::vector<double> taken = measured.run();
    if (!measured.error().empty()) {
      say(measured.error());
      code = kEnvironment;
    }
    taken.erase(taken.begin(), taken.begin() + std::min<std::ptrdiff_t>(kWarmUp, std::ssize(taken)));
    if (code == kOk) {
      std::sort(taken.begin(), taken.end());
      const double median = taken[taken.size() / 2];
      const double p99 = taken[taken.size() * 99 / 100];
      if (command.json) {
        print(to_json(Value(Map{{"median_us", median}, {"p99_us", p99}, {"calls", command.calls}})) + "\n");
      } else {
        print(fmt::format("an empty call between two processes over {}: {:.1f} µs (median), {:.1f} µs (99 %) of {}\n",
                          command.over == "yarp" ? "YARP" : "a Unix socket", median, p99, command.calls));
      }
    }
  }
  return code;
}

}  // namespace sentree::cli
