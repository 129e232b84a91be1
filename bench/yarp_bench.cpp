// An empty call to a port of YARP in another process, on tcp and fast_tcp, as charts make calls: each where the one
// before has ended; as many octets over TCP alone; and the call observed by the monitors of the recharge mission. To be
// run on one processor: taskset -c 0 yarp_bench

#include <benchmark/benchmark.h>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <future>
#include <iostream>
#include <thread>
#include <vector>

#include "sentree/project/plan.h"
#include "sentree/rpc/middleware.h"
#include "sentree/runtime/monitors.h"
#include "sentree/runtime/stream.h"
#include "sentree/runtime/watchdog.h"
#include "sentree/yarp/detail/port.h"
#include "sentree/yarp/middleware.h"

namespace {

using namespace sentree;
using std::chrono::steady_clock;

constexpr int kWarmUp = 1000;
constexpr int kCalls = 20'000;

idl::ServicePtr skill() {
  const auto schema = idl::Schema::load(
      "enum SkillAck { SKILL_IDLE, SKILL_RUNNING, SKILL_SUCCESS, SKILL_FAILURE }\n"
      "service Skill { SkillAck request_ack() }",
      "skill.thrift");
  return schema.value->service("Skill");
}

// A process with a port.
class Server {
 public:
  Server() {
    int ends[2] = {-1, -1};
    if (::pipe(ends) != 0) std::abort();
    child_ = ::fork();
    if (child_ == 0) serve(ends[1]);
    ::close(ends[1]);
    if (::read(ends[0], &port_, sizeof port_) != sizeof port_) std::abort();
    ::close(ends[0]);
  }
  ~Server() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] std::unique_ptr<rpc::Caller> caller(const char* carrier) const {
    const auto address = rpc::Address::parse("yarp://127.0.0.1:" + std::to_string(port_) + "/skill?carrier=" + carrier);
    return std::move(*rpc::connect(*address, skill()));
  }

 private:
  [[noreturn]] static void serve(int out) {
    auto service = std::make_shared<rpc::FunctionService>(
        skill(), [](const idl::Method&, const Value&) -> rpc::Outcome { return Value("SKILL_RUNNING"); });
    const auto port = yarp::Port::open({.name = "/skill"}, {.service = std::move(service)});
    const std::uint16_t number = (*port)->at().port;
    if (::write(out, &number, sizeof number) != sizeof number) std::abort();
    for (;;) ::pause();
  }

  pid_t child_ = -1;
  std::uint16_t port_ = 0;
};

// Makes the calls and tells the time of each [us].
std::vector<double> chain(rpc::Caller& caller, const std::function<void()>& before,
                          const std::function<void(const Value&)>& after) {
  const idl::Method& method = *caller.interface().find("request_ack");
  std::vector<double> times;
  times.reserve(kWarmUp + kCalls);
  std::promise<void> over;
  std::function<void()> next = [&] {
    const auto from = steady_clock::now();
    before();
    caller.call(method, Value(), rpc::kNoDeadline, [&, from](const rpc::Outcome& outcome) {
      if (!outcome) std::abort();
      after(*outcome);
      times.push_back(std::chrono::duration<double, std::micro>(steady_clock::now() - from).count());
      times.size() == kWarmUp + kCalls ? over.set_value() : next();
    });
  };
  next();
  over.get_future().wait();
  times.erase(times.begin(), times.begin() + kWarmUp);
  std::sort(times.begin(), times.end());
  return times;
}

void tell(benchmark::State& state, const std::vector<double>& times) {
  state.counters["median_us"] = times[times.size() / 2];
  state.counters["p99_us"] = times[times.size() * 99 / 100];
}

void round_trip(benchmark::State& state, const char* carrier) {
  const Server server;
  const auto caller = server.caller(carrier);
  for (auto _ : state)
    tell(state, chain(
                    *caller, [] {}, [](const Value&) {}));
  caller->end();
}
BENCHMARK_CAPTURE(round_trip, tcp, "tcp")->Unit(benchmark::kMillisecond)->Iterations(5);
BENCHMARK_CAPTURE(round_trip, fast_tcp, "fast_tcp")->Unit(benchmark::kMillisecond)->Iterations(5);

// What the kernel takes alone: as many octets there and back between two processes, with nothing read in them.
void bare_tcp(benchmark::State& state) {
  constexpr int kOctets = 40;
  const auto all = [](int socket, auto pass) {
    char octets[kOctets] = {};
    for (ssize_t done = 0; done < kOctets;) {
      const ssize_t some = pass(socket, octets + done, static_cast<std::size_t>(kOctets - done));
      if (some <= 0) return false;
      done += some;
    }
    return true;
  };
  const auto send_all = [&](int to) {
    return all(to, [](int s, char* at, std::size_t size) { return ::send(s, at, size, MSG_NOSIGNAL); });
  };
  const auto take_all = [&](int from) {
    return all(from, [](int s, char* at, std::size_t size) { return ::recv(s, at, size, 0); });
  };
  const int door = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(door, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(door, 1) != 0 ||
      ::getsockname(door, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    std::abort();
  const int on = 1;
  const pid_t child = ::fork();
  if (child == 0) {
    const int peer = ::accept(door, nullptr, nullptr);
    ::setsockopt(peer, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    while (take_all(peer) && send_all(peer)) {
    }
    ::_exit(0);
  }
  ::close(door);
  const int wire = ::socket(AF_INET, SOCK_STREAM, 0);
  if (::connect(wire, reinterpret_cast<sockaddr*>(&address), size) != 0) std::abort();
  ::setsockopt(wire, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  for (auto _ : state) {
    std::vector<double> times;
    for (int i = 0; i < kWarmUp + kCalls; ++i) {
      const auto from = steady_clock::now();
      if (!send_all(wire) || !take_all(wire)) std::abort();
      if (i >= kWarmUp) times.push_back(std::chrono::duration<double, std::micro>(steady_clock::now() - from).count());
    }
    std::sort(times.begin(), times.end());
    tell(state, times);
  }
  ::close(wire);
  ::waitpid(child, nullptr, 0);
}
BENCHMARK(bare_tcp)->Unit(benchmark::kMillisecond)->Iterations(5);

project::Plan recharge() {
  auto scenario =
      project::load_scenario(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge/scenarios/recharge.yaml");
  if (scenario.ok()) {
    auto plan = prepare(std::move(*scenario.value));
    if (plan.ok()) return std::move(*plan.value);
  }
  std::cerr << "examples/recharge cannot be loaded\n";
  std::exit(1);
}

void observed(benchmark::State& state) {
  const Server server;
  const project::Plan plan = recharge();
  const auto scheduler = runtime::make_real_scheduler();
  runtime::Stream stream{*scheduler};
  runtime::Watchdog watchdog{std::chrono::seconds(10)};
  runtime::Monitors monitors(plan, *scheduler, stream, watchdog,
                             {.decided = [](const runtime::MonitorReport&) {}, .given_up = [](const std::string&) {}});
  stream.subscribe([&](const Message& message) { monitors.observe(message); });
  monitors.start();
  std::thread running([&] { (void)scheduler->run(); });
  std::uint64_t call = 0;
  const auto publish = [&](MessageKind kind, const char* what, Map data) {
    Message message;
    message.kind = kind;
    message.source = "mission";
    message.target = "battery";
    message.name = std::string("battery.getBatteryState.") + what;
    message.call = call;
    message.data = std::move(data);
    stream.publish(std::move(message));
  };
  const auto caller = server.caller("tcp");
  for (auto _ : state) {
    tell(state, chain(
                    *caller,
                    [&] {
                      ++call;
                      publish(MessageKind::kRequest, "request", Map{{"args", Map()}});
                    },
                    [&](const Value&) {
                      publish(MessageKind::kReply, "reply",
                              Map{{"args", Map()},
                                  {"result", Map{{"percentage", 0.8}, {"power_supply_status", "DISCHARGING"}}}});
                    }));
  }
  caller->end();
  scheduler->stop();
  running.join();
  monitors.finish(scheduler->now());
}
BENCHMARK(observed)->Unit(benchmark::kMillisecond)->Iterations(5);

}  // namespace

int main(int argc, char** argv) {
  rpc::register_middleware(yarp::make_middleware());
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
