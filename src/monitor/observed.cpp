#include "sentree/monitor/observed.h"

#include <algorithm>

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

}  // namespace

Observations::Observations(const Vocabulary& vocabulary) : vocabulary_(vocabulary) {
  for (const auto& [service, methods] : vocabulary.services) {
    for (const auto& [method, types] : methods) {
      const std::string call = fmt::format("{}.{}", service, method);
      add(call + ".request", {Form::kRequest, "", service, &types});
      add(call + ".error", {Form::kError, "", service, &types});
      if (types.oneway) continue;
      add(call + ".reply", {Form::kReply, "", service, &types});
      add(call + ".late", {Form::kLate, "", service, &types});
    }
  }
  for (const std::string& leaf : vocabulary.leaves) {
    add(leaf + ".tick.request", {Form::kLeafTick, "mission", leaf});
    add(leaf + ".tick.reply", {Form::kLeafAnswer, leaf, "mission"});
    add(leaf + ".tick.error", {Form::kLeafError, leaf, "mission"});
    for (const char* what : {"tick", "halt", "cancel", "timer", "topic", "kill", "restart"})
      add(fmt::format("{}.{}.taken", leaf, what), {Form::kOpen, leaf, ""});
    add(leaf + ".topic.untaken", {Form::kOpen, leaf, ""});
    for (const char* what : {"tick", "halt", "cancel", "topic"})
      add(fmt::format("{}.{}.delayed", leaf, what), {Form::kOpen, "scenario", leaf});
    add(leaf + ".halt.request", {Form::kBare, "mission", leaf});
    add(leaf + ".halt.reply", {Form::kBare, leaf, "mission"});
    add(leaf + ".cancel", {Form::kBare, "mission", leaf});
    add(leaf + ".log", {Form::kLeafLog, leaf, ""});
    add(leaf + ".given_up", {Form::kLeafGivenUp, leaf, ""});
  }
  for (const std::string& model : vocabulary.models) {
    add(model + ".choice", {Form::kOpen});
    add(model + ".log", {Form::kLeafLog, model, ""});
  }
  add("mission.tick", {Form::kTick});
  add("mission.status", {Form::kMissionStatus});
  add("mission.resumed", {Form::kOpen});
  add("node.status", {Form::kNodeStatus});
  add("observer.lost", {Form::kLost});
  for (const char* what : {"process.exited", "process.restarted", "process.given_up"}) add(what, {Form::kProcess});
  add("scenario.injection", {Form::kOpen});
  add("scenario.breakpoint", {Form::kOpen});
  add("monitor.violated", {Form::kVerdict});
  add("monitor.satisfied", {Form::kVerdict});
  add("monitor.given_up", {Form::kMonitorGivenUp});
}

void Observations::add(std::string name, Entry entry) {
  names_.push_back(std::move(name));
  entries_.push_back(std::move(entry));
}

const Observations::Entry* Observations::find(std::string_view name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  return found == names_.end() ? nullptr : &entries_[static_cast<std::size_t>(found - names_.begin())];
}

DataType Observations::data_of(std::string_view name) const {
  const Entry* entry = find(name);
  if (entry == nullptr || entry->form == Form::kOpen) return {};
  DataType data{.kind = TypeKind::kRecord, .name = fmt::format("the data of {}", name), .may_be_absent = false};
  const auto member = [&](std::string id, DataType type) { data.members.push_back({std::move(id), std::move(type)}); };
  const bool is_call = entry->method != nullptr;
  if (is_call && !entry->method->oneway)
    member("source", one_of("leaf of the mission", vocabulary_.leaves));
  else if (!entry->source.empty())
    member("source", one_of(fmt::format("source of {}", name), {entry->source}));
  else if (entry->form == Form::kNodeStatus)
    member("source", one_of("node of the mission", vocabulary_.nodes));
  else
    member("source", text());
  member("target", is_call ? one_of(fmt::format("target of {}", name), {entry->target}) : text());
  member("call", number());
  member("tick", number());
  member("time", number("s"));
  DataType anything;
  switch (entry->form) {
    case Form::kMissionStatus: member("status", status()); break;
    case Form::kNodeStatus:
      member("node", number());
      member("from", status());
      member("to", status());
      break;
    case Form::kLeafTick: member("inputs", anything); break;
    case Form::kLeafAnswer:
      member("status", status());
      member("outputs", anything);
      member("forced", truth());
      break;
    case Form::kLeafError:
      member("kind", one_of("kind of error", {"late"}));
      member("message", text());
      break;
    case Form::kLeafLog:
      member("label", text());
      member("text", anything);
      break;
    case Form::kLeafGivenUp: member("reason", text()); break;
    case Form::kRequest: member("args", entry->method->arguments); break;
    case Form::kReply:
      member("args", entry->method->arguments);
      member("result", entry->method->result);
      break;
    case Form::kLate: member("result", entry->method->result); [[fallthrough]];
    case Form::kError:
      member("args", entry->method->arguments);
      member("kind", one_of("kind of error", {"exception", "vetoed", "unreachable", "late", "protocol"}));
      member("message", text());
      member("exception", anything);
      member("vetoed_by", text());
      break;
    case Form::kLost:
      member("count", number());
      member("first", anything);
      break;
    case Form::kProcess:
      member("process", text());
      member("pid", number());
      member("how", anything);
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

}  // namespace sentree::monitor
