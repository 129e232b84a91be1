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

template <class One>
std::string word() {
  return std::string(One::kKind.word);
}

// Reads the mapping below a kind's word, if it is one.
template <class One, class Read>
void read_mapping(YamlReader& reader, Diagnostics& diagnostics, const Read& read) {
  const auto* node = reader.mapping(word<One>());
  if (node == nullptr) return;
  YamlReader inner(*node, fmt::format("\"{}\"", word<One>()), diagnostics);
  read(inner, *node);
}

// A member of such a mapping.
struct ReadMember {
  YamlReader& reader;
  const text::YamlNode& node;
  std::string word;

  template <class Member>
  void operator()(const Member& member, std::string& text) const {
    text = member.may_lack ? reader.string(member.name).value_or("") : reader.required_string(member.name);
  }
  template <class Member>
  void operator()(const Member& member, Duration& duration) const {
    need(member.name, reader.node(member.name) != nullptr);
    duration = reader.duration(member.name).value_or(Duration(0));
  }
  // Null is one.
  template <class Member>
  void operator()(const Member& member, Value& value) const {
    reader.know(member.name);
    const text::YamlNode* const there = node.find(member.name);
    need(member.name, there != nullptr);
    if (there != nullptr) value = there->value();
  }
  template <class Member>
  void operator()(const Member& member, std::uint64_t& count) const {
    const auto number = reader.integer(member.name);
    if (number && *number > 0)
      count = static_cast<std::uint64_t>(*number);
    else if (number)
      reader.error(reader.span(member.name), "scenario.count",
                   "count must be at least 1; leave it out for as long as it is not cleared");
  }

 private:
  void need(const char* name, bool is_there) const {
    if (!is_there) reader.error(node.span, "project.missing-key", fmt::format("\"{}\" needs \"{}\"", word, name));
  }
};

void read_only_member(YamlReader& reader, const std::string& word, std::string& text) {
  text = reader.string(word).value_or("");
}
void read_only_member(YamlReader& reader, const std::string& word, std::uint64_t& number) {
  const auto given = reader.integer(word);
  if (given && *given > 0)
    number = static_cast<std::uint64_t>(*given);
  else if (given)
    reader.error(reader.span(word), fmt::format("scenario.{}", word), "what stands is numbered from 1");
}

void append_member(Map& entry, const char* name, const std::string& text) { entry[name] = text; }
void append_member(Map& entry, const char* name, const Value& value) { entry[name] = value; }
void append_member(Map& entry, const char* name, Duration duration) { entry[name] = exact_seconds(duration); }
void append_member(Map& entry, const char* name, std::uint64_t number) {
  entry[name] = static_cast<std::int64_t>(number);
}

// Of each kind: how it is read, what an entry says of it, whom it concerns, and how it is told in one line. Most of
// that follows from its members.

template <class One>
constexpr bool kHasOneMember = std::tuple_size_v<decltype(One::members())> == 1;

template <class One>
void read(YamlReader& reader, Diagnostics& diagnostics, One& what) {
  if constexpr (kHasOneMember<One>) {
    each_member(what, [&](const auto&, auto& member) { read_only_member(reader, word<One>(), member); });
  } else {
    read_mapping<One>(reader, diagnostics, [&](YamlReader& inner, const text::YamlNode& node) {
      each_member(what, ReadMember{inner, node, word<One>()});
      if constexpr (std::is_same_v<One, Force>) check_status(inner, what.status, {"SUCCESS", "FAILURE", "RUNNING"});
    });
  }
}
template <class One>
Map form(const One& what) {
  Map entry;
  each_member(what, [&](const auto& member, const auto& value) {
    if (!member.may_lack || value != std::decay_t<decltype(value)>()) append_member(entry, member.name, value);
  });
  return {{word<One>(), kHasOneMember<One> ? entry.begin()->second : Value(std::move(entry))}};
}
template <class One>
std::vector<std::string> keys(const One& what) {
  std::vector<std::string> names;
  each_member(what, [&](const auto& member, const auto& /*value*/) { names.emplace_back(member.name); });
  return names;
}
template <class One>
std::string concerned(const One& what) {
  if constexpr (requires { what.part; }) return what.part;
  if constexpr (requires { what.leaf; }) return what.leaf;
  return "";
}

void read(YamlReader& reader, Diagnostics& /*diagnostics*/, Call& call) {
  call.method = reader.string(word<Call>()).value_or("");
  if (!call.method.empty() && call.method.find('.') == std::string::npos) {
    reader.error(reader.span("call"), "scenario.call", fmt::format("call \"{}\" must be SERVICE.METHOD", call.method));
  }
  const auto* args = reader.mapping("args");
  call.args = args != nullptr ? args->value() : Value(Map());
}
Map form(const Call& call) {
  Map entry{{word<Call>(), call.method}};
  if (call.args.as_map() != nullptr && !call.args.as_map()->empty()) entry["args"] = call.args;
  return entry;
}
std::string concerned(const Call& call) { return call.method.substr(0, call.method.rfind('.')); }
std::string told(const Call& call) { return fmt::format("{} {}", call.method, to_json(call.args)); }

void read(YamlReader& reader, Diagnostics& /*diagnostics*/, Stop& /*stop*/) {
  if (const auto target = reader.string("stop"); target && *target != "mission") {
    reader.error(reader.span("stop"), "scenario.stop",
                 fmt::format("only the mission can be stopped; to end \"{}\" write kill: {}", *target, *target));
  }
}
Map form(const Stop& /*stop*/) { return {{word<Stop>(), "mission"}}; }
std::string concerned(const Stop& /*stop*/) { return "mission"; }
std::string told(const Stop& /*stop*/) { return "stop the mission"; }

std::string told(const Kill& kill) { return "kill " + kill.part; }
std::string told(const Restart& restart) { return "restart " + restart.part; }
std::string told(const Delay& delay) {
  return fmt::format("delay {} by {}{}", delay.message, exact_seconds(delay.by), times(delay.count));
}
std::string told(const Falsify& falsify) {
  return fmt::format("falsify {}: {} becomes {}{}", falsify.call, falsify.path.empty() ? "result" : falsify.path,
                     to_json(falsify.value), times(falsify.count));
}
std::string told(const Force& force) {
  return fmt::format("force {} to {}{}", force.leaf, force.status, times(force.count));
}

void read(YamlReader& reader, Diagnostics& diagnostics, Breakpoint& breakpoint) {
  read_mapping<Breakpoint>(reader, diagnostics, [&](YamlReader& inner, const text::YamlNode& place) {
    const auto node = inner.string("node");
    const auto chart = inner.string("chart");
    const auto message = inner.string("message");
    if ((node ? 1 : 0) + (chart ? 1 : 0) + (message ? 1 : 0) != 1) {
      inner.error(place.span, "scenario.breakpoint",
                  "a breakpoint needs one of \"node: PATH\", \"chart: NAME\" and \"message: PATTERN\"");
    } else if (node) {
      breakpoint.point = Breakpoint::Point::kNode;
      breakpoint.target = *node;
      breakpoint.status = inner.string("status").value_or("");
      check_status(inner, breakpoint.status, {"IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED"});
    } else if (chart) {
      breakpoint.point = Breakpoint::Point::kState;
      breakpoint.target = *chart;
      breakpoint.state = inner.required_string("state");
    } else {
      breakpoint.target = *message;
    }
  });
}
std::vector<std::string> keys(const Breakpoint& /*breakpoint*/) {
  return {"message", "node", "chart", "state", "status"};
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
  return {{word<Breakpoint>(), std::move(entry)}};
}
std::string told(const Breakpoint& breakpoint) {
  std::string at = "breakpoint at " + breakpoint.target;
  switch (breakpoint.point) {
    case Breakpoint::Point::kNode: return at + (breakpoint.status.empty() ? " changes" : " is " + breakpoint.status);
    case Breakpoint::Point::kState: return fmt::format("{} enters {}", at, breakpoint.state);
    case Breakpoint::Point::kMessage: break;
  }
  return at;
}

std::string told(const Clear& clear) { return fmt::format("clear {}", clear.id); }
std::string told(const Unreachable& what) { return fmt::format("{} is {}", what.call, what.kKind.word); }
std::string told(const Late& what) { return fmt::format("{} is {}", what.call, what.kKind.word); }

template <std::size_t... kIndex>
std::vector<Intervention> one_of_each(std::index_sequence<kIndex...> /*of*/) {
  return {std::variant_alternative_t<kIndex, Intervention>()...};
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

const std::vector<Intervention>& every_kind() {
  static const auto kEvery = one_of_each(std::make_index_sequence<std::variant_size_v<Intervention>>());
  return kEvery;
}

const Kind& kind_of(const Intervention& what) {
  return std::visit([](const auto& one) -> const Kind& { return one.kKind; }, what);
}

std::vector<std::string> keys_of(const Intervention& kind) {
  return std::visit([](const auto& one) { return keys(one); }, kind);
}

std::uint64_t count_of(const Intervention& what) {
  return std::visit(
      [](const auto& one) -> std::uint64_t {
        if constexpr (requires { one.count; }) return one.count;
        return 0;
      },
      what);
}

Intervention read_intervention(YamlReader& reader, const text::YamlNode& entry, Diagnostics& diagnostics) {
  std::vector<Intervention> found;
  std::vector<std::string_view> words;
  for (const Intervention& kind : every_kind()) {
    words.push_back(word_of(kind));
    if (reader.node(std::string(words.back())) != nullptr) found.push_back(kind);
  }
  if (found.size() != 1) {
    reader.error(entry.span, found.empty() ? "project.missing-key" : "scenario.timeline",
                 fmt::format("an entry of the timeline needs one of {}{}", fmt::join(words, ", "),
                             found.size() < 2 ? ""
                                              : fmt::format("; it has {} and {}, make two entries of it",
                                                            word_of(found[0]), word_of(found[1]))));
    return {};
  }
  std::visit([&](auto& what) { read(reader, diagnostics, what); }, found.front());
  return std::move(found.front());
}

Result<Intervention> from_entry(const Map& entry) {
  const text::YamlNode yaml = written(Value(entry));
  Diagnostics diagnostics;
  Intervention what;
  {
    YamlReader reader(yaml, "it", diagnostics);
    what = read_intervention(reader, yaml, diagnostics);
  }
  for (const Diagnostic& one : diagnostics) {
    if (one.severity == Severity::kError) return fail(one.code, one.message);
  }
  return what;
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
  auto read = from_entry(entry);
  return read ? std::optional(std::move(*read)) : std::nullopt;
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
