#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/bt/registry.h"
#include "sentree/exec/threads.h"

namespace sentree::exec {

/// One run of a threaded action, as the function that does the work sees it, in its own thread.
///
/// Inputs are those at the tick that started it; outputs are written by the tick that returns its status. So the work
/// touches neither the tree nor its blackboard.
class Job {
 public:
  using Work = std::function<bt::Status(Job&)>;

  Job(std::string path, Work work, std::map<std::string, bt::Datum, std::less<>> inputs, std::function<void()> finished)
      : path_(std::move(path)), work_(std::move(work)), inputs_(std::move(inputs)), finished_(std::move(finished)) {}
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  /// Path of the node, for messages.
  [[nodiscard]] const std::string& path() const { return path_; }

  /// The value of a port when the action was started. Errors: exec.no-input (no such port, or nothing in it),
  /// exec.conversion.
  template <class T>
  [[nodiscard]] Result<T> input(std::string_view port) const;
  template <class T>
  [[nodiscard]] T input_or(std::string_view port, T otherwise) const {
    auto read = input<T>(port);
    return read ? std::move(*read) : std::move(otherwise);
  }
  /// Kept until the tick that returns the status; dropped if the action is halted before.
  template <class T>
  void output(std::string port, T value) {
    if constexpr (bt::detail::kIsText<T>) {
      return output(std::move(port), std::string(std::string_view(value)));  // what it points to may be gone by then
    }
    outputs_.push_back([port = std::move(port), value = std::move(value)](bt::Context& self) {
      return self.output<T>(port, value).has_value();
    });
  }

  /// The action was halted, or the program ends: come to an end soon. What is returned then counts for nothing.
  [[nodiscard]] bool stop_requested() const { return stop_.stop_requested(); }
  [[nodiscard]] std::stop_token stop_token() const { return stop_.get_token(); }
  /// Sleeps that long, in wall time, or until the job is asked to stop. False: it was.
  bool sleep_for(Duration duration);

  /// Gives the tick up with that message, as an exception of the work does. Return any status afterwards.
  void fail(std::string message) { error_ = std::move(message); }

  // --- For the node and the threads ---------------------------------------------------------------------------------

  void request_stop() { stop_.request_stop(); }
  /// Does the work, in this thread.
  void run();
  /// The work is over; status, outputs and error can be read.
  [[nodiscard]] bool done() const { return done_.load(std::memory_order_acquire); }
  /// Waits until it is over, at most until then. False: it is not.
  [[nodiscard]] bool wait_until(std::chrono::steady_clock::time_point until);
  /// Only when done: writes the outputs, or fails the tick.
  [[nodiscard]] bt::Status finish(bt::Context& self) const;

 private:
  std::string path_;
  Work work_;
  std::map<std::string, bt::Datum, std::less<>> inputs_;
  std::function<void()> finished_;
  std::stop_source stop_;
  std::vector<std::function<bool(bt::Context&)>> outputs_;
  bt::Status status_ = bt::Status::kIdle;
  std::optional<std::string> error_;
  std::atomic<bool> done_ = false;
  std::mutex done_mutex_;
  std::condition_variable done_changed_;
};

/// Registers an action whose work is done in a thread (BehaviorTree.CPP's ThreadedAction), so that the tree goes on.
///
///     auto threads = std::make_shared<exec::Threads>(4);
///     exec::threaded_action(registry, threads, "Plan", {bt::input<Pose>("goal"), bt::output<Path>("path")},
///                           [](exec::Job& job) {
///       for (Planner planner(*job.input<Pose>("goal")); !planner.done(); planner.improve())
///         if (job.stop_requested()) return bt::Status::kFailure;
///       …
///       return bt::Status::kSuccess;
///     });
///
/// The leaf is RUNNING until the work is over; that wakes the tree, if whoever ticks it gave a waker. Halting asks the
/// job to stop and never waits; a leaf ticked again before it did is RUNNING and starts anew when it has. An exception
/// fails the tick with its text. SUCCESS, FAILURE and SKIPPED may be returned.
///
/// The job itself is no value: a copy of the state shares it (both get its result, and halting one stops it for both),
/// and a state in which one works cannot be saved (bt.unsavable). Simulated time passes no faster than the clock while
/// it works, where whoever ticks the tree sees to that (`sentree run` does, see bt::wait_for_threads): a job that takes
/// less than a period gives its result at the next tick, a longer one at a tick that depends on the machine. With a
/// `threads` that has no thread at all it is done within the tick that starts it.
void threaded_action(bt::Registry& registry, std::shared_ptr<Threads> threads, std::string id, bt::Ports ports,
                     Job::Work work);

template <class T>
Result<T> Job::input(std::string_view port) const {
  const auto found = inputs_.find(port);
  if (found == inputs_.end() || found->second.empty()) {
    return sentree::fail("exec.no-input", "node \"" + path_ + "\" has no value for port \"" + std::string(port) + "\"");
  }
  const bt::Datum& datum = found->second;
  if constexpr (bt::Convertible<T>) {
    if (auto value = bt::Convert<T>::from_value(datum.value)) return std::move(*value);
    if constexpr (bt::TextConvertible<T>) {
      if (datum.value.as_string() != nullptr) {
        if (auto value = bt::Convert<T>::from_text(datum.value.text())) return std::move(*value);
      }
    }
  } else {
    if (const auto* boxed = dynamic_cast<const bt::Boxed<T>*>(datum.object.get())) return boxed->content();
  }
  return sentree::fail("exec.conversion", "node \"" + path_ + "\": the value of port \"" + std::string(port) +
                                              "\" is no " + bt::type_of<T>().name);
}

}  // namespace sentree::exec
