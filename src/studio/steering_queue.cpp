#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <string_view>

#include "sentree/studio/detail/steering_queue.h"

namespace sentree::studio {

namespace {

// These change when things happen, or only look: the run is not waited for.
constexpr std::string_view kPrompt[] = {"pause", "resume", "step", "factor", "interventions"};

}  // namespace

SteeringQueue::SteeringQueue(Steer steer, std::function<void(Outcome)> done)
    : steer_(std::move(steer)), done_(std::move(done)) {
  // Signals are for the program's own thread.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  for (Lane& lane : lanes_) lane.thread = std::thread([this, &lane] { work(lane); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

SteeringQueue::~SteeringQueue() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  for (Lane& lane : lanes_) lane.thread.join();
}

void SteeringQueue::put(Request request) {
  const bool is_prompt = std::find(std::begin(kPrompt), std::end(kPrompt), request.op) != std::end(kPrompt);
  const std::lock_guard lock(mutex_);
  lanes_[is_prompt ? 0 : 1].waiting.push_back(std::move(request));
  changed_.notify_all();
}

void SteeringQueue::forget(std::uint64_t client) {
  const std::lock_guard lock(mutex_);
  for (Lane& lane : lanes_) std::erase_if(lane.waiting, [&](const Request& one) { return one.client == client; });
}

void SteeringQueue::work(Lane& lane) {
  for (;;) {
    Request request;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stopping_ || !lane.waiting.empty(); });
      if (stopping_) return;
      request = std::move(lane.waiting.front());
      lane.waiting.pop_front();
    }
    done_({request.client, request.id, steer_(request.op, request.body)});
  }
}

}  // namespace sentree::studio
