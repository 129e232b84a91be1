#include <sys/prctl.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <queue>
#include <thread>
#include <vector>

#include "sentree/base/assert.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::runtime {

namespace {

using SteadyClock = std::chrono::steady_clock;

// Run time that stands at 0 until it is started, and while it is paused. Any thread may read it.
class StretchedClock final : public Clock {
 public:
  explicit StretchedClock(double factor) : factor_(factor) { SENTREE_ASSERT(factor > 0); }

  void start() {
    const std::lock_guard lock(mutex_);
    started_ = true;
    anchor(TimePoint{}, factor_);
  }
  void set(Pace pace) {
    const std::lock_guard lock(mutex_);
    const TimePoint present = now();
    paused_ = pace.paused;
    if (pace.factor > 0) factor_ = pace.factor;
    anchor(present, factor_);
  }
  Pace pace() const {
    const std::lock_guard lock(mutex_);
    return {paused_, factor_};
  }
  TimePoint now() const override {
    const Line line = read();
    const auto passed = static_cast<double>(SteadyClock::now().time_since_epoch().count() - line.wall_ns);
    return TimePoint(Duration(line.run_ns + static_cast<std::int64_t>(passed * line.slope)));
  }
  /// When it will be `when`; never, while time stands.
  SteadyClock::time_point wall(TimePoint when) const {
    const Line line = read();
    if (line.slope <= 0) return SteadyClock::time_point::max();
    const double ns = static_cast<double>(when.time_since_epoch().count() - line.run_ns) / line.slope;
    if (ns > 9e18 - static_cast<double>(line.wall_ns)) return SteadyClock::time_point::max();
    return SteadyClock::time_point(Duration(line.wall_ns + static_cast<std::int64_t>(ns)));
  }

 private:
  // Run time as a function of wall time.
  struct Line {
    std::int64_t run_ns = 0;
    std::int64_t wall_ns = 0;
    double slope = 0.0;
  };

  // Readers outnumber writers by millions, so they take no lock: they read again what was written meanwhile.
  Line read() const {
    for (;;) {
      const std::uint64_t version = version_;
      const Line line{run_ns_, wall_ns_, slope_};
      if (version % 2 == 0 && version_ == version) return line;
    }
  }
  void anchor(TimePoint present, double factor) {
    ++version_;
    run_ns_ = present.time_since_epoch().count();
    wall_ns_ = SteadyClock::now().time_since_epoch().count();
    slope_ = started_ && !paused_ ? factor : 0.0;
    ++version_;
  }

  mutable std::mutex mutex_;  // of those who write
  double factor_;
  bool paused_ = false;
  bool started_ = false;
  std::atomic<std::uint64_t> version_ = 0;  // odd: being written
  std::atomic<std::int64_t> run_ns_ = 0;
  std::atomic<std::int64_t> wall_ns_ = 0;
  std::atomic<double> slope_ = 0.0;
};

thread_local const void* working_for = nullptr;  // the scheduler whose task this thread executes

class RealScheduler final : public Scheduler {
 public:
  explicit RealScheduler(double factor) : clock_(factor) {}
  ~RealScheduler() override {
    stop();
    join();
  }

  TimePoint now() const override { return clock_.now(); }
  bool is_virtual() const override { return false; }
  bool is_inside() const override { return working_for == this; }

  ActorId add_actor(std::string name) override {
    const std::lock_guard lock(mutex_);
    Actor& actor = *actors_.emplace_back(std::make_unique<Actor>());
    actor.name = std::move(name);
    if (running_) start(actor);
    return actors_.size() - 1;
  }

  void post(ActorId to, Task task) override {
    push(to, [&](Actor& actor) { actor.tasks.push_back(std::move(task)); });
  }

  void at(ActorId to, TimePoint when, Rank rank, Task task) override {
    push(to, [&](Actor& actor) { actor.timers.push({when, rank, actor.order++, std::move(task)}); });
  }

  std::optional<std::string> run() override {
    std::unique_lock lock(mutex_);
    running_ = true;
    clock_.start();
    for (auto& actor : actors_) start(*actor);
    stopped_changed_.wait(lock, [&] { return stopped_.load(); });
    lock.unlock();
    join();
    return error_;
  }

  void stop() override {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    stopped_changed_.notify_all();
    wake_all();
  }

  void set_pace(Pace pace) override {
    const bool was_paused = clock_.pace().paused;
    clock_.set(pace);
    wake_all();
    if (pace.paused && !was_paused && told_standing_) told_standing_();
  }
  Pace pace() const override { return clock_.pace(); }
  bool standing() const override { return clock_.pace().paused; }
  void on_standing(std::function<void()> told) override { told_standing_ = std::move(told); }
  bool inject(ActorId to, Task task) override {
    if (injected_.fetch_add(1) >= kInboxMax) {
      --injected_;
      return false;
    }
    post(to, [this, task = std::move(task)] {
      --injected_;
      task();
    });
    return true;
  }
  TimePoint view_time() const override { return now(); }

  void abandon(ActorId which, std::string) override {
    const std::lock_guard lock(mutex_);
    Actor& actor = *actors_[which];
    {
      const std::lock_guard actor_lock(actor.mutex);
      ++actor.generation;
      leave_behind(actor.thread);
    }
    start(actor);
  }

 private:
  struct Timer {
    TimePoint when;
    Rank rank;
    std::uint64_t order;
    Task task;
  };
  struct Later {
    bool operator()(const Timer& a, const Timer& b) const {
      if (a.when != b.when) return a.when > b.when;
      if (a.rank != b.rank) return a.rank > b.rank;
      return a.order > b.order;
    }
  };
  struct Actor {
    std::string name;
    std::mutex mutex;
    std::condition_variable wake;
    std::deque<Task> tasks;
    std::priority_queue<Timer, std::vector<Timer>, Later> timers;
    std::uint64_t order = 0;
    std::thread thread;
    std::uint64_t generation = 0;  // of threads: counts those that were left behind
    bool ended = false;            // the present thread does nothing more
    std::condition_variable ended_changed;
  };

  void wake_all() {
    // Actors are never removed, so the list can be walked while more are added only under the lock.
    const std::lock_guard lock(mutex_);
    for (auto& actor : actors_) {
      const std::lock_guard actor_lock(actor->mutex);
      actor->wake.notify_all();
    }
  }

  template <class Add>
  void push(ActorId to, Add add) {
    Actor* actor = nullptr;
    {
      const std::lock_guard lock(mutex_);
      actor = actors_[to].get();
    }
    bool full = false;
    {
      const std::lock_guard lock(actor->mutex);
      full = actor->tasks.size() + actor->timers.size() >= kQueueMax;
      if (!full) add(*actor);
    }
    if (full) {
      fail("more than " + std::to_string(kQueueMax) + " messages are waiting for " + actor->name);
    } else {
      actor->wake.notify_one();
    }
  }

  void fail(std::string why) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(why);
    stopped_ = true;
    stopped_changed_.notify_all();
  }

  void start(Actor& actor) {
    if (!actor.thread.joinable())
      actor.thread = std::thread([this, &actor, mine = actor.generation] { work(actor, mine); });
  }

  void work(Actor& actor, std::uint64_t mine) {
    working_for = this;
    prctl(PR_SET_NAME, actor.name.substr(0, 15).c_str());
    prctl(PR_SET_TIMERSLACK, 1000UL);  // 1 µs: the default of 50 µs would show as jitter of every tick
    std::unique_lock lock(actor.mutex);
    while (!stopped_ && actor.generation == mine) {
      Task task;
      if (!actor.timers.empty() && actor.timers.top().when <= now()) {
        task = std::move(const_cast<Timer&>(actor.timers.top()).task);
        actor.timers.pop();
      } else if (!actor.tasks.empty()) {
        task = std::move(actor.tasks.front());
        actor.tasks.pop_front();
      } else if (actor.timers.empty()) {
        actor.wake.wait(lock);
        continue;
      } else {
        actor.wake.wait_until(lock, clock_.wall(actor.timers.top().when));
        continue;
      }
      lock.unlock();
      task();
      task = nullptr;
      lock.lock();
    }
    actor.ended = true;
    actor.ended_changed.notify_all();
  }

  void join() {
    for (auto& actor : actors_) {
      {
        std::unique_lock lock(actor->mutex);
        actor->wake.notify_all();
        // Its thread may be in a script that does not end, and be replaced while we wait.
        if (actor->thread.joinable()) actor->ended_changed.wait(lock, [&] { return actor->ended; });
      }
      if (actor->thread.joinable()) actor->thread.join();
    }
  }

  StretchedClock clock_;
  std::mutex mutex_;
  std::condition_variable stopped_changed_;
  std::atomic<bool> stopped_ = false;
  bool running_ = false;
  std::function<void()> told_standing_;
  std::atomic<std::size_t> injected_ = 0;
  std::optional<std::string> error_;
  std::vector<std::unique_ptr<Actor>> actors_;
};

}  // namespace

std::unique_ptr<Scheduler> make_real_scheduler(double factor) { return std::make_unique<RealScheduler>(factor); }

std::unique_ptr<Clock> make_real_clock(double factor) {
  auto clock = std::make_unique<StretchedClock>(factor);
  clock->start();
  return clock;
}

}  // namespace sentree::runtime
