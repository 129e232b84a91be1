#include "sentree/project/detail/check_monitor.h"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "sentree/monitor/observed.h"
#include "sentree/project/detail/check_expressions.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/reach.h"

namespace sentree::project {

namespace {

using monitor::DataType;

void add_once(Diagnostics& diagnostics, Severity severity, std::string code, std::string message, SourceSpan span) {
  Diagnostic diagnostic{severity, std::move(code), std::move(message), std::move(span)};
  if (std::find(diagnostics.begin(), diagnostics.end(), diagnostic) == diagnostics.end())
    diagnostics.push_back(std::move(diagnostic));
}

void error(Diagnostics& diagnostics, std::string code, std::string message, SourceSpan span) {
  add_once(diagnostics, Severity::kError, std::move(code), std::move(message), std::move(span));
}

/// Events that a chart sends to itself, and that those which it invokes send to it.
struct OwnEvents {
  std::vector<std::string> names;
  bool open = false;  ///< Or any other: of charts that are not known, or named by an expression.

  explicit OwnEvents(const scxml::Chart& chart) : open(scxml::invokes_unknown(chart)) {
    for (const auto& [event, place] : chart.model().raises) names.push_back(event);
    for (const scxml::SendInfo& send : chart.sends()) add(send);
    for (const scxml::Invoke& invoke : chart.model().invokes) {
      open = open || !invoke.child || invoke.child->model().passed_over;
      if (!invoke.child) continue;
      for (const scxml::Chart& child : scxml::with_invoked(*invoke.child)) {
        const bool is_ours = child == *invoke.child;
        // A session that is named by what was heard of it may be this one.
        for (const scxml::SendInfo& send : child.sends()) {
          if (!send.target || (is_ours && *send.target == "#_parent") || send.target->starts_with("#_scxml_"))
            add(send);
        }
      }
    }
  }

 private:
  void add(const scxml::SendInfo& send) {
    if (send.type == "thrift") return;
    if (send.event)
      names.push_back(*send.event);
    else
      open = true;
  }
};

bool matches_any(const std::string& descriptor, const std::vector<std::string>& names) {
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return scxml::event_matches(descriptor, name); });
}

// Events of the platform, which need nobody to send them.
bool is_of_platform(const std::string& descriptor) {
  return descriptor == "*" || scxml::event_matches("error", descriptor) || scxml::event_matches("done", descriptor);
}

// What could be meant: also a part of a name, as descriptors may be.
std::string meant(const std::string& descriptor, const std::vector<std::string>& known) {
  std::set<std::string> candidates;
  const auto dots = std::count(descriptor.begin(), descriptor.end(), '.');
  for (const std::string& name : known) {
    std::size_t end = 0;
    for (auto i = 0; i <= dots && end != std::string::npos; ++i) end = name.find('.', i == 0 ? 0 : end + 1);
    candidates.insert(name.substr(0, end));
    candidates.insert(name);
  }
  return did_you_mean(descriptor, std::vector<std::string>(candidates.begin(), candidates.end()));
}

// `visit(descriptor, place, hint)` for each event that cannot come.
template <class Visit>
void for_each_unknown(const scxml::Chart& chart, const std::vector<std::string>& known, const Visit& visit) {
  const OwnEvents own(chart);
  if (own.open) return;
  for (const scxml::Transition& transition : chart.transitions()) {
    for (const std::string& descriptor : transition.events) {
      if (is_of_platform(descriptor) || matches_any(descriptor, own.names) || matches_any(descriptor, known)) continue;
      std::vector<std::string> candidates = known;
      candidates.insert(candidates.end(), own.names.begin(), own.names.end());
      candidates.insert(candidates.end(), {"error.execution", "error.communication", "done.state"});
      visit(descriptor, transition.place, meant(descriptor, candidates));
    }
  }
}

// An action that only waits, or that takes `halt`, is one that is ended from outside. A top-level <final> of another
// name is told elsewhere.
bool seems_to_want_an_end(const scxml::Chart& chart) {
  const auto takes_halt = [](const scxml::Transition& transition) {
    return std::any_of(transition.events.begin(), transition.events.end(),
                       [](const std::string& event) { return event != "*" && scxml::event_matches(event, "halt"); });
  };
  const auto transitions = chart.transitions();
  const auto states = chart.states();
  const auto is_end = [](const scxml::State& state) {
    return state.kind == scxml::StateKind::kFinal && state.parent == 0;
  };
  // Those of initial states are of no state.
  const auto leads_on = [](const scxml::State& state) { return !state.transitions.empty(); };
  return std::any_of(states.begin(), states.end(), leads_on) && std::none_of(states.begin(), states.end(), is_end) &&
         std::none_of(transitions.begin(), transitions.end(), takes_halt);
}

// A transition without target and content is there to keep others from being taken; where there are none, something was
// forgotten.
void check_idle_transitions(const scxml::Chart& chart, bool is_skill, Diagnostics& diagnostics) {
  const scxml::Model& model = chart.model();
  const auto takes = [&](const scxml::Transition& other, const std::string& event) {
    return std::any_of(other.events.begin(), other.events.end(), [&](const std::string& descriptor) {
      return scxml::event_matches(descriptor, event) || scxml::event_matches(event, descriptor);
    });
  };
  for (std::size_t t = 0; t < model.transitions.size(); ++t) {
    const scxml::Transition& transition = model.transitions[t];
    if (!transition.targets.empty() || transition.events.empty() || !model.transition_code[t].content.empty()) continue;
    // To take `halt` means that the run is not cancelled; ticks come whether or not anything is done with them.
    if (is_skill && (takes(transition, "halt") || takes(transition, "tick"))) continue;
    bool hides = false;
    for (scxml::StateIndex s = transition.source; s != scxml::kNoState && !hides; s = model.states[s].parent) {
      for (const scxml::TransitionIndex other : model.states[s].transitions) {
        if (s == transition.source && other <= t) continue;
        for (const std::string& event : transition.events) hides = hides || takes(model.transitions[other], event);
      }
    }
    if (hides) continue;
    add_once(diagnostics, Severity::kWarning, "check.idle-transition",
             "this transition does nothing: it has neither target nor content, and keeps no other from being taken",
             chart.span(transition.place));
  }
}

void check_verdicts(const MonitorEntry& entry, const scxml::Chart& chart, Diagnostics& diagnostics) {
  const std::vector<bool> reached = scxml::reachable_states(chart);
  const auto check = [&](scxml::StateIndex state) {
    if (reached[state]) return;
    error(diagnostics, "check.unreachable-verdict",
          fmt::format(
              "monitor \"{}\" can never be violated by state \"{}\": no transition of a reachable state leads to it",
              entry.name, chart.states()[state].id),
          chart.span(chart.states()[state].place));
  };
  for (const std::string& id : entry.violated) {
    if (const auto state = chart.find(id)) check(*state);
  }
  const auto final_state = chart.find("violated");
  if (final_state && chart.states()[*final_state].parent == 0) check(*final_state);
}

void check_renames(const MonitorEntry& entry, const scxml::Chart& chart, const monitor::Observations* observations,
                   ChartEvents& events, Diagnostics& diagnostics) {
  std::vector<std::string> handled = chart.events_handled();
  auto types = std::make_shared<std::map<std::string, DataType>>();
  for (const EventRename& rename : entry.events) {
    if (std::find(events.names.begin(), events.names.end(), rename.event) == events.names.end())
      events.names.push_back(rename.event);
    const bool heard = std::any_of(handled.begin(), handled.end(), [&](const std::string& descriptor) {
      return scxml::event_matches(descriptor, rename.event);
    });
    if (!heard) {
      error(diagnostics, "check.unheard-event",
            fmt::format("monitor \"{}\": its chart has no transition for event \"{}\"{}", entry.name, rename.event,
                        did_you_mean(rename.event, handled)),
            rename.span);
    }
    if (observations == nullptr) continue;
    std::vector<DataType> observed;
    for (const std::string& pattern : rename.on) {
      const std::size_t before = observed.size();
      for (const std::string& name : observations->names()) {
        if (matches_pattern(pattern, name)) observed.push_back(observations->data_of(name));
      }
      if (observed.size() > before) continue;
      error(diagnostics, "check.unknown-event",
            fmt::format("event \"{}\": nothing in this project is observed as \"{}\"{}", rename.event, pattern,
                        did_you_mean(pattern, observations->names())),
            rename.span);
    }
    DataType data = check_renamed_data(rename, observed, diagnostics);
    data.name = fmt::format("event \"{}\"", rename.event);
    // An event of several sources has the data of one of them, whichever came.
    const auto [slot, is_new] = types->emplace(rename.event, std::move(data));
    if (!is_new) slot->second = {};
  }
  events.data_of = [types](const std::string& name) {
    const auto found = types->find(name);
    return found != types->end() ? found->second : DataType();
  };
}

// The arguments of what is published.
DataType topic_data(const std::string& topic, const monitor::Vocabulary& vocabulary) {
  const auto dot = topic.rfind('.');
  const auto service = vocabulary.services.find(topic.substr(0, dot));
  if (dot == std::string::npos || service == vocabulary.services.end()) return {};
  const auto method = service->second.find(topic.substr(dot + 1));
  if (method == service->second.end()) return {};
  DataType data = method->second.arguments;
  data.name = "the data of " + topic;
  return data;
}

const monitor::Vocabulary::Method* method_of(const std::string& service, const std::string& method,
                                             const monitor::Vocabulary& vocabulary) {
  const auto found = vocabulary.services.find(service);
  if (found == vocabulary.services.end()) return nullptr;
  const auto of = found->second.find(method);
  return of == found->second.end() ? nullptr : &of->second;
}

const idl::Method* method_of(const std::string& service, const std::string& method,
                             const std::map<std::string, ServicePlan>& services) {
  const auto found = services.find(service);
  return found == services.end() ? nullptr : found->second.service->find(method);
}

// Null: there is none.
const idl::Type* argument_of(const std::string& service, const std::string& method, const std::string& name,
                             const std::map<std::string, ServicePlan>& services) {
  const idl::Method* const found = method_of(service, method, services);
  const idl::Field* const argument = found == nullptr ? nullptr : found->arguments.find(name);
  return argument == nullptr ? nullptr : argument->type;
}

DataType member_of(const DataType& record, const std::string& name) {
  const auto found = std::find_if(record.members.begin(), record.members.end(),
                                  [&](const monitor::DataMember& member) { return member.name == name; });
  return found == record.members.end() ? DataType() : found->type;
}

DataType arguments_of(const std::string& service, const std::string& method, const monitor::Vocabulary& vocabulary) {
  const auto* const found = method_of(service, method, vocabulary);
  return found == nullptr ? DataType() : found->arguments;
}

}  // namespace

void check_model_expressions(const ModelEntry& entry, const ChartFacts& facts,
                             const std::map<std::string, ServicePlan>& services, const monitor::Vocabulary& vocabulary,
                             Diagnostics& diagnostics) {
  ChartEvents events;
  for (const std::string& service : entry.serves) {
    const auto methods = vocabulary.services.find(service);
    if (methods == vocabulary.services.end()) continue;
    for (const auto& [name, method] : methods->second)
      events.names.push_back(fmt::format("{}.{}.request", service, name));
  }
  events.names.insert(events.names.end(), entry.subscribes.topics.begin(), entry.subscribes.topics.end());
  events.functions = {"choose", "pick", "between", "chance", "draw", "fresh"};
  events.data_of = [&](const std::string& name) {
    const auto& topics = entry.subscribes.topics;
    if (std::find(topics.begin(), topics.end(), name) != topics.end()) return topic_data(name, vocabulary);
    const auto dot = name.find('.');
    const auto last = name.rfind('.');
    DataType data{.kind = DataType::Kind::kRecord, .name = "the data of " + name, .may_be_absent = false};
    data.members.push_back(
        {"args", arguments_of(name.substr(0, dot), name.substr(dot + 1, last - dot - 1), vocabulary)});
    data.members.push_back({"source", {.kind = DataType::Kind::kText, .name = "string", .may_be_absent = false}});
    data.members.push_back({"id", {.kind = DataType::Kind::kNumber, .name = "number", .may_be_absent = false}});
    return data;
  };
  events.param_of = [&](const std::string& target, const std::string& event, const std::string& param) {
    if (!event.ends_with(".reply")) return member_of(arguments_of(target, event, vocabulary), param);
    const auto* const method = method_of(target, event.substr(0, event.rfind('.')), vocabulary);
    return method == nullptr || param != "result" ? DataType() : method->result;
  };
  events.type_of = [&](const std::string& target, const std::string& event, const std::string& param) {
    if (!event.ends_with(".reply")) return argument_of(target, event, param, services);
    const idl::Method* const method = method_of(target, event.substr(0, event.rfind('.')), services);
    return method == nullptr || param != "result" ? nullptr : method->result;
  };
  check_expressions(facts, events, diagnostics);
}

void check_monitor(const MonitorEntry& entry, const ChartFacts& facts, const monitor::Vocabulary* vocabulary,
                   Diagnostics& diagnostics) {
  const scxml::Chart& chart = facts.chart();
  check_verdicts(entry, chart, diagnostics);
  check_idle_transitions(chart, false, diagnostics);
  for (const scxml::SendInfo& send : chart.sends()) {
    if (!send.type || scxml::is_scxml_processor(*send.type)) continue;
    error(diagnostics, "check.unknown-receiver",
          fmt::format("a monitor only watches: nobody receives its <send type=\"{}\">; \"gate\" in sentree.yaml lets a "
                      "monitor refuse requests, and skills call services",
                      *send.type),
          chart.span(send.place));
  }
  std::optional<monitor::Observations> observations;
  if (vocabulary != nullptr) observations.emplace(*vocabulary);
  ChartEvents events;
  if (!entry.events.empty()) {
    check_renames(entry, chart, observations ? &*observations : nullptr, events, diagnostics);
    for_each_unknown(
        chart, events.names, [&](const std::string& descriptor, const scxml::Place& place, const std::string& hint) {
          error(diagnostics, "check.unknown-event",
                fmt::format("event \"{}\" never comes: \"events\" of monitor \"{}\" in sentree.yaml does not name it{}",
                            descriptor, entry.name, hint),
                chart.span(place));
        });
  } else if (observations) {
    events.names = observations->names();
    events.data_of = [&](const std::string& name) { return observations->data_of(name); };
    for_each_unknown(
        chart, events.names, [&](const std::string& descriptor, const scxml::Place& place, const std::string& hint) {
          error(diagnostics, "check.unknown-event",
                fmt::format("event \"{}\" never comes: nothing in this project is observed so{}", descriptor, hint),
                chart.span(place));
        });
  } else {
    return;
  }
  if (vocabulary != nullptr) check_expressions(facts, events, diagnostics);
}

void check_receivers(const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services,
                     Diagnostics& diagnostics) {
  static const std::vector<std::string> kTypes{"thrift", "scxml"};
  for (const scxml::SendInfo& send : chart.sends()) {
    if (!send.type || send.type == "thrift" || send.type->starts_with("http://")) continue;
    if (!send.type->empty() && send.type != "scxml") {
      add_once(diagnostics, Severity::kError, "check.unknown-receiver",
               fmt::format("nobody receives <send> of type \"{}\"; services are called with type=\"thrift\"{}",
                           *send.type, did_you_mean(*send.type, kTypes)),
               chart.span(send.place));
    } else if (send.target && services.contains(*send.target)) {
      add_once(diagnostics, Severity::kError, "check.unknown-receiver",
               fmt::format("\"{}\" is a service: call it with type=\"thrift\"", *send.target),
               chart.span(send.target_place));
    }
  }
}

void check_skill_events(const ChartFacts& facts, const std::map<std::string, ServicePlan>& services,
                        const monitor::Vocabulary& vocabulary, const SkillUse& use, Diagnostics& diagnostics) {
  const scxml::Chart& chart = facts.chart();
  ChartEvents events;
  if (use.is_native) events.names = {"tick", "halt"};
  for (const SkillProtocol& protocol : use.protocols) {
    for (const std::string* event : {&protocol.start, &protocol.tick, &protocol.halt, &protocol.acknowledge}) {
      if (!event->empty()) events.names.push_back(*event);
    }
  }
  for (const auto& [service, plan] : services) {
    for (const idl::Method* method : plan.service->methods) {
      const auto& sends = chart.sends();
      const bool may_publish =
          std::any_of(sends.begin(), sends.end(), [&, &service = service](const scxml::SendInfo& send) {
            return send.target.value_or(service) == service && send.event.value_or(method->name) == method->name;
          });
      if (!method->oneway) events.names.push_back(fmt::format("{}.{}.reply", service, method->name));
      // The name of a topic is the beginning of that of its error.
      if (!method->oneway || may_publish) events.names.push_back(fmt::format("{}.{}.error", service, method->name));
    }
  }
  events.names.insert(events.names.end(), use.topics.begin(), use.topics.end());
  events.data_of = [&](const std::string& name) {
    if (use.topics.contains(name)) return topic_data(name, vocabulary);
    const auto last = name.rfind('.');
    const auto dot = last == std::string::npos ? last : name.rfind('.', last - 1);
    if (dot == std::string::npos) return DataType();
    const auto service = vocabulary.services.find(name.substr(0, dot));
    if (service == vocabulary.services.end()) return DataType();
    const auto method = service->second.find(name.substr(dot + 1, last - dot - 1));
    if (method == service->second.end()) return DataType();
    DataType data{.kind = DataType::Kind::kRecord, .name = "the data of " + name, .may_be_absent = false};
    data.members.push_back({"args", method->second.arguments});
    if (name.ends_with(".reply")) {
      data.members.push_back({"result", method->second.result});
    } else {
      for (const monitor::DataMember& member : monitor::data_of_error(method->second).members)
        data.members.push_back(member);
    }
    return data;
  };
  events.given = use.given;
  events.texts = use.texts;
  events.param_of = [&](const std::string& target, const std::string& event, const std::string& param) {
    const auto arguments = arguments_of(target, event, vocabulary);
    return member_of(arguments, param);
  };
  events.type_of = [&](const std::string& target, const std::string& event, const std::string& param) {
    return argument_of(target, event, param, services);
  };

  for_each_unknown(
      chart, events.names, [&](const std::string& descriptor, const scxml::Place& place, const std::string& near) {
        const auto dot = descriptor.find('.');
        const auto service = services.find(descriptor.substr(0, dot));
        if (service != services.end()) {
          // Of an unknown method it is said elsewhere.
          const auto second = descriptor.find('.', dot + 1);
          const std::string method =
              descriptor.substr(dot + 1, second == std::string::npos ? second : second - dot - 1);
          if (service->second.service->find(method) == nullptr) return;
          const idl::Method& called = *service->second.service->find(method);
          if (called.oneway && second == std::string::npos) return;  // likewise of topics
          error(diagnostics, "check.unknown-event",
                fmt::format("event \"{}\" never comes: {}", descriptor,
                            called.oneway ? method + " is one-way, and nobody answers it"
                                          : "a call ends with .reply or .error" + near),
                chart.span(place));
          return;
        }
        // Charts of other runtimes may know more events than they get here.
        if (near.empty() && !use.is_native) return;
        add_once(diagnostics, Severity::kWarning, "check.never-arrives",
                 fmt::format("event \"{}\" never arrives: nobody sends it{}", descriptor, near), chart.span(place));
      });
  check_expressions(facts, events, diagnostics);
  check_idle_transitions(chart, true, diagnostics);
  check_receivers(chart, services, diagnostics);
  if (!use.is_native) return;

  // An action may wait for ever; a condition owes an answer.
  const std::vector<bool> reached = scxml::reachable_states(chart);
  bool has_end = false;
  bool reaches_end = false;
  for (scxml::StateIndex s = 0; s < chart.states().size(); ++s) {
    const scxml::State& state = chart.states()[s];
    if (state.kind != scxml::StateKind::kFinal || state.parent != 0) continue;
    if (state.id != "success" && state.id != "failure") continue;
    has_end = true;
    reaches_end = reaches_end || reached[s];
  }
  if (reaches_end) return;
  const SourceSpan span = chart.span(chart.states()[0].place);
  if (has_end || use.is_condition) {
    error(diagnostics, "check.no-outcome",
          has_end
              ? "the skill never ends: no path leads to its top-level <final id=\"success\"> or <final id=\"failure\">"
              : "a condition must end: give its chart a top-level <final id=\"success\"> and <final id=\"failure\">",
          span);
  } else if (seems_to_want_an_end(chart)) {
    add_once(diagnostics, Severity::kWarning, "check.no-outcome",
             "the skill never ends, and its leaf is RUNNING until it is halted: give the chart a top-level "
             "<final id=\"success\"> and <final id=\"failure\">; if that is meant, <transition event=\"halt\" "
             "target=\"halted\"/> and <final id=\"halted\"/> say so",
             span);
  }
}

}  // namespace sentree::project
