#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/detail/data_model.h"
#include "sentree/scxml/detail/ecmascript_model.h"
#include "sentree/scxml/detail/null_model.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/session.h"
#include "sentree/scxml/step.h"

namespace sentree::scxml {

/// Bytes that one step may log and send; beyond, the session ends.
inline constexpr std::size_t kOutputMax = 64U << 20U;
/// Errors of one step that an observer may be told of.
inline constexpr std::size_t kFailuresMax = 16;
inline constexpr std::string_view kErrorExecution = "error.execution";
inline constexpr std::string_view kErrorCommunication = "error.communication";

/// What all sessions of one step share: the root session, its children, and the world outside.
struct Run {
  Session& root;
  TimePoint now;
  Effects& effects;
  const Host& host;
  StepInfo info;
  bool sent = false;          ///< Something left for the world outside.
  std::uint64_t actions = 0;  ///< Executable content so far.
  std::size_t output = 0;     ///< Bytes logged and sent so far, about.
  Place place = {};           ///< Of the executable content that came last.
  std::uint32_t depth = 0;    ///< Of invocations inside invocations, while one starts.
};

/// Sets and lists that a step needs and no session keeps. Leased, so that a step allocates nothing in the steady state.
struct Scratch {
  std::vector<TransitionIndex> enabled;
  std::vector<TransitionIndex> filtered;
  std::vector<StateIndex> targets;
  std::vector<std::pair<StateIndex, TransitionIndex>> default_history_content;
  StateSet exit_set;
  StateSet entry_set;
  StateSet default_entry;
  StateSet to_invoke;
  bool has_to_invoke = false;
};

/// A new session of `chart`, not yet started.
void reset_session(const Chart& chart, Session& session, std::string id, std::uint64_t seed);

/// The algorithm of SCXML Appendix D for one session. Functions have the appendix's names, so that they can be read
/// side by side. interpreter.cpp: the algorithm; content.cpp: executable content; send.cpp: <send>, <cancel>;
/// invoke.cpp: <invoke>.
class Interpreter {
 public:
  /// `parent`: the session that invoked this one, or null.
  Interpreter(Run& run, const Chart& chart, Session& session, Session* parent);
  ~Interpreter();
  Interpreter(const Interpreter&) = delete;
  Interpreter& operator=(const Interpreter&) = delete;

  void start(const Map& data);
  /// One external event and all that follows, up to a stable configuration.
  void process_external_event(const Event& event);
  void process_platform_event(const Event& event);
  void cancel();
  /// A delayed <send> whose time has come. Runs a macrostep if it left an error behind.
  void deliver(Timer timer);

  Result<std::optional<Value>> evaluate(std::string_view expression) { return data_->evaluate(expression); }
  /// What an external event would enable; nothing: a condition fails. Changes nothing but the errors that are raised.
  [[nodiscard]] std::optional<std::vector<TransitionIndex>> enabled_by(const Event& event);

  // Used by the data models.
  [[nodiscard]] bool is_active(StateIndex state) const { return session_.configuration_.contains(state); }
  [[nodiscard]] const Chart& chart() const { return chart_; }
  [[nodiscard]] const Host& host() const { return run_.host; }
  [[nodiscard]] TimePoint now() const { return run_.now; }

  /// Runs the children of `session`, and itself, until no external event waits. False: a bound was exceeded.
  static bool run_family(Run& run, const Chart& chart, Session& session, Session* parent);
  /// A session of a family, with its chart and parent; none, if it is not there.
  struct Relative {
    Session* session = nullptr;
    const Chart* chart = nullptr;
    Session* parent = nullptr;
  };
  /// Among those that `session` has invoked, directly or not.
  static Relative find_invoked(Session& session, std::string_view id);

 private:
  // Appendix D (interpreter.cpp).
  void run_to_completion();
  void take(const Event& event);
  void select_eventless_transitions();
  void select_transitions(const Event& event);
  void select_for_state(StateIndex atomic, const DescriptorTable::Matches* matches);
  [[nodiscard]] bool condition_match(const TransitionCode& transition);
  void remove_conflicting_transitions();
  void microstep();
  void exit_states();
  void compute_exit_set();
  void record_history(StateIndex state);
  void execute_transition_content();
  void enter_states();
  void compute_entry_set();
  void add_descendant_states_to_enter(StateIndex state);
  void add_ancestor_states_to_enter(StateIndex state, StateIndex ancestor);
  void add_regions_to_enter(StateIndex parallel);
  void enter_state(StateIndex state);
  void enter_final(StateIndex state);
  [[nodiscard]] bool is_in_final_state(StateIndex state) const;
  [[nodiscard]] StateIndex transition_domain(TransitionIndex transition);
  void effective_targets(TransitionIndex transition, std::vector<StateIndex>& targets);
  void exit_interpreter(SessionStatus status);
  void initialize_datamodel(StateIndex state, const Map* overrides);
  [[nodiscard]] const std::vector<StateIndex>* history_value(StateIndex history) const;

  // Executable content (content.cpp).
  void execute_blocks(const std::vector<Block>& blocks);
  /// False: an error ended the block (SCXML 4.1).
  bool execute(const Block& block);
  bool execute(const Action& action);
  bool execute_if(const If& action);
  bool execute_foreach(const Foreach& action, const Place& place);
  /// Counts one piece of executable content. False: there have been too many in this step, and the session has failed.
  bool spend(const Place& place);
  bool spend_output(std::size_t bytes, const Place& place);
  bool execute_log(const Log& action, const Place& place);
  bool execute_send(const Send& send, const Place& place);
  bool execute_cancel(const Cancel& cancel);
  Result<std::string> text_of(const Text& text);
  /// Names and values; `strict`: the first failure is the result, else failures are reported one by one and left out.
  Result<std::optional<Value>> payload_data(const Payload& payload, bool strict);

  // Sending (send.cpp).
  Result<void> prepare_send(const Send& send, Timer& timer);
  void dispatch(Timer&& timer);
  void send_to_session(Session& target, Event&& event);
  void send_outside(OutgoingSend&& send);
  void raise(Event event);
  static std::string message_of(const Diagnostic& why);
  void raise_error(Diagnostic why, std::string sendid = {}, std::string_view name = kErrorExecution);
  void raise_communication_error(std::string message, std::string sendid = {});
  // Nothing is enabled by it.
  void tell_unhandled(const Event& event);
  [[nodiscard]] OutgoingSend outgoing(Timer&& timer) const;
  [[nodiscard]] std::string make_id(std::string_view whose, std::string_view what);

  // Invoking (invoke.cpp).
  void invoke_entered_states();
  Result<void> start_invocation(std::uint32_t index);
  Result<Chart> child_chart(const Invoke& invoke, const std::string& src);
  void cancel_invocations_of(StateIndex state);
  void cancel_invocation(std::size_t position);
  void apply_finalize_and_autoforward(const Event& event);
  void apply_default_finalize(const Invoke& invoke, const Event& event);

  void fail_endless(const StateSet& lately, const Event& last);
  /// Ends the session: a bound was exceeded.
  void fail_session(std::string code, std::string message, const Place& place);
  [[nodiscard]] static bool must_yield(const Run& run) { return run.sent && run.host.yield_after_send; }
  [[nodiscard]] bool running() const { return session_.status_ == SessionStatus::kRunning; }

  Run& run_;
  const Chart& chart_;
  const Model& model_;
  Session& session_;
  Session* parent_;
  Observer* observer_;
  std::vector<Diagnostic> failures_;  // behind error events that wait, for the observer
  std::unique_ptr<Scratch> scratch_;
  std::optional<NullModel> null_model_;
  std::optional<EcmaScriptModel> ecma_model_;
  DataModel* data_ = nullptr;
};

}  // namespace sentree::scxml
