#include "sentree/runtime/services.h"

#include <algorithm>
#include <utility>

#include "sentree/base/present.h"
#include "sentree/sim/scan_memo.h"
#include "sentree/sim/services.h"
#include "sentree/sim/simulation.h"

namespace sentree::runtime {

namespace {

// A call pays for that much time at most, a fifth of what usually passes between ticks.
constexpr std::chrono::milliseconds kKeepUpPeriod{20};
// Run time after which it is looked how long advancing takes.
constexpr std::chrono::milliseconds kSlice{100};

// Of the world that this thread advanced last.
sim::ScanMemo& scans_of(const std::shared_ptr<const sim::World>& world) {
  // Another world may come to lie where one was, but not be owned by what owned that.
  thread_local std::weak_ptr<const sim::World> of;
  thread_local sim::ScanMemo scans;
  if (of.owner_before(world) || world.owner_before(of)) {
    of = world;
    scans = {};
  }
  return scans;
}

}  // namespace

SimHost::SimHost(std::shared_ptr<const sim::World> world, std::uint64_t seed, const Clock& clock)
    : world_(std::move(world)), clock_(clock), state_(sim::initial_state(*world_, seed)) {}

SimHost::~SimHost() { stop_keeping_up(); }

void SimHost::stop_keeping_up() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  end_.notify_all();
  if (keeper_.joinable()) keeper_.join();
}

void SimHost::keep_up(Patience patience, std::function<void(Duration)> told) {
  keeps_up_ = true;
  patience_ = patience;
  advanced_to_ = clock_.now();
  keeper_ = std::thread([this, told = std::move(told)] {
    Duration next = std::chrono::seconds(1);
    std::unique_lock lock(mutex_);
    while (!end_.wait_for(lock, kKeepUpPeriod, [this] { return ending_; })) {
      advance();
      if (behind_ < next) continue;
      const Duration behind = behind_;
      next = 2 * behind;
      lock.unlock();
      told(behind);
      lock.lock();
    }
  });
}

void SimHost::advance() {
  const Present<sim::ScanMemo> remembers(scans_of(world_));
  const TimePoint now = clock_.now();
  if (!keeps_up_) return sim::advance_uncast(*world_, state_, now);
  const auto until = std::chrono::steady_clock::now() + patience_.work;
  while (advanced_to_ < now) {
    advanced_to_ = std::min(add_saturating(advanced_to_, kSlice), now);
    sim::advance_uncast(*world_, state_, advanced_to_);
    if (std::chrono::steady_clock::now() >= until) break;
  }
  if (now - advanced_to_ <= patience_.lag) return;
  behind_ += now - advanced_to_;
  sim::follow(state_, now);
  advanced_to_ = now;
}

void SimHost::advance_whole() {
  advance();
  const Present<sim::ScanMemo> remembers(scans_of(world_));
  sim::cast_scans(*world_, state_);
}

mission::CallOutcome SimHost::call(const std::string& interface, const std::string& method, const Value& args,
                                   const std::string& robot) {
  const Map none;
  const Map* map = args.as_map();
  const std::lock_guard lock(mutex_);
  advance();
  auto result = sim::call_uncast(*world_, state_,
                                 {.service = interface, .method = method, .args = map ? *map : none, .robot = robot},
                                 keeps_up_ ? advanced_to_ : clock_.now());
  if (!result) return mission::CallOutcome::failed(idl::CallErrorKind::kException, result.error().message);
  return mission::CallOutcome::returned(std::move(*result));
}

sim::State SimHost::snapshot() {
  const std::lock_guard lock(mutex_);
  advance_whole();
  return state_;
}

void SimHost::inspect(const std::function<void(const sim::State&)>& look) {
  const std::lock_guard lock(mutex_);
  advance_whole();
  look(state_);
}

void SimHost::glance(const std::function<void(const sim::State&)>& look) {
  const std::lock_guard lock(mutex_);
  advance();
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
  void call(const idl::Method&, Value, Done done) override { done(mission::CallOutcome::returned()); }
};

}  // namespace

std::string falls_behind(Duration behind) {
  std::string text = "this machine is too slow for the simulator's pace: ";
  text += std::to_string(std::chrono::duration_cast<std::chrono::seconds>(behind).count());
  text += " s of simulated time were left out so far; a smaller --factor helps";
  return text;
}

std::unique_ptr<ServicePort> make_topic_port() { return std::make_unique<TopicPort>(); }

std::unique_ptr<ServicePort> make_sim_port(SimHost& host, std::string interface, std::string robot) {
  return std::make_unique<SimPort>(host, std::move(interface), std::move(robot));
}

}  // namespace sentree::runtime
