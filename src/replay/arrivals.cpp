#include "sentree/replay/detail/arrivals.h"

#include <algorithm>

#include "sentree/runtime/monitors.h"

namespace sentree::replay {

namespace {

// What of the name of a message that is told of a leaf comes behind the leaf's.
std::string_view behind_source(const Message& message, const std::string& leaf) {
  return std::string_view(message.name).substr(std::min(leaf.size() + 1, message.name.size()));
}

std::optional<std::uint64_t> number_in(const Message& message, const char* key) {
  const Value* const number = message.data.find(key);
  if (number == nullptr || number->as_int() == nullptr || *number->as_int() < 0) return std::nullopt;
  return static_cast<std::uint64_t>(*number->as_int());
}

bool is_subscribed(const project::Plan& plan, const std::string& topic) {
  return std::any_of(plan.leaves.begin(), plan.leaves.end(), [&](const project::LeafPlan& leaf) {
    return std::find(leaf.subscribes.begin(), leaf.subscribes.end(), topic) != leaf.subscribes.end();
  });
}

// The first that waits, if there is one.
template <class What>
What* first_of(std::deque<What*>& waiting) {
  if (waiting.empty()) return nullptr;
  What* const first = waiting.front();
  waiting.pop_front();
  return first;
}

}  // namespace

bool tells_unreached(const Message& message) {
  return message.source == "run" && message.name.ends_with(".unreachable");
}

std::vector<std::size_t> leaves_of_process(const project::Plan& plan, const ProcessSkills& processes,
                                           const std::string& process) {
  std::vector<std::size_t> leaves;
  const auto ran = processes.find(process);
  if (ran == processes.end()) return leaves;
  for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) {
    if (plan.leaves[leaf].name == ran->second || plan.leaves[leaf].id == ran->second) leaves.push_back(leaf);
  }
  return leaves;
}

Arrivals::Arrivals(const project::Plan& plan, ProcessSkills processes, NeverCame never_came,
                   std::set<std::size_t> tell_timers, From from)
    : plan_(plan),
      processes_(std::move(processes)),
      never_came_(never_came),
      tell_timers_(std::move(tell_timers)),
      from_(from) {
  for (std::size_t i = 0; i < plan_.leaves.size(); ++i) leaves_[plan_.leaves[i].name] = i;
}

std::string Arrivals::topic_of(const Message& request) { return std::string(runtime::call_of(request)); }

bool Arrivals::note(const Message& message) {
  ended_ = std::max(ended_, message.time);
  if (TopicOf of{topic_of(message), message.source};
      message.kind == MessageKind::kRequest && is_subscribed(plan_, of.first)) {
    std::vector<PublishedThen>& all = published_[of];
    places_[message.sequence] = {std::move(of), all.size()};
    all.push_back({message.time, {}});
  }
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
  if (const auto by = latest_ticks_.find(message.source); by != latest_ticks_.end()) by->second->seen = true;
  if (message.kind != MessageKind::kEvent) return false;
  if (tells_unreached(message)) return note_unreached(message);
  if (message.name == "process.restarted") note_restarted(message);
  if (message.name == "mission.tick") ticked_[message.tick] = message.time;
  if (message.name == "mission.stop.taken") {
    stops_.push_back(message.time);
    return true;
  }
  if (message.name == "scenario.injection") note_injection(message);
  return (message.name.ends_with("taken") && note_taken(message)) ||
         (message.name.ends_with(".delayed") && note_delayed(message));
}

bool Arrivals::note_taken(const Message& message) {
  const auto leaf = leaves_.find(message.source);
  if (leaf == leaves_.end()) return false;
  const auto what = behind_source(message, message.source);
  Delayed& waiting = delayed_[leaf->second];
  const bool was_delayed = message.data.find("delayed") != nullptr;
  if (what == "tick.taken" || what == "halt.taken") {
    const bool ticked = what == "tick.taken";
    const auto& latest = ticked ? latest_ticks_ : latest_halts_;
    const auto asked = latest.find(message.source);
    Activation* const taken = was_delayed             ? first_of(ticked ? waiting.ticks : waiting.halts)
                              : asked != latest.end() ? asked->second
                                                      : nullptr;
    if (taken != nullptr) taken->asked = message.time;
  } else if (what == "cancel.taken") {
    const auto asked = latest_cancels_.find(message.source);
    TimePoint* const taken = was_delayed                      ? first_of(waiting.cancels)
                             : asked != latest_cancels_.end() ? asked->second
                                                              : nullptr;
    if (taken != nullptr) *taken = message.time;
  } else if (what == "kill.taken" || what == "restart.taken") {
    auto& all = (what == "kill.taken" ? kills_ : restarts_)[leaf->second];
    if (!all.empty()) all.back() = message.time;
  } else if (what == "timer.taken") {
    if (const auto number = number_in(message, "number")) {
      taken_timers_[{leaf->second, *number}] = message.time;
      timers_before_.try_emplace(leaf->second, from_ == From::kMiddle ? *number - 1 : 0);
    }
  } else if (what == "topic.taken" || what == "topic.untaken") {
    note_topic(leaf->second, message, what == "topic.taken" ? message.time : kNever);
  } else {
    return false;
  }
  return true;
}

// It is taken when that is told, or never.
bool Arrivals::note_delayed(const Message& message) {
  const auto leaf = leaves_.find(message.target);
  if (leaf == leaves_.end()) return false;
  const auto what = behind_source(message, message.target);
  Delayed& waiting = delayed_[leaf->second];
  if (what == "tick.delayed" || what == "halt.delayed") {
    const bool ticked = what == "tick.delayed";
    const auto& latest = ticked ? latest_ticks_ : latest_halts_;
    const auto asked = latest.find(message.target);
    if (asked == latest.end()) return true;
    asked->second->asked = kNever;
    (ticked ? waiting.ticks : waiting.halts).push_back(asked->second);
  } else if (what == "cancel.delayed") {
    const auto asked = latest_cancels_.find(message.target);
    if (asked == latest_cancels_.end()) return true;
    *asked->second = kNever;
    waiting.cancels.push_back(asked->second);
  } else if (what == "topic.delayed") {
    note_topic(leaf->second, message, kNever);
  } else {
    return false;
  }
  return true;
}

void Arrivals::note_topic(std::size_t leaf, const Message& message, TimePoint taken) {
  const auto sequence = number_in(message, "sequence");
  const auto place = sequence ? places_.find(*sequence) : places_.end();
  if (place != places_.end()) published_[place->second.first][place->second.second].late[leaf] = taken;
}

void Arrivals::note_injection(const Message& message) {
  for (const auto& [what, all] : {std::pair("kill", &kills_), std::pair("restart", &restarts_)}) {
    const Value* const part = message.data.find(what);
    const auto leaf = part != nullptr ? leaves_.find(part->text()) : leaves_.end();
    if (leaf != leaves_.end()) (*all)[leaf->second].emplace_back();
  }
}

// What did not reach a skill that was gone was tried again until it was there.
void Arrivals::note_restarted(const Message& message) {
  const Value* const process = message.data.find("process");
  if (process == nullptr) return;
  for (const std::size_t leaf : leaves_of_process(plan_, processes_, std::string(process->text()))) {
    const auto latest = latest_ticks_.find(plan_.leaves[leaf].name);
    if (latest == latest_ticks_.end()) continue;
    Activation& open = *latest->second;
    if (!open.answered && !open.seen && !open.unreached) open.asked = message.time;
  }
}

// False: the mission waited for that.
bool Arrivals::note_unreached(const Message& message) {
  const auto latest = latest_ticks_.find(message.target);
  if (latest == latest_ticks_.end() || latest->second->answered) return true;
  latest->second->unreached = true;
  if (!latest->second->seen) latest->second->asked = kNever;
  return false;
}

std::optional<Arrivals::Unreached> Arrivals::of_unreached(std::size_t leaf) const {
  const auto current = ticking_.find(leaf);
  if (current == ticking_.end() || !current->second || !current->second->unreached || !current->second->answered)
    return std::nullopt;
  return Unreached{*current->second->answered, current->second->seen};
}

TimePoint Arrivals::of(std::size_t leaf, LeafMessage what, std::uint64_t tick, TimePoint now) {
  // What was not taken then is by a changed project.
  const auto next_of = [this](std::deque<TimePoint>& all) {
    if (all.empty()) return TimePoint{};
    const TimePoint taken = all.front();
    all.pop_front();
    return taken == kNever ? never() : taken;
  };
  switch (what) {
    case LeafMessage::kCancel: return next_of(cancels_[{leaf, tick}]);
    case LeafMessage::kKill: return next_of(kills_[leaf]);
    case LeafMessage::kRestart: return next_of(restarts_[leaf]);
    default: break;
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
    return current->asked == kNever ? never() : current->asked;
  }
  if (!current) return {};
  // The next tick began when this one had ended.
  const auto next = ticked_.find(tick + 1);
  const TimePoint patience = add_saturating(now, plan_.scenario.project.deadlines.budget);
  const TimePoint due = next != ticked_.end() ? std::min(patience, next->second) : patience;
  // What the end of the run cut short is cut short again.
  if (!current->answered) return what == LeafMessage::kDue && due < ended_ ? TimePoint{} : never();
  if (what == LeafMessage::kAnswer && current->unreached) return never();
  if (what != LeafMessage::kDue) return current->late ? never() : *current->answered;
  if (current->late) return *current->answered;
  // The deadline's own timer may have been late, and the answer so in time.
  if (plan_.leaves[leaf].condition) return kNever;
  return *current->answered <= due ? kNever : TimePoint{};
}

TimePoint Arrivals::of_topic(std::size_t leaf, const mission::Publication& what) const {
  const TopicOf of{what.topic, what.source};
  const auto number = published_now_.find(of);
  const auto all = published_.find(of);
  if (number == published_now_.end() || all == published_.end() || number->second > all->second.size()) return {};
  const PublishedThen& then = all->second[number->second - 1];
  const auto late = then.late.find(leaf);
  if (late == then.late.end()) return then.time;
  return late->second == kNever ? never() : late->second;
}

TimePoint Arrivals::of_stop() {
  if (stops_.empty()) return {};
  const TimePoint taken = stops_.front();
  stops_.pop_front();
  return taken;
}

TimePoint Arrivals::of_veto(std::size_t leaf, const std::string& call) {
  const auto found = vetoes_.find({leaf, call});
  if (found == vetoes_.end() || found->second.empty()) return {};
  const TimePoint at = found->second.front();
  found->second.pop_front();
  return at;
}

TimePoint Arrivals::of_timer(std::size_t leaf, std::uint64_t number) const {
  const auto before = timers_before_.find(leaf);
  if (before == timers_before_.end()) return tell_timers_.contains(leaf) ? never() : TimePoint{};
  const auto taken = taken_timers_.find({leaf, before->second + number});
  // One that was due, and had not been taken when its chart took it back.
  return taken != taken_timers_.end() ? taken->second : never();
}

}  // namespace sentree::replay
