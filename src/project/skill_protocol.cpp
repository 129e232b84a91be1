#include "sentree/project/detail/skill_protocol.h"

#include <algorithm>
#include <array>
#include <set>

#include <fmt/format.h>

#include "sentree/project/yaml_reader.h"
#include "sentree/scxml/event.h"

namespace sentree::project {

namespace {

constexpr std::array kStatuses{bt::Status::kSuccess, bt::Status::kFailure, bt::Status::kRunning};

std::vector<std::string> status_names() {
  std::vector<std::string> names;
  for (const bt::Status status : kStatuses) names.emplace_back(bt::to_string(status));
  return names;
}

// As a key of `values:`. A number is the same whether a script made it an integer or not.
std::string as_key(const Value& value) {
  if (const std::string* text = value.as_string()) return *text;
  std::string text = to_json(value);
  if (text.ends_with(".0")) text.resize(text.size() - 2);
  return text;
}

// {0: SUCCESS, 1: FAILURE}
SkillProtocol::Meanings read_meanings(const text::YamlNode& node, const std::string& key, SkillProtocol& protocol,
                                      YamlReader& reader) {
  SkillProtocol::Meanings meanings;
  for (const auto& [name, entry] : node.entries) {
    const auto status = std::find_if(kStatuses.begin(), kStatuses.end(),
                                     [&entry = entry](bt::Status s) { return bt::to_string(s) == entry.scalar; });
    if (status == kStatuses.end()) {
      reader.error(entry.span, "project.protocol",
                   fmt::format("\"{}\" means \"{}\", which is no status; write SUCCESS, FAILURE or RUNNING{}",
                               name.scalar, entry.scalar, did_you_mean(entry.scalar, status_names())));
      continue;
    }
    meanings.emplace_back(name.scalar, *status);
    protocol.places[fmt::format("{}.{}", key, name.scalar)] = name.span;
  }
  return meanings;
}

SkillProtocol read_protocol(const text::YamlNode& node, const std::string& what, Diagnostics& diagnostics) {
  SkillProtocol protocol;
  protocol.places[""] = node.span;
  YamlReader reader(node, what, diagnostics);
  const auto name = [&](const char* key) {
    protocol.places[key] = reader.span(key);
    return reader.string(key).value_or("");
  };
  protocol.start = name("start");
  protocol.tick = name("tick");
  protocol.halt = name("halt");
  protocol.acknowledge = name("acknowledge");
  protocol.halted = name("halted");
  if (const auto* answer = reader.mapping("answer")) {
    YamlReader inner(*answer, "\"answer\" of " + what, diagnostics);
    protocol.answer = inner.required_string("event");
    protocol.places["answer"] = inner.span("event");
    protocol.param = inner.string("param").value_or("");
    protocol.places["param"] = inner.span("param");
    if (const auto* values = inner.mapping("values"))
      protocol.values = read_meanings(*values, "values", protocol, inner);
    else
      for (const bt::Status status : kStatuses) protocol.values.emplace_back(bt::to_string(status), status);
  }
  if (const auto* states = reader.mapping("states"))
    protocol.states = read_meanings(*states, "states", protocol, reader);
  if (!node.is_mapping()) return protocol;
  if (protocol.start.empty() && protocol.tick.empty()) {
    reader.error(node.span, "project.protocol",
                 what + " needs \"tick\" or \"start\": the event that sets the chart to work");
  }
  if (protocol.answer.empty() && protocol.states.empty() && reader.node("answer") == nullptr) {
    reader.error(
        node.span, "project.protocol",
        what + " needs \"answer\": {event: NAME, param: NAME} or \"states\": {STATE: SUCCESS, …}: what answers a tick");
  }
  return protocol;
}

}  // namespace

std::optional<bt::Status> SkillProtocol::meaning(const Value& status) const {
  const std::string text = as_key(status);
  for (const auto& [value, means] : values) {
    if (value == text) return means;
  }
  return std::nullopt;
}

Map initial_data(const std::vector<SkillConstant>& constants) {
  Map data;
  for (const SkillConstant& constant : constants) data[constant.id] = constant.value;
  return data;
}

void read_protocols(const text::YamlNode& node, Project& project, Diagnostics& diagnostics) {
  for (const auto& [name, entry] : node.entries)
    project.protocols[name.scalar] = read_protocol(entry, fmt::format("protocol \"{}\"", name.scalar), diagnostics);
}

void read_skill(YamlReader& reader, const Project& project, SkillEntry& skill, Diagnostics& diagnostics) {
  if (const auto file = reader.string("file")) skill.file = {*file, reader.span("file")};
  if (const auto at = reader.string("at")) skill.at = *at;
  if (const auto* data = reader.mapping("data")) {
    skill.data.clear();
    for (const auto& [id, value] : data->entries) skill.data.push_back({id.scalar, value.value(), id.span});
  }
  if (reader.node("subscribe") != nullptr || reader.node("latest") != nullptr) {
    const char* named = reader.node("subscribe") != nullptr ? "subscribe" : "latest";
    skill.subscribes = {reader.strings("subscribe"), reader.strings("latest"), reader.span(named)};
    auto& topics = skill.subscribes.topics;
    for (const std::string& topic : skill.subscribes.latest) {
      if (std::find(topics.begin(), topics.end(), topic) == topics.end()) topics.push_back(topic);
    }
  }
  const text::YamlNode* protocol = reader.node("protocol");
  if (protocol == nullptr) return;
  if (!protocol->is_scalar()) {
    skill.protocol = read_protocol(*protocol, fmt::format("protocol of skill \"{}\"", skill.leaf), diagnostics);
    return;
  }
  const auto shared = project.protocols.find(protocol->scalar);
  if (shared != project.protocols.end()) {
    skill.protocol = shared->second;
    return;
  }
  std::vector<std::string> names;
  for (const auto& [name, known] : project.protocols) names.push_back(name);
  reader.error(
      protocol->span, "project.protocol",
      fmt::format("\"protocols\" has no \"{}\"{}; a protocol can also be written here, as {{tick: …, answer: …}}",
                  protocol->scalar, did_you_mean(protocol->scalar, names)));
}

void check_skill_data(const std::vector<SkillConstant>& constants, const scxml::Chart& chart,
                      Diagnostics& diagnostics) {
  std::vector<std::string> ids;
  for (const scxml::DataItem& item : chart.data()) ids.push_back(item.id);
  for (const SkillConstant& constant : constants) {
    if (std::find(ids.begin(), ids.end(), constant.id) != ids.end()) continue;
    diagnostics.push_back(
        {Severity::kError, "check.skill-data",
         fmt::format("data \"{}\" reaches nothing: {} has no <data id=\"{}\"> directly below <scxml>{}", constant.id,
                     chart.file(), constant.id, did_you_mean(constant.id, ids)),
         constant.span});
  }
}

namespace {

class ProtocolCheck {
 public:
  ProtocolCheck(const SkillProtocol& protocol, const scxml::Chart& chart, Diagnostics& diagnostics)
      : protocol_(protocol), chart_(chart), diagnostics_(diagnostics) {
    for (const scxml::State& state : chart.states()) {
      if (!state.id.empty()) states_.push_back(state.id);
    }
    for (const scxml::SendInfo& send : chart.sends()) all_sends_known_ = all_sends_known_ && send.event.has_value();
  }

  void run() {
    handled("start", protocol_.start);
    handled("tick", protocol_.tick);
    handled("halt", protocol_.halt);
    handled("acknowledge", protocol_.acknowledge);
    for (const auto& [state, status] : protocol_.states) {
      if (!chart_.find(state))
        error("states." + state, fmt::format("has no state \"{}\"{}", state, did_you_mean(state, states_)));
    }
    if (!protocol_.halted.empty() && !chart_.find(protocol_.halted) && !sends(protocol_.halted)) {
      std::vector<std::string> known = chart_.events_sent();
      known.insert(known.end(), states_.begin(), states_.end());
      error("halted", fmt::format("neither sends an event \"{}\" nor has such a state{}", protocol_.halted,
                                  did_you_mean(protocol_.halted, known)));
    }
    if (protocol_.answer.empty()) return;
    if (!sends(protocol_.answer)) {
      error("answer", fmt::format("never sends \"{}\", which is to answer its ticks{}", protocol_.answer,
                                  did_you_mean(protocol_.answer, chart_.events_sent())));
    }
    for (const scxml::SendInfo& send : chart_.sends()) {
      if (send.event == protocol_.answer) answer(send);
    }
  }

 private:
  void error(const std::string& key, const std::string& what) {
    const auto place = protocol_.places.find(key);
    diagnostics_.push_back({Severity::kError, "check.protocol", fmt::format("{} {}", chart_.file(), what),
                            place != protocol_.places.end() ? place->second : protocol_.places.at("")});
  }

  [[nodiscard]] bool sends(const std::string& event) const {
    if (!all_sends_known_) return true;
    const std::vector<std::string> sent = chart_.events_sent();
    return std::find(sent.begin(), sent.end(), event) != sent.end();
  }

  void handled(const std::string& key, const std::string& event) {
    if (event.empty()) return;
    const std::vector<std::string> known = chart_.events_handled();
    if (std::any_of(known.begin(), known.end(),
                    [&](const std::string& descriptor) { return scxml::event_matches(descriptor, event); }))
      return;
    error(key, fmt::format("has no transition for \"{}\"{}", event, did_you_mean(event, known)));
  }

  // The status that a <send> of the answer carries.
  void answer(const scxml::SendInfo& send) {
    if (protocol_.param.empty() || send.has_content) return;
    const auto param = std::find_if(send.params.begin(), send.params.end(),
                                    [&](const scxml::SendParam& p) { return p.name == protocol_.param; });
    if (param == send.params.end()) {
      std::vector<std::string> names;
      for (const scxml::SendParam& p : send.params) names.push_back(p.name);
      diagnostics_.push_back({Severity::kError, "check.protocol",
                              fmt::format("\"{}\" answers a tick and has no param \"{}\"{}", protocol_.answer,
                                          protocol_.param, did_you_mean(protocol_.param, names)),
                              chart_.span(send.place)});
      return;
    }
    std::optional<Value> value = param->constant;
    for (const scxml::DataItem& item : chart_.data()) {
      if (!value && item.id == param->expression) value = item.initial;
    }
    if (!value || value->is_null() || protocol_.meaning(*value)) return;
    std::vector<std::string> names;
    std::string listed;
    for (const auto& [name, means] : protocol_.values) {
      names.push_back(name);
      listed += (listed.empty() ? "" : ", ") + name;
    }
    diagnostics_.push_back({Severity::kError, "check.protocol",
                            fmt::format("the answer {} is none of the protocol's values ({}){}", as_key(*value), listed,
                                        did_you_mean(as_key(*value), names)),
                            chart_.span(param->place)});
  }

  const SkillProtocol& protocol_;
  const scxml::Chart& chart_;
  Diagnostics& diagnostics_;
  std::vector<std::string> states_;
  bool all_sends_known_ = true;
};

}  // namespace

void check_protocol(const SkillProtocol& protocol, const scxml::Chart& chart, Diagnostics& diagnostics) {
  ProtocolCheck(protocol, chart, diagnostics).run();
}

}  // namespace sentree::project
