#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "sentree/monitor/monitor_set.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/stream.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::runtime {

/// "<service>.<method>" of a request.
[[nodiscard]] std::string_view call_of(const Message& request);

/// "monitor.violated" and the like: what a run publishes of a decision.
[[nodiscard]] Message decision_message(const MonitorReport& report);

/// Those of the gaps that lie within what led to the decision.
[[nodiscard]] std::vector<Gap> gaps_within(const monitor::Decision& decision, const std::vector<Gap>& gaps);

/// Feeds the run's monitors with the stream and wakes them when time matters to them. A listener of the stream.
///
/// A monitor whose script does not end is given up. In real time a new thread goes on behind it, so that every other
/// monitor sees every message; in virtual time the run ends.
class Monitors : private monitor::MonitorSet::Listener {
 public:
  struct Replies {
    std::function<void(const MonitorReport&)> decided;
    std::function<void(const std::string& why)> given_up;
    /// Told, where `observe` is called, when a monitor has taken a step; may be empty.
    std::function<void(std::size_t index)> stepped = {};
  };

  Monitors(const project::Plan& plan, Scheduler& scheduler, Stream& stream, Watchdog& watchdog, Replies replies);

  void start();
  /// Instead of `start`: goes on from there.
  void recall(monitor::MonitorSet::Memory memory);
  /// Times of which nothing was observed; decisions say which of them matter.
  void note_gaps(std::vector<Gap> gaps) { gaps_ = std::move(gaps); }
  /// All that they remember, between two observations.
  [[nodiscard]] monitor::MonitorSet::Memory memory() const { return set_.memory(); }
  void observe(const Message& message);
  /// Whether observations of that name change anything here.
  [[nodiscard]] bool wants(const std::string& name);
  /// Something was observed that changes nothing here, but for the time.
  void pass(TimePoint now);
  /// Indices of those that the message observed last went to. Called where `observe` is.
  [[nodiscard]] std::span<const std::uint32_t> reached() const { return reached_; }
  /// Whether a monitor gates calls of this name, "<service>.<method>". From any thread.
  [[nodiscard]] bool is_gated(std::string_view call) const;
  /// Names of the calls that are gated, as the project writes them.
  [[nodiscard]] std::vector<std::string> gated() const;
  /// What the gates say of a request that is not yet sent. Called where `observe` is.
  [[nodiscard]] std::optional<mission::Veto> judge(const Message& request) const;
  /// After the run: what is still in the stream, then time passes until `end`; nothing more is decided.
  void finish(TimePoint end);
  [[nodiscard]] const std::vector<MonitorReport>& reports() const { return reports_; }
  /// Where a monitor stands, or null if it has been given up. Called where `observe` is.
  [[nodiscard]] const monitor::State* state(std::size_t index) const;
  /// Why the first monitor whose script did not end was given up.
  [[nodiscard]] std::optional<std::string> hung() const;

 private:
  struct Entry {
    std::shared_ptr<Watched> watched;
    std::atomic<bool> given_up = false;
    std::string why;  // written before given_up
  };

  /// Outside the stream's actor: repeats `work`, which knows how far it came, until it is done.
  void on_own_thread(const std::function<void()>& work);
  // monitor::MonitorSet::Listener
  scxml::ExecutionWatch* watch(std::size_t index) override { return &watched(index); }
  bool is_given_up(std::size_t index) override { return entries_[index].given_up; }
  void stepped(std::size_t index, monitor::Decisions decisions) override;

  /// Makes the monitor the next thing that this thread steps.
  scxml::ExecutionWatch& watched(std::size_t index) const;
  void give_up(std::size_t index, const SourceSpan& script);
  void tell_given_up();
  void go_on();
  void count_veto(const Message& error);
  void advance(TimePoint now);
  void schedule();

  // Own copies: a thread that was left behind may use them until the process ends.
  const std::vector<project::GatePlan> gates_;
  monitor::MonitorSet set_;
  const bool keeps_;                        // observations, for witnesses
  std::span<const std::uint32_t> reached_;  // of the message observed last
  Scheduler& scheduler_;
  Stream& stream_;
  Watchdog& watchdog_;
  Replies replies_;
  std::vector<MonitorReport> reports_;
  std::vector<Gap> gaps_;
  std::deque<Entry> entries_;
  TimePoint wake_ = kNever;
  std::optional<TimePoint> advancing_to_;  // what a thread that was left behind had begun
  mutable std::mutex own_mutex_;
  LeavableThread* own_thread_ = nullptr;
};

}  // namespace sentree::runtime
