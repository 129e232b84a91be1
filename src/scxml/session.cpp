#include "sentree/scxml/session.h"

#include <algorithm>
#include <array>
#include <utility>

#include "sentree/scxml/detail/interpreter.h"
#include "sentree/scxml/detail/script_heap.h"
#include "sentree/scxml/detail/session_members.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/step.h"

namespace sentree::scxml {

Model::Model() : heaps(std::make_shared<HeapPool>()) {}
Model::~Model() = default;

std::string_view to_string(SessionStatus status) {
  constexpr std::array<std::string_view, 5> kNames{"new", "running", "finished", "cancelled", "failed"};
  return kNames[static_cast<std::size_t>(status)];
}

ChildSession::ChildSession() = default;
ChildSession::ChildSession(Chart chart) : chart_(std::move(chart)), session_(std::make_unique<Session>()) {}
ChildSession::ChildSession(ChildSession&&) noexcept = default;
ChildSession& ChildSession::operator=(ChildSession&&) noexcept = default;
ChildSession::~ChildSession() = default;
ChildSession::ChildSession(const ChildSession& other)
    : chart_(other.chart_), session_(other.session_ ? std::make_unique<Session>(*other.session_) : nullptr) {}
ChildSession& ChildSession::operator=(const ChildSession& other) {
  if (this != &other) *this = ChildSession(other);
  return *this;
}
bool operator==(const ChildSession& a, const ChildSession& b) {
  return a.session_ && b.session_ ? *a.session_ == *b.session_ : a.session_ == b.session_;
}

std::uint64_t Session::hash() const {
  archive::Hasher hasher;
  hasher.mix(fingerprint_);
  SessionMembers::visit(*this, hasher);
  for (const Invocation& invocation : invocations_) {
    hasher(std::string_view(), invocation.id);
    hasher(std::string_view(), invocation.invoke);
    if (invocation.child) hasher.mix(invocation.child->hash());
  }
  return hasher.value;
}

std::vector<std::string> Session::active_ids(const Chart& chart) const {
  std::vector<std::string> ids;
  configuration_.for_each([&](StateIndex s) {
    if (!chart.states()[s].id.empty()) ids.push_back(chart.states()[s].id);
  });
  return ids;
}

Map Session::data(const Chart& chart) const {
  Map data;
  visit_data(chart, [&](const std::string& name, const Value& value) { data[name] = value; });
  return data;
}

void Session::visit_data(const Chart& chart, const std::function<void(const std::string&, const Value&)>& visit) const {
  const auto& variables = *variables_;
  for (std::uint32_t slot = 0; slot < variables.size(); ++slot) {
    if (variables[slot]) visit(chart.model().variables[slot].id, *variables[slot]);
  }
  for (const auto& [name, value] : *globals_) visit(name, value);
}

TimePoint Session::next_timer() const {
  if (running() && !external_.empty()) return TimePoint::min();
  TimePoint next = timers_->empty() ? kNever : timers_->front().due;
  for (const Invocation& invocation : invocations_) {
    if (invocation.child) next = std::min(next, invocation.child->next_timer());
  }
  return next;
}

std::optional<Diagnostic> Session::unsaveable() const {
  if (*heap_.unsaveable) return *heap_.unsaveable;
  for (const Invocation& invocation : invocations_) {
    if (invocation.child && invocation.child->unsaveable()) return invocation.child->unsaveable();
  }
  return std::nullopt;
}

void give_up(Session& session, Diagnostic why) {
  session.failure_.edit() = std::move(why);
  session.status_ = SessionStatus::kFailed;
  session.internal_.clear();
  session.external_.clear();
  session.timers_.reset();
}

void reset_session(const Chart& chart, Session& session, std::string id, std::uint64_t seed) {
  session = Session();
  const Model& model = chart.model();
  session.fingerprint_ = model.fingerprint;
  session.status_ = SessionStatus::kRunning;
  session.identity_.edit().id = std::move(id);
  session.configuration_ = StateSet(model.states.size());
  if (model.late_binding) session.initialized_.edit() = StateSet(model.states.size());
  if (!model.variables.empty()) session.variables_.edit().resize(model.variables.size());
  session.rng_ = Rng(seed);
}

}  // namespace sentree::scxml
