#include <fmt/format.h>

#include <algorithm>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/processes/control.h"
#include "sentree/processes/environment.h"
#include "sentree/processes/remote_service.h"
#include "sentree/project/project.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/middleware.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kDeadline{1000};

rpc::Deadline in_time() { return SteadyClock::now() + kDeadline; }

struct Offered {
  std::string name;
  std::string interface;
  std::string at;
  std::vector<std::string> methods;
};

std::optional<std::vector<Offered>> services_of(rpc::Client& run) {
  const auto reply = run.call("services", Map(), in_time());
  if (!reply) {
    say(reply.error().message);
    return std::nullopt;
  }
  std::vector<Offered> all;
  const auto list = text::parse_json(reply->text());
  if (!list || list->as_list() == nullptr) return all;
  for (const Value& entry : *list->as_list()) {
    Offered& offered = all.emplace_back();
    offered.name = entry.find("name")->text();
    offered.interface = entry.find("interface")->text();
    offered.at = entry.find("at")->text();
    for (const Value& method : *entry.find("methods")->as_list()) offered.methods.emplace_back(method.text());
  }
  return all;
}

struct Ping {
  std::string name;
  std::string at;
  bool alive = false;
  double milliseconds = 0;
  std::string message;
};

// What the control socket says of where a service is: addresses, joined by ", ".
std::vector<std::string> addresses_in(std::string_view text) {
  constexpr std::string_view kBetween = ", ";
  std::vector<std::string> all;
  for (;;) {
    const std::size_t end = std::min(text.find(kBetween), text.size());
    all.emplace_back(text.substr(0, end));
    if (end == text.size()) return all;
    text.remove_prefix(end + kBetween.size());
  }
}

// The first call connects; the round trip is the second's.
Ping ping_address(const std::string& name, const std::string& text) {
  Ping ping{.name = name, .at = text, .message = {}};
  auto address = rpc::Address::parse(text);
  if (!address) {
    ping.message = address.error().message;
    return ping;
  }
  auto probe = processes::Probe::to(*address, name);
  if (!probe) {
    ping.message = probe.error().message;
    return ping;
  }
  for (int i = 0; i < 2; ++i) {
    const auto from = SteadyClock::now();
    const auto silent = probe->ask(in_time());
    ping.milliseconds = seconds(SteadyClock::now() - from) * 1e3;
    ping.alive = !silent;
    ping.message = silent.value_or("");
    if (silent) break;
  }
  return ping;
}

Ping ping_run(rpc::Client& run) {
  Ping ping{.name = "run", .at = "control socket", .message = {}};
  for (int i = 0; i < 2; ++i) {
    const auto from = SteadyClock::now();
    const auto outcome = run.call("info", Map(), in_time());
    ping.milliseconds = seconds(SteadyClock::now() - from) * 1e3;
    ping.alive = outcome.has_value();
    if (!outcome) ping.message = outcome.error().message;
  }
  return ping;
}

int report(const std::vector<Ping>& pings, bool json) {
  const bool all = std::all_of(pings.begin(), pings.end(), [](const Ping& ping) { return ping.alive; });
  List list;
  for (const Ping& ping : pings) {
    if (json) {
      Map entry{{"name", ping.name}, {"at", ping.at}, {"alive", ping.alive}};
      if (ping.alive)
        entry["round_trip_ms"] = ping.milliseconds;
      else
        entry["message"] = ping.message;
      list.emplace_back(std::move(entry));
    } else if (ping.alive) {
      print(fmt::format("✓ {:<16} {:>8.3f} ms  {}\n", ping.name, ping.milliseconds, ping.at));
    } else {
      print(fmt::format("✗ {:<16} {:>11}  {}{}\n", ping.name, "", ping.at == ping.name ? "" : ping.at + ": ",
                        ping.message));
    }
  }
  if (json) print(to_json(Value(std::move(list))) + "\n");
  return all ? kOk : kEnvironment;
}

}  // namespace

namespace {

int services_on(const ServicesCommand& command) {
  const auto address = rpc::Address::parse(command.on);
  if (!address) {
    say("--on: " + address.error().message);
    return kUsage;
  }
  const auto all = rpc::middleware_of(*address).list(*address, kDeadline);
  if (!all) {
    say(to_string(all.error()));
    return kEnvironment;
  }
  List list;
  for (const rpc::NetworkEntry& entry : *all) {
    if (command.json)
      list.push_back(Map{{"name", entry.name}, {"at", entry.at}, {"kind", entry.kind}});
    else
      print(fmt::format("{:<32} {}\n", entry.at, entry.kind));
  }
  if (command.json) print(to_json(Value(std::move(list))) + "\n");
  return kOk;
}

}  // namespace

int services(const ServicesCommand& command) {
  if (!command.on.empty()) return services_on(command);
  const auto run = processes::connect_control(std::atoi(command.run.c_str()));
  if (!run) {
    say(run.error().message);
    return kEnvironment;
  }
  const auto all = services_of(**run);
  if (!all) return kEnvironment;
  List list;
  for (const Offered& service : *all) {
    if (command.json) {
      List methods;
      for (const std::string& method : service.methods) methods.emplace_back(method);
      list.push_back(Map{{"name", service.name},
                         {"interface", service.interface},
                         {"at", service.at},
                         {"methods", std::move(methods)}});
      continue;
    }
    print(fmt::format("{}: {} at {}\n", service.name, service.interface, service.at));
    for (const std::string& method : service.methods) print(fmt::format("  {}\n", method));
  }
  if (command.json) print(to_json(Value(std::move(list))) + "\n");
  return kOk;
}

int ping(const PingCommand& command) {
  if (command.target.find(':') != std::string::npos)
    return report({ping_address(command.target, command.target)}, command.json);
  const auto run = processes::connect_control(std::atoi(command.run.c_str()));
  if (!run) {
    say(run.error().message);
    return kEnvironment;
  }
  const auto all = services_of(**run);
  if (!all) return kEnvironment;
  std::vector<Ping> pings{ping_run(**run)};
  std::vector<std::string> names;
  for (const Offered& service : *all) {
    names.push_back(service.name);
    // What is in the run answers with it.
    const bool is_inside = project::is_inside(service.at);
    if (is_inside && service.name == command.target) return report(pings, command.json);
    if (is_inside || (!command.target.empty() && service.name != command.target)) continue;
    const std::size_t before = pings.size();
    for (const std::string& at : addresses_in(service.at)) {
      auto address = rpc::Address::parse(at);
      if (address && address->service.empty()) address->service = service.name;
      pings.push_back(ping_address(service.name, address ? to_string(*address) : at));
    }
    if (!command.target.empty())
      return report({pings.begin() + static_cast<std::ptrdiff_t>(before), pings.end()}, command.json);
  }
  if (!command.target.empty()) {
    say(fmt::format("the run has no service \"{}\"{}", command.target, did_you_mean(command.target, names)));
    return kUsage;
  }
  return report(pings, command.json);
}

}  // namespace sentree::cli
