#include "sentree/cli/output.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <iterator>
#include <system_error>

#include "sentree/cli/commands.h"
#include "sentree/runtime/watchdog.h"
#include "sentree/text/file.h"
#include "sentree/text/yaml.h"

namespace sentree::cli {

namespace {
std::atomic<int> unwritten = 0;  // why something could not be printed; 0: all was
}  // namespace

void print(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) unwritten = errno;
}

int finished(int code) {
  const int why = unwritten.exchange(0);
  if (why == 0) return code;
  say("standard output cannot be written: " + std::generic_category().message(why));
  return code == kOk ? kEnvironment : code;
}

void say(const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); }

int leave(int code) {
  code = finished(code);
  if (runtime::threads_left_behind() == 0) return code;
  std::fflush(nullptr);
  _exit(code);
}

void say(const Diagnostics& diagnostics) {
  for (const Diagnostic& diagnostic : diagnostics) say(to_string(diagnostic));
}

bool wants_colour() {
  const char* none = std::getenv("NO_COLOR");
  const char* terminal = std::getenv("TERM");
  if (none != nullptr && *none != '\0') return false;
  return isatty(STDOUT_FILENO) != 0 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

Result<std::string> read_named(const std::string& name) {
  if (name != "-") return text::read_file(name);
  return std::string{std::istreambuf_iterator<char>(std::cin), {}};
}

Value to_value(const Diagnostic& diagnostic) {
  return Map{{"severity", to_string(diagnostic.severity)},
             {"code", diagnostic.code},
             {"file", diagnostic.span.file},
             {"line", diagnostic.span.line},
             {"column", diagnostic.span.column},
             {"message", diagnostic.message}};
}

Value to_value(const Diagnostics& diagnostics) {
  List list;
  for (const Diagnostic& diagnostic : diagnostics) list.push_back(to_value(diagnostic));
  return list;
}

std::optional<project::Scenario> load(const std::string& project, const std::string& scenario) {
  if (scenario.empty()) return load_file(project);
  auto loaded_project = project::load_project(project);
  if (!loaded_project.ok()) {
    say(loaded_project.diagnostics);
    return std::nullopt;
  }
  std::vector<std::string> names;
  for (const auto& file : project::scenario_files(*loaded_project.value)) {
    names.push_back(file.stem().string());
    if (names.back() == scenario) return load_file(file.string());
  }
  say(loaded_project.value->file + ": the project has no scenario \"" + scenario + "\"" +
      did_you_mean(scenario, names));
  return std::nullopt;
}

bool is_world(const std::string& path) {
  const std::filesystem::path file(path);
  if ((file.extension() != ".yaml" && file.extension() != ".yml") || file.filename() == "sentree.yaml") return false;
  const auto source = text::read_file(file);
  const auto root = source ? text::parse_yaml(*source, path) : tl::unexpected(source.error());
  if (!root || !root->is_mapping()) return false;
  const auto has = [&](std::string_view key) {
    return std::any_of(root->entries.begin(), root->entries.end(),
                       [&](const auto& e) { return e.first.scalar == key; });
  };
  return has("map") || has("start") || has("robots");
}

std::optional<project::Scenario> load_file(const std::string& path) {
  std::error_code error;
  const std::filesystem::path file(path);
  if (std::filesystem::is_directory(file, error) || file.filename() == "sentree.yaml" ||
      !std::filesystem::exists(file, error)) {
    auto project = project::load_project(file);
    say(project.diagnostics);
    if (!project.ok()) return std::nullopt;
    return project::plain_scenario(std::move(*project.value));
  }
  auto scenario = project::load_scenario(file);
  say(scenario.diagnostics);
  return std::move(scenario.value);
}

}  // namespace sentree::cli
