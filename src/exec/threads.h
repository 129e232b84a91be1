#pragma once

#include <cstddef>
#include <memory>

namespace sentree::exec {

class Job;

/// The threads in which threaded actions do their work; shared by the nodes that are given it.
///
/// At most `max` work at a time; further jobs wait, their leaves being RUNNING. Threads are made when they are needed.
/// With a `max` of 0 there are none: a job is done at once, within the tick that starts it. That makes every run the
/// same, and is meant for tests and for simulated time, where work takes no time.
///
/// Destroying it asks all jobs to stop and waits until they have. A job that does not heed its stop token is waited
/// for: a thread cannot be ended from outside.
class Threads {
 public:
  static constexpr std::size_t kDefaultMax = 8;
  /// Jobs that wait for a thread; one more fails the tick that starts it.
  static constexpr std::size_t kWaitingMax = 1'000;

  explicit Threads(std::size_t max = kDefaultMax);
  ~Threads();
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  /// Runs the job as soon as a thread is free. False: too many wait.
  [[nodiscard]] bool start(std::shared_ptr<Job> job);
  [[nodiscard]] std::size_t max() const;

 private:
  class Pool;
  std::unique_ptr<Pool> pool_;
};

}  // namespace sentree::exec
