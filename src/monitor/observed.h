#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/monitor/requirement_types.h"

namespace sentree::monitor {

/// What an observation is about.
struct Observed {
  enum class Form : std::uint8_t {
    kBare,  ///< Nothing but the facts of the message.
    kMissionStatus,
    kResumed,
    kNodeStatus,
    kLeafTick,
    kLeafAnswer,
    kLeafError,
    kLog,
    kGivenUp,
    kTaken,
    kDelayed,
    kTimerTaken,
    kTopicTaken,
    kRequest,
    kReply,
    kError,
    kLate,
    kChoice,
    kLost,
    kProcess,
    kInjection,
    kBreakpoint,
    kVerdict,
    kMonitorGivenUp,
  };
  Form form = Form::kBare;
  std::string source;  ///< Empty: some leaf, of calls; else not told.
  std::string target;
  const Vocabulary::Method* method = nullptr;  ///< Of calls; borrowed.
};

/// Of the outcome of a call that is an error: kind, message, exception, vetoed_by.
[[nodiscard]] DataType data_of_error(const Vocabulary::Method& method);

/// What `_event.data` holds of an observation of that name, whatever the project is: as far as the name tells, all that
/// it can have. Unknown, with the members that are told: it can have others.
[[nodiscard]] DataType data_of_any(std::string_view name);

/// Each member that data of some observation have, as far as its form tells.
[[nodiscard]] const std::set<std::string>& observed_members();

/// Every observation that a project can have (docs/observations.md), and what its data are.
class Observations {
 public:
  /// @param vocabulary  Borrowed.
  explicit Observations(const Vocabulary& vocabulary);

  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// What `_event.data` of a chart holds that is fed with the observation: a record, the facts of the message (source,
  /// target, …) included. Unknown if there is no such observation, or if its data are not told.
  [[nodiscard]] DataType data_of(std::string_view name) const;

 private:
  void add(std::string name, Observed observed);

  const Vocabulary& vocabulary_;
  std::vector<std::string> names_;
  std::vector<Observed> observed_;  // by place in names_
};

}  // namespace sentree::monitor
