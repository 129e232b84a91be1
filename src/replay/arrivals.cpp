#include "sentree/replay/arrivals.h"

#include <algorithm>

#include "sentree/runtime/monitors.h"

namespace sentree::replay {

Arrivals::Arrivals(const project::Plan& plan) : plan_(plan) {
  for (std::size_t i = 0; i < plan_.leaves.size(); ++i) leaves_[plan_.leaves[i].name] = i;
}

std::string Arrivals::topic_of(const Message& request) { return std::string(runtime::call_of(request)); }

bool Arrivals::note(const Message& message) {
  if (message.kind == MessageKind::kRequest) published_[topic_of(message)].push_back(message.sequence);
  if (const auto asked = leaves_.find(message.target); asked != leaves_.end() && message.source == "mission") {
    if (message.name.ends_with(".cancel")) {
      latest_cancels_[message.target] = &cancels_[{asked->second, message.tick}].emplace_back(message.time);
      return true;
    }
    const bool ticked = message.name.ends_with(".tick.request");
    if (!ticked && !message.name.ends_with(".halt.request")) return true;
    auto& list = (ticked ? ticks_ : halts_)[{asked->second, message.tick}];
    list.push_back({.asked = message.time, .answered = {}});
    open_[message.call] = &list.back();
    (ticked ? latest_ticks_ : latest_halts_)[message.target] = &list.back();
    return true;
  }
  if (message.kind == MessageKind::kError && message.data.find("vetoed_by") != nullptr) {
    if (const auto leaf = leaves_.find(message.source); leaf != leaves_.end())
      vetoes_[{leaf->second, message.name.substr(0, message.name.rfind('.'))}].push_back(message.time);
    return true;
  }
  if (message.target == "mission") {
    const auto activation = open_.find(message.call);
    if (activation == open_.end()) return true;
    activation->second->answered = message.time;
    activation->second->late = message.kind == MessageKind::kError;
    open_.erase(activation);
    return true;
  }
  return message.kind == MessageKind::kEvent && message.name.ends_with(".taken") && note_taken(message);
}

bool Arrivals::note_taken(const Message& message) {
  const auto leaf = leaves_.find(message.source);
  if (leaf == leaves_.end()) return false;
  const auto what = std::string_view(message.name).substr(std::min(message.source.size() + 1, message.name.size()));
  const auto number_in = [&](const char* key) -> std::optional<std::uint64_t> {
    const Value* const number = message.data.find(key);
    if (number == nullptr || number->as_int() == nullptr || *number->as_int() < 0) return std::nullopt;
    return static_cast<std::uint64_t>(*number->as_int());
  };
  if (what == "tick.taken" || what == "halt.taken") {
    const auto& latest = what == "tick.taken" ? latest_ticks_ : latest_halts_;
    if (const auto asked = latest.find(message.source); asked != latest.end()) asked->second->asked = message.time;
  } else if (what == "cancel.taken") {
    if (const auto asked = latest_cancels_.find(message.source); asked != latest_cancels_.end())
      *asked->second = message.time;
  } else if (what == "timer.taken") {
    if (const auto number = number_in("number")) late_timers_[{leaf->second, *number}] = message.time;
  } else if (what == "topic.taken") {
    const Value* const topic = message.data.find("topic");
    const auto sequence = number_in("sequence");
    if (topic == nullptr || !sequence) return true;
    const std::vector<std::uint64_t>& all = published_[std::string(topic->text())];
    const auto at = std::lower_bound(all.begin(), all.end(), *sequence);
    if (at != all.end() && *at == *sequence)
      late_topics_[{leaf->second, std::string(topic->text()), at - all.begin() + 1}] = message.time;
  } else {
    return false;
  }
  return true;
}

TimePoint Arrivals::of(std::size_t leaf, LeafMessage what, std::uint64_t tick, TimePoint now, bool exact) {
  if (what == LeafMessage::kCancel) {
    const auto found = cancels_.find({leaf, tick});
    if (found == cancels_.end() || found->second.empty()) return {};
    const TimePoint taken = found->second.front();
    found->second.pop_front();
    return taken;
  }
  const bool is_halt = what == LeafMessage::kHalt || what == LeafMessage::kHalted;
  std::optional<Activation>& current = (is_halt ? halting_ : ticking_)[leaf];
  if (what == LeafMessage::kTick || what == LeafMessage::kHalt) {
    current.reset();
    auto& all = is_halt ? halts_ : ticks_;
    const auto found = all.find({leaf, tick});
    if (found == all.end() || found->second.empty()) return {};
    current = found->second.front();
    found->second.pop_front();
    return current->asked;
  }
  if (!current) return {};
  // What the end of the run cut short is cut short again.
  if (!current->answered) return exact ? kNever : TimePoint{};
  if (what != LeafMessage::kDue) return !current->late ? *current->answered : exact ? kNever : TimePoint{};
  if (current->late) return *current->answered;
  // The deadline's own timer may have been late, and the answer so in time.
  if (plan_.leaves[leaf].condition) return kNever;
  return *current->answered <= now + plan_.scenario.project.deadlines.budget ? kNever : TimePoint{};
}

TimePoint Arrivals::of_topic(std::size_t leaf, const std::string& topic) const {
  const auto number = published_now_.find(topic);
  if (number == published_now_.end()) return {};
  const auto late = late_topics_.find({leaf, topic, number->second});
  return late != late_topics_.end() ? late->second : TimePoint{};
}

TimePoint Arrivals::of_veto(std::size_t leaf, const std::string& call) {
  const auto found = vetoes_.find({leaf, call});
  if (found == vetoes_.end() || found->second.empty()) return {};
  const TimePoint at = found->second.front();
  found->second.pop_front();
  return at;
}

TimePoint Arrivals::of_timer(std::size_t leaf, std::uint64_t number) const {
  const auto late = late_timers_.find({leaf, number});
  return late != late_timers_.end() ? late->second : TimePoint{};
}

}  // namespace sentree::replay
