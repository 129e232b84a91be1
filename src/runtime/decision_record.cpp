#include "sentree/runtime/detail/decision_record.h"

#include "sentree/base/message_archive.h"

namespace sentree::monitor {

constexpr Verdict last_enumerator(Verdict) { return Verdict::kSatisfied; }

template <class S, class V>
requires archive::MaybeConst<S, Decision>
void visit_members(S& s, V&& visit) {
  visit("verdict", s.verdict);
  visit("at", s.at);
  visit("state", s.state);
  visit("deciding", s.deciding);
  visit("since", s.since);
  visit("number", s.number);
  visit("started", s.started);
  visit("witness", s.witness);
  visit("witness_complete", s.witness_complete);
  visit("witness_minimal", s.witness_minimal);
}

}  // namespace sentree::monitor

namespace sentree::runtime {

Value save(const monitor::Decision& decision) { return archive::save(decision); }

std::optional<monitor::Decision> restore_decision(const Value& saved) {
  monitor::Decision decision;
  if (!archive::restore(saved, decision).empty()) return std::nullopt;
  return decision;
}

}  // namespace sentree::runtime
