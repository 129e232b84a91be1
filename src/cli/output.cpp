#include "sentree/cli/output.h"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <mutex>
#include <system_error>

#include "sentree/base/shown.h"
#include "sentree/cli/colours.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/document.h"
#include "sentree/runtime/watchdog.h"
#include "sentree/text/file.h"
#include "sentree/text/yaml.h"

namespace sentree::cli {

namespace {
std::atomic<int> unwritten = 0;  // why something could not be printed; 0: all was

constexpr std::chrono::seconds kStatusInLogs{30};
std::mutex status_mutex;
std::string status;  // on the terminal now

// Takes the status off the terminal while something else is printed.
struct StatusAside {
  StatusAside() {
    if (!status.empty()) std::fputs("\r\x1b[K", stderr);
  }
  ~StatusAside() {
    if (!status.empty()) std::fputs(status.c_str(), stderr);
  }
  StatusAside(const StatusAside&) = delete;
  StatusAside& operator=(const StatusAside&) = delete;
  std::lock_guard<std::mutex> lock{status_mutex};
};

void write_out(const std::string& text) {
  const StatusAside aside;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) unwritten = errno;
}

}  // namespace

void print(const std::string& text) {
  static const bool terminal = isatty(STDOUT_FILENO) != 0;
  write_out(terminal ? shown_in_colour(text) : text);
}

void print_screen(const std::string& sequences) { write_out(sequences); }

std::string shown_in_colour(const std::string& text) {
  std::string out;
  std::size_t from = 0;  // what is not in `out` yet
  for (std::size_t at = text.find('\x1b'); at != std::string::npos; at = text.find('\x1b', at + 1)) {
    for (const std::string_view colour : kColours) {
      if (text.compare(at, colour.size(), colour) != 0) continue;
      out.append(shown(std::string_view(text).substr(from, at - from))).append(colour);
      from = at + colour.size();
    }
  }
  return out + shown(std::string_view(text).substr(from));
}

void show_status(const std::string& text) {
  static const bool terminal = isatty(STDERR_FILENO) != 0;
  const std::lock_guard lock(status_mutex);
  if (!terminal) {
    using std::chrono::steady_clock;
    static steady_clock::time_point told = steady_clock::now();
    if (text.empty() || steady_clock::now() - told < kStatusInLogs) return;
    told = steady_clock::now();
    std::fprintf(stderr, "%s\n", shown(text).c_str());
    return;
  }
  if (text == status) return;
  std::fprintf(stderr, "\r\x1b[K%s", text.c_str());
  status = text;
}

int finished(int code) {
  const int why = unwritten.exchange(0);
  if (why == 0) return code;
  say("standard output cannot be written: " + std::generic_category().message(why));
  return code == kOk ? kEnvironment : code;
}

void say(const std::string& text) {
  const StatusAside aside;
  std::fprintf(stderr, "%s\n", shown(text).c_str());
}

int leave(int code) {
  code = finished(code);
  if (runtime::threads_left_behind() == 0) return code;
  std::fflush(nullptr);
  _exit(code);
}

namespace {

void say_lines(std::string text) {
  if (text.ends_with('\n')) text.pop_back();
  if (!text.empty()) say(text);
}

}  // namespace

void say(const Diagnostics& diagnostics, const std::string& project) {
  Diagnostics others;
  std::copy_if(diagnostics.begin(), diagnostics.end(), std::back_inserter(others),
               [](const Diagnostic& d) { return d.severity != Severity::kWarning; });
  say_lines(told(others) + warnings_in_short(diagnostics, project));
}

void say_each(const Diagnostics& diagnostics) { say_lines(told(diagnostics)); }

bool wants_colour() {
  const char* none = std::getenv("NO_COLOR");
  const char* terminal = std::getenv("TERM");
  if (none != nullptr && *none != '\0') return false;
  return isatty(STDOUT_FILENO) != 0 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

bool may_write(const std::filesystem::path& file, std::string_view begins,
               const std::vector<std::filesystem::path>& inputs) {
  std::error_code error;
  for (const std::filesystem::path& input : inputs) {
    if (!std::filesystem::equivalent(file, input, error)) continue;
    say(fmt::format("{} is read here, and would be written over; name another file", file.string()));
    return false;
  }
  if (begins.empty() || !std::filesystem::is_regular_file(file, error)) return true;
  std::string there(begins.size(), '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(there.data(), static_cast<std::streamsize>(there.size()));
  if (stream.gcount() == 0 || there == begins) return true;
  say(fmt::format("{} is there and is something else; name another file, or remove it", file.string()));
  return false;
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

namespace {

Loaded<project::Scenario> read(const std::filesystem::path& file) {
  std::error_code error;
  if (const auto kind = file.extension();
      (kind == ".xml" || kind == ".scxml" || kind == ".req") && std::filesystem::is_regular_file(file, error)) {
    return {.value = std::nullopt,
            .diagnostics = {{Severity::kError, "project.not-a-scenario",
                             "is a part of a project, not one: `sentree init FOLDER` makes a project, and its "
                             "sentree.yaml names the mission (`mission: {file: …}`) and all else",
                             SourceSpan{file.string()}}}};
  }
  if (!std::filesystem::is_directory(file, error) && file.filename() != "sentree.yaml" &&
      std::filesystem::exists(file, error))
    return project::load_scenario(file);
  auto project = project::load_project(file);
  Loaded<project::Scenario> loaded{.value = std::nullopt, .diagnostics = std::move(project.diagnostics)};
  if (project.value) loaded.value = project::plain_scenario(std::move(*project.value));
  return loaded;
}

}  // namespace

Loaded<project::Scenario> load(const std::string& project, const std::string& scenario) {
  std::error_code error;
  if (scenario.empty() || std::filesystem::is_regular_file(scenario, error))
    return read(scenario.empty() ? project : scenario);
  auto loaded = project::load_project(project);
  if (!loaded.ok()) return {.value = std::nullopt, .diagnostics = std::move(loaded.diagnostics)};
  std::vector<std::string> names;
  for (const auto& file : project::scenario_files(*loaded.value)) {
    names.push_back(file.stem().string());
    if (names.back() == scenario) return read(file);
  }
  return {.value = std::nullopt,
          .diagnostics = {{Severity::kError, "project.no-scenario",
                           fmt::format("the project has no scenario \"{}\"{}", scenario, did_you_mean(scenario, names)),
                           SourceSpan{loaded.value->file}}}};
}

std::optional<project::Scenario> load_file(const std::string& path) {
  auto loaded = read(path);
  say(loaded.diagnostics);
  return std::move(loaded.value);
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

}  // namespace sentree::cli
