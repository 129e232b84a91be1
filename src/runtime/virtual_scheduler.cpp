#include <atomic>
#include <mutex>
#include <queue>
#include <vector>

#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::runtime {

namespace {

class VirtualScheduler final : public Scheduler {
 public:
  TimePoint now() const override { return now_; }
  bool is_virtual() const override { return true; }

  ActorId add_actor(std::string name) override {
    names_.push_back(std::move(name));
    return names_.size() - 1;
  }

  void post(ActorId to, Task task) override { push(to, now_, Rank::kMessage, std::move(task)); }
  void at(ActorId to, TimePoint when, Rank rank, Task task) override {
    push(to, std::max(when, now_), rank, std::move(task));
  }

  // In a thread of its own, so that the caller comes back even from a script that does not.
  std::optional<std::string> run() override {
    if (thread_.run([this] { result_ = work(); })) return result_;
    const std::lock_guard lock(abandoned_mutex_);
    return abandoned_;
  }

  void stop() override { stopped_ = true; }

  void abandon(ActorId, std::string why) override {
    {
      const std::lock_guard lock(abandoned_mutex_);
      abandoned_ = std::move(why);
    }
    thread_.leave();
  }

 private:
  std::optional<std::string> work() {
    std::size_t tasks_now = 0;
    while (!stopped_) {
      if (error_) return error_;
      if (queue_.empty()) return "nothing is left to do, and nobody ended the run";
      // The top is only read through a const reference; its task is moved out right before it is popped.
      auto& top = const_cast<Entry&>(queue_.top());
      if (top.when > now_) {
        now_ = top.when;
        tasks_now = 0;
      } else if (++tasks_now > kTasksPerInstantMax) {
        return names_[top.actor] + " has been sent more than " + std::to_string(kTasksPerInstantMax) +
               " messages without time passing; two parts answer each other for ever";
      }
      const Task task = std::move(top.task);
      queue_.pop();
      task();
    }
    return error_;
  }

  struct Entry {
    TimePoint when;
    Rank rank;
    std::uint64_t order;
    ActorId actor;
    Task task;
  };
  struct Later {
    bool operator()(const Entry& a, const Entry& b) const {
      if (a.when != b.when) return a.when > b.when;
      if (a.rank != b.rank) return a.rank > b.rank;
      return a.order > b.order;
    }
  };

  void push(ActorId to, TimePoint when, Rank rank, Task task) {
    if (queue_.size() >= kQueueMax) {
      error_ = "more than " + std::to_string(kQueueMax) + " messages are waiting; the last one was for " + names_[to];
      return;
    }
    queue_.push({when, rank, order_++, to, std::move(task)});
  }

  TimePoint now_{};
  std::uint64_t order_ = 0;
  std::atomic<bool> stopped_ = false;  // an interrupt comes from another thread
  std::optional<std::string> error_;
  std::vector<std::string> names_;
  LeavableThread thread_;
  std::mutex abandoned_mutex_;
  std::string abandoned_;
  std::optional<std::string> result_;
  std::priority_queue<Entry, std::vector<Entry>, Later> queue_;
};

}  // namespace

std::unique_ptr<Scheduler> make_virtual_scheduler() { return std::make_unique<VirtualScheduler>(); }

}  // namespace sentree::runtime
