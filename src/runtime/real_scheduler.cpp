#include <pthread.h>
#include <sys/prctl.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <queue>
#include <system_error>
#include <thread>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "sentree/base/alarm.h"
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

  /// From the time that `begin` has set, or 0.
  void start() {
    const std::lock_guard lock(mutex_);
    started_ = true;
    anchor(now(), factor_);
  }
  void begin(TimePoint at) {
    const std::lock_guard lock(mutex_);
    anchor(at, factor_);
  }
  void set_held(bool held) {
    const std::lock_guard lock(mutex_);
    const TimePoint present = now();
    held_ = held;
    anchor(present, factor_);
  }
  /// Stands until `go_on`, after which it is as if it had not, unless it was changed meanwhile.
  void stand() {
    const std::lock_guard lock(mutex_);
    went_ = read();
    stands_ = true;
    anchor(now(), factor_);
    stood_ = version_;
  }
  void go_on() {
    const std::lock_guard lock(mutex_);
    const TimePoint present = now();
    stands_ = false;
    if (version_ == stood_)
      write(went_);
    else
      anchor(present, factor_);
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
  /// When it will be `when`; never, while time stands before it.
  SteadyClock::time_point wall(TimePoint when) const {
    const Line line = read();
    const std::int64_t left = when.time_since_epoch().count() - line.run_ns;
    if (line.slope <= 0) return left > 0 ? SteadyClock::time_point::max() : SteadyClock::time_point();
    const double ns = static_cast<double>(left) / line.slope;
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
    write({.run_ns = present.time_since_epoch().count(),
           .wall_ns = SteadyClock::now().time_since_epoch().count(),
           .slope = started_ && !paused_ && !held_ && !stands_ ? factor : 0.0});
  }
  void write(const Line& line) {
    ++version_;
    run_ns_ = line.run_ns;
    wall_ns_ = line.wall_ns;
    slope_ = line.slope;
    ++version_;
  }

  mutable std::mutex mutex_;  // of those who write
  double factor_;
  bool paused_ = false;
  bool held_ = false;
  bool stands_ = false;
  Line went_;                // before it stood
  std::uint64_t stood_ = 0;  // its version since
  bool started_ = false;
  std::atomic<std::uint64_t> version_ = 0;  // odd: being written
  std::atomic<std::int64_t> run_ns_ = 0;
  std::atomic<std::int64_t> wall_ns_ = 0;
  std::atomic<double> slope_ = 0.0;
};

// Actors are not bound to threads: a task that an actor posts to an idle one is executed, as soon as the posting task
// has ended, by the same thread. A tick that goes from the mission to a skill and back so wakes nobody, where a thread
// of each actor's own would be woken for every step.
//
// One thread at a time watches the clock; the others are spare. Whoever has work to do does it first and watches
// afterwards. What waits for a busy thread longer than kPatience (for a script that does not end, say) is given to
// another one by the rescuer; since there may be one more thread than actors, everything goes on beside any number of
// actors that do not come back.
class RealScheduler final : public Scheduler {
 public:
  using Scheduler::at;
  using Scheduler::hand_over;
  using Scheduler::post;

  explicit RealScheduler(double factor) : clock_(factor) {}
  ~RealScheduler() override {
    stop();
    join();
  }

  TimePoint now() const override { return clock_.now(); }
  bool is_virtual() const override { return false; }
  bool is_inside() const override { return t_worker != nullptr && &t_worker->owner == this; }

  ActorId add_actor(std::string name, Urgency urgency) override {
    const std::lock_guard lock(mutex_);
    Actor& actor = actors_.emplace_back();
    actor.id = actors_.size() - 1;
    actor.name = std::move(name);
    actor.background = urgency == Urgency::kBackground;
    return actor.id;
  }

  void post(ActorId to, Task task) override {
    const std::lock_guard lock(mutex_);
    Actor& actor = actors_[to];
    if (!has_room(actor)) return;
    actor.tasks.push_back(std::move(task));
    if (!actor.claimed()) make_ready(actor);
  }

  void hand_over(ActorId to, Task task) override {
    std::unique_lock lock(mutex_);
    Actor& actor = actors_[to];
    if (!has_room(actor)) return;
    actor.tasks.push_back(std::move(task));
    if (actor.claimed()) return;
    if (!running_ || stopped_ || is_looked_at_ || own_worker() != nullptr) {
      make_ready(actor);
      return;
    }
    Worker guest(*this);
    guest.handle = pthread_self();
    guests_.push_back(&guest);
    Worker* const before = std::exchange(t_worker, &guest);
    // Nobody else's tasks: one that does not end would cost the guest its thread.
    execute(guest, actor, lock);
    t_worker = before;
    if (!guest.left) release(guest.next);
    std::erase(guests_, &guest);
    if (stopped_) ended_.notify_all();
  }

  void at(ActorId to, TimePoint when, mission::Rank rank, Task task) override {
    add_timer(to, {when, rank, 0, std::move(task)});
  }
  void at(ActorId to, TimePoint when, mission::Rank rank, mission::Delivery delivery) override {
    add_timer(to, {when, rank, 0, std::move(delivery)});
  }

  void on_order(std::function<std::size_t(std::uint64_t, std::span<const mission::Delivery* const>)>,
                std::function<bool(const mission::Delivery&)>) override {}

  void hold() override { set_held(true); }
  void go_on() override { set_held(false); }
  Result<void> settle(ActorId actor, std::chrono::milliseconds patience) override {
    std::unique_lock lock(mutex_);
    Worker* const me = own_worker();
    SENTREE_ASSERT(me != nullptr && me->actor == &actors_[actor]);
    release(me->next);
    // Work is done in other threads of ours, some of which are woken by the rescuer only.
    const auto until = SteadyClock::now() + patience;
    for (;;) {
      if (stopped_) return fail("run.ended", "the run has ended");
      const Actor* const other = at_work_beside(*me->actor);
      if (other == nullptr) return {};
      if (SteadyClock::now() >= until) {
        return fail("run.cannot-carry",
                    fmt::format("{} is still at work after {} s in which no time passed, and what is half done cannot "
                                "be taken over; try again when its script has ended",
                                other->name, std::chrono::duration<double>(patience).count()));
      }
      arm_rescue();
      idle_.wait_until(lock, std::min(until, SteadyClock::now() + 10 * kPatience));
    }
  }
  bool look_at_rest(ActorId actor, const std::function<void()>& look) override {
    std::unique_lock lock(mutex_);
    SENTREE_ASSERT(own_worker() != nullptr && own_worker()->actor == &actors_[actor]);
    clock_.stand();
    const bool rests = at_work_beside(actors_[actor]) == nullptr;
    if (rests) {
      is_looked_at_ = true;
      lock.unlock();
      look();
      lock.lock();
      is_looked_at_ = false;
    }
    clock_.go_on();
    if (watching_)
      watch_until({});
    else if (!ready_.empty())
      call_worker();
    return rests;
  }
  void save(mission::State& state) const override {
    const std::lock_guard lock(mutex_);
    state.now = clock_.now();
    state.begun = true;
    state.queue.clear();
    for (const Actor& actor : actors_) {
      for (auto timers = actor.timers; !timers.empty(); timers.pop()) {
        const Timer& timer = timers.top();
        if (const auto* delivery = std::get_if<mission::Delivery>(&timer.what))
          state.queue.push_back({timer.when, timer.rank, 0, *delivery});
      }
    }
    std::stable_sort(state.queue.begin(), state.queue.end(), [](const mission::Waiting& a, const mission::Waiting& b) {
      return std::tie(a.when, a.rank) < std::tie(b.when, b.rank);
    });
    for (mission::Waiting& waiting : state.queue) waiting.order = state.order++;
  }
  void load(const mission::State& state, const std::function<ActorId(const mission::Delivery&)>& actor_of) override {
    clock_.begin(state.now);
    for (const mission::Waiting& waiting : state.queue)
      at(actor_of(waiting.what), waiting.when, waiting.rank, waiting.what);
  }

  std::optional<std::string> run() override {
    std::unique_lock lock(mutex_);
    if (!alarm_.works() || !rescue_.works()) return "no file descriptor is left for the run's clock";
    running_ = true;
    clock_.start();
    rescuer_ = std::thread([this] { rescue(); });
    add_worker();
    ended_.wait(lock, [&] { return stopped_; });
    lock.unlock();
    join();
    return error_;
  }

  void stop() override {
    const std::lock_guard lock(mutex_);
    stop_all();
  }

  void set_pace(Pace pace) override {
    const bool was_paused = clock_.pace().paused;
    clock_.set(pace);
    {
      const std::lock_guard lock(mutex_);
      if (watching_) watch_until({});  // and then as the new pace wants
    }
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
    Actor& actor = actors_[which];
    if (Worker* worker = std::exchange(actor.at_work, nullptr)) {
      worker->left = true;
      worker->actor = nullptr;
      --busy_;
      release(worker->next);
      if (worker->thread.joinable()) {
        leave_behind(worker->thread);
        --live_;
      } else {
        leave_behind(worker->handle);
        std::erase(guests_, worker);
      }
    }
    if (!actor.ready && !actor.tasks.empty()) make_ready(actor);
    call_worker();
    if (stopped_) ended_.notify_all();
  }

 private:
  // How long an actor that can go on waits for the thread that made it so.
  static constexpr std::chrono::milliseconds kPatience{1};

  struct Timer {
    TimePoint when;
    mission::Rank rank;
    std::uint64_t order;
    std::variant<Task, mission::Delivery> what;
  };
  struct Later {
    bool operator()(const Timer& a, const Timer& b) const {
      if (a.when != b.when) return a.when > b.when;
      if (a.rank != b.rank) return a.rank > b.rank;
      return a.order > b.order;
    }
  };
  struct Worker;
  struct Actor {
    ActorId id = 0;
    std::string name;
    bool background = false;
    std::deque<Task> tasks;
    std::priority_queue<Timer, std::vector<Timer>, Later> timers;
    std::uint64_t order = 0;
    Worker* at_work = nullptr;  // who executes its task
    bool ready = false;         // is in a list of actors that can go on
    [[nodiscard]] bool claimed() const { return at_work != nullptr || ready; }
    [[nodiscard]] bool has_task(TimePoint now) const {
      return !tasks.empty() || (!timers.empty() && timers.top().when <= now);
    }
  };
  // A thread of our own, or a guest: one that lends itself while it hands something over.
  struct Worker {
    explicit Worker(RealScheduler& scheduler) : owner(scheduler) {}
    RealScheduler& owner;
    std::thread thread;
    pthread_t handle{};
    Actor* actor = nullptr;    // whose task it executes
    std::vector<Actor*> next;  // made ready by its tasks; the last one first
    SteadyClock::time_point next_since;
    bool left = false;  // behind: touches nothing any more
    bool called = false;
    std::condition_variable wake;  // of a spare one
  };
  // Each timer has one; when it is due, its actor looks.
  struct Due {
    TimePoint when;
    Actor* actor;
    bool operator<(const Due& other) const { return when > other.when; }
  };

  void set_held(bool held) {
    clock_.set_held(held);
    const std::lock_guard lock(mutex_);
    if (watching_) watch_until({});  // and then as the clock goes
  }

  // All below: with the lock held.

  [[nodiscard]] Worker* own_worker() const {
    return t_worker != nullptr && &t_worker->owner == this && !t_worker->left ? t_worker : nullptr;
  }

  // Another one that is at work, or has something to do now.
  [[nodiscard]] const Actor* at_work_beside(const Actor& actor) const {
    const TimePoint now = clock_.now();
    const auto found = std::find_if(actors_.begin(), actors_.end(), [&](const Actor& other) {
      return &other != &actor && (other.claimed() || other.has_task(now));
    });
    return found != actors_.end() ? &*found : nullptr;
  }

  bool has_room(const Actor& actor) {
    if (actor.tasks.size() + actor.timers.size() < kQueueMax) return true;
    if (!error_) error_ = fmt::format("more than {} messages are waiting for {}", kQueueMax, actor.name);
    stop_all();
    return false;
  }

  void stop_all() {
    stopped_ = true;
    if (watching_) watch_until({});
    rescue_.set({});
    for (Worker* spare : spares_) spare->wake.notify_all();
    ended_.notify_all();
  }

  void add_timer(ActorId to, Timer&& timer) {
    const std::lock_guard lock(mutex_);
    Actor& actor = actors_[to];
    if (!has_room(actor)) return;
    timer.order = actor.order++;
    due_.push({timer.when, &actor});
    const auto when = timer.when;
    actor.timers.push(std::move(timer));
    if (watching_) watch_until(clock_.wall(when));
  }

  void make_ready(Actor& actor) {
    actor.ready = true;
    if (Worker* me = own_worker(); me != nullptr && me->actor != nullptr) {
      if (me->next.empty()) me->next_since = SteadyClock::now();
      me->next.insert(actor.background ? me->next.begin() : me->next.end(), &actor);
      arm_rescue();
    } else {
      ready_.push_back(&actor);
      call_worker_for(actor);
    }
  }

  // The background is worth no thread of its own yet; the rescuer sees to it if nobody does before.
  void call_worker_for(const Actor& actor) {
    if (actor.background)
      arm_rescue();
    else
      call_worker();
  }

  // Gives what waits for one worker to any.
  void release(std::vector<Actor*>& next) {
    ready_.insert(ready_.end(), next.rbegin(), next.rend());
    for (const Actor* actor : std::exchange(next, {})) call_worker_for(*actor);
  }

  void call_worker() {
    if (!running_ || stopped_) return;
    if (watching_) {
      watch_until({});
    } else if (!spares_.empty()) {
      Worker* spare = spares_.back();
      spares_.pop_back();
      spare->called = true;
      spare->wake.notify_one();
    } else if (busy_ == 0) {
      add_worker();
    } else {
      arm_rescue();  // perhaps one of the busy ones is free before
    }
  }

  void add_worker() {
    if (live_ > actors_.size()) return;
    Worker& worker = workers_.emplace_back(*this);
    try {
      worker.thread = std::thread([this, &worker] { work(worker); });
      ++live_;
    } catch (const std::system_error&) {
      workers_.pop_back();
      arm_rescue();  // which tries again
    }
  }

  void watch_until(SteadyClock::time_point when) {
    if (when >= alarm_at_) return;
    alarm_at_ = when;
    alarm_.set(when);
  }

  void arm_rescue() {
    if (std::exchange(rescue_armed_, true)) return;
    rescue_.set(SteadyClock::now() + kPatience);
  }

  // A rescuer that wakes for nothing costs more than this.
  void disarm_rescue() {
    if (busy_ == 0 && ready_.empty() && std::exchange(rescue_armed_, false))
      rescue_.set(SteadyClock::time_point::max());
  }

  // Actors whose time has come.
  void look_at_clock() {
    if (due_.empty()) return;
    for (const TimePoint now = clock_.now(); !due_.empty() && due_.top().when <= now; due_.pop()) {
      Actor& actor = *due_.top().actor;
      if (actor.claimed()) continue;  // looks for itself
      actor.ready = true;
      ready_.push_back(&actor);
    }
  }

  Actor* take(Worker& me) {
    if (is_looked_at_) return nullptr;
    if (!me.next.empty()) {
      Actor* actor = me.next.back();
      me.next.pop_back();
      return actor;
    }
    if (ready_.empty()) look_at_clock();
    if (ready_.empty()) return nullptr;
    Actor* actor = ready_.front();
    ready_.pop_front();
    return actor;
  }

  // What the actor has to do now. Whom it tells something comes before what else it has to do itself.
  void execute(Worker& me, Actor& actor, std::unique_lock<std::mutex>& lock) {
    actor.ready = false;
    actor.at_work = &me;
    me.actor = &actor;
    ++busy_;
    if (!watching_) arm_rescue();
    const auto told = [&] { return !me.next.empty() && !me.next.back()->background; };
    const std::size_t before = me.next.size();
    while (!stopped_ && (me.next.size() == before || !told())) {
      Task task = due_task(actor);
      if (!task) break;
      lock.unlock();
      task();
      task = nullptr;
      lock.lock();
      if (me.left) return;
    }
    actor.at_work = nullptr;
    me.actor = nullptr;
    --busy_;
    idle_.notify_all();
    if (stopped_ || !actor.has_task(clock_.now())) return;
    actor.ready = true;
    if (me.next.empty()) me.next_since = SteadyClock::now();
    auto place = me.next.begin() + static_cast<std::ptrdiff_t>(std::min(before, me.next.size()));
    while (!actor.background && place != me.next.end() && (*place)->background) ++place;
    me.next.insert(place, &actor);
  }

  Task due_task(Actor& actor) {
    Task task;
    if (!actor.timers.empty() && actor.timers.top().when <= now()) {
      auto what = std::move(const_cast<Timer&>(actor.timers.top()).what);
      actor.timers.pop();
      if (auto* delivery = std::get_if<mission::Delivery>(&what))
        task = task_of(actor.id, std::move(*delivery));
      else
        task = std::get<Task>(std::move(what));
    } else if (!actor.tasks.empty()) {
      task = std::move(actor.tasks.front());
      actor.tasks.pop_front();
    }
    return task;
  }

  void work(Worker& me) {
    prctl(PR_SET_NAME, "actors");
    std::unique_lock lock(mutex_);
    t_worker = &me;
    while (!stopped_ && !me.left) {
      if (Actor* actor = take(me)) {
        execute(me, *actor, lock);
      } else if (!watching_) {
        watch(lock);
      } else {
        spares_.push_back(&me);
        me.wake.wait(lock, [&] { return me.called || stopped_; });
        me.called = false;
      }
    }
    if (me.left) return;
    --live_;
    ended_.notify_all();
  }

  void watch(std::unique_lock<std::mutex>& lock) {
    watching_ = true;
    disarm_rescue();
    const auto next = due_.empty() ? SteadyClock::time_point::max() : clock_.wall(due_.top().when);
    if (alarm_at_ != next) alarm_.set(alarm_at_ = next);
    lock.unlock();
    alarm_.wait();
    lock.lock();
    watching_ = false;
    alarm_at_ = SteadyClock::time_point::max();
  }

  void rescue() {
    prctl(PR_SET_NAME, "actors' rescuer");
    for (;;) {
      rescue_.wait();
      const std::lock_guard lock(mutex_);
      if (stopped_) return;
      rescue_armed_ = false;
      bool again = busy_ > 0 && !watching_;
      const auto look_at = [&](Worker& worker) {
        if (worker.next.empty()) return;
        if (SteadyClock::now() - worker.next_since >= kPatience)
          release(worker.next);
        else
          again = true;
      };
      for (Worker& worker : workers_) look_at(worker);
      for (Worker* guest : guests_) look_at(*guest);
      if (!watching_) look_at_clock();
      if (!ready_.empty()) {
        if (!watching_ && spares_.empty())
          add_worker();
        else
          call_worker();
        again = true;
      }
      if (again) arm_rescue();
    }
  }

  void join() {
    {
      std::unique_lock lock(mutex_);
      // A thread may be in a script that does not end, and be left behind while we wait.
      ended_.wait(lock, [&] { return live_ == 0 && guests_.empty(); });
    }
    for (Worker& worker : workers_) {
      if (worker.thread.joinable()) worker.thread.join();
    }
    if (rescuer_.joinable()) rescuer_.join();
  }

  static thread_local Worker* t_worker;

  StretchedClock clock_;
  Alarm alarm_;   // rings for the one who watches
  Alarm rescue_;  // rings for the rescuer
  mutable std::mutex mutex_;
  std::condition_variable ended_;  // something has
  std::condition_variable idle_;   // an actor has come to rest
  bool stopped_ = false;
  bool running_ = false;
  bool is_looked_at_ = false;  // nobody takes anything
  std::function<void()> told_standing_;
  std::atomic<std::size_t> injected_ = 0;
  std::optional<std::string> error_;
  std::deque<Actor> actors_;    // never fewer
  std::deque<Worker> workers_;  // those left behind too
  std::vector<Worker*> guests_;
  std::vector<Worker*> spares_;
  std::size_t live_ = 0;  // workers that are not left behind
  std::size_t busy_ = 0;  // workers and guests with an actor
  std::deque<Actor*> ready_;
  std::priority_queue<Due> due_;
  bool watching_ = false;  // a worker waits for alarm_
  SteadyClock::time_point alarm_at_ = SteadyClock::time_point::max();
  bool rescue_armed_ = false;
  std::thread rescuer_;
};

thread_local RealScheduler::Worker* RealScheduler::t_worker = nullptr;

}  // namespace

std::unique_ptr<Scheduler> make_real_scheduler(double factor) { return std::make_unique<RealScheduler>(factor); }

std::unique_ptr<Clock> make_real_clock(double factor) {
  auto clock = std::make_unique<StretchedClock>(factor);
  clock->start();
  return clock;
}

}  // namespace sentree::runtime
