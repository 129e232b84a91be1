#include "sentree/project/check_intervention.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include "sentree/idl/conform.h"

namespace sentree::project {

namespace {

using Kind = Intervention::Kind;
using Names = std::vector<std::string>;

std::optional<std::size_t> to_index(std::string_view text) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return index;
}

// "a.b" as "a" and "b".
std::pair<std::string_view, std::string_view> split(std::string_view path) {
  const auto dot = path.find('.');
  if (dot == std::string_view::npos) return {path, {}};
  return {path.substr(0, dot), path.substr(dot + 1)};
}

bool contains(const Names& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

class Check {
 public:
  Check(const Intervention& what, const InterventionScope& scope, const SourceSpan& span)
      : what_(what), scope_(scope), span_(span) {}

  Result<void> run() const {
    switch (what_.kind) {
      case Kind::kCall: return call();
      case Kind::kKill:
      case Kind::kRestart: return part();
      case Kind::kDelay: return delay();
      case Kind::kFalsify: return falsify();
      case Kind::kForce: return force();
      case Kind::kUnreachable:
      case Kind::kLate: return failing();
      case Kind::kBreakpoint: return breakpoint();
      case Kind::kStop:
      case Kind::kClear: break;
    }
    return {};
  }

 private:
  tl::unexpected<Diagnostic> refuse(std::string code, std::string message) const {
    return fail(std::move(code), std::move(message), span_);
  }

  Result<void> call() const {
    const auto dot = what_.target.rfind('.');
    const std::string name = what_.target.substr(0, dot);
    const bool is_control =
        scope_.world != nullptr ? test_control_of(name, *scope_.world).has_value() : name == kTestControl;
    const auto found = scope_.services->find(name);
    const idl::ServicePtr service = is_control                        ? scope_.test_control
                                    : found != scope_.services->end() ? found->second.service
                                                                      : nullptr;
    if (!service || dot == std::string::npos) {
      Names names;
      for (const auto& [known, plan] : *scope_.services) names.push_back(known);
      if (scope_.world != nullptr && scope_.test_control) {
        for (const std::string& control : test_control_names(*scope_.world)) names.push_back(control);
      }
      return refuse("scenario.call", "the project has no service \"" + name + "\"" + did_you_mean(name, names));
    }
    const auto method = idl::find_method(*service, what_.target.substr(dot + 1), name, span_);
    if (!method) return tl::unexpected(method.error());
    const auto args = idl::conform_arguments(**method, what_.args);
    if (!args) return refuse(args.error().code, args.error().message);
    if (const auto checked = idl::check_ranges(**method, *args); !checked)
      return refuse(checked.error().code, checked.error().message);
    return is_control ? door(**method, *args) : Result<void>();
  }

  // Obstacles come and go in a run; doors are those of the world.
  Result<void> door(const idl::Method& method, const Value& args) const {
    const Value* const id = args.find("id");
    if (scope_.world == nullptr || method.name != "setDoor" || id == nullptr) return {};
    Names names;
    for (const auto& door : scope_.world->doors) names.push_back(door.id);
    const std::string wanted(id->text());
    if (contains(names, wanted)) return {};
    return refuse("scenario.call", "the world has no door \"" + wanted + "\"" + did_you_mean(wanted, names));
  }

  Result<void> part() const {
    Names names;
    for (const SteeredPart& part : parts_of(scope_)) names.push_back(part.name);
    if (contains(names, what_.target)) return {};
    std::string why =
        "nothing of this run that can be killed is called \"" + what_.target + "\"" + did_you_mean(what_.target, names);
    if (scope_.monitors != nullptr) {
      for (const monitor::Model& monitor : *scope_.monitors) {
        if (monitor.name() == what_.target)
          why = "monitor \"" + what_.target +
                "\" runs in this process and cannot be killed; give it a process of its own";
      }
    }
    return refuse("scenario.kill", std::move(why));
  }

  // Every call, "SERVICE.METHOD".
  Names calls() const {
    Names names;
    for (const auto& [name, service] : *scope_.services) {
      for (const idl::Method* method : service.service->methods) names.push_back(name + "." + method->name);
    }
    return names;
  }

  Result<void> delay() const {
    if (what_.by <= Duration(0)) return refuse("steering.delay", "a delay must be longer than 0 s");
    Names names = calls();
    for (std::size_t i = 0, count = names.size(); i < count; ++i) names.push_back(names[i] + ".reply");
    if (scope_.leaves == nullptr) return {};
    for (const LeafPlan& leaf : *scope_.leaves) {
      for (const char* message : {".tick", ".halt"}) names.push_back(leaf.name + message);
    }
    const bool is_reply = what_.target.ends_with(".reply");
    for (const std::string& name : names) {
      if (name.ends_with(".reply") == is_reply && matches_pattern(what_.target, name)) return {};
    }
    return refuse("steering.unknown-message", "no message is called \"" + what_.target +
                                                  "\": LEAF.tick, LEAF.halt, SERVICE.METHOD or SERVICE.METHOD.reply" +
                                                  did_you_mean(what_.target, names));
  }

  Result<void> falsify() const {
    std::optional<Diagnostic> why;
    for (const auto& [name, service] : *scope_.services) {
      for (const idl::Method* method : service.service->methods) {
        if (!matches_pattern(what_.target, name + "." + method->name)) continue;
        const auto type = method->result != nullptr ? type_at(*method->result, what_.path)
                                                    : fail("steering.path", method->name + " returns nothing");
        if (!type) {
          why = type.error();
        } else if (const auto value = idl::conform(**type, what_.value, what_.path.empty() ? "result" : what_.path);
                   !value) {
          why = value.error();
        } else {
          return {};
        }
      }
    }
    if (why) return refuse(why->code, "falsify " + what_.target + ": " + why->message);
    return refuse("steering.unknown-call",
                  "no service has a method \"" + what_.target + "\"" + did_you_mean(what_.target, calls()));
  }

  Result<void> failing() const {
    bool is_oneway = false;
    for (const auto& [name, service] : *scope_.services) {
      for (const idl::Method* method : service.service->methods) {
        if (!matches_pattern(what_.target, name + "." + method->name)) continue;
        if (!method->oneway) return {};
        is_oneway = true;
      }
    }
    if (is_oneway)
      return refuse("steering.unknown-call", what_.target + " is one-way: nobody learns what became of it");
    return refuse("steering.unknown-call",
                  "no service has a method \"" + what_.target + "\"" + did_you_mean(what_.target, calls()));
  }

  const LeafPlan* leaf(const std::string& name) const {
    const auto found = std::find_if(scope_.leaves->begin(), scope_.leaves->end(),
                                    [&](const LeafPlan& leaf) { return leaf.name == name; });
    return found != scope_.leaves->end() ? &*found : nullptr;
  }

  Names leaf_names() const {
    Names names;
    for (const LeafPlan& leaf : *scope_.leaves) names.push_back(leaf.name);
    return names;
  }

  Result<void> force() const {
    if (scope_.leaves == nullptr) return {};
    const LeafPlan* found = leaf(what_.target);
    if (found == nullptr) {
      return refuse("steering.unknown-leaf", "no leaf that runs a skill is called \"" + what_.target + "\"" +
                                                 did_you_mean(what_.target, leaf_names()));
    }
    const Names statuses{"SUCCESS", "FAILURE", "RUNNING"};
    if (!contains(statuses, what_.status)) {
      return refuse("steering.status", "a leaf cannot be forced to \"" + what_.status +
                                           "\"; there are SUCCESS, FAILURE "
                                           "and RUNNING" +
                                           did_you_mean(what_.status, statuses));
    }
    if (found->condition && what_.status == "RUNNING")
      return refuse("steering.status", "leaf \"" + what_.target + "\" is a condition, which is never RUNNING");
    return {};
  }

  Result<void> breakpoint() const {
    switch (what_.point) {
      case Intervention::Point::kMessage:
        if (what_.target.empty()) return refuse("steering.pattern", "a breakpoint needs the name of an observation");
        return {};
      case Intervention::Point::kNode: return at_node();
      case Intervention::Point::kState: return at_state();
    }
    return {};
  }

  Result<void> at_node() const {
    if (scope_.tree == nullptr || scope_.tree->find(what_.target) != bt::kNoNode) return {};
    Names paths;
    for (bt::NodeId node = 0; node < scope_.tree->size(); ++node) paths.push_back(scope_.tree->path(node));
    return refuse("steering.unknown-node",
                  "the tree has no node \"" + what_.target + "\"" + did_you_mean(what_.target, paths));
  }

  Result<void> at_state() const {
    Names charts;
    const scxml::Chart* chart = nullptr;
    const auto offer = [&](std::string name, const scxml::Chart& offered) {
      if (name == what_.target) chart = &offered;
      charts.push_back(std::move(name));
    };
    if (scope_.leaves == nullptr || scope_.monitors == nullptr) return {};
    for (const LeafPlan& leaf : *scope_.leaves) {
      if (leaf.chart && leaf.at.empty()) offer("skill:" + leaf.name, *leaf.chart);
    }
    for (const monitor::Model& monitor : *scope_.monitors) offer("monitor:" + monitor.name(), monitor.chart());
    if (chart == nullptr) {
      return refuse("steering.unknown-chart",
                    "this process runs no chart \"" + what_.target + "\"" + did_you_mean(what_.target, charts));
    }
    if (chart->find(what_.state)) return {};
    Names states;
    for (const scxml::State& state : chart->states()) states.push_back(state.id);
    return refuse("steering.unknown-state",
                  what_.target + " has no state \"" + what_.state + "\"" + did_you_mean(what_.state, states));
  }

  const Intervention& what_;
  const InterventionScope& scope_;
  const SourceSpan& span_;
};

}  // namespace

InterventionScope scope_of(const Plan& plan) {
  return {&plan.scenario,    &plan.tree,       &plan.leaves,  &plan.services,
          plan.test_control, plan.world.get(), &plan.monitors};
}

Result<void> check_intervention(const Intervention& what, const InterventionScope& scope, const SourceSpan& span) {
  return Check(what, scope, span).run();
}

std::optional<Diagnostic> doubt_about(const Intervention& what, const InterventionScope& scope,
                                      const SourceSpan& span) {
  if (what.kind != Kind::kFalsify) return std::nullopt;
  for (const auto& [name, service] : *scope.services) {
    for (const idl::Method* method : service.service->methods) {
      if (method->result == nullptr || !matches_pattern(what.target, name + "." + method->name)) continue;
      const auto type = type_at(*method->result, what.path);
      const auto value = type ? idl::conform(**type, what.value, "") : tl::unexpected(type.error());
      if (!value) continue;
      // The member itself, whose bounds its type does not know.
      const auto dot = what.path.rfind('.');
      const auto owner = type_at(
          *method->result, dot == std::string::npos ? std::string_view() : std::string_view(what.path).substr(0, dot));
      const std::string last = dot == std::string::npos ? what.path : what.path.substr(dot + 1);
      const idl::Field* field =
          owner && (*owner)->kind == idl::Kind::kStruct && !last.empty() ? (*owner)->structure->find(last) : nullptr;
      const std::string shown = what.path.empty() ? "result" : what.path;
      const auto checked =
          field != nullptr ? idl::check_ranges(*field, *value, shown) : idl::check_ranges(**type, *value, shown);
      if (checked) continue;
      return Diagnostic{Severity::kWarning, checked.error().code,
                        "falsify " + what.target + ": " + checked.error().message, span};
    }
  }
  return std::nullopt;
}

std::vector<SteeredPart> parts_of(const InterventionScope& scope) {
  std::vector<SteeredPart> parts;
  for (const ProcessEntry& entry : scope.scenario->processes) {
    const char* kind = !entry.skill.empty() ? "skill" : !entry.monitor.empty() ? "monitor" : "component";
    parts.push_back({entry.name, kind, true});
  }
  const auto add = [&](const std::string& name, const char* kind) {
    const bool taken =
        std::any_of(parts.begin(), parts.end(), [&](const SteeredPart& part) { return part.name == name; });
    if (!taken) parts.push_back({name, kind, false});
  };
  if (scope.leaves != nullptr) {
    for (const LeafPlan& leaf : *scope.leaves) {
      if (leaf.at.empty()) add(leaf.name, "skill");
    }
  }
  bool simulates = false;
  for (const auto& [name, service] : *scope.services) {
    if (service.at != "sim" && service.at != "model") continue;
    simulates = simulates || service.at == "sim";
    add(name, "component");
  }
  if (simulates) add(std::string(kSimulatorPart), "component");
  return parts;
}

Result<const idl::Type*> type_at(const idl::Type& type, std::string_view path) {
  if (path.empty()) return &type;
  const auto [first, rest] = split(path);
  const std::string name(first);
  if (type.kind == idl::Kind::kStruct) {
    const idl::Field* field = type.structure->find(first);
    if (field != nullptr) return type_at(*field->type, rest);
    return fail("steering.path",
                type.name + " has no member \"" + name + "\"" + did_you_mean(name, type.structure->field_names()));
  }
  const bool is_list = type.kind == idl::Kind::kList || type.kind == idl::Kind::kSet;
  if (is_list && to_index(first)) return type_at(*type.element, rest);
  return fail("steering.path", "a " + type.name + " has no member \"" + name + "\"");
}

bool put_at(Value& at, std::string_view path, const Value& value) {
  if (path.empty()) {
    at = value;
    return true;
  }
  const auto [first, rest] = split(path);
  if (Map* map = at.as_map()) return put_at((*map)[first], rest, value);
  List* list = at.as_list();
  const auto index = to_index(first);
  return list != nullptr && index && *index < list->size() && put_at((*list)[*index], rest, value);
}

}  // namespace sentree::project
