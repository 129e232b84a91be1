#include "sentree/project/detail/check_topics.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "sentree/rpc/address.h"
#include "sentree/rpc/middleware.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/model.h"
#include "sentree/sim/topics.h"

namespace sentree::project {

namespace {

const idl::Method* method_of(const std::string& topic, const std::map<std::string, ServicePlan>& services) {
  const auto dot = topic.rfind('.');
  const auto service = services.find(topic.substr(0, dot));
  if (dot == std::string::npos || service == services.end()) return nullptr;
  return service->second.service->find(topic.substr(dot + 1));
}

std::vector<std::string> topics_of(const std::map<std::string, ServicePlan>& services) {
  std::vector<std::string> topics;
  for (const auto& [name, plan] : services) {
    for (const idl::Method* method : plan.service->methods) {
      if (method->oneway) topics.push_back(fmt::format("{}.{}", name, method->name));
    }
  }
  return topics;
}

bool is_all_oneway(const idl::Service& service) {
  return std::all_of(service.methods.begin(), service.methods.end(), [](const auto* method) { return method->oneway; });
}

// What a chart handles of what comes from outside: itself, or by charts that it invokes and forwards everything to.
// Nothing: one of those is known at run time only, and may handle anything.
std::optional<std::vector<std::string>> handled_inside(const scxml::Chart& chart) {
  std::vector<std::string> handled;
  std::vector<scxml::Chart> hearing{chart};
  for (std::size_t i = 0; i < hearing.size(); ++i) {
    const scxml::Chart one = hearing[i];
    const std::vector<std::string> events = one.events_handled();
    handled.insert(handled.end(), events.begin(), events.end());
    for (const scxml::Invoke& invoke : one.model().invokes) {
      if (!invoke.autoforward) continue;
      if (!invoke.child) return std::nullopt;
      hearing.push_back(*invoke.child);
    }
  }
  return handled;
}

}  // namespace

void check_all_oneway(const ServiceEntry& entry, const idl::Service& service, Diagnostics& diagnostics) {
  for (const idl::Method* method : service.methods) {
    if (method->oneway) continue;
    add(diagnostics, Severity::kError, "check.topic",
        fmt::format("service \"{}\" is at: topics, where nobody answers, but {} is not one-way; write \"oneway void "
                    "{}(…)\" in {}, or say who serves it",
                    entry.name, method->name, method->name, entry.idl),
        entry.span);
    return;
  }
}

void check_published(const ServiceEntry& entry, const idl::Service& service, Diagnostics& diagnostics) {
  const bool is_telemetry = entry.interface == sim::kTelemetry;
  if (!entry.publish.empty() && entry.at != "sim") {
    add(diagnostics, Severity::kError, "check.publish",
        fmt::format("service \"{}\" is at: {}, but only the simulator in the process of the run publishes at a rate; "
                    "write at: sim, or leave \"publish\" out",
                    entry.name, entry.at),
        entry.publish.front().span);
    return;
  }
  std::vector<std::string> known;
  for (const sim::TopicInfo& info : sim::topics()) known.emplace_back(info.topic);
  for (const PublishedTopic& topic : entry.publish) {
    if (is_telemetry && sim::find_topic(topic.method) != nullptr && service.find(topic.method) != nullptr) continue;
    add(diagnostics, Severity::kError, "check.publish",
        is_telemetry
            ? fmt::format("the simulator publishes no topic \"{}\"{}", topic.method, did_you_mean(topic.method, known))
            : "the simulator publishes topics of robot.thrift/Telemetry, and not of " + entry.interface,
        topic.span);
  }
  if (is_telemetry && entry.at == "sim" && entry.publish.empty()) {
    add(diagnostics, Severity::kWarning, "check.publish",
        fmt::format("service \"{}\" publishes nothing; write publish: {{battery: 2 Hz}}", entry.name), entry.span);
  }
}

void check_subscriptions(const std::string& who, const Subscriptions& subscribes, const scxml::Chart& chart,
                         const std::map<std::string, ServicePlan>& services, Diagnostics& diagnostics) {
  const auto handled = handled_inside(chart);
  for (const std::string& topic : subscribes.topics) {
    const idl::Method* const method = method_of(topic, services);
    if (method == nullptr || !method->oneway) {
      add(diagnostics, Severity::kError, "check.unknown-topic",
          fmt::format("{} subscribes to \"{}\", which is no topic: {}{}", who, topic,
                      method == nullptr ? "no service of the project has such a method"
                                        : "the method is not one-way, so it is called and not published",
                      did_you_mean(topic, topics_of(services))),
          subscribes.span);
      continue;
    }
    const bool heard = !handled || std::any_of(handled->begin(), handled->end(), [&](const std::string& descriptor) {
      return scxml::event_matches(descriptor, topic);
    });
    if (heard) continue;
    add(diagnostics, Severity::kError, "check.unheard-event",
        fmt::format("{} subscribes to \"{}\", but {} has no transition for that event{}", who, topic, chart.file(),
                    did_you_mean(topic, *handled)),
        subscribes.span);
  }
}

std::vector<std::string> topics_handled(const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services) {
  std::vector<std::string> topics;
  for (const std::string& event : chart.events_handled()) {
    const idl::Method* const method = method_of(event, services);
    if (method != nullptr && method->oneway) topics.push_back(event);
  }
  return topics;
}

void check_types(const Project& project, const std::map<std::string, ServicePlan>& services, Diagnostics& diagnostics) {
  // The name, the domain, and whether it is a topic, a service or an action: those do not get into each other's way.
  std::map<std::string, const ServiceEntry*> known;
  for (const ServiceEntry& entry : project.services) {
    const auto service = services.find(entry.name);
    if (service == services.end()) continue;
    const std::string& at = service->second.observed.empty() ? service->second.at : service->second.observed;
    if (!at.starts_with("ros:") || entry.idl.ends_with(".thrift")) continue;
    std::string_view name = at;
    std::string key;
    for (const auto& [option, value] : rpc::cut_options(name)) {
      if (option.starts_with("domain=")) key = option;
    }
    if (name.ends_with('/')) continue;
    const auto type = [](const ServiceEntry& each) { return each.idl.substr(0, each.idl.rfind('.')); };
    key = fmt::format("{} {} {}", entry.idl.substr(entry.idl.rfind('.') + 1), name, key);
    const auto [other, is_new] = known.emplace(key, &entry);
    if (is_new || other->second->idl == entry.idl) continue;
    add(diagnostics, Severity::kError, "check.two-types",
        fmt::format("{} is of type {} here, and of {} for \"{}\": a node has one type at a name", name, type(entry),
                    type(*other->second), other->second->name),
        entry.span);
  }
}

void check_publishers(const Project& project, const std::vector<LeafPlan>& leaves, const std::vector<ModelPlan>& models,
                      const std::map<std::string, ServicePlan>& services, Diagnostics& diagnostics) {
  std::set<std::string> published;
  bool open = false;  // anything may be
  const auto look = [&](const scxml::Chart& chart) {
    open = open || scxml::invokes_unknown(chart);
    for (const scxml::SendInfo& send : scxml::sends_with_invoked(chart)) {
      if (send.type && *send.type != "thrift") continue;
      if (!send.type || !send.target || !send.event)
        open = true;
      else
        published.insert(fmt::format("{}.{}", *send.target, *send.event));
    }
  };
  for (const LeafPlan& leaf : leaves) {
    if (leaf.chart)
      look(*leaf.chart);
    else
      open = true;
  }
  for (const ModelPlan& model : models) look(model.chart);
  for (const ServiceEntry& service : project.services) {
    for (const PublishedTopic& topic : service.publish)
      published.insert(fmt::format("{}.{}", service.name, topic.method));
  }
  if (open) return;
  const auto check = [&](const Subscriptions& subscribes) {
    for (const std::string& topic : subscribes.topics) {
      const idl::Method* const method = method_of(topic, services);
      if (method == nullptr || !method->oneway || published.contains(topic)) continue;
      const ServicePlan& service = services.at(topic.substr(0, topic.rfind('.')));
      const std::string& at = service.at;
      if (!service.observed.empty()) continue;
      if (!is_inside(at)) {
        // Who serves it elsewhere may publish it, unless it is where the project does.
        const auto address = rpc::Address::parse(at);
        if (!address || address->kind != rpc::Address::Kind::kOther || !is_all_oneway(*service.service) ||
            rpc::middleware_of(*address).is_source(*address, service.service.get()))
          continue;
        add(diagnostics, Severity::kError, "check.unpublished",
            fmt::format("\"{}\" never comes: \"{}\" is where the project publishes, and no chart of it publishes "
                        "that; give an address that is read from{}",
                        topic, at, address->scheme == "yarp" ? ": yarp:/NAME:o, or yarp:/NAME?read" : ""),
            subscribes.span);
        continue;
      }
      if (at == "sim") {
        add(diagnostics, Severity::kWarning, "check.unpublished",
            fmt::format(
                "the simulator does not publish \"{}\": write publish: {{{}: 2 Hz}} in the entry of the service", topic,
                method->name),
            subscribes.span);
        continue;
      }
      add(diagnostics, Severity::kWarning, "check.unpublished",
          fmt::format(
              "no chart of the project publishes \"{}\"; it comes only from scenarios, people and other processes",
              topic),
          subscribes.span);
    }
  };
  for (const SkillEntry& skill : project.skills) check(skill.subscribes);
  for (const ModelEntry& model : project.models) check(model.subscribes);
}

}  // namespace sentree::project
