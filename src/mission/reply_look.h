#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/base/value.h"
#include "sentree/mission/delivery.h"
#include "sentree/monitor/projection.h"
#include "sentree/scxml/enabled.h"
#include "sentree/scxml/plain.h"

namespace sentree::mission {

/// Tells of one skill's chart what a reply would do in it. Two replies to a call that enable the same transitions do
/// the same wherever nothing but conditions looks at them.
class ReplyLook {
 public:
  explicit ReplyLook(const scxml::Chart& chart);

  /// The transitions that a reply with that result enables. Nothing: more of it matters than these, or a condition
  /// cannot be evaluated.
  /// @param result  As the interface has it; the same afterwards.
  /// Cost: what the conditions read of it, where a plan of plain steps tells; else an event is made and asked about.
  [[nodiscard]] std::optional<std::vector<scxml::TransitionIndex>> enabled(const Call& call, Value& result,
                                                                           const scxml::Session& session,
                                                                           TimePoint now);

 private:
  struct Method {
    std::string service;
    std::string method;
    std::optional<scxml::PlainPlan> plan;           // nothing: only the event itself tells
    std::vector<std::vector<std::string>> paths;    // that the plan reads, within the result
    std::vector<std::vector<std::uint32_t>> hints;  // where they were
  };
  Method& of(const Call& call);
  static std::optional<std::vector<scxml::TransitionIndex>> plainly(Method& method, const Value& result,
                                                                    const scxml::Session& session);

  scxml::Chart chart_;
  scxml::EventReads reads_;
  monitor::Projection members_;  // of the event's data; all, if it may look at facts that only observations have
  std::vector<Method> methods_;  // that were called
};

}  // namespace sentree::mission
