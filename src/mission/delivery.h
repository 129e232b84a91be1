#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/bt/status.h"
#include "sentree/idl/call_error.h"
#include "sentree/mission/shared.h"

namespace sentree::mission {

/// What comes first at one instant of virtual time.
enum class Rank : std::uint8_t { kInjection, kSimulator, kMessage, kTimer, kTick };

/// Why a request is not sent.
struct Veto {
  std::string by;  ///< Name of the monitor or observer that refused.
  std::string reason;
  friend bool operator==(const Veto&, const Veto&) = default;
};
/// What became of a request that gates were asked about.
struct Admission {
  std::optional<Veto> veto;
  friend bool operator==(const Admission&, const Admission&) = default;
};

/// A call that a chart makes.
struct Call {
  std::uint64_t run = 0;  ///< The run of the skill that it belongs to; no other run's chart gets its outcome.
  std::uint64_t id = 0;   ///< Joins request and outcome.
  std::string service;
  std::string method;
  Value args;  ///< As the IDL has them.
  std::string sendid;
  std::string session;  ///< The invoked chart that makes it (`scxml::Event::session`); empty: the skill's own.
  friend bool operator==(const Call&, const Call&) = default;
};

/// How a call ended.
struct CallOutcome {
  bool ok = false;
  Value result;  ///< If ok. Else, of an exception that the interface declares: its fields, under its name.
  std::optional<idl::CallErrorKind> kind;  ///< Else.
  std::string message;

  [[nodiscard]] static CallOutcome returned(Value result = {}) {
    return {.ok = true, .result = std::move(result), .kind = {}, .message = {}};
  }
  [[nodiscard]] static CallOutcome failed(idl::CallErrorKind kind, std::string message) {
    return {.ok = false, .result = {}, .kind = kind, .message = std::move(message)};
  }
  /// Somebody has answered, if only by an exception.
  [[nodiscard]] bool is_served() const { return ok || kind == idl::CallErrorKind::kException; }
  /// As observations have it; empty: the call has returned.
  [[nodiscard]] std::string_view kind_word() const { return kind ? to_string(*kind) : std::string_view(); }
  friend bool operator==(const CallOutcome&, const CallOutcome&) = default;
};

/// A call of a one-way method, told to whoever subscribes to its topic.
struct Publication {
  std::string topic;   ///< SERVICE.METHOD
  std::string source;  ///< Who published it.
  Value args;          ///< As the IDL has them.
  friend bool operator==(const Publication&, const Publication&) = default;
};

// What is on its way to the tree.

/// A period begins: the tree is to be ticked.
struct Period {
  friend bool operator==(const Period&, const Period&) = default;
};
/// Timers of the tree may be due.
struct TreeTimer {
  friend bool operator==(const TreeTimer&, const TreeTimer&) = default;
};
/// A leaf has had its time to answer tick number `tick`.
struct AnswerDue {
  std::size_t leaf = 0;
  std::uint64_t tick = 0;
  TimePoint when{};
  friend bool operator==(const AnswerDue&, const AnswerDue&) = default;
};
/// A leaf answers tick number `tick`.
struct Answered {
  std::size_t leaf = 0;
  std::uint64_t tick = 0;
  bt::Status status = bt::Status::kIdle;
  Map outputs;
  friend bool operator==(const Answered&, const Answered&) = default;
};
/// A leaf has halted.
struct Halted {
  std::size_t leaf = 0;
  friend bool operator==(const Halted&, const Halted&) = default;
};
/// The mission is to halt.
struct Stop {
  friend bool operator==(const Stop&, const Stop&) = default;
};
/// Leaves have had their time to halt.
struct HaltLimit {
  friend bool operator==(const HaltLimit&, const HaltLimit&) = default;
};
using TreeDelivery = std::variant<Period, TreeTimer, AnswerDue, Answered, Halted, Stop, HaltLimit>;

// What is on its way to a skill.

struct TickSkill {
  std::uint64_t tick = 0;  ///< Numbers the ticks of all leaves.
  bool started = false;    ///< The leaf was idle: a new run begins.
  Map inputs;
  friend bool operator==(const TickSkill&, const TickSkill&) = default;
};
struct HaltSkill {
  friend bool operator==(const HaltSkill&, const HaltSkill&) = default;
};
/// Its run is given up; no answer is expected.
struct CancelSkill {
  friend bool operator==(const CancelSkill&, const CancelSkill&) = default;
};
/// It ends as if its process had been killed.
struct KillSkill {
  friend bool operator==(const KillSkill&, const KillSkill&) = default;
};
/// After it was killed: it can be ticked again.
struct RestartSkill {
  friend bool operator==(const RestartSkill&, const RestartSkill&) = default;
};
/// A timer of its chart, or its halt deadline, may be due.
struct SkillTimer {
  TimePoint when{};
  friend bool operator==(const SkillTimer&, const SkillTimer&) = default;
};
/// The gates have decided about the oldest call to that service that waits for them.
struct Admitted {
  Shared<Call> call;
  Admission admission;
  friend bool operator==(const Admitted&, const Admitted&) = default;
};
/// A request that was held back goes out.
struct Send {
  Shared<Call> call;
  friend bool operator==(const Send&, const Send&) = default;
};
/// A service has answered, or will not.
struct Outcome {
  Shared<Call> call;
  CallOutcome outcome;
  friend bool operator==(const Outcome&, const Outcome&) = default;
};
/// The outcome reaches the chart, after all that held it back.
struct Finish {
  Shared<Call> call;
  CallOutcome outcome;
  std::string vetoed_by;  ///< The gate that refused the call.
  friend bool operator==(const Finish&, const Finish&) = default;
};
/// Something was published on a topic that it subscribes to.
struct Published {
  Shared<Publication> what;
  friend bool operator==(const Published&, const Published&) = default;
};
using SkillDelivery = std::variant<TickSkill, HaltSkill, CancelSkill, KillSkill, RestartSkill, SkillTimer, Admitted,
                                   Send, Outcome, Finish, Published>;

// What is on its way to a model of components.

/// Its chart begins.
struct StartModel {
  friend bool operator==(const StartModel&, const StartModel&) = default;
};
/// A service that it serves is called.
struct ServeCall {
  static constexpr std::size_t kOutside = static_cast<std::size_t>(-1);

  std::size_t leaf = kOutside;  ///< Whose skill calls; kOutside: none, somebody steers the run.
  std::string source;           ///< Its name.
  Shared<Call> call;
  friend bool operator==(const ServeCall&, const ServeCall&) = default;
};
/// A timer of its chart may be due, or a call late.
struct ModelTimer {
  TimePoint when{};
  friend bool operator==(const ModelTimer&, const ModelTimer&) = default;
};
/// A gate has refused what it wanted to publish.
struct Refused {
  std::string service;
  std::string method;
  std::uint64_t id = 0;  ///< Of the call that the request was to be.
  Value args;
  Veto veto;
  friend bool operator==(const Refused&, const Refused&) = default;
};
using ModelDelivery = std::variant<StartModel, ServeCall, ModelTimer, Published, Refused>;

/// Something on its way to a part of the run.
struct Delivery {
  static constexpr std::size_t kTree = static_cast<std::size_t>(-1);

  /// To the skill of that leaf, or to that model, by its index in the plan; kTree: to the tree.
  std::size_t leaf = kTree;
  std::variant<TreeDelivery, SkillDelivery, ModelDelivery> what;
  friend bool operator==(const Delivery&, const Delivery&) = default;
};

}  // namespace sentree::mission
