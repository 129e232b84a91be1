#include "sentree/exec/threaded_action.h"

#include <exception>
#include <string_view>

#include "sentree/bt/thread_work.h"

namespace sentree::exec {

void Job::run() {
  // One that was halted before a thread was free has nothing to do.
  if (!stop_requested()) {
    try {
      status_ = work_(*this);
    } catch (const std::exception& thrown) {
      error_ = thrown.what();
    } catch (...) {
      error_ = "threw what is no std::exception";
    }
  }
  {
    const std::lock_guard lock(done_mutex_);
    done_.store(true, std::memory_order_release);
  }
  done_changed_.notify_all();
  if (finished_) finished_();
}

bool Job::sleep_for(Duration duration) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  return !wake.wait_for(lock, stop_token(), duration, [this] { return stop_requested(); });
}

bool Job::wait_until(std::chrono::steady_clock::time_point until) {
  std::unique_lock lock(done_mutex_);
  return done_changed_.wait_until(lock, until, [this] { return done(); });
}

bt::Status Job::finish(bt::Context& self) const {
  if (error_) {
    self.fail(*error_);
    return bt::Status::kFailure;
  }
  for (const auto& write : outputs_) {
    // Nobody asks for what a port without an entry gives: that is an error of `output` which fails nothing.
    if (!write(self) && self.failed()) return bt::Status::kFailure;
  }
  if (status_ == bt::Status::kRunning || status_ == bt::Status::kIdle) {
    self.fail("the work of a threaded action returned " + std::string(to_string(status_)) + ", which is no result");
  }
  return status_;
}

namespace {

/// A job that some state waits for. When the last of its copies is gone, nobody wants the result any more.
struct Wanted {
  explicit Wanted(std::shared_ptr<Job> wanted) : job(std::move(wanted)) {}
  ~Wanted() { job->request_stop(); }
  Wanted(const Wanted&) = delete;
  Wanted& operator=(const Wanted&) = delete;
  const std::shared_ptr<Job> job;
};

/// Which job a leaf works on, and which it was told to give up and has not yet.
class Jobs final : public bt::NodeMemory {
 public:
  std::shared_ptr<const Wanted> current;
  std::shared_ptr<Job> halting;

  /// The last run is over, so that the next may begin.
  bool is_free() {
    if (halting != nullptr && halting->done()) halting.reset();
    return halting == nullptr;
  }

  [[nodiscard]] std::unique_ptr<NodeMemory> clone() const override { return std::make_unique<Jobs>(*this); }
  [[nodiscard]] bool equals(const NodeMemory& other) const override {
    const auto* same = dynamic_cast<const Jobs*>(&other);
    return same != nullptr && same->current == current && same->halting == halting;
  }
  [[nodiscard]] std::optional<Value> save() const override {
    if (current != nullptr || (halting != nullptr && !halting->done())) return std::nullopt;
    return Value(true);
  }
  [[nodiscard]] bool restore(const Value& /*saved*/) override {
    current.reset();
    halting.reset();
    return true;
  }
};

class ThreadedAction final : public bt::Behaviour, public bt::ThreadWork {
 public:
  ThreadedAction(std::shared_ptr<Threads> threads, bt::Ports ports, Job::Work work)
      : threads_(std::move(threads)), ports_(std::move(ports)), work_(std::move(work)) {}

  [[nodiscard]] std::unique_ptr<bt::NodeMemory> make_memory() const override { return std::make_unique<Jobs>(); }

  [[nodiscard]] bt::Next tick(bt::Context& self, bt::NodeMemory* memory) const override {
    const bt::Status kept = self.status();
    if (bt::is_completed(kept)) return bt::Next::done(kept);  // until its parent resets it
    Jobs& jobs = *static_cast<Jobs*>(memory);
    if (jobs.current == nullptr) {
      if (!jobs.is_free()) return bt::Next::done(bt::Status::kRunning);
      jobs.current = std::make_shared<const Wanted>(make_job(self));
      if (!threads_->start(jobs.current->job)) {
        jobs.current.reset();
        self.fail("more than " + std::to_string(Threads::kWaitingMax) + " jobs wait for one of " +
                  std::to_string(threads_->max()) + " threads");
        return bt::Next::done(bt::Status::kFailure);
      }
      // However fast the thread is: what a tick returns does not depend on it more than it must.
      if (threads_->max() > 0) return bt::Next::done(bt::Status::kRunning);
    }
    const std::shared_ptr<Job> job = jobs.current->job;
    if (!job->done()) return bt::Next::done(bt::Status::kRunning);
    jobs.current.reset();
    return bt::Next::done(job->finish(self));
  }

  [[nodiscard]] std::string_view unsaved() const override {
    return "its work is in a thread: save when it is not running, or make it a class with on_start(), on_running(), "
           "save() and restore()";
  }
  void halted(bt::Context& /*self*/, bt::NodeMemory* memory) const override {
    Jobs& jobs = *static_cast<Jobs*>(memory);
    if (jobs.current == nullptr) return;
    jobs.halting = jobs.current->job;
    jobs.halting->request_stop();
    jobs.current.reset();
  }

  [[nodiscard]] bool works_in_threads() const override { return threads_->max() > 0; }
  [[nodiscard]] bool wait(const bt::NodeMemory& memory, std::chrono::steady_clock::time_point until) const override {
    const Jobs& jobs = static_cast<const Jobs&>(memory);
    const std::shared_ptr<Job> job = jobs.current != nullptr ? jobs.current->job : jobs.halting;
    return job == nullptr || job->wait_until(until);
  }

 private:
  [[nodiscard]] std::shared_ptr<Job> make_job(bt::Context& self) const {
    std::map<std::string, bt::Datum, std::less<>> inputs;
    for (const bt::PortInfo& port : ports_) {
      if (port.direction == bt::PortDirection::kOutput) continue;
      if (const bt::Datum* held = self.held(port.name)) inputs.emplace(port.name, *held);
    }
    return std::make_shared<Job>(self.path(), work_, std::move(inputs), self.waker());
  }

  std::shared_ptr<Threads> threads_;
  bt::Ports ports_;
  Job::Work work_;
};

}  // namespace

void threaded_action(bt::Registry& registry, std::shared_ptr<Threads> threads, std::string id, bt::Ports ports,
                     Job::Work work) {
  bt::Registry::Entry entry;
  entry.id = std::move(id);
  entry.category = bt::Category::kAction;
  entry.ports = ports;
  entry.behaviour = std::make_shared<ThreadedAction>(std::move(threads), std::move(ports), std::move(work));
  registry.add(std::move(entry));
}

}  // namespace sentree::exec
