#include "sentree/runtime/monitors.h"

#include <algorithm>

namespace sentree::runtime {

namespace {

bool matches(const GatePlan& gate, std::string_view call) {
  return std::any_of(gate.requests.begin(), gate.requests.end(),
                     [&](const std::string& pattern) { return matches_pattern(pattern, call); });
}

}  // namespace

Monitors::Monitors(const Plan& plan, Scheduler& scheduler, Stream& stream,
                   std::function<void(const MonitorReport&)> on_decision)
    : models_(plan.monitors),
      gates_(plan.gates),
      scheduler_(scheduler),
      stream_(stream),
      on_decision_(std::move(on_decision)) {
  for (const monitor::Model& model : models_) {
    reports_.emplace_back().name = model.name();
  }
}

std::string_view call_of(const Message& request) {
  constexpr std::string_view kSuffix = ".request";
  const std::string_view name = request.name;
  return name.ends_with(kSuffix) ? name.substr(0, name.size() - kSuffix.size()) : name;
}

bool Monitors::is_gated(std::string_view call) const {
  return std::any_of(gates_.begin(), gates_.end(), [&](const GatePlan& gate) { return matches(gate, call); });
}

std::optional<Veto> Monitors::judge(const Message& request) const {
  const std::string_view call = call_of(request);
  for (const GatePlan& gate : gates_) {
    if (!matches(gate, call)) continue;
    if (auto reason = monitor::veto(models_[gate.monitor], states_[gate.monitor], request))
      return Veto{models_[gate.monitor].name(), std::move(*reason)};
  }
  return std::nullopt;
}

void Monitors::start() {
  for (const monitor::Model& model : models_) states_.push_back(monitor::start(model, TimePoint{}));
  schedule();
}

void Monitors::observe(const Message& message) {
  if (message.kind == MessageKind::kError) count_veto(message);
  for (std::size_t i = 0; i < models_.size(); ++i) take(i, monitor::observe(models_[i], states_[i], message));
  schedule();
}

void Monitors::count_veto(const Message& error) {
  const Value* by = error.data.find("vetoed_by");
  if (by == nullptr) return;
  for (MonitorReport& report : reports_) {
    if (report.name == by->text()) ++report.vetoes;
  }
}

void Monitors::advance(TimePoint now) {
  for (std::size_t i = 0; i < models_.size(); ++i) take(i, monitor::advance(models_[i], states_[i], now));
}

void Monitors::finish(TimePoint end) { advance(end); }

void Monitors::take(std::size_t index, std::optional<monitor::Decision> decision) {
  MonitorReport& report = reports_[index];
  if (states_[index].failure && report.failure.empty()) report.failure = to_string(*states_[index].failure);
  if (!decision) return;
  report.verdict = decision->verdict;
  report.decision = std::move(decision);
  Message message;
  message.kind = MessageKind::kEvent;
  message.source = report.name;
  message.name = "monitor." + std::string(to_string(report.verdict));
  message.data = Map{{"monitor", report.name}, {"state", report.decision->state}};
  stream_.publish(std::move(message));
  on_decision_(report);
}

void Monitors::schedule() {
  TimePoint next = kNever;
  for (const monitor::State& state : states_) next = std::min(next, monitor::next_timer(state));
  if (next == kNever || next >= wake_) return;
  wake_ = next;
  // One nanosecond later: an observation at the same instant wins over a timer.
  scheduler_.at(stream_.actor(), next + Duration(1), Rank::kTimer, [this, next] {
    if (wake_ != next) return;
    wake_ = kNever;
    stream_.flush();
    advance(next);
    schedule();
  });
}

}  // namespace sentree::runtime
