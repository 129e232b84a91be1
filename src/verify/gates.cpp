#include "sentree/verify/gates.h"

#include <algorithm>
#include <utility>

namespace sentree::verify {

Gates::Gates(const project::Plan& plan) {
  for (const project::GatePlan& gate : plan.gates)
    gates_.push_back({.plan = &gate, .model = &plan.monitors[gate.monitor], .core = {}, .zero = {}});
  begin();
}

void Gates::begin() {
  for (Gate& gate : gates_) {
    gate.core = monitor::begin(*gate.model, TimePoint{});
    gate.zero = {};
  }
}

void Gates::advance(Gate& gate, TimePoint until) {
  for (;;) {
    const monitor::Stepped what = monitor::step_timers(*gate.model, gate.core, until);
    if (what.verdict == monitor::Verdict::kUndecided || gate.core.verdict != monitor::Verdict::kUndecided) return;
  }
}

void Gates::observed(const Message& message, TimePoint now) {
  for (Gate& gate : gates_) {
    if (!gate.model->listens_to(message.name)) continue;
    message_ = message;
    message_.time = gate.zero + now.time_since_epoch();
    advance(gate, message_.time - Duration(1));
    monitor::step(*gate.model, gate.core, message_);
  }
}

std::optional<mission::Veto> Gates::judge(const Message& request, TimePoint now) {
  constexpr std::string_view kSuffix = ".request";
  std::string_view call = request.name;
  if (call.ends_with(kSuffix)) call.remove_suffix(kSuffix.size());
  for (Gate& gate : gates_) {
    const auto& patterns = gate.plan->requests;
    if (std::none_of(patterns.begin(), patterns.end(),
                     [&](const std::string& pattern) { return project::matches_pattern(pattern, call); }))
      continue;
    message_ = request;
    message_.time = gate.zero + now.time_since_epoch();
    advance(gate, message_.time - Duration(1));
    if (auto reason = monitor::veto(*gate.model, gate.core, message_))
      return mission::Veto{gate.model->name(), std::move(*reason)};
  }
  return std::nullopt;
}

Result<void> Gates::keep(TimePoint now, std::vector<std::uint32_t>& out) {
  for (std::size_t i = 0; i < gates_.size(); ++i) {
    Gate& gate = gates_[i];
    const TimePoint at = gate.zero + now.time_since_epoch();
    advance(gate, at);
    std::string form = std::to_string(i) + ' ' + std::to_string(static_cast<int>(gate.core.verdict)) + ' ';
    if (auto encoded = monitor::encode(*gate.model, gate.core, at, form); !encoded) return encoded;
    const std::size_t size = form.size();
    const auto [found, is_new] = number_of_.emplace(std::move(form), static_cast<std::uint32_t>(kept_.size()));
    if (is_new) {
      kept_.push_back({gate.core, at});
      bytes_ += sizeof(Kept) + 6 * size + 500;
    }
    out.push_back(found->second);
  }
  return {};
}

void Gates::again(std::span<const std::uint32_t> numbers, TimePoint now) {
  for (std::size_t i = 0; i < gates_.size(); ++i) {
    gates_[i].core = kept_[numbers[i]].core;
    gates_[i].zero = kept_[numbers[i]].at - now.time_since_epoch();
  }
}

}  // namespace sentree::verify
