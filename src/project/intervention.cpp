#include "sentree/project/intervention.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/base/json.h"
#include "sentree/project/yaml_reader.h"

namespace sentree::project {

namespace {

using namespace intervention;

// What is read: the entry of the timeline, and what its word says.
struct Entry {
  YamlReader& reader;
  Diagnostics& diagnostics;

  std::string text(std::string_view word) const { return reader.string(std::string(word)).value_or(""); }
  // Reads the mapping of the word, if it is one.
  template <class Read>
  void details(std::string_view word, const Read& read) const {
    const auto* node = reader.mapping(std::string(word));
    if (node == nullptr) return;
    YamlReader inner(*node, fmt::format("\"{}\"", word), diagnostics);
    read(inner, *node);
  }
};

std::uint64_t read_count(YamlReader& reader) {
  const auto count = reader.integer("count");
  if (!count) return 0;
  if (*count > 0) return static_cast<std::uint64_t>(*count);
  reader.error(reader.span("count"), "scenario.count",
               "count must be at least 1; leave it out for as long as it is not cleared");
  return 0;
}
void append_count(Map& entry, std::uint64_t count) {
  if (count > 0) entry["count"] = static_cast<std::int64_t>(count);
}
std::string times(std::uint64_t count) {
  if (count == 0) return "";
  return count == 1 ? ", once" : fmt::format(", {} times", count);
}

void check_status(YamlReader& reader, const std::string& status, const std::vector<std::string>& statuses) {
  if (status.empty() || std::find(statuses.begin(), statuses.end(), status) != statuses.end()) return;
  std::string way_out = did_you_mean(status, statuses);
  if (way_out.empty()) way_out = fmt::format("; it is one of {}", fmt::join(statuses, ", "));
  reader.error(reader.span("status"), "scenario.status", fmt::format("there is no status \"{}\"{}", status, way_out));
}

// Of each kind: how it is read, what an entry says of it, whom it concerns, and how it is told in one line.

void read(const Entry& entry, Call& call) {
  YamlReader& reader = entry.reader;
  call.method = entry.text(Call::kWord);
  if (!call.method.empty() && call.method.find('.') == std::string::npos) {
    reader.error(reader.span("call"), "scenario.call", fmt::format("call \"{}\" must be SERVICE.METHOD", call.method));
  }
  const auto* args = reader.mapping("args");
  call.args = args != nullptr ? args->value() : Value(Map());
}
Map form(const Call& call) {
  Map entry{{std::string(Call::kWord), call.method}};
  if (call.args.as_map() != nullptr && !call.args.as_map()->empty()) entry["args"] = call.args;
  return entry;
}
std::string concerned(const Call& call) { return call.method.substr(0, call.method.rfind('.')); }
std::string told(const Call& call) { return fmt::format("{} {}", call.method, to_json(call.args)); }

void read(const Entry& entry, Stop& /*stop*/) {
  if (const auto target = entry.reader.string("stop"); target && *target != "mission") {
    entry.reader.error(entry.reader.span("stop"), "scenario.stop",
                       fmt::format("only the mission can be stopped; to end \"{}\" write kill: {}", *target, *target));
  }
}
Map form(const Stop& /*stop*/) { return {{std::string(Stop::kWord), "mission"}}; }
std::string concerned(const Stop& /*stop*/) { return "mission"; }
std::string told(const Stop& /*stop*/) { return "stop the mission"; }

void read(const Entry& entry, Kill& kill) { kill.part = entry.text(Kill::kWord); }
Map form(const Kill& kill) { return {{std::string(Kill::kWord), kill.part}}; }
std::string concerned(const Kill& kill) { return kill.part; }
std::string told(const Kill& kill) { return "kill " + kill.part; }

void read(const Entry& entry, Restart& restart) { restart.part = entry.text(Restart::kWord); }
Map form(const Restart& restart) { return {{std::string(Restart::kWord), restart.part}}; }
std::string concerned(const Restart& restart) { return restart.part; }
std::string told(const Restart& restart) { return "restart " + restart.part; }

void read(const Entry& entry, Delay& delay) {
  entry.details(Delay::kWord, [&](YamlReader& reader, const text::YamlNode& node) {
    delay.message = reader.required_string("message");
    if (reader.node("by") == nullptr) reader.error(node.span, "project.missing-key", "\"delay\" needs \"by\"");
    delay.by = reader.duration("by").value_or(Duration(0));
    delay.count = read_count(reader);
  });
}
Map form(const Delay& delay) {
  Map entry{{"message", delay.message}, {"by", exact_seconds(delay.by)}};
  append_count(entry, delay.count);
  return {{std::string(Delay::kWord), std::move(entry)}};
}
std::string concerned(const Delay& /*delay*/) { return ""; }
std::string told(const Delay& delay) {
  return fmt::format("delay {} by {}{}", delay.message, exact_seconds(delay.by), times(delay.count));
}

void read(const Entry& entry, Falsify& falsify) {
  entry.details(Falsify::kWord, [&](YamlReader& reader, const text::YamlNode& node) {
    falsify.call = reader.required_string("call");
    falsify.path = reader.string("path").value_or("");
    reader.know("value");
    // Null is one.
    if (const auto* value = node.find("value"); value != nullptr)
      falsify.value = value->value();
    else
      reader.error(node.span, "project.missing-key", "\"falsify\" needs \"value\"");
    falsify.count = read_count(reader);
  });
}
Map form(const Falsify& falsify) {
  Map entry{{"call", falsify.call}};
  if (!falsify.path.empty()) entry["path"] = falsify.path;
  entry["value"] = falsify.value;
  append_count(entry, falsify.count);
  return {{std::string(Falsify::kWord), std::move(entry)}};
}
std::string concerned(const Falsify& /*falsify*/) { return ""; }
std::string told(const Falsify& falsify) {
  return fmt::format("falsify {}: {} becomes {}{}", falsify.call, falsify.path.empty() ? "result" : falsify.path,
                     to_json(falsify.value), times(falsify.count));
}

void read(const Entry& entry, Force& force) {
  entry.details(Force::kWord, [&](YamlReader& reader, const text::YamlNode& /*node*/) {
    force.leaf = reader.required_string("leaf");
    force.status = reader.required_string("status");
    check_status(reader, force.status, {"SUCCESS", "FAILURE", "RUNNING"});
    force.count = read_count(reader);
  });
}
Map form(const Force& force) {
  Map entry{{"leaf", force.leaf}, {"status", force.status}};
  append_count(entry, force.count);
  return {{std::string(Force::kWord), std::move(entry)}};
}
std::string concerned(const Force& force) { return force.leaf; }
std::string told(const Force& force) {
  return fmt::format("force {} to {}{}", force.leaf, force.status, times(force.count));
}

void read(const Entry& entry, Breakpoint& breakpoint) {
  entry.details(Breakpoint::kWord, [&](YamlReader& reader, const text::YamlNode& place) {
    const auto node = reader.string("node");
    const auto chart = reader.string("chart");
    const auto message = reader.string("message");
    if ((node ? 1 : 0) + (chart ? 1 : 0) + (message ? 1 : 0) != 1) {
      reader.error(place.span, "scenario.breakpoint",
                   "a breakpoint needs one of \"node: PATH\", \"chart: NAME\" and \"message: PATTERN\"");
    } else if (node) {
      breakpoint.point = Breakpoint::Point::kNode;
      breakpoint.target = *node;
      breakpoint.status = reader.string("status").value_or("");
      check_status(reader, breakpoint.status, {"IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED"});
    } else if (chart) {
      breakpoint.point = Breakpoint::Point::kState;
      breakpoint.target = *chart;
      breakpoint.state = reader.required_string("state");
    } else {
      breakpoint.target = *message;
    }
  });
}
Map form(const Breakpoint& breakpoint) {
  Map entry;
  switch (breakpoint.point) {
    case Breakpoint::Point::kNode:
      entry["node"] = breakpoint.target;
      if (!breakpoint.status.empty()) entry["status"] = breakpoint.status;
      break;
    case Breakpoint::Point::kState: entry = {{"chart", breakpoint.target}, {"state", breakpoint.state}}; break;
    case Breakpoint::Point::kMessage: entry["message"] = breakpoint.target; break;
  }
  return {{std::string(Breakpoint::kWord), std::move(entry)}};
}
std::string concerned(const Breakpoint& /*breakpoint*/) { return ""; }
std::string told(const Breakpoint& breakpoint) {
  std::string at = "breakpoint at " + breakpoint.target;
  switch (breakpoint.point) {
    case Breakpoint::Point::kNode: return at + (breakpoint.status.empty() ? " changes" : " is " + breakpoint.status);
    case Breakpoint::Point::kState: return fmt::format("{} enters {}", at, breakpoint.state);
    case Breakpoint::Point::kMessage: break;
  }
  return at;
}

void read(const Entry& entry, Clear& clear) {
  const auto id = entry.reader.integer("clear");
  if (id && *id > 0)
    clear.id = static_cast<std::uint64_t>(*id);
  else if (id)
    entry.reader.error(entry.reader.span("clear"), "scenario.clear", "what stands is numbered from 1");
}
Map form(const Clear& clear) { return {{std::string(Clear::kWord), static_cast<std::int64_t>(clear.id)}}; }
std::string concerned(const Clear& /*clear*/) { return ""; }
std::string told(const Clear& clear) { return fmt::format("clear {}", clear.id); }

template <class Failing>
concept FailingCalls = std::is_same_v<Failing, Unreachable> || std::is_same_v<Failing, Late>;
template <FailingCalls Failing>
void read(const Entry& entry, Failing& failing) {
  failing.call = entry.text(Failing::kWord);
}
template <FailingCalls Failing>
Map form(const Failing& failing) {
  return {{std::string(Failing::kWord), failing.call}};
}
template <FailingCalls Failing>
std::string concerned(const Failing& /*failing*/) {
  return "";
}
template <FailingCalls Failing>
std::string told(const Failing& failing) {
  return fmt::format("{} is {}", failing.call, Failing::kWord);
}

// Calls `each` with one of every kind.
template <class Each, std::size_t... kIndex>
void for_each_kind(const Each& each, std::index_sequence<kIndex...> /*of*/) {
  (each(std::variant_alternative_t<kIndex, Intervention>()), ...);
}
template <class Each>
void for_each_kind(const Each& each) {
  for_each_kind(each, std::make_index_sequence<std::variant_size_v<Intervention>>());
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

}  // namespace

bool stands(const Intervention& what) {
  return std::visit(
      [](const auto& one) {
        using One = std::decay_t<decltype(one)>;
        return !(std::is_same_v<One, Call> || std::is_same_v<One, Stop> || std::is_same_v<One, Kill> ||
                 std::is_same_v<One, Restart> || std::is_same_v<One, Clear>);
      },
      what);
}

std::uint64_t count_of(const Intervention& what) {
  return std::visit(
      [](const auto& one) -> std::uint64_t {
        if constexpr (requires { one.count; }) return one.count;
        return 0;
      },
      what);
}

std::string_view word_of(const Intervention& what) {
  return std::visit([](const auto& one) { return one.kWord; }, what);
}

Intervention read_intervention(YamlReader& reader, const text::YamlNode& entry, Diagnostics& diagnostics) {
  std::vector<Intervention> found;
  std::string words;
  for_each_kind([&](const auto& kind) {
    words += (words.empty() ? "" : ", ") + std::string(kind.kWord);
    if (reader.node(std::string(kind.kWord)) != nullptr) found.emplace_back(kind);
  });
  if (found.size() != 1) {
    reader.error(entry.span, found.empty() ? "project.missing-key" : "scenario.timeline",
                 "an entry of the timeline needs one of " + words);
    return {};
  }
  std::visit([&](auto& what) { read(Entry{reader, diagnostics}, what); }, found.front());
  return std::move(found.front());
}

Map to_entry(const Intervention& what) {
  return std::visit([](const auto& one) { return form(one); }, what);
}

std::string describe(const Intervention& what) {
  return std::visit([](const auto& one) { return told(one); }, what);
}

Message injection_message(const Intervention& what, const std::string& source, std::uint64_t id) {
  Message message;
  message.source = source;
  message.name = "scenario.injection";
  message.target = std::visit([](const auto& one) { return concerned(one); }, what);
  if (const auto* call = std::get_if<Call>(&what)) {
    message.data = Map{{"args", call->args}, {"what", call->method}};
    return message;
  }
  Map data = to_entry(what);
  data["what"] = word_of(what);
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
