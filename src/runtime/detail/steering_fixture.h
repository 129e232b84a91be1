#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sentree/runtime/inside.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/steering.h"

namespace sentree::runtime {

/// A scenario of examples/recharge.
inline project::Scenario recharge_scenario(const std::string& name) {
  auto loaded =
      project::load_scenario(std::string(SENTREE_SOURCE_DIR) + "/examples/recharge/scenarios/" + name + ".yaml");
  EXPECT_TRUE(loaded.ok()) << (loaded.ok() ? "" : to_string(loaded.diagnostics.front()));
  return std::move(*loaded.value);
}

/// A run in a thread of its own, which a test steers. It begins paused at time 0.
class SteeredRunFixture {
 public:
  explicit SteeredRunFixture(project::Scenario scenario, RunOptions options = {})
      : plan_(prepare_or_die(std::move(scenario))) {
    std::promise<Steering*> steering;
    auto ready = steering.get_future();
    options.paused = true;
    options.listeners.push_back([this](const Message& message) { messages.push_back(message); });
    options.on_begin = [&steering, next = std::move(options.on_begin)](RunInside& inside) {
      if (next) next(inside);
      steering.set_value(&inside.steering());
    };
    run_ = std::make_unique<Run>(plan_, std::move(options));
    thread_ = std::thread([this] { report = run_->execute(); });
    steering_ = ready.get();
  }
  ~SteeredRunFixture() {
    if (!thread_.joinable()) return;
    run_->interrupt();
    thread_.join();
  }
  SteeredRunFixture(const SteeredRunFixture&) = delete;
  SteeredRunFixture& operator=(const SteeredRunFixture&) = delete;

  Steering& steering() { return *steering_; }
  Run& run() { return *run_; }
  const project::Plan& plan() const { return plan_; }
  /// Goes on to the end.
  void finish() {
    (void)steering_->resume();
    thread_.join();
  }
  /// Goes on to that time, and waits until it is there.
  Steering::Status run_until(Duration time) {
    EXPECT_TRUE(steering_->run_until(TimePoint(time)).has_value());
    return steering_->wait_paused();
  }
  Steering::Status step(std::uint64_t ticks = 1) {
    EXPECT_TRUE(steering_->step(ticks).has_value());
    return steering_->wait_paused();
  }

  /// In virtual time to be read while the run stands or has ended.
  std::vector<Message> messages;
  RunReport report;

  [[nodiscard]] std::size_t count(std::string_view name) const {
    return static_cast<std::size_t>(
        std::count_if(messages.begin(), messages.end(), [&](const Message& m) { return m.name == name; }));
  }
  [[nodiscard]] std::string log() const {
    std::string text;
    for (const Message& message : messages) text += to_json(message) + "\n";
    return text;
  }

 private:
  static project::Plan prepare_or_die(project::Scenario scenario) {
    auto plan = prepare(std::move(scenario));
    for (const Diagnostic& diagnostic : plan.diagnostics) ADD_FAILURE() << to_string(diagnostic);
    return std::move(*plan.value);
  }

  const project::Plan plan_;
  std::unique_ptr<Run> run_;
  std::thread thread_;
  Steering* steering_ = nullptr;
};

}  // namespace sentree::runtime
