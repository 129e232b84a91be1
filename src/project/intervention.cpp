#include "sentree/project/intervention.h"

#include <utility>

#include "sentree/base/json.h"
#include "sentree/project/timeline.h"
#include "sentree/project/yaml_reader.h"

namespace sentree::project {

namespace {

using Kind = Intervention::Kind;

void append_count(Map& entry, const Intervention& what) {
  if (what.count > 0) entry["count"] = static_cast<std::int64_t>(what.count);
}

Map breakpoint_entry(const Intervention& what) {
  switch (what.point) {
    case Intervention::Point::kNode: {
      Map entry{{"node", what.target}};
      if (!what.status.empty()) entry["status"] = what.status;
      return entry;
    }
    case Intervention::Point::kState: return Map{{"chart", what.target}, {"state", what.state}};
    case Intervention::Point::kMessage: break;
  }
  return Map{{"message", what.target}};
}

std::string times(const Intervention& what) {
  if (what.count == 0) return "";
  return what.count == 1 ? ", once" : ", " + std::to_string(what.count) + " times";
}

text::YamlNode scalar(std::string text, bool quoted) {
  text::YamlNode node;
  node.kind = text::YamlNode::Kind::kScalar;
  node.scalar = std::move(text);
  node.quoted = quoted;
  return node;
}

// What was observed, as if it had been written in a file.
text::YamlNode written(const Value& value) {
  text::YamlNode node;
  if (const auto* list = value.as_list()) {
    node.kind = text::YamlNode::Kind::kSequence;
    for (const Value& item : *list) node.items.push_back(written(item));
  } else if (const auto* map = value.as_map()) {
    node.kind = text::YamlNode::Kind::kMapping;
    for (const auto& [key, item] : *map) node.entries.emplace_back(scalar(key, true), written(item));
  } else if (const auto* text = value.as_string()) {
    return scalar(*text, true);
  } else if (const auto* octets = value.as_bytes()) {
    std::string base64;
    append_base64(base64, octets->octets);
    return written(Map{{"$bytes", std::move(base64)}});
  } else if (!value.is_null()) {
    // "NaN" and "Infinity" are text.
    const std::string json = to_json(value);
    return json.front() == '"' ? scalar(json.substr(1, json.size() - 2), true) : scalar(json, false);
  }
  return node;
}

std::string breakpoint_text(const Intervention& what) {
  switch (what.point) {
    case Intervention::Point::kNode: return what.target + (what.status.empty() ? " changes" : " is " + what.status);
    case Intervention::Point::kState: return what.target + " enters " + what.state;
    case Intervention::Point::kMessage: break;
  }
  return what.target;
}

}  // namespace

std::string_view to_string(Kind kind) {
  switch (kind) {
    case Kind::kCall: return "call";
    case Kind::kStop: return "stop";
    case Kind::kKill: return "kill";
    case Kind::kRestart: return "restart";
    case Kind::kDelay: return "delay";
    case Kind::kFalsify: return "falsify";
    case Kind::kForce: return "force";
    case Kind::kBreakpoint: return "breakpoint";
    case Kind::kClear: return "clear";
    case Kind::kUnreachable: return "unreachable";
    case Kind::kLate: return "late";
  }
  return "";
}

Map to_entry(const Intervention& what) {
  const std::string word(to_string(what.kind));
  switch (what.kind) {
    case Kind::kCall: {
      Map entry{{word, what.target}};
      if (what.args.as_map() != nullptr && !what.args.as_map()->empty()) entry["args"] = what.args;
      return entry;
    }
    case Kind::kStop: return Map{{word, "mission"}};
    case Kind::kKill:
    case Kind::kRestart:
    case Kind::kUnreachable:
    case Kind::kLate: return Map{{word, what.target}};
    case Kind::kDelay: {
      Map entry{{"message", what.target}, {"by", exact_seconds(what.by)}};
      append_count(entry, what);
      return Map{{word, std::move(entry)}};
    }
    case Kind::kFalsify: {
      Map entry{{"call", what.target}};
      if (!what.path.empty()) entry["path"] = what.path;
      entry["value"] = what.value;
      append_count(entry, what);
      return Map{{word, std::move(entry)}};
    }
    case Kind::kForce: {
      Map entry{{"leaf", what.target}, {"status", what.status}};
      append_count(entry, what);
      return Map{{word, std::move(entry)}};
    }
    case Kind::kBreakpoint: return Map{{word, breakpoint_entry(what)}};
    case Kind::kClear: return Map{{word, static_cast<std::int64_t>(what.id)}};
  }
  return {};
}

std::string describe(const Intervention& what) {
  const std::string word(to_string(what.kind));
  switch (what.kind) {
    case Kind::kCall: return what.target + " " + to_json(what.args);
    case Kind::kStop: return "stop the mission";
    case Kind::kKill:
    case Kind::kRestart: return word + " " + what.target;
    case Kind::kUnreachable:
    case Kind::kLate: return what.target + " is " + word;
    case Kind::kDelay: return "delay " + what.target + " by " + exact_seconds(what.by) + times(what);
    case Kind::kFalsify:
      return "falsify " + what.target + ": " + (what.path.empty() ? "result" : what.path) + " becomes " +
             to_json(what.value) + times(what);
    case Kind::kForce: return "force " + what.target + " to " + what.status + times(what);
    case Kind::kBreakpoint: return "breakpoint at " + breakpoint_text(what);
    case Kind::kClear: return "clear " + std::to_string(what.id);
  }
  return word;
}

Message injection_message(const Intervention& what, const std::string& source, std::uint64_t id) {
  Message message;
  message.source = source;
  message.name = "scenario.injection";
  switch (what.kind) {
    case Kind::kCall:
      message.target = what.target.substr(0, what.target.rfind('.'));
      message.data = Map{{"args", what.args}, {"what", what.target}};
      return message;
    case Kind::kKill:
    case Kind::kRestart:
    case Kind::kForce: message.target = what.target; break;
    case Kind::kStop: message.target = "mission"; break;
    default: break;
  }
  Map data = to_entry(what);
  data["what"] = to_string(what.kind);
  if (id > 0) data["id"] = static_cast<std::int64_t>(id);
  message.data = std::move(data);
  return message;
}

std::optional<Intervention> intervention_of(const Message& message) {
  const Map* data = message.data.as_map();
  const Value* what = message.data.find("what");
  if (message.name != "scenario.injection" || data == nullptr || what == nullptr) return std::nullopt;
  Map entry = *data;
  entry.erase("what");
  entry.erase("id");
  if (entry.find("args") != nullptr) entry["call"] = *what;
  if (const Value* process = entry.find("process"); process != nullptr && what->text() == "kill") {
    // As recordings of Sentree 0.1 have it.
    entry["kill"] = *process;
    entry.erase("process");
  }
  const text::YamlNode yaml = written(Value(std::move(entry)));
  Diagnostics diagnostics;
  std::optional<Intervention> read;
  {
    YamlReader reader(yaml, "the observation", diagnostics);
    read = read_intervention(reader, yaml, diagnostics);
  }
  return has_errors(diagnostics) ? std::nullopt : read;
}

std::string exact_seconds(Duration duration) {
  const std::int64_t ns = duration.count();
  std::string text = std::to_string(ns / 1'000'000'000);
  if (const std::int64_t rest = ns % 1'000'000'000; rest != 0) {
    std::string digits = std::to_string(rest);
    digits.insert(0, 9 - digits.size(), '0');
    digits.erase(digits.find_last_not_of('0') + 1);
    text += "." + digits;
  }
  return text + " s";
}

}  // namespace sentree::project
