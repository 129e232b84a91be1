#include "sentree/replay/behaviour.h"

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
  deeds_[who].push_back({message.time, message.tick, message.sequence, std::move(what)});
}

void Behaviour::observe(const Message& message) {
  const std::string& name = message.name;
  if (name == "mission.status") {
    did(message, "mission", "status", text_of(message, "status"));
  } else if (name.starts_with("monitor.")) {
    did(message, message.source, "verdict", name.substr(8) + " in state " + text_of(message, "state"));
  } else if (name.ends_with(".tick.reply")) {
    const std::string outputs = text_of(message, "outputs");
    did(message, message.source, "answer",
        "answers " + text_of(message, "status") + (outputs.empty() ? "" : " " + outputs));
  } else if (name.ends_with(".tick.error")) {
    did(message, message.source, "answer", "does not answer: " + text_of(message, "message"));
  } else if (name.ends_with(".halt.request") && message.source == "mission") {
    last_[message.target].clear();
    did(message, message.target, "halt", "is halted");
    last_[message.target].clear();
  } else if (message.kind == MessageKind::kRequest && !name.ends_with(".tick.request")) {
    const std::string call = name.substr(0, name.rfind('.'));
    did(message, message.source, "ask " + call, "asks " + call + "(" + text_of(message, "args") + ")");
  } else if (message.kind == MessageKind::kError && name.ends_with(".error")) {
    const std::string call = name.substr(0, name.rfind('.'));
    did(message, message.source, "error " + call, call + " fails: " + text_of(message, "kind"));
  }
}

}  // namespace sentree::replay
