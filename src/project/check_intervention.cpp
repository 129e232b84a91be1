#include "sentree/project/check_intervention.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/base/numbered.h"
#include "sentree/idl/conform.h"
#include "sentree/monitor/observed.h"

namespace sentree::project {

namespace {

using namespace intervention;
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

// Null: the path leads to no member of a struct.
const idl::Field* field_at(const idl::Type& type, std::string_view path) {
  const auto dot = path.rfind('.');
  const auto owner = type_at(type, dot == std::string_view::npos ? std::string_view() : path.substr(0, dot));
  const std::string_view last = dot == std::string_view::npos ? path : path.substr(dot + 1);
  if (!owner || (*owner)->kind != idl::Kind::kStruct || last.empty()) return nullptr;
  return (*owner)->structure->find(last);
}

// What a falsified result has at its path. Null is an optional member that is not there.
Result<Value> fitted(const idl::Type& result, const Falsify& what) {
  const auto type = type_at(result, what.path);
  if (!type) return tl::unexpected(type.error());
  const idl::Field* field = what.value.is_null() ? field_at(result, what.path) : nullptr;
  const bool may_lack =
      field != nullptr && (field->requiredness == idl::Requiredness::kOptional || field->default_value);
  if (may_lack) return what.value;
  return idl::conform(**type, what.value, what.path.empty() ? "result" : what.path);
}

class Check {
 public:
  Check(const Intervention& what, const InterventionScope& scope, const SourceSpan& span)
      : what_(what), scope_(scope), span_(span) {}

  Result<void> run() const {
    return std::visit([this](const auto& what) { return check(what); }, what_);
  }

 private:
  tl::unexpected<Diagnostic> refuse(std::string code, std::string message) const {
    return fail(std::move(code), std::move(message), span_);
  }

  // The project has that service, and why nothing is known of it has been told.
  bool is_broken(std::string_view call) const {
    const std::string service(call.substr(0, call.find('.')));
    return scope_.scenario->project.service(service) != nullptr && !scope_.services->contains(service);
  }

  // Behind "there is no leaf of that name": which leaves may be meant. `names`: all that may be said.
  std::string way_to_leaf(const std::string& wanted, const Names& names) const {
    if (scope_.leaves == nullptr) return did_you_mean(wanted, names);
    Names alike = numbered(wanted, names);
    if (!alike.empty()) return fmt::format("; several leaves have that name: say {}", fmt::join(alike, " or "));
    for (const LeafPlan& leaf : *scope_.leaves) {
      if (leaf.id == wanted && contains(names, leaf.name) && !leaf.name.ends_with(wanted)) alike.push_back(leaf.name);
    }
    if (!alike.empty()) return fmt::format("; it is the skill of {}", fmt::join(alike, ", "));
    return did_you_mean(wanted, names);
  }

  Result<void> check(const Call& what) const {
    const auto dot = what.method.rfind('.');
    const std::string name = what.method.substr(0, dot);
    if (is_broken(name)) return {};
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
      return refuse("scenario.call",
                    fmt::format("the project has no service \"{}\"{}", name, did_you_mean(name, names)));
    }
    const auto method = idl::find_method(*service, what.method.substr(dot + 1), name, span_);
    if (!method) return tl::unexpected(method.error());
    if (!is_control && !found->second.observed.empty() && !(*method)->oneway) {
      return refuse(
          "scenario.call",
          fmt::format("\"{}\" is observed, and nobody answers its calls here; what is one-way can be published", name));
    }
    const auto args = idl::conform_arguments(**method, what.args);
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
    return refuse("scenario.call", fmt::format("the world has no door \"{}\"{}", wanted, did_you_mean(wanted, names)));
  }

  Result<void> check(const Kill& kill) const { return part(kill.part); }
  Result<void> check(const Restart& restart) const { return part(restart.part); }
  Result<void> check(const Unreachable& what) const { return failing(what.call); }
  Result<void> check(const Late& what) const { return failing(what.call); }
  Result<void> check(const Stop& /*what*/) const { return {}; }
  Result<void> check(const Clear& /*what*/) const { return {}; }

  Result<void> part(const std::string& wanted) const {
    Names names;
    for (const SteeredPart& part : parts_of(scope_)) names.push_back(part.name);
    if (contains(names, wanted)) return {};
    std::string way_out = way_to_leaf(wanted, names);
    constexpr std::size_t kShownMax = 8;
    if (way_out.empty() && !names.empty() && names.size() <= kShownMax)
      way_out = fmt::format("; there are {}", fmt::join(names, ", "));
    std::string why = fmt::format("nothing of this run that can be killed is called \"{}\"{}", wanted, way_out);
    if (const LeafPlan* leaf = leaf_elsewhere(wanted); leaf != nullptr) {
      why = contains(names, leaf->id)
                ? fmt::format("\"{}\" runs in the process \"{}\": kill that, with all leaves that it runs", wanted,
                              leaf->id)
                : fmt::format("\"{}\" runs at {}, where nobody here can kill it", wanted, leaf->at);
    }
    if (scope_.monitors != nullptr) {
      for (const monitor::Model& monitor : *scope_.monitors) {
        if (monitor.name() == wanted)
          why = fmt::format("monitor \"{}\" runs in this process and cannot be killed; give it a process of its own",
                            wanted);
      }
    }
    return refuse("scenario.kill", std::move(why));
  }

  // Null: no leaf of that name is in another process.
  const LeafPlan* leaf_elsewhere(const std::string& name) const {
    if (scope_.leaves == nullptr) return nullptr;
    for (const LeafPlan& leaf : *scope_.leaves) {
      if (leaf.name == name && !leaf.at.empty()) return &leaf;
    }
    return nullptr;
  }

  // Every call, "SERVICE.METHOD".
  Names calls() const {
    Names names;
    for (const auto& [name, service] : *scope_.services) {
      if (!service.observed.empty()) continue;  // what others say is only heard
      for (const idl::Method* method : service.service->methods)
        names.push_back(fmt::format("{}.{}", name, method->name));
    }
    return names;
  }

  Result<void> check(const Delay& what) const {
    if (what.by <= Duration(0)) return refuse("steering.delay", "a delay must be longer than 0 s");
    Names names = calls();
    for (std::size_t i = 0, count = names.size(); i < count; ++i) names.push_back(names[i] + ".reply");
    if (scope_.leaves == nullptr || is_broken(what.message)) return {};
    for (const LeafPlan& leaf : *scope_.leaves) {
      for (const char* message : {".tick", ".halt"}) names.push_back(leaf.name + message);
    }
    const bool is_reply = what.message.ends_with(".reply");
    for (const std::string& name : names) {
      if (name.ends_with(".reply") == is_reply && matches_pattern(what.message, name)) return {};
    }
    return refuse(
        "steering.unknown-message",
        fmt::format("no message is called \"{}\": LEAF.tick, LEAF.halt, SERVICE.METHOD or SERVICE.METHOD.reply{}",
                    what.message, did_you_mean(what.message, names)));
  }

  Result<void> check(const Falsify& what) const {
    if (is_broken(what.call)) return {};
    std::optional<Diagnostic> why;
    for (const auto& [name, service] : *scope_.services) {
      if (!service.observed.empty()) continue;
      for (const idl::Method* method : service.service->methods) {
        if (!matches_pattern(what.call, fmt::format("{}.{}", name, method->name))) continue;
        if (method->result == nullptr) {
          why = Diagnostic{Severity::kError, "steering.path", method->name + " returns nothing", {}};
        } else if (const auto value = fitted(*method->result, what); !value) {
          why = value.error();
        } else {
          return {};
        }
      }
    }
    if (why) return refuse(why->code, fmt::format("falsify {}: {}", what.call, why->message));
    return refuse("steering.unknown-call",
                  fmt::format("no service has a method \"{}\"{}", what.call, did_you_mean(what.call, calls())));
  }

  Result<void> failing(const std::string& pattern) const {
    if (is_broken(pattern)) return {};
    bool is_oneway = false;
    for (const auto& [name, service] : *scope_.services) {
      if (!service.observed.empty()) continue;
      for (const idl::Method* method : service.service->methods) {
        if (!matches_pattern(pattern, fmt::format("{}.{}", name, method->name))) continue;
        if (!method->oneway) return {};
        is_oneway = true;
      }
    }
    if (is_oneway) return refuse("steering.unknown-call", pattern + " is one-way: nobody learns what became of it");
    // A service's name by itself is meant for all of it.
    Names services;
    for (const auto& [name, service] : *scope_.services) services.push_back(name);
    const std::string near(closest(pattern, services));
    return refuse("steering.unknown-call",
                  fmt::format("no service has a method \"{}\"{}", pattern,
                              near.empty() ? did_you_mean(pattern, calls())
                                           : fmt::format("; all methods of {} are \"{}.*\"", near, near)));
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

  Result<void> check(const Force& what) const {
    if (scope_.leaves == nullptr) return {};
    const LeafPlan* found = leaf(what.leaf);
    if (found == nullptr) {
      return refuse("steering.unknown-leaf", fmt::format("no leaf that runs a skill is called \"{}\"{}", what.leaf,
                                                         way_to_leaf(what.leaf, leaf_names())));
    }
    const Names statuses{"SUCCESS", "FAILURE", "RUNNING"};
    if (!contains(statuses, what.status)) {
      return refuse("steering.status",
                    fmt::format("a leaf cannot be forced to \"{}\"; there are SUCCESS, FAILURE and RUNNING{}",
                                what.status, did_you_mean(what.status, statuses)));
    }
    if (found->condition && what.status == "RUNNING")
      return refuse("steering.status", fmt::format("leaf \"{}\" is a condition, which is never RUNNING", what.leaf));
    return {};
  }

  Result<void> check(const Breakpoint& what) const {
    switch (what.point) {
      case Breakpoint::Point::kMessage:
        if (what.target.empty()) return refuse("steering.pattern", "a breakpoint needs the name of an observation");
        return {};
      case Breakpoint::Point::kNode: return at_node(what);
      case Breakpoint::Point::kState: return at_state(what);
    }
    return {};
  }

  Result<void> at_node(const Breakpoint& what) const {
    if (scope_.tree == nullptr || scope_.tree->find(what.target) != bt::kNoNode) return {};
    Names paths;
    Names names;
    for (bt::NodeId node = 0; node < scope_.tree->size(); ++node) {
      paths.push_back(scope_.tree->path(node));
      names.push_back(paths.back().substr(paths.back().rfind('.') + 1));
    }
    std::string nearest = did_you_mean(what.target, paths);
    if (nearest.empty()) {
      // Right but for where it is: paths name the subtrees around a node, and nothing else.
      const std::string name = what.target.substr(what.target.rfind('.') + 1);
      const std::string near(closest(name, names));
      const auto found = std::find(names.begin(), names.end(), near);
      if (!near.empty() && found != names.end())
        nearest = fmt::format("; did you mean \"{}\"?", paths[static_cast<std::size_t>(found - names.begin())]);
    }
    return refuse("steering.unknown-node", fmt::format("the tree has no node \"{}\"{}", what.target, nearest));
  }

  Result<void> at_state(const Breakpoint& what) const {
    Names charts;
    const scxml::Chart* chart = nullptr;
    const auto offer = [&](std::string name, const scxml::Chart& offered) {
      if (name == what.target) chart = &offered;
      charts.push_back(std::move(name));
    };
    if (scope_.leaves == nullptr || scope_.monitors == nullptr) return {};
    for (const LeafPlan& leaf : *scope_.leaves) {
      if (leaf.chart && leaf.at.empty()) offer("skill:" + leaf.name, *leaf.chart);
    }
    for (const monitor::Model& monitor : *scope_.monitors) offer("monitor:" + monitor.name(), monitor.chart());
    if (chart == nullptr) {
      return refuse("steering.unknown-chart",
                    fmt::format("this process runs no chart \"{}\"{}", what.target, did_you_mean(what.target, charts)));
    }
    if (chart->find(what.state)) return {};
    Names states;
    for (const scxml::State& state : chart->states()) states.push_back(state.id);
    return refuse("steering.unknown-state",
                  fmt::format("{} has no state \"{}\"{}", what.target, what.state, did_you_mean(what.state, states)));
  }

  const Intervention& what_;
  const InterventionScope& scope_;
  const SourceSpan& span_;
};

std::optional<Diagnostic> doubt_about_message(const Breakpoint& breakpoint, const InterventionScope& scope,
                                              const SourceSpan& span) {
  if (breakpoint.point != Breakpoint::Point::kMessage || scope.vocabulary == nullptr) return std::nullopt;
  const monitor::Observations observations(*scope.vocabulary);
  const Names& names = observations.names();
  if (std::any_of(names.begin(), names.end(),
                  [&](const auto& name) { return matches_pattern(breakpoint.target, name); }))
    return std::nullopt;
  return Diagnostic{Severity::kWarning, "steering.unknown-message",
                    fmt::format("nothing in this project is observed as \"{}\", so it is never reached{}",
                                breakpoint.target, did_you_mean(breakpoint.target, names)),
                    span};
}

}  // namespace

InterventionScope scope_of(const Plan& plan) {
  return {&plan.scenario,    &plan.tree,       &plan.leaves,   &plan.services,
          plan.test_control, plan.world.get(), &plan.monitors, nullptr};
}

Result<void> check_intervention(const Intervention& what, const InterventionScope& scope, const SourceSpan& span) {
  return Check(what, scope, span).run();
}

std::optional<Diagnostic> doubt_about(const Intervention& what, const InterventionScope& scope,
                                      const SourceSpan& span) {
  if (const auto* breakpoint = std::get_if<Breakpoint>(&what)) return doubt_about_message(*breakpoint, scope, span);
  const auto* falsify = std::get_if<Falsify>(&what);
  if (falsify == nullptr) return std::nullopt;
  for (const auto& [name, service] : *scope.services) {
    for (const idl::Method* method : service.service->methods) {
      if (method->result == nullptr || !matches_pattern(falsify->call, fmt::format("{}.{}", name, method->name)))
        continue;
      const auto value = fitted(*method->result, *falsify);
      if (!value || value->is_null()) continue;
      // The member itself, whose bounds its type does not know.
      const idl::Field* field = field_at(*method->result, falsify->path);
      const std::string shown = falsify->path.empty() ? "result" : falsify->path;
      const auto checked = field != nullptr
                               ? idl::check_ranges(*field, *value, shown)
                               : idl::check_ranges(**type_at(*method->result, falsify->path), *value, shown);
      if (checked) continue;
      return Diagnostic{Severity::kWarning, checked.error().code,
                        fmt::format("falsify {}: {}", falsify->call, checked.error().message), span};
    }
  }
  return std::nullopt;
}

std::optional<Diagnostic> doubt_about_number(const Scenario& scenario, const Injection& injection) {
  const auto* clear = std::get_if<Clear>(&injection.what);
  if (clear == nullptr) return std::nullopt;
  const auto before = [&](const Injection& other) { return other.at <= injection.at && stands(other.what); };
  const auto most = scenario.delays.size() +
                    static_cast<std::size_t>(std::count_if(scenario.timeline.begin(), scenario.timeline.end(), before));
  if (clear->id <= most) return std::nullopt;
  return Diagnostic{Severity::kWarning, "scenario.clear",
                    fmt::format("nothing stands as number {} by then: the timeline has {} before", clear->id,
                                most == 0   ? "nothing that stands"
                                : most == 1 ? "one fault or breakpoint"
                                            : fmt::format("{} faults and breakpoints", most)),
                    injection.span};
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
    return fail("steering.path", fmt::format("{} has no member \"{}\"{}", type.name, name,
                                             did_you_mean(name, type.structure->field_names())));
  }
  const bool is_list = type.kind == idl::Kind::kList || type.kind == idl::Kind::kSet;
  if (is_list && to_index(first)) return type_at(*type.element, rest);
  return fail("steering.path", fmt::format("a {} has no member \"{}\"", type.name, name));
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
