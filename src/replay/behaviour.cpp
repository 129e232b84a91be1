#include "sentree/replay/behaviour.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

namespace sentree::replay {

namespace {

std::string text_of(const Message& message, std::string_view member) {
  const Value* value = message.data.find(member);
  if (value == nullptr) return {};
  return value->as_string() != nullptr ? *value->as_string() : to_json(*value);
}

}  // namespace

void Behaviour::did(const Message& message, const std::string& who, const std::string& kind, std::string what) {
  std::string& last = last_[who][kind];
  if (last == what) return;
  last = what;
  events_[who].push_back({message.time, message.tick, message.sequence, std::move(what)});
}

void Behaviour::observe(const Message& message) {
  const std::string& name = message.name;
  if (name == "mission.status") {
    did(message, "mission", "status", text_of(message, "status"));
  } else if (name == "node.status") {
    const std::string to = nodes_.contains(message.source) ? text_of(message, "to") : "IDLE";
    if (to != "IDLE") did(message, message.source, "status", "is " + to);
  } else if (name.starts_with("monitor.")) {
    did(message, message.source, "verdict", fmt::format("{} in state {}", name.substr(8), text_of(message, "state")));
  } else if (name.ends_with(".tick.reply")) {
    const std::string outputs = text_of(message, "outputs");
    did(message, message.source, "answer",
        fmt::format("answers {}{}", text_of(message, "status"), outputs.empty() ? "" : " " + outputs));
  } else if (name.ends_with(".tick.error")) {
    did(message, message.source, "answer", "does not answer: " + text_of(message, "message"));
  } else if (name.ends_with(".halt.request") && message.source == "mission") {
    last_[message.target].clear();
    did(message, message.target, "halt", "is halted");
    last_[message.target].clear();
  } else if (message.kind == MessageKind::kRequest && !name.ends_with(".tick.request")) {
    const std::string call = name.substr(0, name.rfind('.'));
    did(message, message.source, "ask " + call, fmt::format("asks {}({})", call, text_of(message, "args")));
  } else if (message.kind == MessageKind::kError && name.ends_with(".error")) {
    const std::string call = name.substr(0, name.rfind('.'));
    did(message, message.source, "error " + call, fmt::format("{} fails: {}", call, text_of(message, "kind")));
  }
}

std::vector<Difference> differences(const Behaviour& then, const Behaviour& now, Compared compared, TimePoint until) {
  const auto same_tick = [&](const BehaviourEvent& a, const BehaviourEvent& b) {
    return compared == Compared::kOrder || a.tick == b.tick;
  };
  std::vector<Difference> found;
  std::set<std::string> all;
  for (const auto& [who, events] : then.events()) all.insert(who);
  for (const auto& [who, events] : now.events()) all.insert(who);
  for (const std::string& who : all) {
    static const std::vector<BehaviourEvent> kNone;
    const auto of = [&](const Behaviour& behaviour) -> const std::vector<BehaviourEvent>& {
      const auto events = behaviour.events().find(who);
      return events != behaviour.events().end() ? events->second : kNone;
    };
    const std::vector<BehaviourEvent>& a = of(then);
    const std::vector<BehaviourEvent>& b = of(now);
    for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
      const BehaviourEvent* recorded = i < a.size() ? &a[i] : nullptr;
      const BehaviourEvent* replayed = i < b.size() ? &b[i] : nullptr;
      if (recorded != nullptr && replayed != nullptr && recorded->what == replayed->what &&
          same_tick(*recorded, *replayed))
        continue;
      // What comes first is where they part.
      const bool now_first = recorded == nullptr || (replayed != nullptr && replayed->time <= recorded->time);
      const BehaviourEvent& first = now_first ? *replayed : *recorded;
      if (first.time > until) break;
      const auto text = [&](const BehaviourEvent* event) {
        if (event != nullptr && same_tick(*event, first)) return event->what;
        return i > 0 ? "no change: it last " + a[i - 1].what : std::string("nothing yet");
      };
      found.push_back({first.time, first.tick, first.sequence, who, text(recorded), text(replayed)});
      break;
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const Difference& x, const Difference& y) {
    return x.time != y.time ? x.time < y.time : x.sequence < y.sequence;
  });
  return found;
}

}  // namespace sentree::replay
