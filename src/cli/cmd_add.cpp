#include <fmt/format.h>
#include <algorithm>
#include <cctype>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/project/plan.h"
#include "sentree/text/file.h"
#include "sentree/text/yaml_edit.h"

namespace sentree::cli {

namespace {

namespace fs = std::filesystem;

/// A part as it comes into a project: files, and an entry of sentree.yaml.
struct Part {
  std::vector<std::pair<fs::path, std::string>> files;
  std::vector<std::pair<std::string, std::string>> entries;  ///< Section and line.
  std::string next;                                          ///< What to do with it.
};

/// A call that the templates make: one without arguments that answers, where the project has one.
struct Call {
  std::string service;
  std::string method;
};

std::optional<Call> example_call(const project::Plan& plan) {
  for (const auto& [name, service] : plan.services) {
    for (const idl::Method* method : service.service->methods) {
      if (!method->oneway && method->arguments.fields.empty() && method->result->kind != idl::Kind::kVoid)
        return Call{name, method->name};
    }
  }
  return std::nullopt;
}

std::string chart(const std::string& name, const std::string& about, const std::string& initial,
                  const std::string& body) {
  return fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- {} -->\n"
      "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" name=\"{}\" "
      "initial=\"{}\">\n{}</scxml>\n",
      about, name, initial, body);
}

constexpr const char* kOutcomes = "  <final id=\"success\"/>\n  <final id=\"failure\"/>\n  <final id=\"halted\"/>\n";

Part skill(const std::string& name, const std::optional<Call>& call) {
  Part part;
  const std::string body = call ? fmt::format(
                                      "  <state id=\"asking\">\n"
                                      "    <onentry><send type=\"thrift\" target=\"{0}\" event=\"{1}\"/></onentry>\n"
                                      "    <transition event=\"halt\" target=\"halted\"/>\n"
                                      "    <!-- cond=\"_event.data.result …\" looks at the answer -->\n"
                                      "    <transition event=\"{0}.{1}.reply\" target=\"success\"/>\n"
                                      "    <!-- no answer in time, or none at all -->\n"
                                      "    <transition event=\"{0}.{1}.error error\" target=\"failure\"/>\n"
                                      "  </state>\n",
                                      call->service, call->method)
                                : "  <state id=\"waiting\">\n"
                                  "    <onentry><send event=\"enough\" delay=\"2s\"/></onentry>\n"
                                  "    <transition event=\"halt\" target=\"halted\"/>\n"
                                  "    <transition event=\"enough\" target=\"success\"/>\n"
                                  "    <transition event=\"error\" target=\"failure\"/>\n"
                                  "  </state>\n";
  part.files.emplace_back("skills/" + name + ".scxml",
                          chart(name, "Each tick is RUNNING until a final state is entered.",
                                call ? "asking" : "waiting", body + kOutcomes));
  part.next = fmt::format(
      "put <{0} name=\"{0}\"/> into the tree, then `sentree model {{project}} --into {{mission}}` makes it known to "
      "editors",
      name);
  return part;
}

Part monitor(const std::string& name, const std::optional<Call>& call) {
  Part part;
  const std::string request = call ? call->service + "." + call->method + ".request" : "mission.tick";
  const std::string answer =
      call ? fmt::format("{0}.{1}.reply {0}.{1}.error", call->service, call->method) : "mission.status";
  part.files.emplace_back(
      "monitors/" + name + ".scxml",
      chart(name,
            call ? fmt::format("Requirement: {}.{} is answered within two seconds.", call->service, call->method)
                 : "Requirement: the mission ends within two seconds of a tick.",
            "content",
            fmt::format("  <state id=\"content\">\n"
                        "    <transition event=\"{}\" target=\"waiting\"/>\n"
                        "  </state>\n"
                        "  <state id=\"waiting\">\n"
                        "    <onentry><send event=\"late\" id=\"late\" delay=\"2s\"/></onentry>\n"
                        "    <onexit><cancel sendid=\"late\"/></onexit>\n"
                        "    <transition event=\"{}\" target=\"content\"/>\n"
                        "    <transition event=\"late\" target=\"violated\"/>\n"
                        "  </state>\n"
                        "  <final id=\"violated\"/>\n",
                        request, answer)));
  part.entries.emplace_back("monitors", "- {file: monitors/" + name + ".scxml}");
  part.next = "docs/observations.md lists what a monitor can see";
  return part;
}

Part requirement(const std::string& name, const std::optional<Call>& call) {
  Part part;
  const std::string what = call ? call->service + "." + call->method : "";
  part.files.emplace_back("requirements/" + name + ".req",
                          call ? fmt::format("# docs/requirements.md tells what can be said.\n"
                                             "event asked    = request({0})\n"
                                             "event answered = reply({0})\n\n"
                                             "{1} \"{0} is answered within two seconds.\":\n"
                                             "  whenever event(asked), {2} shall event(answered) within 2 s.\n",
                                             what, name, call->service)
                               : fmt::format("# docs/requirements.md tells what can be said.\n"
                                             "{} \"The mission is ticked at least once a second.\":\n"
                                             "  observation(mission.tick) at least every 1 s.\n",
                                             name));
  part.entries.emplace_back("monitors", "- {file: requirements/" + name + ".req}");
  part.next = "`sentree run {project}` judges it, `sentree monitor check RUN.mcap --project {project}` on a past run";
  return part;
}

Part scenario(const std::string& name) {
  Part part;
  part.files.emplace_back("scenarios/" + name + ".yaml",
                          "description: the mission succeeds\n"
                          "# What happens to it, for example a call of the simulator's control, or of a service:\n"
                          "# timeline:\n"
                          "#   - {at: 20 s, call: simulation.setBatteryCharge, args: {percent: 10}}\n"
                          "duration: 2 min\n"
                          "expect:\n"
                          "  mission: SUCCESS\n");
  part.next = "`sentree test {project} --scenario " + name + "` runs it";
  return part;
}

Part component(const std::string& name) {
  Part part;
  std::string service = name;
  service.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(service.front())));
  part.files.emplace_back("interfaces/" + name + ".thrift", fmt::format("// What {0} can be asked.\n"
                                                                        "service {1} {{\n"
                                                                        "  bool isReady()\n"
                                                                        "}}\n",
                                                                        name, service));
  part.files.emplace_back("models/" + name + ".scxml",
                          chart(name, "Stands in for " + name + ": one session for the whole run.", "ready",
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
  part.next = "skills call it by <send type=\"thrift\" target=\"" + name +
              "\" event=\"isReady\"/>; an address in place of `model` reaches the real one";
  return part;
}

bool is_name(const std::string& name) {
  const auto letter = [](unsigned char c) { return std::isalpha(c) != 0 || c == '_'; };
  return !name.empty() && letter(static_cast<unsigned char>(name.front())) &&
         std::all_of(name.begin(), name.end(), [&](unsigned char c) { return letter(c) || std::isdigit(c) != 0; });
}

std::string filled(std::string text, const std::string& project, const std::string& mission) {
  for (const auto& [mark, value] :
       {std::pair<std::string, std::string>("{project}", project), {"{mission}", mission}}) {
    for (std::size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + value.size()))
      text.replace(at, mark.size(), value);
  }
  return text;
}

}  // namespace

int add(const AddCommand& command) {
  if (!is_name(command.name)) {
    say("\"" + command.name + "\" is no name: letters, digits and _, with a letter first");
    return kUsage;
  }
  auto loaded = project::load_project(command.project);
  if (!loaded.ok()) {
    say(loaded.diagnostics);
    return kInvalidInput;
  }
  const project::Project project = *loaded.value;
  const auto plan = project::prepare(project::plain_scenario(std::move(*loaded.value)));
  if (!plan.ok()) {
    say(plan.diagnostics);
    say("mend the project first: `sentree check " + command.project + "`");
    return kInvalidInput;
  }
  const auto call = example_call(*plan.value);
  const Part part = command.kind == "skill"         ? skill(command.name, call)
                    : command.kind == "monitor"     ? monitor(command.name, call)
                    : command.kind == "requirement" ? requirement(command.name, call)
                    : command.kind == "scenario"    ? scenario(command.name)
                                                    : component(command.name);
  for (const auto& [file, content] : part.files) {
    std::error_code error;
    if (!fs::exists(project.folder / file, error)) continue;
    say(project.shown(file.string()) + ": is there already; choose another name");
    return kInvalidInput;
  }
  const fs::path yaml = project.folder / fs::path(project.file).filename();
  auto source = text::read_file(yaml);
  for (const auto& [section, entry] : part.entries) {
    if (source) source = text::with_entry(*source, section, entry, project.file);
    if (source) continue;
    say(to_string(source.error()));
    say("nothing was added; the entry would be, under " + section + ":\n  " + entry);
    return kInvalidInput;
  }
  std::vector<std::pair<fs::path, std::string>> files = part.files;
  if (!part.entries.empty()) files.emplace_back(yaml.filename(), *source);
  for (const auto& [file, content] : files) {
    std::error_code error;
    fs::create_directories((project.folder / file).parent_path(), error);
    if (const auto written = text::write_file(project.folder / file, content); !written) {
      say(to_string(written.error()));
      return kEnvironment;
    }
    print(project.shown(file.string()) + "\n");
  }
  say(filled(part.next, command.project, project.shown(project.mission.path)));
  return kOk;
}

}  // namespace sentree::cli
