#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree::studio {

/// Carries out what pages ask of a run, away from the thread that composes: a call of a component that hangs keeps no
/// page from its deltas. Requests that wait for the run come one after the other, in the order of all pages; those that
/// never wait (pause, resume, …) have a thread of their own, so a run can be paused meanwhile.
///
/// What waits is bounded by who asks: `kRequestsMax` of each of `kClientsMax` pages.
class SteeringQueue {
 public:
  using Steer = std::function<Result<Value>(const std::string& op, const Value& request)>;
  struct Request {
    std::uint64_t client = 0;
    std::int64_t id = 0;
    std::string op;
    Value body;
  };
  struct Outcome {
    std::uint64_t client = 0;
    std::int64_t id = 0;
    Result<Value> result;
  };
  /// @param done  Called in the queue's threads.
  SteeringQueue(Steer steer, std::function<void(Outcome)> done);
  /// Waits for what is being carried out; the rest is dropped.
  ~SteeringQueue();
  SteeringQueue(const SteeringQueue&) = delete;
  SteeringQueue& operator=(const SteeringQueue&) = delete;

  void put(Request request);
  /// What a page asked for and is still waiting is dropped.
  void forget(std::uint64_t client);

 private:
  struct Lane {
    std::deque<Request> waiting;
    std::thread thread;
  };
  void work(Lane& lane);

  const Steer steer_;
  const std::function<void(Outcome)> done_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::array<Lane, 2> lanes_;  // those that never wait; the others
};

}  // namespace sentree::studio
