#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/mission/delivery.h"
#include "sentree/sim/state.h"
#include "sentree/sim/world.h"

namespace sentree::runtime {

/// A service as one caller sees it. Calls are executed in the order given.
class ServicePort {
 public:
  using Done = std::function<void(mission::CallOutcome)>;
  virtual ~ServicePort() = default;
  /// Whether the call goes to a part of the run as data, whose outcome comes back to the skill of `leaf` as data too;
  /// else `call` makes it.
  virtual bool take(std::size_t /*leaf*/, const mission::Shared<mission::Call>& /*call*/) { return false; }
  /// Gets ready for calls before there are any; `done` once it is, or cannot: before this returns, or later from
  /// another thread.
  virtual void open(const std::function<void()>& done) { done(); }
  /// `args` conform to the method. `done` is called once: before this returns, or later from another thread.
  virtual void call(const idl::Method& method, Value args, Done done) = 0;
};

/// The simulated robot of a run: one world's state, shared by all its services.
class SimHost {
 public:
  SimHost(std::shared_ptr<const sim::World> world, std::uint64_t seed, const Clock& clock);
  ~SimHost();
  SimHost(const SimHost&) = delete;
  SimHost& operator=(const SimHost&) = delete;

  /// In real time: from now on a thread keeps the world up with the clock, so that no call pays for all the time since
  /// the one before. What calls see is the same, as long as the machine is fast enough. On one that is not, simulated
  /// time falls behind the clock instead of calls waiting for ever more of it.
  struct Patience {
    std::chrono::milliseconds work{20};  ///< Wall time for which a call waits, or the thread works, at once.
    Duration lag{0};                     ///< Run time that may be left over then; more is left out for good.
  };
  /// @param told  Hears how much was left out in all, once that is a second and when it has doubled. From the thread.
  void keep_up(Patience patience, std::function<void(Duration behind)> told);
  /// Its thread has ended.
  void stop_keeping_up();

  /// Advances the world to now and serves the call of a robot (empty: the first). From any thread.
  [[nodiscard]] mission::CallOutcome call(const std::string& interface, const std::string& method, const Value& args,
                                          const std::string& robot = {});
  /// A copy of the state, advanced to now.
  [[nodiscard]] sim::State snapshot();
  /// Shows the state, advanced to now, without a copy. `look` must not call back.
  void inspect(const std::function<void(const sim::State&)>& look);
  /// Likewise, but the scans in it may not have been cast.
  void glance(const std::function<void(const sim::State&)>& look);
  /// Puts another state of the same world in its place.
  void restore(sim::State state);
  [[nodiscard]] const sim::World& world() const { return *world_; }

 private:
  // With the lock held.
  void advance();
  void advance_whole();

  std::shared_ptr<const sim::World> world_;
  const Clock& clock_;
  std::mutex mutex_;
  sim::State state_;
  bool keeps_up_ = false;
  Patience patience_;
  TimePoint advanced_to_{};  // of the clock, while the thread keeps up
  Duration behind_{0};       // simulated time that was left out
  bool ending_ = false;
  std::condition_variable end_;
  std::thread keeper_;
};

/// What a person is told of a simulator that cannot keep up.
[[nodiscard]] std::string falls_behind(Duration behind);

/// A service that nobody serves: what is published on its topics has left when it was observed.
[[nodiscard]] std::unique_ptr<ServicePort> make_topic_port();

/// A service of the simulator in this process; answers before `call` returns.
[[nodiscard]] std::unique_ptr<ServicePort> make_sim_port(SimHost& host, std::string interface, std::string robot = {});

}  // namespace sentree::runtime
