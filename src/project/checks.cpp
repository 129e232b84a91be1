#include "sentree/project/detail/checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/idl/conform.h"
#include "sentree/monitor/observed.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/middleware.h"
#include "sentree/scxml/model.h"

namespace sentree::project {

namespace {

template <class Names>
std::vector<std::string> names_of(const Names& named) {
  std::vector<std::string> names;
  for (const auto& [name, value] : named) names.push_back(name);
  return names;
}

// What sentree.yaml sets the <data> of that id to, or null.
const SkillConstant* constant(const LeafPlan& leaf, const std::string& id) {
  const auto found = std::find_if(leaf.constants.begin(), leaf.constants.end(),
                                  [&](const SkillConstant& set) { return set.id == id; });
  return found == leaf.constants.end() ? nullptr : &*found;
}

// False: what is called is not known, so its outcomes cannot be told either.
bool check_call(const scxml::Chart& chart, const scxml::SendInfo& send,
                const std::map<std::string, ServicePlan>& services, const Project& project, Diagnostics& diagnostics) {
  if (!send.target) return false;  // known at run time only
  if (*send.target == kTestControl || send.target->ends_with(fmt::format("/{}", kTestControl))) {
    add(diagnostics, Severity::kError, "check.test-control",
        fmt::format("service \"{}\" is test control; skills cannot reach it, scenarios can", *send.target),
        chart.span(send.target_place));
    return false;
  }
  const auto service = services.find(*send.target);
  if (service == services.end()) {
    if (project.service(*send.target) != nullptr) return false;
    add(diagnostics, Severity::kError, "check.unknown-service",
        fmt::format("service \"{}\" is not in sentree.yaml{}", *send.target,
                    did_you_mean(*send.target, names_of(services))),
        chart.span(send.target_place));
    return false;
  }
  if (!service->second.observed.empty()) {
    add(diagnostics, Severity::kError, "check.observed",
        fmt::format("\"{}\" stands under observe: in sentree.yaml, so that what others say there is heard; what is "
                    "called stands under services:",
                    *send.target),
        chart.span(send.target_place));
    return false;
  }
  if (!send.event) return false;
  const auto method =
      idl::find_method(*service->second.service, *send.event, *send.target, chart.span(send.event_place));
  if (!method) {
    diagnostics.push_back(method.error());
    return false;
  }
  if (!is_inside(service->second.at)) {
    // What cannot be meant has been told where it stands.
    auto address = rpc::Address::parse(service->second.at);
    if (address) {
      if (address->service.empty()) address->service = *send.target;
      const auto can_be = rpc::middleware_of(*address).check_called(*address, *service->second.service, **method);
      if (!can_be) {
        add(diagnostics, Severity::kError, "check.not-called",
            fmt::format("{}.{}: {}", *send.target, *send.event, can_be.error().message), chart.span(send.event_place));
        return false;
      }
    }
  }
  if (send.has_content) return true;
  std::vector<idl::WrittenArgument> arguments;
  for (const scxml::SendParam& param : send.params)
    arguments.push_back({param.name, param.constant, chart.span(param.place)});
  const Diagnostics found = idl::check_arguments(**method, arguments, chart.span(send.place));
  diagnostics.insert(diagnostics.end(), found.begin(), found.end());
  return true;
}

void check_calls(const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services, const Project& project,
                 Diagnostics& diagnostics) {
  for (const scxml::SendInfo& send : chart.sends()) {
    if (send.type == "thrift") check_call(chart, send, services, project, diagnostics);
  }
}

// "battery.getBatteryState.reply" handled, but nothing of that name can ever arrive.
void check_handled(const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services,
                   const std::set<std::string>& called, const std::set<std::string>& topics, Diagnostics& diagnostics) {
  for (const scxml::Transition& transition : chart.transitions()) {
    for (const std::string& event : transition.events) {
      const auto dot = event.find('.');
      if (dot == std::string::npos) continue;
      const auto service = services.find(event.substr(0, dot));
      if (service == services.end()) continue;
      const auto second = event.find('.', dot + 1);
      const std::string method = event.substr(dot + 1, second == std::string::npos ? second : second - dot - 1);
      if (called.contains(fmt::format("{}.{}", service->first, method)) || topics.contains(event)) continue;
      const std::vector<std::string> methods = service->second.service->method_names();
      const idl::Method* const found = service->second.service->find(method);
      const bool exists = found != nullptr;
      if (exists && found->oneway && second == std::string::npos) {
        add(diagnostics, Severity::kError, "check.never-arrives",
            fmt::format("event \"{}\" never arrives: the skill does not subscribe to this topic; write subscribe: [{}] "
                        "in its entry of sentree.yaml",
                        event, event),
            chart.span(transition.place));
        continue;
      }
      add(diagnostics, exists ? Severity::kWarning : Severity::kError, "check.never-arrives",
          fmt::format("event \"{}\" never arrives: {}", event,
                      exists ? fmt::format("the chart does not call {}.{}", service->first, method)
                             : fmt::format("service \"{}\" has no method \"{}\"{}", service->first, method,
                                           did_you_mean(method, methods))),
          chart.span(transition.place));
    }
  }
}

// What is given back under a name that nearly is that of an output.
void check_outputs(const bt::Tree& tree, const LeafPlan& leaf, Diagnostics& diagnostics) {
  std::vector<std::string> outputs;
  for (const bt::PortFact& port : tree.ports(leaf.node)) {
    if (port.output) outputs.emplace_back(port.name);
  }
  for (const scxml::State& state : leaf.chart->states()) {
    if (state.parent != 0 || leaf.protocol) continue;
    std::vector<std::string> missing;
    for (const std::string& output : outputs) {
      if (std::find(state.donedata.begin(), state.donedata.end(), output) == state.donedata.end())
        missing.push_back(output);
    }
    for (const std::string& given : state.donedata) {
      if (given == "reason" || std::find(outputs.begin(), outputs.end(), given) != outputs.end()) continue;
      const std::string near = did_you_mean(given, missing);
      if (near.empty()) continue;
      add(diagnostics, Severity::kWarning, "check.unknown-port",
          fmt::format("{} has no output port \"{}\"{}", leaf.name, given, near), leaf.chart->span(state.place));
    }
  }
}

}  // namespace

namespace {

// To a file that is not there: one that is called nearly so, or, of a skill, the command that makes it.
std::string way_to(const Project& project, const FileRef& file) {
  constexpr std::size_t kLookedAtMax = 1'000;
  const std::filesystem::path wanted(file.path);
  std::vector<std::string> there;
  std::error_code error;
  for (auto at = std::filesystem::directory_iterator((project.folder / wanted).parent_path(), error);
       !error && at != decltype(at)() && there.size() < kLookedAtMax; at.increment(error)) {
    if (at->path().extension() == wanted.extension()) there.push_back(at->path().filename().string());
  }
  std::sort(there.begin(), there.end());
  if (std::string near = did_you_mean(wanted.filename().string(), there); !near.empty()) return near;
  const bool is_skill = wanted.parent_path() == "skills" && wanted.extension() == ".scxml";
  return is_skill ? fmt::format("; `sentree add skill {}` makes one", wanted.stem().string()) : "";
}

}  // namespace

Diagnostic missing(const Project& project, const FileRef& file, Diagnostic why) {
  if (file.span.line > 0) {
    why.message = fmt::format("file \"{}\": {}{}", project.shown(file.path), why.message,
                              why.code == "file.not-found" ? way_to(project, file) : "");
    why.span = file.span;
  }
  return why;
}

namespace {

bool has_no_way_out(const scxml::Chart& chart, const scxml::State& state) {
  for (const scxml::State* one = &state;; one = &chart.states()[one->parent]) {
    if (!one->transitions.empty()) return false;
    if (one->parent == scxml::kNoState) return true;
  }
}

}  // namespace

void check_outcomes(const scxml::Chart& chart, Diagnostics& diagnostics) {
  static const std::vector<std::string> kOutcomes{"success", "failure", "halted"};
  for (const scxml::State& state : chart.states()) {
    const bool is_outcome = std::find(kOutcomes.begin(), kOutcomes.end(), state.id) != kOutcomes.end();
    if (is_outcome && state.kind == scxml::StateKind::kAtomic && has_no_way_out(chart, state)) {
      add(diagnostics, Severity::kError, "check.outcome",
          fmt::format("state \"{}\" has no way out and ends nothing: write <final id=\"{}\"/>", state.id, state.id),
          chart.span(state.place));
    }
    if (state.kind != scxml::StateKind::kFinal || state.parent != 0 || is_outcome) continue;
    add(diagnostics, Severity::kError, "check.outcome",
        fmt::format("top-level <final id=\"{}\"> is no outcome of a skill; use success, failure or halted{}", state.id,
                    did_you_mean(state.id, kOutcomes)),
        chart.span(state.place));
  }
}

void check_skill_chart(const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services,
                       const std::set<std::string>& topics, const Project& project, Diagnostics& diagnostics) {
  std::set<std::string> called;
  bool all_known = true;
  for (const scxml::SendInfo& send : chart.sends()) {
    if (!send.type || !send.target || !send.event) all_known = false;
    if (send.type != "thrift") continue;
    if (!check_call(chart, send, services, project, diagnostics)) all_known = false;
    if (send.target && send.event) called.insert(fmt::format("{}.{}", *send.target, *send.event));
  }
  if (all_known) check_handled(chart, services, called, topics, diagnostics);
  for (const scxml::Chart& one : scxml::with_invoked(chart)) {
    if (!(one == chart)) check_calls(one, services, project, diagnostics);
  }
}

void check_leaf_ports(const bt::Tree& tree, const LeafPlan& leaf, Diagnostics& diagnostics) {
  if (!leaf.chart) return;
  check_outputs(tree, leaf, diagnostics);
  for (const bt::PortFact& port : tree.ports(leaf.node)) {
    if (!port.declared || port.text.empty()) continue;
    const std::string name(port.name);
    const auto& data = leaf.chart->data();
    const bool has_data = std::any_of(data.begin(), data.end(), [&](const auto& item) { return item.id == name; });
    if (const SkillConstant* const twice = constant(leaf, name); port.input && twice != nullptr) {
      add(diagnostics, Severity::kError, "check.skill-data",
          fmt::format("input port \"{}\" of {}, which may have a default in the TreeNodesModel, and the data of its "
                      "skill at {}:{} set the same <data>; leave one of them out",
                      name, leaf.name, twice->span.file, twice->span.line),
          tree.span(leaf.node));
    }
    // The events of a protocol carry the ports, whether or not the chart has <data> for them.
    if (port.input && !has_data && !leaf.protocol) {
      add(diagnostics, Severity::kWarning, "check.unused-port",
          fmt::format("input port \"{}\" of {} reaches nothing: {} has no <data id=\"{}\">", name, leaf.name,
                      leaf.chart->file(), name),
          tree.span(leaf.node));
    }
    if (!port.output) continue;
    const auto& states = leaf.chart->states();
    const auto& sends = leaf.chart->sends();
    const bool fed = std::any_of(states.begin(), states.end(),
                                 [&](const scxml::State& state) {
                                   return state.parent == 0 && std::find(state.donedata.begin(), state.donedata.end(),
                                                                         name) != state.donedata.end();
                                 }) ||
                     (leaf.protocol && std::any_of(sends.begin(), sends.end(), [&](const scxml::SendInfo& send) {
                        return send.event.value_or(leaf.protocol->answer) == leaf.protocol->answer &&
                               (send.has_content || std::any_of(send.params.begin(), send.params.end(),
                                                                [&](const auto& param) { return param.name == name; }));
                      }));
    if (!fed) {
      add(diagnostics, Severity::kWarning, "check.unfed-port",
          fmt::format("output port \"{}\" of {} is never written: no {} of {} has a <param name=\"{}\">", name,
                      leaf.name,
                      leaf.protocol ? fmt::format("<send event=\"{}\">", leaf.protocol->answer) : "<donedata>",
                      leaf.chart->file(), name),
          tree.span(leaf.node));
    }
  }
}

void check_names(const bt::Tree& tree, const std::vector<LeafPlan>& leaves,
                 const std::map<std::string, ServicePlan>& services, const Project& project, Diagnostics& diagnostics) {
  const auto reserved = [](const std::string& name) {
    const std::string first = name.substr(0, name.find('.'));
    return std::find(std::begin(kReservedNames), std::end(kReservedNames), first) != std::end(kReservedNames);
  };
  for (const LeafPlan& leaf : leaves) {
    if (services.contains(leaf.name)) {
      add(diagnostics, Severity::kError, "check.name-clash",
          fmt::format("leaf \"{}\" and a service have the same name, so their messages would look alike; rename one",
                      leaf.name),
          tree.span(leaf.node));
    } else if (reserved(leaf.name)) {
      add(diagnostics, Severity::kError, "check.reserved-name",
          fmt::format("leaf name \"{}\" is reserved; choose another name", leaf.name), tree.span(leaf.node));
    }
  }
  for (const SkillEntry& entry : project.skills) {
    std::set<std::string> ids;
    std::vector<std::string> named;
    for (const LeafPlan& leaf : leaves) {
      // Where its name alone tells it from others, the path ends with it.
      if (tree.name(leaf.node) != entry.leaf || tree.path(leaf.node).ends_with(entry.leaf)) continue;
      ids.insert(leaf.id);
      named.push_back(fmt::format("{} ({})", leaf.name, leaf.id));
    }
    if (ids.size() < 2) continue;
    add(diagnostics, Severity::kError, "check.name-clash",
        fmt::format("skill \"{}\" would be that of leaves of several IDs: {}; give one of them another name",
                    entry.leaf, fmt::join(named, ", ")),
        entry.span);
  }
  for (const ModelEntry& model : project.models) {
    const bool is_leaf =
        std::any_of(leaves.begin(), leaves.end(), [&](const LeafPlan& leaf) { return leaf.name == model.name; });
    if (is_leaf || services.contains(model.name)) {
      add(diagnostics, Severity::kError, "check.name-clash",
          fmt::format("model \"{}\" and a {} have the same name, so their messages would look alike; give it another "
                      "with \"name\"",
                      model.name, is_leaf ? "leaf" : "service"),
          model.span);
    } else if (reserved(model.name)) {
      add(diagnostics, Severity::kError, "check.reserved-name",
          fmt::format("model name \"{}\" is reserved; give it another with \"name\"", model.name), model.span);
    }
  }
  for (const ServiceEntry& service : project.services) {
    if (!reserved(service.name)) continue;
    add(diagnostics, Severity::kError, "check.reserved-name",
        fmt::format("service name \"{}\" is reserved; choose another name", service.name), service.span);
  }
}

namespace {

// The value of a parameter as far as the files tell: a constant, or a <data> that starts as a constant and that no port
// sets.
std::optional<Value> constant_of(const LeafPlan& leaf, const scxml::SendParam& param) {
  if (param.constant) return param.constant;
  if (const SkillConstant* set = constant(leaf, param.expression)) return set->value;
  for (const scxml::DataItem& item : leaf.chart->data()) {
    if (item.id == param.expression) return item.initial;
  }
  return std::nullopt;
}

void check_tolerance(const scxml::Chart& chart, const scxml::SendParam& param, double tolerance, double least,
                     double most, bool has_station, const char* unit, Diagnostics& diagnostics) {
  if (tolerance < least) {
    add(diagnostics, Severity::kError, "check.tolerances",
        fmt::format("{} of {}{} is narrower than navigation's {}{}: the robot can stop where this skill does not see "
                    "it arrived",
                    param.name, plain_decimal(tolerance), unit, plain_decimal(least), unit),
        chart.span(param.place));
  } else if (has_station && tolerance >= most) {
    add(diagnostics, Severity::kError, "check.tolerances",
        fmt::format("{} of {}{} is not below the charging station's {}{}: the robot can wait where the station does "
                    "not charge it",
                    param.name, plain_decimal(tolerance), unit, plain_decimal(most), unit),
        chart.span(param.place));
  }
}

}  // namespace

void check_tolerances(const std::vector<LeafPlan>& leaves, const sim::World& world, Diagnostics& diagnostics) {
  const sim::Tolerances least = sim::navigation_tolerances(world);
  const auto most = sim::station_tolerances(world);
  std::set<std::string> seen;
  for (const LeafPlan& leaf : leaves) {
    if (!leaf.chart || (!seen.insert(leaf.chart->file()).second && leaf.constants.empty())) continue;
    for (const scxml::SendInfo& send : leaf.chart->sends()) {
      if (send.type != "thrift" || send.event != "checkNearToLocation") continue;
      for (const scxml::SendParam& param : send.params) {
        const auto value = constant_of(leaf, param);
        if (!value || !value->is_number()) continue;
        if (param.name == "linear_tolerance") {
          check_tolerance(*leaf.chart, param, value->number(), least.linear_m, most ? most->linear_m : 0,
                          most.has_value(), " m", diagnostics);
        } else if (param.name == "angular_tolerance") {
          check_tolerance(*leaf.chart, param, value->number(), least.angular_rad, most ? most->angular_rad : 0,
                          most.has_value(), " rad", diagnostics);
        }
      }
    }
  }
}

void check_gate(const MonitorEntry& entry, const monitor::Model& model,
                const std::map<std::string, ServicePlan>& services, Diagnostics& diagnostics) {
  std::vector<std::string> calls;
  for (const auto& [name, plan] : services) {
    for (const idl::Method* method : plan.service->methods) calls.push_back(fmt::format("{}.{}", name, method->name));
  }
  bool listens = false;
  for (const std::string& pattern : entry.gate) {
    bool matches = false;
    for (const std::string& call : calls) {
      if (!matches_pattern(pattern, call)) continue;
      matches = true;
      listens = listens || model.listens_to(call + ".request");
    }
    if (matches) continue;
    add(diagnostics, Severity::kError, "check.gate",
        fmt::format("gate \"{}\" of monitor \"{}\" matches no call of the project (SERVICE.METHOD){}", pattern,
                    entry.name, did_you_mean(pattern, calls)),
        entry.gate_span);
    return;
  }
  if (listens) return;
  add(diagnostics, Severity::kError, "check.gate",
      fmt::format("monitor \"{}\" listens to none of the requests that it is to gate, so it would let all of them pass",
                  entry.name),
      entry.gate_span);
}

namespace {

// Whether an observation of that name may be of one of these leaves.
bool may_say(const std::vector<std::string>& leaves, const std::string& name, const monitor::Vocabulary& vocabulary,
             const monitor::Observations& observations) {
  const auto is_one = [&](const std::string& leaf) {
    return std::find(leaves.begin(), leaves.end(), leaf) != leaves.end();
  };
  const monitor::DataType data = observations.data_of(name);
  const auto source = std::find_if(data.members.begin(), data.members.end(),
                                   [](const monitor::DataMember& member) { return member.name == "source"; });
  if (source == data.members.end() || source->type.words.empty()) return true;
  if (std::none_of(source->type.words.begin(), source->type.words.end(), is_one)) return false;
  const std::string call = name.substr(0, name.rfind('.'));
  const std::string service = call.substr(0, call.rfind('.'));
  if (!vocabulary.calls || !vocabulary.services.contains(service)) return true;
  return std::any_of(vocabulary.calls->begin(), vocabulary.calls->end(), [&](const monitor::Vocabulary::Call& made) {
    return is_one(made.leaf) && made.service == service && call.substr(service.size() + 1) == made.method;
  });
}

// Leaves that are meant, and nobody else, and that say nothing of it.
void check_said(const EventRename& rename, const std::string& pattern, const std::vector<LeafPlan>& all,
                const monitor::Vocabulary& vocabulary, Diagnostics& diagnostics) {
  std::vector<std::string> leaves;
  for (const LeafPlan& leaf : all) {
    if (matches_pattern(pattern, leaf.name)) leaves.push_back(leaf.name);
  }
  const monitor::Observations observations(vocabulary);
  bool is_known = false;
  for (const std::string& name : observations.names()) {
    const bool is_meant = std::any_of(rename.on.begin(), rename.on.end(),
                                      [&](const std::string& on) { return matches_pattern(on, name); });
    if (is_meant && may_say(leaves, name, vocabulary, observations)) return;
    is_known = is_known || is_meant;
  }
  if (!is_known) return;  // of that it has been said
  add(diagnostics, Severity::kWarning, "check.source",
      fmt::format("event \"{}\" never comes from \"{}\": no leaf that is called so says {}", rename.event, pattern,
                  fmt::join(rename.on, " or ")),
      rename.from_span);
}

}  // namespace

void check_sources(const EventRename& rename, const std::vector<LeafPlan>& leaves,
                   const std::map<std::string, ServicePlan>& services, const Project& project,
                   const monitor::Vocabulary* vocabulary, Diagnostics& diagnostics) {
  // Without its mission a project has no leaves, which has been said.
  if (leaves.empty()) return;
  std::vector<std::string> others = names_of(services);
  for (const ModelEntry& model : project.models) others.push_back(model.name);
  others.insert(others.end(), std::begin(kReservedNames), std::end(kReservedNames));
  std::vector<std::string> sources = others;
  for (const LeafPlan& leaf : leaves) sources.push_back(leaf.name);
  for (const std::string& pattern : rename.from) {
    const auto is_any = [&](const std::vector<std::string>& of) {
      return std::any_of(of.begin(), of.end(),
                         [&](const std::string& source) { return matches_pattern(pattern, source); });
    };
    if (is_any(sources)) {
      if (vocabulary != nullptr && !is_any(others)) check_said(rename, pattern, leaves, *vocabulary, diagnostics);
      continue;
    }
    add(diagnostics, Severity::kError, "check.source",
        fmt::format("event \"{}\" is of nobody: \"{}\" is no leaf of the mission{}", rename.event, pattern,
                    did_you_mean(pattern, sources)),
        rename.from_span);
  }
}

void check_locations(const bt::Tree& tree, const std::vector<LeafPlan>& leaves, const sim::World& world,
                     const std::string& world_file, Diagnostics& diagnostics) {
  std::vector<std::string> places;
  for (const sim::NamedLocation& location : world.locations) places.push_back(location.name);
  for (const sim::NamedArea& area : world.areas) places.push_back(area.name);
  constexpr std::array<std::string_view, 2> kMethods{"gotoTargetByLocationName", "checkNearToLocation"};
  std::set<std::pair<std::string, std::string>> checked;  // several sends may use one port, several leaves one constant
  for (const LeafPlan& leaf : leaves) {
    if (!leaf.chart) continue;
    const auto check = [&](const std::string& id, const std::string& text, const SourceSpan& span) {
      if (text.empty() || text.front() == '{' || std::find(places.begin(), places.end(), text) != places.end()) return;
      if (!checked.insert({to_string(span), id}).second) return;
      add(diagnostics, Severity::kError, "check.unknown-location",
          fmt::format("\"{}\", the {} of {}, is no location or area of {}{}", text, id, leaf.name, world_file,
                      did_you_mean(text, places)),
          span);
    };
    for (const scxml::SendInfo& send : leaf.chart->sends()) {
      if (send.type != "thrift" || !send.event ||
          std::find(kMethods.begin(), kMethods.end(), *send.event) == kMethods.end())
        continue;
      for (const scxml::SendParam& param : send.params) {
        if (param.name != "name") continue;
        if (const SkillConstant* set = constant(leaf, param.expression))
          check(set->id, std::string(set->value.text()), set->span);
        for (const bt::PortFact& port : tree.ports(leaf.node)) {
          if (port.name == param.expression) check(param.expression, std::string(port.text), tree.span(leaf.node));
        }
      }
    }
  }
}

}  // namespace sentree::project
