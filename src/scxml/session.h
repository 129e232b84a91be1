#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/copy_on_write.h"
#include "sentree/base/result.h"
#include "sentree/base/rng.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/state_set.h"

namespace sentree::scxml {

/// Events waiting, first in, first out.
class EventQueue {
 public:
  [[nodiscard]] bool empty() const { return head_ == events_.size(); }
  [[nodiscard]] std::size_t size() const { return events_.size() - head_; }
  void push(Event event) { events_.push_back(std::move(event)); }
  [[nodiscard]] Event pop() {
    Event event = std::move(events_[head_++]);
    if (head_ == events_.size()) clear();
    return event;
  }
  void clear() {
    events_.clear();
    head_ = 0;
  }
  /// Drops what came from the invocation of that id.
  void drop_from(std::string_view invokeid) {
    events_.erase(events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(head_));
    head_ = 0;
    std::erase_if(events_, [&](const Event& event) { return event.invokeid == invokeid; });
  }
  [[nodiscard]] auto begin() const { return events_.begin() + static_cast<std::ptrdiff_t>(head_); }
  [[nodiscard]] auto end() const { return events_.end(); }
  friend bool operator==(const EventQueue& a, const EventQueue& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

 private:
  std::vector<Event> events_;
  std::size_t head_ = 0;
};

/// For `archive`: the events.
[[nodiscard]] inline std::vector<Event> archived(const EventQueue& queue) { return {queue.begin(), queue.end()}; }
inline void unarchive(std::vector<Event>&& events, EventQueue& queue) {
  queue.clear();
  for (Event& event : events) queue.push(std::move(event));
}

/// A delayed <send>. It holds the event as it was evaluated when the <send> was executed (SCXML 6.2.4).
struct Timer {
  TimePoint due{};
  std::uint64_t sequence = 0;  ///< Breaks ties: sent earlier, delivered earlier.
  Event event;
  std::string target;  ///< Empty: this session.
  std::string type;    ///< Empty: the SCXML processor.
  bool is_content = false;
  Duration delay{};
  Place place;
  friend bool operator==(const Timer&, const Timer&) = default;
};

/// Delayed sends by due time, then in the order sent.
class TimerQueue {
 public:
  [[nodiscard]] bool empty() const { return head_ == timers_.size(); }
  [[nodiscard]] std::size_t size() const { return timers_.size() - head_; }
  [[nodiscard]] const Timer& front() const { return timers_[head_]; }
  [[nodiscard]] auto begin() const { return timers_.begin() + static_cast<std::ptrdiff_t>(head_); }
  [[nodiscard]] auto end() const { return timers_.end(); }
  void insert(Timer timer) {
    // Taken ones are dropped when they are half of all, so that taking costs no more than a move.
    if (head_ > 0 && head_ * 2 >= timers_.size()) {
      timers_.erase(timers_.begin(), timers_.begin() + static_cast<std::ptrdiff_t>(head_));
      head_ = 0;
    }
    const auto earlier = [](const Timer& a, const Timer& b) {
      return a.due != b.due ? a.due < b.due : a.sequence < b.sequence;
    };
    timers_.insert(
        std::upper_bound(timers_.begin() + static_cast<std::ptrdiff_t>(head_), timers_.end(), timer, earlier),
        std::move(timer));
  }
  [[nodiscard]] Timer pop() {
    Timer timer = std::move(timers_[head_++]);
    if (empty()) clear();
    return timer;
  }
  void cancel(std::string_view sendid) {
    timers_.erase(std::remove_if(timers_.begin() + static_cast<std::ptrdiff_t>(head_), timers_.end(),
                                 [&](const Timer& timer) { return timer.event.sendid == sendid; }),
                  timers_.end());
    if (empty()) clear();
  }
  void clear() {
    timers_.clear();
    head_ = 0;
  }
  friend bool operator==(const TimerQueue& a, const TimerQueue& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

 private:
  std::vector<Timer> timers_;
  std::size_t head_ = 0;
};

/// For `archive`: the timers.
[[nodiscard]] inline std::vector<Timer> archived(const TimerQueue& queue) { return {queue.begin(), queue.end()}; }
inline void unarchive(std::vector<Timer>&& timers, TimerQueue& queue) {
  queue.clear();
  for (Timer& timer : timers) queue.insert(std::move(timer));
}

class Session;

/// The session of an invoked chart, or none. A copy is a copy of the session.
class ChildSession {
 public:
  ChildSession();
  /// A new session, not yet started.
  explicit ChildSession(Chart chart);
  ChildSession(const ChildSession& other);
  ChildSession(ChildSession&&) noexcept;
  ChildSession& operator=(const ChildSession& other);
  ChildSession& operator=(ChildSession&&) noexcept;
  ~ChildSession();

  explicit operator bool() const { return session_ != nullptr; }
  [[nodiscard]] Session* get() const { return session_.get(); }
  [[nodiscard]] Session& operator*() const { return *session_; }
  [[nodiscard]] Session* operator->() const { return session_.get(); }
  /// Whose session it is; only if there is one.
  [[nodiscard]] const Chart& chart() const { return *chart_; }

  /// Of the sessions; those know which chart they belong to.
  friend bool operator==(const ChildSession& a, const ChildSession& b);

 private:
  std::optional<Chart> chart_;
  std::unique_ptr<Session> session_;
};

/// A running <invoke>.
struct Invocation {
  std::string id;
  StateIndex state = 0;
  std::uint32_t invoke = 0;  ///< Index among the model's invokes.
  ChildSession child = {};   ///< None: a service that the host runs.
  friend bool operator==(const Invocation&, const Invocation&) = default;
};

enum class SessionStatus : std::uint8_t {
  kNew,       ///< Not started.
  kRunning,   ///< In a stable configuration between steps.
  kFinished,  ///< In a top-level <final>.
  kCancelled,
  kFailed,  ///< A bound was exceeded; see `Session::failure`.
};
[[nodiscard]] std::string_view to_string(SessionStatus status);

/// What a session needs at its start beside the chart.
struct StartOptions {
  Map data = {};                       ///< Replaces the values of top-level <data> of the same ids (SCXML 6.4).
  std::string session_id = "session";  ///< `_sessionid`; children's ids are derived from it.
  std::uint64_t seed = 1;              ///< Of Math.random.
};

class ScriptHeap;

struct SessionIdentity {
  std::string id;        ///< `_sessionid`
  std::string parent;    ///< Of a child: the _sessionid of its parent.
  std::string invokeid;  ///< Of a child: by which its parent knows it.
  friend bool operator==(const SessionIdentity&, const SessionIdentity&) = default;
};

/// Which JavaScript heap holds a session's data. A disposable cache and no part of the session's value, but for data
/// without a Value form: those live in the heap only, and a copy lacks them.
struct HeapLink {
  std::uint64_t tag = 0;  ///< Of the heap's content; 0: none.
  std::shared_ptr<ScriptHeap> pinned;
  bool data_lost = false;
  CopyOnWrite<std::optional<Diagnostic>> unsaveable;

  HeapLink() = default;
  HeapLink(const HeapLink& other)
      : tag(other.pinned ? 0 : other.tag), data_lost(other.data_lost || other.pinned), unsaveable(other.unsaveable) {}
  HeapLink(HeapLink&&) noexcept = default;
  HeapLink& operator=(const HeapLink& other) {
    if (this != &other) *this = HeapLink(other);
    return *this;
  }
  HeapLink& operator=(HeapLink&&) noexcept = default;
  ~HeapLink() = default;
  friend bool operator==(const HeapLink&, const HeapLink&) { return true; }
};

/// The state of one chart's execution, as a value: it can be copied, compared, hashed, saved and restored at any
/// stable configuration. Made by `start`, changed by the step functions (step.h) only.
///
/// A session is bound to the chart it was started with. One thread at a time.
/// Memory: below 2 KiB for small charts without data. Cost of a copy: tens of nanoseconds; what is large is shared
/// until one of the two changes it.
class Session {
 public:
  [[nodiscard]] SessionStatus status() const { return status_; }
  [[nodiscard]] bool running() const { return status_ == SessionStatus::kRunning; }
  /// Why the session failed (kFailed).
  [[nodiscard]] const std::optional<Diagnostic>& failure() const { return *failure_; }
  [[nodiscard]] const std::string& id() const { return identity_->id; }

  /// The active states, ancestors included; the root is not among them.
  [[nodiscard]] const StateSet& configuration() const { return configuration_; }
  [[nodiscard]] bool is_active(StateIndex state) const {
    return state / 64 < configuration_.words() && configuration_.contains(state);
  }
  /// Ids of the active states in document order; states without id are left out.
  [[nodiscard]] std::vector<std::string> active_ids(const Chart& chart) const;

  /// All data as a map in document order, then what scripts added. What scripts see as undefined is left out.
  [[nodiscard]] Map data(const Chart& chart) const;
  /// The same without a copy: `visit(name, value)` for each.
  void visit_data(const Chart& chart, const std::function<void(const std::string&, const Value&)>& visit) const;

  /// Due time of the earliest delayed send, children's included; kNever: none;
  /// TimePoint::min(): the session wants to go on at once (see Host::yield_after_send).
  [[nodiscard]] TimePoint next_timer() const;
  [[nodiscard]] const TimerQueue& timers() const { return *timers_; }
  [[nodiscard]] const std::vector<Invocation>& invocations() const { return invocations_; }

  /// Why the session cannot be copied or saved faithfully (a script keeps a function or a cycle in its data); nothing:
  /// it can. A copy of such a session lacks that data and is refused by the step functions.
  [[nodiscard]] std::optional<Diagnostic> unsaveable() const;

  friend bool operator==(const Session&, const Session&) = default;
  [[nodiscard]] std::uint64_t hash() const;

 private:
  friend class Interpreter;
  friend class EcmaScriptModel;
  friend struct SessionAccess;
  friend struct SessionMembers;
  friend struct SessionSnapshot;
  friend class SessionEncoder;
  friend class PlainStep;
  friend void give_up(Session& session, Diagnostic why);
  friend void reset_session(const Chart& chart, Session& session, std::string id, std::uint64_t seed);

  using HistoryValues = std::vector<std::pair<StateIndex, std::vector<StateIndex>>>;

  // The members but the invocations are listed once more, in detail/session_members.h: archives and encodings follow
  // from there.
  std::uint64_t fingerprint_ = 0;  // of the chart
  SessionStatus status_ = SessionStatus::kNew;
  bool scripts_run_ = false;  // the chart's own scripts have been executed
  CopyOnWrite<SessionIdentity> identity_;
  StateSet configuration_;
  CopyOnWrite<StateSet> initialized_;  // late binding: states whose data have been bound
  CopyOnWrite<HistoryValues> history_;
  EventQueue internal_;  // empty in a stable configuration
  EventQueue external_;  // empty between steps
  CopyOnWrite<TimerQueue> timers_;
  std::vector<Invocation> invocations_;
  CopyOnWrite<std::vector<std::optional<Value>>> variables_;  // of <data>, by slot; nothing: undefined
  CopyOnWrite<Map> globals_;                                  // what scripts added
  std::uint64_t sequence_ = 0;                                // of timers
  std::uint64_t ids_ = 0;                                     // made-up sendids and invokeids
  Rng rng_{1};
  CopyOnWrite<std::optional<Diagnostic>> failure_;
  CopyOnWrite<std::optional<Value>> done_data_;
  HeapLink heap_;
};

/// The whole session as a value (JSON can hold it): configuration, history, queues, timers, invocations, data. Of one
/// that belongs to no chart yet: null.
/// Error: scxml.no-value-form if a script keeps a function or a cycle in its data.
[[nodiscard]] Result<Value> save(const Chart& chart, const Session& session);

/// A session that goes on exactly as the saved one. Errors: scxml.bad-snapshot, scxml.other-chart.
[[nodiscard]] Result<Session> restore(const Chart& chart, const Value& saved, const LoadOptions& options = {});

}  // namespace sentree::scxml
