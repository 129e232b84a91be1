#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/base/present.h"
#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/event.h"

namespace sentree::scxml {

/// A <send> that leaves the session.
struct OutgoingSend {
  std::string session;  ///< The sender's _sessionid.
  std::string type;     ///< As written, e.g. "thrift"; the SCXML processor's URI for another session.
  std::string target;   ///< As written.
  std::string event;
  std::string sendid;         ///< Never empty: made up if the document gives none.
  std::optional<Value> data;  ///< Params and namelist as a Map, or the content. Nothing: none was written.
  bool is_content = false;    ///< `data` is <content>.
  Duration delay{};           ///< As written; over when it appears among the effects.
  SourceSpan span;

  friend bool operator==(const OutgoingSend&, const OutgoingSend&) = default;
};

struct LogLine {
  std::string label;
  std::string text;  ///< The value of expr: strings as they are, objects as JSON. Empty without expr.
  SourceSpan span;
  friend bool operator==(const LogLine&, const LogLine&) = default;
};

/// The session reached a top-level <final>, or was cancelled (`final_id` is empty then).
struct Done {
  std::string final_id;
  std::optional<Value> donedata;
  friend bool operator==(const Done&, const Done&) = default;
};

/// An <invoke> of a type that the host offers (not SCXML: such children live inside the session).
struct StartInvoke {
  std::string session;
  std::string invokeid;
  std::string type;
  std::string src;
  std::optional<Value> content;
  Map params;
  SourceSpan span;
  friend bool operator==(const StartInvoke&, const StartInvoke&) = default;
};
struct CancelInvoke {
  std::string session;
  std::string invokeid;
  friend bool operator==(const CancelInvoke&, const CancelInvoke&) = default;
};
/// An event for a service that `StartInvoke` started: <send> to #_invokeid, or autoforward.
struct InvokeEvent {
  std::string session;
  std::string invokeid;
  Event event;
  friend bool operator==(const InvokeEvent&, const InvokeEvent&) = default;
};

using Effect = std::variant<OutgoingSend, LogLine, Done, StartInvoke, CancelInvoke, InvokeEvent>;

/// What a step wants done, in this order. The caller clears it.
using Effects = std::vector<Effect>;

/// Sees what a step does, in the order in which it happens. `session` is the _sessionid, so that children can be told
/// apart.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void event(const Chart& /*chart*/, std::string_view /*session*/, const Event& /*event*/) {}
  virtual void transition(const Chart& /*chart*/, std::string_view /*session*/, TransitionIndex /*taken*/) {}
  virtual void exited(const Chart& /*chart*/, std::string_view /*session*/, StateIndex /*state*/) {}
  virtual void entered(const Chart& /*chart*/, std::string_view /*session*/, StateIndex /*state*/) {}
  /// An error event (SCXML 3.12.2) for which the session has no transition now. `why` has the place of what failed.
  virtual void unhandled(const Chart& /*chart*/, std::string_view /*session*/, const Diagnostic& /*why*/) {}
  /// The end of a macrostep.
  virtual void stable(const Chart& /*chart*/, std::string_view /*session*/) {}
};

/// Between a thread that steps sessions and a watchdog in another one: an endless script cannot be stopped from inside,
/// so its thread is given up together with all that it works on.
///
/// The thread that steps is in a step or not, and inside a step it is in an evaluation or not. `give_up` succeeds in an
/// evaluation only; should that evaluation end all the same, its thread waits there for ever and touches nothing more.
/// Lock-free; one stepping thread at a time.
class ExecutionWatch {
 public:
  // For the engine, in the thread that steps.
  void begin_step() { step_.store(++begun_, std::memory_order_release); }
  void end_step() { step_.store(0, std::memory_order_release); }
  void begin_evaluation(const Model& model, const Place& place);
  void end_evaluation();
  /// Where the evaluation stands in which the thread that steps is; without a line, if it is in none.
  [[nodiscard]] SourceSpan place() const;

  // For the watchdog.
  /// The number of the step that executes; 0: none.
  [[nodiscard]] std::uint64_t step() const { return step_.load(std::memory_order_acquire); }
  /// Takes the session from the thread that executes step `number`, and says which script or expression it is in.
  /// Nothing: it is in no evaluation of that step just now.
  [[nodiscard]] std::optional<SourceSpan> give_up(std::uint64_t number);
  [[nodiscard]] bool given_up() const { return state_.load(std::memory_order_acquire) == State::kGivenUp; }

 private:
  enum class State : std::uint8_t { kOutside, kEvaluating, kGivenUp };

  std::uint64_t begun_ = 0;
  std::atomic<std::uint64_t> step_{0};
  std::atomic<State> state_{State::kOutside};
  std::atomic<const Model*> model_{nullptr};
  std::atomic<int> line_{0};
  std::atomic<int> column_{0};
};

/// While it lives, a watch sees all steps of this thread, beside the watches of their hosts: for who steps many
/// sessions in a row. Null: none does.
using WatchThread = Present<ExecutionWatch>;

/// Bounds of one session; exceeding one ends the session with an error that names the place, except where noted.
struct Limits {
  std::uint32_t microsteps_max = 10'000;       ///< In one macrostep; events that enable nothing count.
  std::uint32_t macrosteps_max = 10'000;       ///< In one step: events between a session and its children.
  std::uint32_t events_max = 10'000;           ///< Waiting in one queue.
  std::uint32_t timers_max = 10'000;           ///< Delayed sends. Beyond: error.execution in the session.
  std::uint32_t invocations_max = 64;          ///< At once in one session. Beyond: error.execution.
  std::uint32_t invocation_depth_max = 8;      ///< Children of children. Beyond: error.execution.
  std::uint32_t foreach_max = 100'000;         ///< Items of one <foreach>. Beyond: error.execution.
  std::uint64_t actions_max = 10'000'000;      ///< Executable content in one step: loops inside loops.
  std::size_t script_memory_max = 16U << 20U;  ///< Bytes of one JavaScript heap. Beyond: error.execution.
};

/// An I/O processor that the embedding program offers beside SCXML's own.
struct Processor {
  std::string type;      ///< What <send type> names, e.g. "thrift".
  std::string location;  ///< `_ioprocessors[type].location`.
};

/// A function of the embedding program that scripts can call. Arguments, and items of lists in them, that are undefined
/// or functions are maps with the member `$undefined`; members of objects that are so are left out.
struct NativeFunction {
  std::string name;
  std::function<Result<Value>(std::span<const Value>)> call;
};

/// A value of the embedding program that scripts can read, and nothing else: it is frozen through and through.
struct NativeValue {
  std::string name;
  Value value;
};

/// What the embedding program offers to sessions. Borrowed by each step; must offer the same at each step of a session.
struct Host {
  std::vector<Processor> processors;
  std::vector<std::string> invoke_types;  ///< Types of <invoke> beside SCXML that become effects.
  std::vector<NativeFunction> functions;
  std::vector<NativeValue> values;
  /// Called while a <send> to outside executes. A failure raises error.execution there, with the sendid;
  /// `_event.data.message` is the message. Must not step this session.
  std::function<Result<void>(const OutgoingSend&)> on_send;
  /// Whether `#_scxml_<id>` names a session beyond this one and its children; not set: none does.
  std::function<bool(std::string_view session_id)> knows_session;
  /// Reads documents that <invoke srcexpr> names at run time.
  std::function<Result<std::string>(std::string_view uri)> read;
  /// A step ends early once it has sent something outside and only events that the session sent to itself wait: the
  /// world gets its turn first, as if all messages went through one queue. `Session::next_timer` then says that the
  /// session wants to go on at once, and `step_timers` does.
  bool yield_after_send = false;
  Observer* observer = nullptr;
  ExecutionWatch* watch = nullptr;
  Limits limits;
};

}  // namespace sentree::scxml
