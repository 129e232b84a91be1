#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/monitor/requirement_types.h"

namespace sentree::monitor {

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
  enum class Form : std::uint8_t {
    kTick,
    kMissionStatus,
    kNodeStatus,
    kLeafTick,
    kLeafAnswer,
    kLeafError,
    kLeafLog,
    kLeafGivenUp,
    kBare,
    kRequest,
    kReply,
    kError,
    kLate,
    kLost,
    kProcess,
    kVerdict,
    kMonitorGivenUp,
    kOpen,
  };
  struct Entry {
    Form form = Form::kOpen;
    std::string source;  ///< Empty: some leaf, of calls; else not told.
    std::string target;
    const Vocabulary::Method* method = nullptr;
  };
  void add(std::string name, Entry entry);
  [[nodiscard]] const Entry* find(std::string_view name) const;

  const Vocabulary& vocabulary_;
  std::vector<std::string> names_;
  std::vector<Entry> entries_;  // by place in names_
};

}  // namespace sentree::monitor
