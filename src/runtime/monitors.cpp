#include "sentree/runtime/monitors.h"

#include <algorithm>

namespace sentree::runtime {

Monitors::Monitors(const std::vector<monitor::Model>& models, Scheduler& scheduler, Stream& stream,
                   std::function<void(const MonitorReport&)> on_decision)
    : models_(models), scheduler_(scheduler), stream_(stream), on_decision_(std::move(on_decision)) {
  for (const monitor::Model& model : models_) reports_.push_back({.name = model.name(), .decision = {}, .failure = {}});
}

void Monitors::start() {
  for (const monitor::Model& model : models_) states_.push_back(monitor::start(model, TimePoint{}));
  schedule();
}

void Monitors::observe(const Message& message) {
  for (std::size_t i = 0; i < models_.size(); ++i) take(i, monitor::observe(models_[i], states_[i], message));
  schedule();
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
