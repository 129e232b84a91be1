#include "sentree/monitor/observed.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace sentree::monitor {

namespace {

using TypeKind = DataType::Kind;

DataType number(std::string unit = {}) {
  return {.kind = TypeKind::kNumber, .name = "number", .unit = std::move(unit), .may_be_absent = false};
}
DataType text() { return {.kind = TypeKind::kText, .name = "string", .may_be_absent = false}; }
DataType one_of(std::string name, std::vector<std::string> words) {
  return {.kind = TypeKind::kText, .name = std::move(name), .may_be_absent = false, .words = std::move(words)};
}
DataType truth() { return {.kind = TypeKind::kTruth, .name = "bool"}; }
DataType status() { return one_of("status", {"IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED"}); }

using Form = Observed::Form;

// Observations by the end of their name, which begins with that of a leaf, a call or a model; of a run by all of it.
struct Named {
  std::string_view name;
  Form form;
};
constexpr std::array<Named, 21> kOfLeaf{{{".tick.request", Form::kLeafTick},
                                         {".tick.reply", Form::kLeafAnswer},
                                         {".tick.error", Form::kLeafError},
                                         {".tick.taken", Form::kTaken},
                                         {".halt.taken", Form::kTaken},
                                         {".cancel.taken", Form::kTaken},
                                         {".kill.taken", Form::kBare},
                                         {".restart.taken", Form::kBare},
                                         {".timer.taken", Form::kTimerTaken},
                                         {".topic.taken", Form::kTopicTaken},
                                         {".topic.untaken", Form::kTopicTaken},
                                         {".tick.delayed", Form::kDelayed},
                                         {".halt.delayed", Form::kDelayed},
                                         {".cancel.delayed", Form::kDelayed},
                                         {".topic.delayed", Form::kDelayed},
                                         {".halt.request", Form::kBare},
                                         {".halt.reply", Form::kBare},
                                         {".cancel", Form::kBare},
                                         {".log", Form::kLog},
                                         {".unreachable", Form::kGivenUp},
                                         {".given_up", Form::kGivenUp}}};
constexpr std::array<Named, 4> kOfCall{
    {{".request", Form::kRequest}, {".error", Form::kError}, {".reply", Form::kReply}, {".late", Form::kLate}}};
constexpr std::array<Named, 2> kOfModel{{{".choice", Form::kChoice}, {".log", Form::kLog}}};
constexpr std::array<Named, 14> kOfRun{{{"mission.tick", Form::kBare},
                                        {"mission.status", Form::kMissionStatus},
                                        {"mission.stop.taken", Form::kBare},
                                        {"mission.resumed", Form::kResumed},
                                        {"node.status", Form::kNodeStatus},
                                        {"observer.lost", Form::kLost},
                                        {"process.exited", Form::kProcess},
                                        {"process.restarted", Form::kProcess},
                                        {"process.given_up", Form::kProcess},
                                        {"scenario.injection", Form::kInjection},
                                        {"scenario.breakpoint", Form::kBreakpoint},
                                        {"monitor.violated", Form::kVerdict},
                                        {"monitor.satisfied", Form::kVerdict},
                                        {"monitor.given_up", Form::kMonitorGivenUp}}};

// Who says so; nothing: the leaf itself.
std::string_view sender_to_leaf(std::string_view end) {
  if (end.ends_with(".delayed")) return "scenario";
  if (end == ".unreachable") return "run";
  return end.ends_with(".request") || end == ".cancel" ? "mission" : "";
}

DataType absent(DataType type) {
  type.may_be_absent = true;
  return type;
}

DataType data_of(const Observed& one, std::string_view name, const Vocabulary& vocabulary) {
  DataType data{.kind = TypeKind::kRecord, .name = fmt::format("the data of {}", name), .may_be_absent = false};
  const auto member = [&](std::string id, DataType type) { data.members.push_back({std::move(id), std::move(type)}); };
  static const Vocabulary::Method kUnknownMethod;
  const Vocabulary::Method& method = one.method != nullptr ? *one.method : kUnknownMethod;
  // What is overheard others call, and topics anybody publishes.
  const bool is_call_of_leaf = one.method != nullptr && !method.oneway && !method.overheard;
  if (is_call_of_leaf)
    member("source", one_of("leaf of the mission", vocabulary.leaves));
  else if (!one.source.empty())
    member("source", one_of(fmt::format("source of {}", name), {one.source}));
  else if (one.form == Form::kNodeStatus)
    member("source", one_of("node of the mission", vocabulary.nodes));
  else
    member("source", text());
  member("target", one.method != nullptr ? one_of(fmt::format("target of {}", name), {one.target}) : text());
  member("call", number());
  member("tick", number());
  member("time", number("s"));
  DataType anything;
  const auto ports = [&](const std::string& leaf, bool are_inputs) {
    const auto found = vocabulary.ports.find(leaf);
    if (found == vocabulary.ports.end()) return anything;
    return are_inputs ? found->second.inputs : found->second.outputs;
  };
  switch (one.form) {
    case Form::kMissionStatus: member("status", status()); break;
    case Form::kResumed:
      for (const char* time : {"from_ns", "lost_ns", "wall_ns"}) member(time, number());
      break;
    case Form::kNodeStatus:
      member("node", number());
      member("from", status());
      member("to", status());
      break;
    case Form::kLeafTick: member("inputs", ports(one.target, true)); break;
    case Form::kLeafAnswer:
      member("status", status());
      member("outputs", ports(one.source, false));
      member("forced", truth());
      break;
    case Form::kLeafError:
      member("kind", one_of("kind of error", {"late"}));
      member("message", text());
      break;
    case Form::kLog:
      member("label", text());
      member("text", anything);
      break;
    case Form::kGivenUp: member("reason", text()); break;
    case Form::kTimerTaken: member("number", number()); break;
    case Form::kTaken: member("delayed", absent(truth())); break;
    case Form::kDelayed:
      member("by_ns", absent(number()));
      member("topic", absent(text()));
      member("sequence", absent(number()));
      break;
    case Form::kTopicTaken:
      member("topic", text());
      member("sequence", number());
      break;
    case Form::kRequest: member("args", method.arguments); break;
    case Form::kReply:
      member("args", method.arguments);
      member("result", method.result);
      break;
    case Form::kLate: member("result", absent(method.result)); [[fallthrough]];
    case Form::kError:
      member("args", method.arguments);
      for (const DataMember& part : data_of_error(method).members)
        member(part.name, one.form == Form::kLate ? absent(part.type) : part.type);
      break;
    case Form::kChoice: {
      const auto known = vocabulary.choices.find(one.source);
      const bool is_known = known != vocabulary.choices.end();
      member("function", one_of("function that chooses", {"choose", "pick", "between", "chance", "draw"}));
      member("name", absent(is_known ? known->second.name : text()));
      member("value", is_known ? known->second.value : anything);
      member("place", absent(text()));
      break;
    }
    case Form::kLost:
      member("count", number());
      member("first", anything);
      break;
    case Form::kProcess:
      member("process", text());
      member("pid", number());
      member("how", anything);
      break;
    case Form::kInjection:
      // And a member of its word, which says what the timeline would say.
      data.kind = TypeKind::kUnknown;
      member("what", text());
      for (const char* id : {"args", "changes", "nodes", "id"}) member(id, anything);
      break;
    case Form::kBreakpoint:
      member("breakpoint", number());
      member("what", text());
      break;
    case Form::kVerdict:
      member("monitor", text());
      member("state", text());
      break;
    case Form::kMonitorGivenUp:
      member("monitor", text());
      member("reason", text());
      break;
    default: break;
  }
  return data;
}

}  // namespace

DataType data_of_error(const Vocabulary::Method& method) {
  DataType data{.kind = TypeKind::kRecord, .name = "an error", .may_be_absent = false};
  data.members.push_back(
      {"kind", one_of("kind of error", {"exception", "vetoed", "unreachable", "late", "protocol", "interrupted"})});
  data.members.push_back({"message", text()});
  data.members.push_back({"exception", absent(method.exceptions)});
  data.members.push_back({"vetoed_by", absent(text())});
  return data;
}

DataType data_of_any(std::string_view name) {
  static const Vocabulary kNothing;
  DataType data;
  const auto add = [&](Form form) {
    const DataType one = data_of(Observed{.form = form}, name, kNothing);
    if (data.members.empty()) {
      data = one;
      return;
    }
    DataMembers joined;
    const auto of = [](const DataType& record, const std::string& id) {
      return std::find_if(record.members.begin(), record.members.end(), [&](const auto& m) { return m.name == id; });
    };
    for (const DataMember& member : data.members) {
      const auto* const other = of(one, member.name);
      const bool differs = other != one.members.end() && !(other->type == member.type);
      joined.push_back(differs ? DataMember{member.name, {}} : member);
    }
    for (const DataMember& member : one.members) {
      if (of(data, member.name) == data.members.end()) joined.push_back(member);
    }
    data.members = std::move(joined);
  };
  for (const Named& whole : kOfRun) {
    if (whole.name == name) add(whole.form);
  }
  if (!data.members.empty()) return data;
  const auto add_ends = [&](const auto& ends) {
    for (const Named& end : ends) {
      if (name.ends_with(end.name)) add(end.form);
    }
  };
  add_ends(kOfLeaf);
  add_ends(kOfCall);
  add_ends(kOfModel);
  return data;
}

const std::set<std::string>& observed_members() {
  static const std::set<std::string> kMembers = [] {
    const Vocabulary nothing;
    std::set<std::string> members;
    const auto add = [&](const auto& all) {
      for (const auto& [name, form] : all) {
        for (const DataMember& member : data_of(Observed{.form = form}, name, nothing).members)
          members.insert(member.name);
      }
    };
    add(kOfLeaf);
    add(kOfCall);
    add(kOfModel);
    add(kOfRun);
    return members;
  }();
  return kMembers;
}

Observations::Observations(const Vocabulary& vocabulary) : vocabulary_(vocabulary) {
  for (const auto& [service, methods] : vocabulary.services) {
    for (const auto& [method, types] : methods) {
      for (const auto& [end, form] : kOfCall) {
        if (types.oneway && (form == Form::kReply || form == Form::kLate)) continue;
        add(fmt::format("{}.{}{}", service, method, end), {form, "", service, &types});
      }
    }
  }
  for (const std::string& leaf : vocabulary.leaves) {
    for (const auto& [end, form] : kOfLeaf) {
      const std::string_view sender = sender_to_leaf(end);
      add(fmt::format("{}{}", leaf, end),
          {form, sender.empty() ? leaf : std::string(sender), sender.empty() ? "" : leaf});
    }
  }
  for (const std::string& model : vocabulary.models) {
    for (const auto& [end, form] : kOfModel) add(fmt::format("{}{}", model, end), {form, model, ""});
  }
  for (const auto& [name, form] : kOfRun) add(std::string(name), {form});
}

void Observations::add(std::string name, Observed observed) {
  names_.push_back(std::move(name));
  observed_.push_back(std::move(observed));
}

DataType Observations::data_of(std::string_view name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) return {};
  return monitor::data_of(observed_[static_cast<std::size_t>(found - names_.begin())], name, vocabulary_);
}

}  // namespace sentree::monitor
