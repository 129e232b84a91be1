// Runs the SCION tests of a folder: documents with a script of events and the configurations to expect after each.
// SCION has semantics of its own; where they differ from the recommendation's algorithm, the test is named in
// scxml/scion_deviations.txt with the rule, and then it must differ. Virtual time.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/step.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree {
namespace {

/// The active states without children, sorted.
std::vector<std::string> basic_configuration(const scxml::Chart& chart, const scxml::Session& session) {
  std::vector<std::string> ids;
  session.configuration().for_each([&](scxml::StateIndex s) {
    if (chart.states()[s].is_atomic()) ids.push_back(chart.states()[s].id);
  });
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<std::string> expected_configuration(const Value* list) {
  std::vector<std::string> ids;
  if (list && list->as_list()) {
    for (const Value& id : *list->as_list()) ids.emplace_back(id.text());
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::string joined(const std::vector<std::string>& ids) {
  std::string text = "[";
  for (const std::string& id : ids) text += (text.size() > 1 ? " " : "") + id;
  return text + "]";
}

// Why the document does not do what its script says; empty: it does.
std::string play(const std::filesystem::path& file, const Value& script) {
  scxml::LoadOptions options;
  options.default_data_model = scxml::DataModelKind::kEcmaScript;
  options.read = [&](std::string_view uri) { return text::read_file(file.parent_path() / uri); };
  auto source = text::read_file(file);
  if (!source) return source.error().message;
  const auto loaded = scxml::load(*source, file.filename().string(), options);
  if (!loaded.ok()) return to_string(loaded.diagnostics.front());
  const scxml::Chart& chart = *loaded.value;
  scxml::Session session;
  scxml::Effects effects;
  TimePoint now{};
  scxml::start(chart, session, {}, now, effects);
  const auto differs = [&](const std::string& when, const Value* expected) -> std::string {
    const auto actual = basic_configuration(chart, session);
    const auto wanted = expected_configuration(expected);
    return actual == wanted ? std::string() : when + ": " + joined(actual) + ", expected " + joined(wanted);
  };
  if (auto why = differs("at the start", script.find("initialConfiguration")); !why.empty()) return why;
  const Value* events = script.find("events");
  std::size_t number = 0;
  for (const Value& item : events && events->as_list() ? *events->as_list() : List()) {
    ++number;
    if (const Value* after = item.find("after")) {
      const TimePoint until = now + from_seconds(after->number() * 1e-3);
      while (session.next_timer() <= until) {
        now = std::max(now, session.next_timer());
        scxml::step_timers(chart, session, now, effects);
      }
      now = until;
    }
    scxml::Event event;
    if (const Value* given = item.find("event")) {
      event.name = given->find("name") ? given->find("name")->text() : "";
      if (const Value* data = given->find("data")) event.data = *data;
    }
    scxml::step(chart, session, event, now, effects);
    if (session.failure()) return to_string(*session.failure());
    if (auto why =
            differs("after event " + std::to_string(number) + " (" + event.name + ")", item.find("nextConfiguration"));
        !why.empty())
      return why;
  }
  return {};
}

// "folder/name: rule", one a line.
Result<std::map<std::string, std::string>> read_deviations(const std::filesystem::path& file) {
  auto content = text::read_file(file);
  if (!content) return tl::unexpected(std::move(content.error()));
  std::map<std::string, std::string> deviations;
  std::istringstream lines(*content);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = line.find(": ");
    if (!line.starts_with('#') && colon != std::string::npos)
      deviations[line.substr(0, colon)] = line.substr(colon + 2);
  }
  return deviations;
}

int run(const std::vector<std::string>& arguments) {
  std::vector<std::string> paths;
  bool json = false;
  for (const std::string& argument : arguments) {
    if (argument == "--json")
      json = true;
    else
      paths.push_back(argument);
  }
  if (paths.size() != 2 || paths[0].starts_with("-")) {
    std::cerr << "usage: conformance_scion DIR DEVIATIONS [--json]\n";
    return 2;
  }
  const auto deviations = read_deviations(paths[1]);
  if (!deviations) {
    std::cerr << to_string(deviations.error()) << "\n";
    return 3;
  }
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(paths[0])) {
    if (entry.path().extension() == ".scxml" && entry.path().parent_path().filename() != "w3c-ecma")
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::int64_t passed = 0;
  List failed;
  List deviating;
  for (const auto& file : files) {
    const std::string id = (file.parent_path().filename() / file.stem()).string();
    const auto script_source = text::read_file(std::filesystem::path(file).replace_extension(".json"));
    const auto script = script_source ? text::parse_json(*script_source) : tl::unexpected(script_source.error());
    const std::string why = script ? play(file, *script) : to_string(script.error());
    const auto known = deviations->find(id);
    if (known == deviations->end() && why.empty()) {
      ++passed;
    } else if (known != deviations->end() && !why.empty()) {
      deviating.emplace_back(Map{{"test", id}, {"rule", known->second}});
    } else {
      failed.emplace_back(id);
      std::cerr << id << ": " << (why.empty() ? "does as SCION does, although " + known->second : why) << "\n";
    }
  }
  if (json) {
    std::cout << to_json(Map{{"passed", passed}, {"failed", failed}, {"deviations", deviating}}) << "\n";
  } else {
    std::cout << passed << " passed, " << failed.size() << " failed, " << deviating.size() << " deviations\n";
  }
  return failed.empty() ? 0 : 1;
}

}  // namespace
}  // namespace sentree

int main(int argc, char** argv) { return sentree::run({argv + 1, argv + argc}); }
