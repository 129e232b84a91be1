// Calls without generated code against calls with it, in the same run: an empty call (`ping`) and one that carries a
// struct. Over Unix sockets both ends are generated (GeneratedUnix), or both dynamic (DynamicUnix).

#include <benchmark/benchmark.h>
#include <thrift/protocol/TBinaryProtocol.h>
#include <thrift/server/TThreadedServer.h>
#include <thrift/transport/TBufferTransports.h>
#include <thrift/transport/TServerSocket.h>
#include <thrift/transport/TSocket.h>
#include <unistd.h>

#include <fstream>
#include <future>
#include <iterator>
#include <thread>

#include "Robot.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/server.h"

namespace sentree::rpc {
namespace {

namespace transport = apache::thrift::transport;

std::string read(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

const idl::ServicePtr& interface() {
  static const idl::ServicePtr kInterface =
      idl::Schema::load(read(SENTREE_BENCH_IDL), "bench.thrift").value->service("Robot");
  return kInterface;
}

std::string socket_path(const char* name) { return "/tmp/sentree-bench-" + std::to_string(::getpid()) + "-" + name; }

std::shared_ptr<Service> robot() {
  return std::make_shared<FunctionService>(interface(),
                                           [](const idl::Method& method, const Value& arguments) -> Outcome {
                                             if (method.result->kind == idl::Kind::kVoid) return Value();
                                             return *arguments.find("state");
                                           });
}

class Generated : public bench::RobotIf {
 public:
  void ping() override {}
  void echo(bench::State& out, const bench::State& state) override { out = state; }
};

Value state() {
  return Map{{"stamp", 12.5},      {"frame", "map"}, {"x", 1.0},           {"y", 2.0},
             {"status", "MOVING"}, {"goal", 77},     {"target", "kitchen"}};
}

void run_dynamic(benchmark::State& bench, Client& client, bool struct_call) {
  const idl::Method& method = *interface()->find(struct_call ? "echo" : "ping");
  const Value arguments = struct_call ? Value(Map{{"state", state()}}) : Value(Map());
  for (auto _ : bench) {
    Outcome out = client.call(method, arguments, std::chrono::steady_clock::now() + std::chrono::seconds(1));
    if (!out) bench.SkipWithError(out.error().message.c_str());
    benchmark::DoNotOptimize(out);
  }
}

void BM_DynamicUnix(benchmark::State& bench) {
  const Address address = *Address::parse("unix:" + socket_path("dynamic"));
  const auto server = Server::start(address, {{"robot", robot()}});
  const auto client = Client::remote(address, interface(), {.target = "robot"});
  run_dynamic(bench, **client, bench.range(0) != 0);
}

struct Ready : apache::thrift::server::TServerEventHandler {
  void preServe() override { ready.set_value(); }
  std::promise<void> ready;
};

void BM_GeneratedUnix(benchmark::State& bench) {
  const std::string path = socket_path("generated");
  apache::thrift::server::TThreadedServer server(std::make_shared<bench::RobotProcessor>(std::make_shared<Generated>()),
                                                 std::make_shared<transport::TServerSocket>(path),
                                                 std::make_shared<transport::TBufferedTransportFactory>(),
                                                 std::make_shared<apache::thrift::protocol::TBinaryProtocolFactory>());
  const auto ready = std::make_shared<Ready>();
  server.setServerEventHandler(ready);
  std::thread serving([&] { server.serve(); });
  ready->ready.get_future().wait();
  const auto wire = std::make_shared<transport::TBufferedTransport>(std::make_shared<transport::TSocket>(path));
  wire->open();
  bench::RobotClient client(std::make_shared<apache::thrift::protocol::TBinaryProtocol>(wire));
  bench::State sent;
  sent.frame = "map";
  sent.target = "kitchen";
  bench::State got;
  for (auto _ : bench) {
    if (bench.range(0) != 0)
      client.echo(got, sent);
    else
      client.ping();
  }
  wire->close();
  server.stop();
  serving.join();
  ::unlink(path.c_str());
}

BENCHMARK(BM_GeneratedUnix)->ArgName("struct")->Arg(0)->Arg(1)->UseRealTime();
BENCHMARK(BM_DynamicUnix)->ArgName("struct")->Arg(0)->Arg(1)->UseRealTime();

}  // namespace
}  // namespace sentree::rpc

BENCHMARK_MAIN();
