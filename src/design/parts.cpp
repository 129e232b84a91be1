#include "sentree/design/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>

#include "sentree/base/assert.h"
#include "sentree/bt/model.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/format.h"
#include "sentree/text/file.h"

namespace sentree::design {

namespace {

/// A call that the templates speak of.
struct Call {
  std::string service;
  std::string method;
};

/// One without arguments that answers, where the project has one.
std::optional<Call> example_call(const project::Plan& plan) {
  for (const auto& [name, service] : plan.services) {
    for (const idl::Method* method : service.service->methods) {
      if (!method->oneway && method->arguments.fields.empty() && method->result->kind != idl::Kind::kVoid)
        return Call{name, method->name};
    }
  }
  return std::nullopt;
}

/// One that some skill makes: of any other, nothing is ever observed.
std::optional<Call> call_of_a_skill(const project::Plan& plan) {
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (!leaf.chart) continue;
    for (const scxml::SendInfo& send : scxml::sends_with_invoked(*leaf.chart)) {
      if (send.type != "thrift" || !send.target || !send.event) continue;
      const auto service = plan.services.find(*send.target);
      if (service == plan.services.end()) continue;
      for (const idl::Method* method : service->second.service->methods) {
        if (method->name == *send.event && !method->oneway) return Call{*send.target, *send.event};
      }
    }
  }
  return std::nullopt;
}

std::string chart(const std::string& name, const std::string& about, const std::string& initial,
                  const std::string& body) {
  const std::string written = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- {} -->\n"
      "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" name=\"{}\" "
      "initial=\"{}\">\n{}</scxml>\n",
      about, name, initial, body);
  // Where lines are broken depends on the names.
  const auto formatted = scxml::format(written, name);
  SENTREE_ASSERT(formatted.has_value());
  return *formatted;
}

constexpr const char* kOutcomes = "  <final id=\"success\"/>\n  <final id=\"failure\"/>\n  <final id=\"halted\"/>\n";

Part skill(const std::string& name, const std::optional<Call>& call) {
  Part part;
  // Calls stand in a comment: a robot may be at the other end.
  const Call shown = call.value_or(Call{"SERVICE", "METHOD"});
  const std::string body = fmt::format(
      "  <state id=\"waiting\">\n"
      "    <!-- <send type=\"thrift\" target=\"{0}\" event=\"{1}\"/> calls; {0}.{1}.reply and {0}.{1}.error answer. "
      "-->\n"
      "    <onentry><send event=\"enough\" delay=\"2s\"/></onentry>\n"
      "    <transition event=\"halt\" target=\"halted\"/>\n"
      "    <transition event=\"enough\" target=\"success\"/>\n"
      "    <transition event=\"error\" target=\"failure\"/>\n"
      "  </state>\n",
      shown.service, shown.method);
  part.files.emplace_back(fmt::format("skills/{}.scxml", name),
                          chart(name,
                                "Each tick is RUNNING until a final state is entered. To begin with, it succeeds "
                                "after two seconds.",
                                "waiting", body + kOutcomes));
  part.next = fmt::format(
      "put <{0} name=\"{0}\"/> into the tree, then `sentree model {{project}} --into {{mission}}` makes it known to "
      "editors",
      name);
  return part;
}

Part monitor(const std::string& name, const std::optional<Call>& call) {
  Part part;
  const std::string request = call ? fmt::format("{}.{}.request", call->service, call->method) : "mission.tick";
  const std::string answer = call ? fmt::format("{0}.{1}.reply {0}.{1}.error", call->service, call->method) : "";
  // Without a call: from tick to tick, until the mission ends.
  const std::string ways = call ? fmt::format("    <transition event=\"{}\" target=\"content\"/>\n", answer)
                                : "    <transition event=\"mission.tick\" target=\"waiting\"/>\n"
                                  "    <transition event=\"mission.status\" cond=\"_event.data.status !== 'RUNNING'\" "
                                  "target=\"content\"/>\n";
  part.files.emplace_back(
      fmt::format("monitors/{}.scxml", name),
      chart(name,
            call ? fmt::format("Requirement: {}.{} is answered within two seconds.", call->service, call->method)
                 : "Requirement: the mission is ticked at least every two seconds.",
            "content",
            fmt::format("  <state id=\"content\">\n"
                        "    <transition event=\"{}\" target=\"waiting\"/>\n"
                        "  </state>\n"
                        "  <state id=\"waiting\">\n"
                        "    <onentry><send event=\"late\" id=\"late\" delay=\"2s\"/></onentry>\n"
                        "    <onexit><cancel sendid=\"late\"/></onexit>\n"
                        "{}"
                        "    <transition event=\"late\" target=\"violated\"/>\n"
                        "  </state>\n"
                        "  <final id=\"violated\"/>\n",
                        request, ways)));
  part.entries.emplace_back("monitors", fmt::format("- {{file: monitors/{}.scxml}}", name));
  part.next = "docs/observations.md lists what a monitor can see";
  return part;
}

Part requirement(const std::string& name, const std::optional<Call>& call) {
  Part part;
  const std::string what = call ? fmt::format("{}.{}", call->service, call->method) : "";
  part.files.emplace_back(fmt::format("requirements/{}.req", name),
                          call ? fmt::format("# docs/requirements.md tells what can be said.\n"
                                             "event asked    = request({0})\n"
                                             "event answered = reply({0})\n\n"
                                             "{1} \"{0} is answered within two seconds.\":\n"
                                             "  whenever event(asked), {2} shall event(answered) within 2 s.\n",
                                             what, name, call->service)
                               : fmt::format("# docs/requirements.md tells what can be said.\n"
                                             "{} \"The mission is ticked at least once a second.\":\n"
                                             "  event(observation(mission.tick)) at least every 1 s.\n",
                                             name));
  part.entries.emplace_back("monitors", fmt::format("- {{file: requirements/{}.req}}", name));
  part.next = "`sentree run {project}` judges it, `sentree monitor check RUN.mcap --project {project}` on a past run";
  return part;
}

Part scenario(const std::string& name) {
  Part part;
  part.files.emplace_back(fmt::format("scenarios/{}.yaml", name),
                          "description: the mission succeeds\n"
                          "# What happens to it, for example a call of the simulator's control, or of a service:\n"
                          "# timeline:\n"
                          "#   - {at: 20 s, call: simulation.setBatteryCharge, args: {percent: 10}}\n"
                          "duration: 2 min\n"
                          "expect:\n"
                          "  mission: SUCCESS\n");
  part.next = fmt::format("`sentree test {{project}} --scenario {}` runs it", name);
  return part;
}

Part component(const std::string& name) {
  Part part;
  std::string service = name;
  service.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(service.front())));
  part.files.emplace_back(fmt::format("interfaces/{}.thrift", name), fmt::format("// What {0} can be asked.\n"
                                                                                 "service {1} {{\n"
                                                                                 "  bool isReady()\n"
                                                                                 "}}\n",
                                                                                 name, service));
  part.files.emplace_back(fmt::format("models/{}.scxml", name),
                          chart(name, fmt::format("Stands in for {}: one session for the whole run.", name), "ready",
                                fmt::format("  <state id=\"ready\">\n"
                                            "    <transition event=\"{0}.isReady.request\">\n"
                                            "      <send type=\"thrift\" target=\"{0}\" event=\"isReady.reply\">"
                                            "<param name=\"result\" expr=\"true\"/></send>\n"
                                            "    </transition>\n"
                                            "  </state>\n",
                                            name)));
  part.entries.emplace_back("services", fmt::format("{0}: {{interface: {0}.thrift/{1}, at: model}}", name, service));
  part.entries.emplace_back("models",
                            fmt::format("- {{file: models/{0}.scxml, name: {0}_model, serves: [{0}]}}", name));
  part.next = fmt::format(
      "skills call it by <send type=\"thrift\" target=\"{}\" event=\"isReady\"/>; an address in place of `model` "
      "reaches the real one",
      name);
  return part;
}

bool is_part_name(const std::string& name) {
  const auto letter = [](unsigned char c) { return std::isalpha(c) != 0 || c == '_'; };
  return !name.empty() && letter(static_cast<unsigned char>(name.front())) &&
         std::all_of(name.begin(), name.end(), [&](unsigned char c) { return letter(c) || std::isdigit(c) != 0; });
}

// Elements that mean something in trees, whatever skills there are.
bool is_of_trees(const std::string& name) {
  constexpr std::array kOthers{"Action",      "Condition", "Control",      "Decorator",     "SubTree",
                               "SubTreePlus", "root",      "BehaviorTree", "TreeNodesModel"};
  return bt::find_builtin(name, 4) != nullptr || bt::find_builtin(name, 3) != nullptr ||
         std::find(kOthers.begin(), kOthers.end(), name) != kOthers.end();
}

// What the project has of that name, which no other part of the kind may have; empty: nothing.
std::string bearer_of(const std::string& name, const std::string& kind, const project::Plan& plan) {
  if (kind == "monitor" || kind == "requirement") {
    const bool is_judged = std::any_of(plan.monitors.begin(), plan.monitors.end(),
                                       [&](const monitor::Model& monitor) { return monitor.name() == name; });
    return is_judged ? "a monitor or requirement " + name : "";
  }
  if (kind != "component") return "";
  if (plan.services.contains(name)) return "a service " + name;
  // Of its two parts, the service and the model, each has a name.
  for (const std::string& one : {name, name + "_model"}) {
    const auto is_called = [&](const auto& other) { return other.name == one; };
    const auto& models = plan.scenario.project.models;
    if (std::any_of(models.begin(), models.end(), is_called)) return "a model " + one;
    if (std::any_of(plan.leaves.begin(), plan.leaves.end(), is_called)) return "a leaf " + one;
  }
  return "";
}

}  // namespace

Result<Part> new_part(const std::string& kind, const std::string& name, const project::Plan* plan) {
  if (!is_part_name(name))
    return fail("design.bad-name", fmt::format("\"{}\" is no name: letters, digits and _, with a letter first", name));
  if (const std::string taken = plan != nullptr ? bearer_of(name, kind, *plan) : std::string(); !taken.empty()) {
    std::string free = name;
    for (int number = 2; !bearer_of(free, kind, *plan).empty(); ++number) free = fmt::format("{}_{}", name, number);
    return fail("design.name-taken",
                fmt::format("there is {} already; choose another name, for example {}", taken, free));
  }
  if (kind == "component" && std::find(std::begin(project::kReservedNames), std::end(project::kReservedNames), name) !=
                                 std::end(project::kReservedNames))
    return fail("design.name-taken",
                fmt::format("{} is a reserved name; choose another, for example {}_1", name, name));
  if (kind == "skill" && is_of_trees(name))
    return fail(
        "design.name-taken",
        fmt::format("{0} is a built-in node: <{0}> in a tree is that, and never the skill; choose another name, "
                    "for example {0}Skill",
                    name));
  const auto call = plan != nullptr ? example_call(*plan) : std::nullopt;
  const auto made = plan != nullptr ? call_of_a_skill(*plan) : std::nullopt;
  if (kind == "skill") return skill(name, call);
  if (kind == "monitor") return monitor(name, made);
  if (kind == "requirement") return requirement(name, made);
  if (kind == "scenario") return scenario(name);
  if (kind == "component") return component(name);
  return fail("design.no-such-part", fmt::format("\"{}\" is no part of a project", kind));
}

Result<std::vector<std::filesystem::path>> begin_project(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const auto name = entry.path().filename();
    if (name != ".git" && name != ".sentree")
      return fail("design.not-empty", folder.string() + ": exists and is not empty; choose another folder");
  }
  const fs::path source = project::shipped_folder("examples") / "minimal";
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(source, error)) {
    if (entry.is_regular_file()) files.push_back(fs::relative(entry.path(), source));
  }
  if (files.empty()) {
    return fail("design.not-installed",
                "the example that a new project starts from is missing; Sentree is not installed whole");
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const auto content = text::read_file(source / file);
    if (!content) return tl::unexpected(content.error());
    fs::create_directories((folder / file).parent_path(), error);
    if (auto written = text::write_file(folder / file, *content); !written) return tl::unexpected(written.error());
  }
  return files;
}

}  // namespace sentree::design
