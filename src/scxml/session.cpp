#include "sentree/scxml/session.h"

#include <algorithm>
#include <array>
#include <utility>

#include "sentree/scxml/interpreter.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/script_heap.h"

namespace sentree::scxml {

Model::Model() : heaps(std::make_shared<HeapPool>()) {}
Model::~Model() = default;

std::string_view to_string(SessionStatus status) {
  constexpr std::array<std::string_view, 5> kNames{"new", "running", "finished", "cancelled", "failed"};
  return kNames[static_cast<std::size_t>(status)];
}

Invocation::Invocation() = default;
Invocation::Invocation(Invocation&&) noexcept = default;
Invocation& Invocation::operator=(Invocation&&) noexcept = default;
Invocation::~Invocation() = default;
Invocation::Invocation(const Invocation& other)
    : id(other.id),
      state(other.state),
      invoke(other.invoke),
      chart(other.chart),
      child(other.child ? std::make_unique<Session>(*other.child) : nullptr) {}
Invocation& Invocation::operator=(const Invocation& other) {
  if (this != &other) *this = Invocation(other);
  return *this;
}

bool operator==(const Invocation& a, const Invocation& b) {
  if (a.id != b.id || a.state != b.state || a.invoke != b.invoke || a.child.operator bool() != b.child.operator bool())
    return false;
  return !a.child || *a.child == *b.child;
}

Session::Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

Session::Session(const Session& other)
    : fingerprint_(other.fingerprint_),
      status_(other.status_),
      data_lost_(other.data_lost_ || other.pinned_),
      id_(other.id_),
      parent_id_(other.parent_id_),
      invokeid_(other.invokeid_),
      configuration_(other.configuration_),
      initialized_(other.initialized_),
      history_(other.history_),
      internal_(other.internal_),
      external_(other.external_),
      timers_(other.timers_),
      invocations_(other.invocations_),
      variables_(other.variables_),
      globals_(other.globals_),
      sequence_(other.sequence_),
      ids_(other.ids_),
      rng_(other.rng_),
      failure_(other.failure_),
      done_data_(other.done_data_),
      scripts_run_(other.scripts_run_),
      heap_tag_(other.pinned_ ? 0 : other.heap_tag_),
      unsaveable_(other.unsaveable_) {}

Session& Session::operator=(const Session& other) {
  if (this != &other) *this = Session(other);
  return *this;
}

bool operator==(const Session& a, const Session& b) {
  return a.fingerprint_ == b.fingerprint_ && a.status_ == b.status_ && a.id_ == b.id_ && a.parent_id_ == b.parent_id_ &&
         a.invokeid_ == b.invokeid_ && a.configuration_ == b.configuration_ && a.initialized_ == b.initialized_ &&
         a.history_ == b.history_ && a.internal_ == b.internal_ && a.external_ == b.external_ &&
         a.timers_ == b.timers_ && a.invocations_ == b.invocations_ && a.variables_ == b.variables_ &&
         a.globals_ == b.globals_ && a.sequence_ == b.sequence_ && a.ids_ == b.ids_ && a.rng_ == b.rng_ &&
         a.failure_ == b.failure_ && a.done_data_ == b.done_data_ && a.scripts_run_ == b.scripts_run_;
}

std::uint64_t Session::hash() const {
  std::uint64_t h = hash_combine(fingerprint_, static_cast<std::uint64_t>(status_));
  h = hash_combine(h, hash_bytes(id_));
  for (std::size_t i = 0; i < configuration_.words(); ++i) h = hash_combine(h, configuration_.word(i));
  for (const auto& [state, value] : history_) {
    h = hash_combine(h, state);
    for (const StateIndex s : value) h = hash_combine(h, s);
  }
  for (const auto* queue : {&internal_, &external_}) {
    for (const Event& event : *queue) h = hash_combine(h, event.hash());
  }
  for (const Timer& timer : timers_) {
    h = hash_combine(h, static_cast<std::uint64_t>(timer.due.time_since_epoch().count()));
    h = hash_combine(h, timer.event.hash());
  }
  for (const Invocation& invocation : invocations_) {
    h = hash_combine(h, hash_bytes(invocation.id));
    if (invocation.child) h = hash_combine(h, invocation.child->hash());
  }
  for (const auto& variable : variables_) h = hash_combine(h, variable ? variable->hash() : 1);
  h = hash_combine(h, Value(globals_).hash());
  return hash_combine(hash_combine(h, ids_), rng_.state());
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
  for (std::uint32_t slot = 0; slot < variables_.size(); ++slot) {
    if (variables_[slot]) visit(chart.model().variables[slot].id, *variables_[slot]);
  }
  for (const auto& [name, value] : globals_) visit(name, value);
}

TimePoint Session::next_timer() const {
  if (running() && !external_.empty()) return TimePoint::min();
  TimePoint next = timers_.empty() ? kNever : timers_.front().due;
  for (const Invocation& invocation : invocations_) {
    if (invocation.child) next = std::min(next, invocation.child->next_timer());
  }
  return next;
}

std::optional<Diagnostic> Session::unsaveable() const {
  if (unsaveable_) return unsaveable_;
  for (const Invocation& invocation : invocations_) {
    if (invocation.child && invocation.child->unsaveable()) return invocation.child->unsaveable();
  }
  return std::nullopt;
}

void reset_session(const Chart& chart, Session& session, std::string id, std::uint64_t seed) {
  session = Session();
  const Model& model = chart.model();
  session.fingerprint_ = model.fingerprint;
  session.status_ = SessionStatus::kRunning;
  session.id_ = std::move(id);
  session.configuration_ = StateSet(model.states.size());
  if (model.late_binding) session.initialized_ = StateSet(model.states.size());
  session.variables_.resize(model.variables.size());
  session.rng_ = Rng(seed);
}

}  // namespace sentree::scxml
