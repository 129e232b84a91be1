#include "sentree/exec/threads.h"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "sentree/exec/threaded_action.h"

namespace sentree::exec {

class Threads::Pool {
 public:
  explicit Pool(std::size_t max) : max_(max) {}
  ~Pool() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
      for (const auto& job : waiting_) job->request_stop();
      for (const auto& job : running_) job->request_stop();
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  bool start(std::shared_ptr<Job> job) {
    if (max_ == 0) {
      job->run();
      return true;
    }
    {
      const std::lock_guard lock(mutex_);
      if (waiting_.size() >= kWaitingMax) return false;
      waiting_.push_back(std::move(job));
      if (idle_ < waiting_.size() && threads_.size() < max_) threads_.emplace_back([this] { work(); });
    }
    wake_.notify_one();
    return true;
  }

  [[nodiscard]] std::size_t max() const { return max_; }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      ++idle_;
      wake_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
      --idle_;
      // What waits is begun even then: a job that is asked to stop says so, and nobody waits for it in vain.
      if (waiting_.empty()) return;
      const std::shared_ptr<Job> job = std::move(waiting_.front());
      waiting_.pop_front();
      running_.insert(job);
      lock.unlock();
      job->run();
      lock.lock();
      running_.erase(job);
    }
  }

  const std::size_t max_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::shared_ptr<Job>> waiting_;
  std::set<std::shared_ptr<Job>> running_;
  std::size_t idle_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

Threads::Threads(std::size_t max) : pool_(std::make_unique<Pool>(max)) {}
Threads::~Threads() = default;
bool Threads::start(std::shared_ptr<Job> job) { return pool_->start(std::move(job)); }
std::size_t Threads::max() const { return pool_->max(); }

}  // namespace sentree::exec
