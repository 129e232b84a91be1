#include "sentree/monitor/monitor_set.h"

#include <algorithm>

#include "sentree/monitor/model.h"

namespace sentree::monitor {

LeafTracker::Sign LeafTracker::sign(std::string_view observation) {
  if (observation.ends_with(".tick.request")) return Sign::kTicked;
  if (observation.ends_with(".tick.reply")) return Sign::kAnswered;
  if (observation.ends_with(".halt.reply") || observation.ends_with(".tick.error") || observation.ends_with(".cancel"))
    return Sign::kEnded;
  return Sign::kNone;
}

void LeafTracker::see(const Message& message, Sign sign) {
  if (sign == Sign::kNone) return;
  // Requests go to the leaf, answers come from it.
  const std::string leaf = message.name.substr(0, message.name.rfind('.', message.name.rfind('.') - 1));
  if (sign == Sign::kTicked) {
    ticked_ = leaf;
    return;
  }
  if (ticked_ == leaf) ticked_.clear();
  std::erase(running_, leaf);
  const Value* status = message.data.find("status");
  if (sign == Sign::kAnswered && status != nullptr && status->text() == "RUNNING") running_.push_back(leaf);
}

const std::string& LeafTracker::active() const {
  static const std::string kNone;
  if (!ticked_.empty()) return ticked_;
  return running_.empty() ? kNone : running_.back();
}

Dispatch::Route Dispatch::make(const std::string& observation) const {
  Route route;
  route.sign = LeafTracker::sign(observation);
  for (std::size_t i = 0; i < models_.size(); ++i) {
    if (!models_[i].listens_to(observation)) continue;
    route.monitors.push_back(static_cast<std::uint32_t>(i));
    route.projection.add(Access::parts(models_[i]).projection);
  }
  return route;
}

const Dispatch::Route& Dispatch::route(const std::string& observation) {
  const auto known = routes_.find(observation);
  if (known != routes_.end()) return known->second;
  if (routes_.size() < kRoutesMax) return routes_.emplace(observation, make(observation)).first->second;
  passing_ = make(observation);
  return passing_;
}

MonitorSet::MonitorSet(std::vector<Model> models, TimePoint begin) : models_(std::move(models)), dispatch_(models_) {
  for (const Model& model : models_) states_.push_back(start(model, begin));
  find_wake();
}

void MonitorSet::find_wake() {
  wake_ = kNever;
  for (std::size_t i = 0; i < models_.size(); ++i) wake_ = std::min(wake_, monitor::next_timer(models_[i], states_[i]));
}

void MonitorSet::step(std::size_t monitor, Decisions decisions, std::vector<Decided>& out) {
  for (Decision& decision : decisions) out.push_back({monitor, std::move(decision), leaves_.active()});
}

void MonitorSet::observe(const Message& message, std::vector<Decided>& out) {
  // Not owned: it stays where it is.
  observe(Observation(Observation(), &message), out);
}

void MonitorSet::observe(const Observation& observation, std::vector<Decided>& out) {
  const Message& message = *observation;
  if (wake_ < message.time) advance(message.time - Duration(1), out);
  const Dispatch::Route& route = dispatch_.route(message.name);
  leaves_.see(message, route.sign);
  if (route.monitors.empty()) return;
  event_.name = message.name;
  event_.data = route.projection.data(message);
  for (const std::uint32_t i : route.monitors) {
    const TimePoint before = monitor::next_timer(models_[i], states_[i]);
    step(i, monitor::observe(models_[i], states_[i], observation, event_, nullptr), out);
    const TimePoint after = monitor::next_timer(models_[i], states_[i]);
    if (after < wake_)
      wake_ = after;
    else if (before == wake_ && after != before)
      find_wake();
  }
}

void MonitorSet::advance(TimePoint now, std::vector<Decided>& out) {
  // In order of time, not of monitors.
  while (wake_ <= now) {
    const TimePoint due = wake_;
    for (std::size_t i = 0; i < models_.size(); ++i) {
      if (monitor::next_timer(models_[i], states_[i]) <= due)
        step(i, monitor::advance(models_[i], states_[i], due), out);
    }
    find_wake();
  }
}

std::vector<MonitorSet::Decided> evaluate(std::vector<Model> models, std::span<const Message> recording,
                                          TimePoint begin, TimePoint end) {
  MonitorSet set(std::move(models), begin);
  std::vector<MonitorSet::Decided> out;
  for (const Message& message : recording) set.observe(message, out);
  set.advance(end, out);
  return out;
}

}  // namespace sentree::monitor
