#include "sentree/runtime/services.h"

#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::runtime {

namespace {

// A call pays for that much time at most, a fifth of what usually passes between ticks.
constexpr std::chrono::milliseconds kKeepUpPeriod{20};

}  // namespace

SimHost::SimHost(std::shared_ptr<const sim::World> world, std::uint64_t seed, const Clock& clock)
    : world_(std::move(world)), clock_(clock), state_(sim::initial_state(*world_, seed)) {}

SimHost::~SimHost() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  end_.notify_all();
  if (keeper_.joinable()) keeper_.join();
}

void SimHost::keep_up() {
  keeper_ = std::thread([this] {
    std::unique_lock lock(mutex_);
    while (!end_.wait_for(lock, kKeepUpPeriod, [this] { return ending_; })) sim::advance(*world_, state_, clock_.now());
  });
}

mission::CallOutcome SimHost::call(const std::string& interface, const std::string& method, const Value& args,
                                   const std::string& robot) {
  const Map none;
  const Map* map = args.as_map();
  const std::lock_guard lock(mutex_);
  auto result =
      sim::call(*world_, state_, {.service = interface, .method = method, .args = map ? *map : none, .robot = robot},
                clock_.now());
  if (!result) return {.ok = false, .result = {}, .kind = "exception", .message = result.error().message};
  return {.ok = true, .result = std::move(*result), .kind = {}, .message = {}};
}

sim::State SimHost::snapshot() {
  const std::lock_guard lock(mutex_);
  sim::advance(*world_, state_, clock_.now());
  return state_;
}

void SimHost::inspect(const std::function<void(const sim::State&)>& look) {
  const std::lock_guard lock(mutex_);
  sim::advance(*world_, state_, clock_.now());
  look(state_);
}

void SimHost::restore(sim::State state) {
  const std::lock_guard lock(mutex_);
  state_ = std::move(state);
}

namespace {

class SimPort final : public ServicePort {
 public:
  SimPort(SimHost& host, std::string interface, std::string robot)
      : host_(host), interface_(std::move(interface)), robot_(std::move(robot)) {}
  void call(const idl::Method& method, Value args, Done done) override {
    done(host_.call(interface_, method.name, args, robot_));
  }

 private:
  SimHost& host_;
  std::string interface_;
  std::string robot_;
};

class TopicPort final : public ServicePort {
 public:
  void call(const idl::Method&, Value, Done done) override {
    done({.ok = true, .result = {}, .kind = {}, .message = {}});
  }
};

}  // namespace

std::unique_ptr<ServicePort> make_topic_port() { return std::make_unique<TopicPort>(); }

std::unique_ptr<ServicePort> make_sim_port(SimHost& host, std::string interface, std::string robot) {
  return std::make_unique<SimPort>(host, std::move(interface), std::move(robot));
}

}  // namespace sentree::runtime
