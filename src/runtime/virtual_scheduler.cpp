#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>

#include "sentree/mission/due.h"
#include "sentree/mission/effect.h"
#include "sentree/mission/instant.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::runtime {

namespace {

using SteadyClock = std::chrono::steady_clock;

// A run that is so far behind the wall clock does not catch up [wall time].
constexpr std::chrono::milliseconds kLagMax{250};

class VirtualScheduler final : public Scheduler {
 public:
  using Scheduler::hand_over;

  TimePoint now() const override { return now_.load(std::memory_order_relaxed); }
  bool is_virtual() const override { return true; }
  bool is_inside() const override { return worker_ == std::this_thread::get_id(); }

  ActorId add_actor(std::string name, Urgency) override {
    names_.push_back(std::move(name));
    return names_.size() - 1;
  }

  void post(ActorId to, Task task) override { push(to, now(), mission::Rank::kMessage, std::move(task)); }
  void at(ActorId to, TimePoint when, mission::Rank rank, Task task) override {
    push(to, std::max(when, now()), rank, std::move(task));
  }

  void post(ActorId to, mission::Delivery delivery) override {
    push(to, now(), mission::Rank::kMessage, std::move(delivery));
  }
  void at(ActorId to, TimePoint when, mission::Rank rank, mission::Delivery delivery) override {
    push(to, std::max(when, now()), rank, std::move(delivery));
  }

  void save(mission::State& state) const override {
    state.now = now();
    state.begun = begun_;
    state.order = order_;
    state.orders = orders_;
    state.queue.clear();
    for (const Entry& entry : queue_) {
      if (const auto* delivery = std::get_if<mission::Delivery>(&things_[entry.thing]))
        state.queue.push_back({entry.when, entry.rank, entry.order, *delivery});
    }
    std::sort(state.queue.begin(), state.queue.end(), [](const mission::Waiting& a, const mission::Waiting& b) {
      return std::tie(a.when, a.rank, a.order) < std::tie(b.when, b.rank, b.order);
    });
  }
  void load(const mission::State& state, const std::function<ActorId(const mission::Delivery&)>& actor_of) override {
    now_.store(state.now, std::memory_order_relaxed);
    begun_ = state.begun;
    order_ = state.order;
    orders_ = state.orders;
    anchor_run_ = state.now;
    for (const mission::Waiting& waiting : state.queue)
      queue_.push_back({waiting.when, waiting.rank, waiting.order, actor_of(waiting.what), put(Thing(waiting.what))});
    std::make_heap(queue_.begin(), queue_.end(), Later());
  }

  void on_order(std::function<std::size_t(std::uint64_t, std::span<const mission::Delivery* const>)> decide,
                std::function<bool(const mission::Delivery&)> has_effect) override {
    decide_ = std::move(decide);
    has_effect_ = std::move(has_effect);
  }

  // In a thread of its own, so that the caller comes back even from a script that does not.
  std::optional<std::string> run() override {
    {
      const std::lock_guard lock(pace_mutex_);
      anchor_wall_ = SteadyClock::now();
      running_ = true;
    }
    if (thread_.run([this] { result_ = work(); })) return result_;
    const std::lock_guard lock(abandoned_mutex_);
    return abandoned_;
  }

  void stop() override {
    stopped_ = true;
    const std::lock_guard lock(pace_mutex_);
    changed_.notify_all();
  }

  void abandon(ActorId, std::string why) override {
    {
      const std::lock_guard lock(abandoned_mutex_);
      abandoned_ = std::move(why);
    }
    thread_.leave();
  }

  void set_pace(Pace pace) override {
    const std::lock_guard lock(pace_mutex_);
    anchor_run_ = shown();
    anchor_wall_ = SteadyClock::now();
    pace_ = pace;
    attention_ = true;
    changed_.notify_all();
  }
  Pace pace() const override {
    const std::lock_guard lock(pace_mutex_);
    return pace_;
  }
  bool standing() const override {
    const std::lock_guard lock(pace_mutex_);
    return standing_ && pace_.paused && inbox_.empty();
  }
  void on_standing(std::function<void()> told) override { told_standing_ = std::move(told); }

  bool inject(ActorId to, Task task) override {
    const std::lock_guard lock(pace_mutex_);
    if (inbox_.size() >= kInboxMax) return false;
    inbox_.emplace_back(to, std::move(task));
    attention_ = true;
    changed_.notify_all();
    return true;
  }

  // Not bounded by kInboxMax: an outcome that is lost is a call that never ends, and calls are bounded.
  void enter(ActorId to, mission::Delivery delivery) override {
    const std::lock_guard lock(pace_mutex_);
    if (inbox_.size() >= kQueueMax) return;
    inbox_.emplace_back(to, std::move(delivery));
    attention_ = true;
    changed_.notify_all();
  }

  void keep(Chronicle* chronicle) override { chronicle_ = chronicle; }
  void on_behind(const std::function<void(Duration)>& told) override { told_behind_ = told; }
  Place place() const override { return {now(), executed_}; }

  void catch_up(TimePoint until, const std::function<void()>& reached) override {
    catching_up_ = true;
    catch_up_until_ = until;
    caught_up_ = reached;
    attention_ = true;
  }

  void leap(TimePoint to, const std::function<void(TimePoint&, mission::Delivery&)>& put_off) override {
    for (Entry& entry : queue_) {
      if (auto* delivery = std::get_if<mission::Delivery>(&things_[entry.thing])) put_off(entry.when, *delivery);
    }
    std::sort(queue_.begin(), queue_.end(), [](const Entry& a, const Entry& b) { return Later()(b, a); });
    for (Entry& entry : queue_) {
      entry.when = std::max(entry.when, to);
      entry.order = order_++;
    }
    std::make_heap(queue_.begin(), queue_.end(), Later());
    now_.store(to, std::memory_order_relaxed);
    begun_ = true;
  }

  TimePoint view_time() const override {
    const std::lock_guard lock(pace_mutex_);
    return shown();
  }

 private:
  std::optional<std::string> work() {
    worker_ = std::this_thread::get_id();
    mission::Instant instant(names_.size());
    std::size_t tasks_now = 0;
    while (!stopped_) {
      if (error_) return error_;
      if (attention_ && !attend()) break;
      if (queue_.empty()) return "nothing is left to do, and nobody ended the run";
      const Entry& top = queue_.front();
      if (top.when > now()) {
        now_.store(top.when, std::memory_order_relaxed);
        instant.begin();
        tasks_now = 0;
        begun_ = false;
        if (chronicle_ != nullptr && !catching_up_) chronicle_->instant(top.when);
      }
      if (const auto* delivery = std::get_if<mission::Delivery>(&things_[top.thing])) {
        // The queue has its own bound, and much in it may be for later.
        if (!instant.admits(0)) return instant.why();
        if (instant.listens()) instant.tell(names_[top.actor], *delivery);
      } else if (++tasks_now > kTasksPerInstantMax) {
        return fmt::format(
            "{} has been sent more than {} messages without time passing; two parts answer each other for ever",
            names_[top.actor], kTasksPerInstantMax);
      }
      if (top.rank != mission::Rank::kInjection) begun_ = true;
      if (decide_) reorder();
      std::pop_heap(queue_.begin(), queue_.end(), Later());
      const Entry next = queue_.back();
      queue_.pop_back();
      Thing thing = std::move(things_[next.thing]);
      free_.push_back(next.thing);
      executed_ = next.order;
      if (auto* delivery = std::get_if<mission::Delivery>(&thing))
        give(next.actor, std::move(*delivery));
      else
        std::get<Task>(thing)();
    }
    return error_;
  }

  // Brings to the front what is decided to come first of the deliveries that are due now.
  void reorder() {
    const Entry& top = queue_.front();
    if (!mission::may_change_places(top.rank) || !is_delivery(top)) return;
    struct Due {
      TimePoint when;
      mission::Rank rank;
      Entry* entry;
    };
    std::vector<Due> due;
    for (Entry& entry : queue_) {
      if (entry.when == top.when && mission::may_change_places(entry.rank) && is_delivery(entry))
        due.push_back({entry.when, entry.rank, &entry});
    }
    std::sort(due.begin(), due.end(), [](const Due& a, const Due& b) { return Later()(*b.entry, *a.entry); });
    const auto delivery = [&](std::size_t i) -> const mission::Delivery& {
      return std::get<mission::Delivery>(things_[due[i].entry->thing]);
    };
    std::vector<std::size_t> at;
    mission::due(
        due, [&](std::size_t i) { return due[i].entry->actor; },
        [&](std::size_t i) { return has_effect_(delivery(i)); }, at);
    if (at.empty()) return;
    std::vector<const mission::Delivery*> asked;
    for (const std::size_t i : at) asked.push_back(&delivery(i));
    Entry* const chosen = due[at[decide_(++orders_, asked)]].entry;
    // It takes the place of what is in front; those of that rank move one back.
    if (chosen == &queue_.front()) return;
    std::vector<Entry*> line{chosen};
    std::vector<std::uint64_t> orders;
    for (const Due& one : due) {
      if (one.entry != chosen && one.rank == top.rank) line.push_back(one.entry);
    }
    chosen->rank = top.rank;
    for (const Entry* entry : line) orders.push_back(entry->order);
    std::sort(orders.begin(), orders.end());
    for (std::size_t i = 0; i < line.size(); ++i) line[i]->order = orders[i];
    std::make_heap(queue_.begin(), queue_.end(), Later());
  }

  // Takes in commands and waits until the next task may be executed. False: the run has been stopped.
  bool attend() {
    std::unique_lock lock(pace_mutex_);
    for (;;) {
      waiting_ = false;
      if (stopped_) return false;
      if (catching_up_) {
        if (!queue_.empty() && queue_.front().when <= catch_up_until_) return true;
        lock.unlock();
        caught_up_();
        lock.lock();
        catching_up_ = false;
        anchor_run_ = now();
        anchor_wall_ = SteadyClock::now();
        continue;
      }
      for (auto& [to, what] : inbox_) {
        commands_until_ = command_time();
        if (const auto* delivery = std::get_if<mission::Delivery>(&what); delivery != nullptr && chronicle_ != nullptr)
          chronicle_->entered({commands_until_, order_}, *delivery);
        push(to, commands_until_, mission::Rank::kInjection, std::move(what));
      }
      inbox_.clear();
      if (error_) return true;
      const TimePoint next = queue_.empty() ? kNever : queue_.front().when;
      const bool goes_on = begun_ && next == now();
      const bool commanded =
          !queue_.empty() && queue_.front().rank == mission::Rank::kInjection && next <= commands_until_;
      if (goes_on || commanded) return true;
      if (!pace_.paused) {
        standing_ = false;
        if (pace_.factor <= 0 || queue_.empty()) {
          attention_ = false;
          return true;
        }
        const SteadyClock::time_point present = SteadyClock::now();
        if (present - wall(next) > kLagMax) {
          behind_ += present - wall(next);
          anchor_run_ = next;
          anchor_wall_ = present;
          if (told_behind_) {
            lock.unlock();
            told_behind_(behind_);
            lock.lock();
            continue;
          }
        }
        if (present >= wall(next)) return true;
        waiting_ = true;
        ceiling_ = next;
        changed_.wait_until(lock, wall(next));
      } else {
        waiting_ = true;
        ceiling_ = next;
        if (!std::exchange(standing_, true) && told_standing_) {
          lock.unlock();
          told_standing_();
          lock.lock();
        } else {
          changed_.wait(lock);
        }
      }
    }
  }

  // With the pace's lock held, from here to `wall`.

  // When a command happens that is taken in now: it must be the first thing at its instant.
  TimePoint command_time() const {
    const TimePoint earliest = begun_ ? now() + Duration(1) : now();
    const TimePoint latest = queue_.empty() ? kNever : queue_.front().when;
    return std::max(earliest, std::min(passed(), latest));
  }

  // Where the wall clock is in run time.
  TimePoint passed() const {
    if (pace_.paused || pace_.factor <= 0 || !running_) return std::max(now(), anchor_run_);
    const double ns = static_cast<double>((SteadyClock::now() - anchor_wall_).count()) * pace_.factor;
    return std::max(now(), add_saturating(anchor_run_, from_seconds(ns * 1e-9)));
  }
  TimePoint shown() const { return waiting_ ? std::max(now(), std::min(passed(), ceiling_)) : now(); }

  SteadyClock::time_point wall(TimePoint when) const {
    const double ns = static_cast<double>((when - anchor_run_).count()) / pace_.factor;
    constexpr double kFarNs = 1e18;  // more than 30 years
    return anchor_wall_ + Duration(static_cast<std::int64_t>(std::clamp(ns, -kFarNs, kFarNs)));
  }

  using Thing = std::variant<Task, mission::Delivery>;
  struct Entry {
    TimePoint when;
    mission::Rank rank;
    std::uint64_t order;
    ActorId actor;
    std::uint32_t thing;  // its place in `things_`: what is sorted is small
  };
  static_assert(std::is_trivially_copyable_v<Entry>);
  bool is_delivery(const Entry& entry) const { return std::holds_alternative<mission::Delivery>(things_[entry.thing]); }
  std::uint32_t put(Thing&& what) {
    if (free_.empty()) {
      things_.push_back(std::move(what));
      return static_cast<std::uint32_t>(things_.size() - 1);
    }
    const std::uint32_t place = free_.back();
    free_.pop_back();
    things_[place] = std::move(what);
    return place;
  }
  struct Later {
    bool operator()(const Entry& a, const Entry& b) const {
      if (a.when != b.when) return a.when > b.when;
      if (a.rank != b.rank) return a.rank > b.rank;
      return a.order > b.order;
    }
  };

  void push(ActorId to, TimePoint when, mission::Rank rank, Thing&& what) {
    if (queue_.size() >= kQueueMax) {
      error_ = fmt::format("more than {} messages are waiting; the last one was for {}", kQueueMax, names_[to]);
      return;
    }
    queue_.push_back({when, rank, order_++, to, put(std::move(what))});
    std::push_heap(queue_.begin(), queue_.end(), Later());
  }

  std::atomic<TimePoint> now_ = TimePoint{};  // written by the thread that works only
  bool begun_ = false;                        // more than injections has happened now
  std::uint64_t order_ = 0;
  std::uint64_t orders_ = 0;    // instants at which an order was decided
  std::uint64_t executed_ = 0;  // the order of what is executed
  std::function<std::size_t(std::uint64_t, std::span<const mission::Delivery* const>)> decide_;
  std::function<bool(const mission::Delivery&)> has_effect_;
  std::atomic<bool> stopped_ = false;  // an interrupt comes from another thread
  std::optional<std::string> error_;
  std::vector<std::string> names_;
  LeavableThread thread_;
  std::atomic<std::thread::id> worker_;
  std::mutex abandoned_mutex_;
  std::string abandoned_;
  std::optional<std::string> result_;
  std::vector<Entry> queue_;         // a heap
  std::vector<Thing> things_;        // what waits
  std::vector<std::uint32_t> free_;  // places among them

  std::atomic<bool> attention_ = false;  // there is a pace to keep or a command to take in
  mutable std::mutex pace_mutex_;
  std::condition_variable changed_;
  Pace pace_;
  std::vector<std::pair<ActorId, std::variant<Task, mission::Delivery>>> inbox_;
  TimePoint commands_until_ = TimePoint::min();  // what was commanded goes on even if time stands
  Chronicle* chronicle_ = nullptr;
  bool catching_up_ = false;
  TimePoint catch_up_until_{};
  std::function<void()> caught_up_;
  bool running_ = false;
  bool waiting_ = false;   // between two instants
  bool standing_ = false;  // and told so
  TimePoint ceiling_{};    // the next instant, while it waits
  TimePoint anchor_run_{};
  SteadyClock::time_point anchor_wall_{};
  std::function<void()> told_standing_;
  std::function<void(Duration)> told_behind_;
  Duration behind_{};
};

}  // namespace

std::unique_ptr<Scheduler> make_virtual_scheduler() { return std::make_unique<VirtualScheduler>(); }

}  // namespace sentree::runtime
