#include <fmt/format.h>

#include <unistd.h>

#include <array>
#include <iostream>

#include "sentree/cli/commands.h"
#include "sentree/cli/document.h"
#include "sentree/cli/output.h"
#include "sentree/studio/chart_player.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

using sentree::studio::ChartPlayer;
using sentree::studio::ChartTrace;

constexpr std::string_view kHelp = R"(An event is its name, and its data as JSON if it has any:
  tick
  battery.getBatteryState.reply {"result": {"percentage": 0.5}}
Commands:
  send NAME [JSON]     an event, also one that is named like a command
  wait DURATION        let virtual time pass: wait 2s, wait 500 ms
  back [N]             take the last step, or the last N, back
  restart              begin again
  state                the active states, and the events that they handle
  data [NAME]          the data, or one of them
  eval EXPRESSION      its value here; nothing is changed by it
  timers               events that are on their way
  history              what was done so far
  save FILE            write the whole session to a file
  restore FILE         go on from one
  help, quit
A line that begins with # is a comment.
)";

/// Lines of `history`; older ones are forgotten.
constexpr std::size_t kHistoryMax = 1000;
/// One line of input; longer ones are refused.
constexpr std::size_t kLineMax = 1U << 20U;

struct TypedLine {
  std::string word;
  std::string rest;
};

std::string trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1));
}

TypedLine split(const std::string& line) {
  const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
  return {line.substr(0, end), trimmed(std::string_view(line).substr(end))};
}

// What a command gives back, for people and for programs.
struct Answer {
  std::string text;
  Map data;
};

class Shell {
 public:
  Shell(ChartPlayer& player, const ChartCommand& command, Map data)
      : player_(player), json_(command.json), start_data_(std::move(data)), prompt_(isatty(STDIN_FILENO) == 1) {}

  /// The exit code.
  int run() {
    if (!json_) {
      const scxml::Chart& chart = player_.chart();
      print(fmt::format("{} ({}, {} states)\n", chart.name().empty() ? std::string("chart") : chart.name(),
                        chart.file(), chart.states().size() - 1));
    }
    answer("start", show(player_.start(start_data_)));
    std::string line;
    for (;;) {
      if (prompt_ && !json_) print("> ");
      if (!std::getline(std::cin, line)) break;
      if (line.size() > kLineMax) {
        refuse(line.substr(0, 20) + "…", {"chart.too-long", fmt::format("a line has at most {} bytes", kLineMax)});
        continue;
      }
      line = trimmed(line);
      if (line.empty() || line.front() == '#') continue;
      if (line == "quit" || line == "exit") break;
      if (!prompt_ && !json_) print(fmt::format("> {}\n", line));
      execute(line);
    }
    if (prompt_ && !json_) print("\n");
    return failed_ && !prompt_ ? kFindings : kOk;
  }

 private:
  struct Refusal {
    std::string code;
    std::string message;
  };

  void refuse(const std::string& line, const Refusal& refusal) {
    failed_ = true;
    if (json_)
      print(to_json(Map{{"command", line}, {"error", Map{{"code", refusal.code}, {"message", refusal.message}}}}) +
            "\n");
    else
      say("! " + refusal.message);
  }

  void answer(const std::string& line, Result<Answer> result) {
    if (!result) {
      refuse(line, {result.error().code, to_string(result.error())});
      return;
    }
    if (!json_) {
      print(result->text);
      return;
    }
    Map data{{"command", line}};
    for (auto& [key, value] : result->data) data[key] = std::move(value);
    print(to_json(Value(std::move(data))) + "\n");
  }

  void execute(const std::string& line) {
    if (history_.size() == kHistoryMax) history_.erase(history_.begin());
    history_.push_back(line);
    const TypedLine parts = split(line);
    for (const auto& [name, handler] : kCommands) {
      if (parts.word == name) {
        answer(line, (this->*handler)(parts.rest));
        return;
      }
    }
    answer(line, send(line));
  }

  // ---- What changes the chart ----

  Result<Answer> send(const std::string& rest) {
    const TypedLine parts = split(rest);
    if (parts.word.empty()) return fail("chart.usage", "send NAME [JSON]");
    scxml::Event event;
    event.name = parts.word;
    // SCXML 6.2.5: what prevents delivery is an event of the platform.
    if (event.name.starts_with("error.")) event.type = scxml::EventType::kPlatform;
    if (!parts.rest.empty()) {
      auto data = text::parse_json(parts.rest);
      if (!data) {
        return fail("chart.bad-data", fmt::format("the data of {} are no JSON: {}", event.name, data.error().message));
      }
      event.data = *std::move(data);
    }
    return show(player_.send(event));
  }

  Result<Answer> wait(const std::string& rest) {
    std::string spaced = rest;
    const std::size_t unit = spaced.find_first_not_of("0123456789.");
    if (unit != std::string::npos && unit > 0 && spaced[unit] != ' ') spaced.insert(unit, " ");
    const auto time = project::parse_duration(spaced);
    if (!time)
      return fail("chart.usage", fmt::format("wait \"{}\": write a duration such as 2 s, 500 ms or 1 min", rest));
    return show(player_.wait(*time));
  }

  Result<Answer> back(const std::string& rest) {
    std::size_t count = 1;
    if (!rest.empty()) {
      if (rest.size() > 6 || rest.find_first_not_of("0123456789") != std::string::npos)
        return fail("chart.usage", "back [N], with a number of steps");
      count = std::stoul(rest);
    }
    if (auto done = player_.back(count); !done) return tl::unexpected(std::move(done.error()));
    return show(ChartTrace{});
  }

  Result<Answer> restart(const std::string&) { return show(player_.start(start_data_)); }

  Result<Answer> restore(const std::string& rest) {
    if (rest.empty()) return fail("chart.usage", "restore FILE");
    auto content = text::read_file(rest);
    if (!content) return tl::unexpected(std::move(content.error()));
    auto saved = text::parse_json(*content, rest);
    if (!saved) return tl::unexpected(std::move(saved.error()));
    if (auto done = player_.restore(*saved); !done) return tl::unexpected(std::move(done.error()));
    return show(ChartTrace{});
  }

  Result<Answer> show(Result<ChartTrace> trace) {
    if (!trace) return tl::unexpected(std::move(trace.error()));
    Answer shown;
    List happened;
    TimePoint at = trace->entries.empty() ? player_.now() : trace->entries.front().at;
    for (ChartTrace::Entry& entry : trace->entries) {
      if (entry.at != at) {
        at = entry.at;
        shown.text += fmt::format("  at {} s\n", to_json(Value(seconds(at))));
      }
      shown.text += fmt::format("  {}{}\n", entry.text, entry.what == "ignored" ? near_to(entry.data.text()) : "");
      happened.push_back(Map{{"what", entry.what}, {"time", seconds(entry.at)}, {"data", std::move(entry.data)}});
    }
    shown.text += fmt::format("  {}\n", where());
    shown.data["happened"] = std::move(happened);
    add_where(shown.data);
    return shown;
  }

  // What an event that nothing took may have been meant to be.
  [[nodiscard]] std::string near_to(std::string_view word) const {
    std::vector<std::string> words = player_.events_handled_here();
    for (const auto& [name, handler] : kCommands) words.emplace_back(name);
    const bool known = std::find(words.begin(), words.end(), word) != words.end();
    return known ? std::string() : did_you_mean(word, words);
  }

  // ---- What looks at it ----

  [[nodiscard]] std::string where() const {
    const scxml::Session& session = player_.session();
    std::string text = session.running() ? "in" : fmt::format("{} in", to_string(session.status()));
    for (const std::string& id : session.active_ids(player_.chart())) text += " " + id;
    if (const TimePoint next = session.next_timer(); session.running() && next != kNever)
      text += fmt::format(", next timer in {} s", to_json(Value(seconds(next - player_.now()))));
    return text;
  }

  void add_where(Map& data) const {
    const scxml::Session& session = player_.session();
    List active;
    for (std::string& id : session.active_ids(player_.chart())) active.emplace_back(std::move(id));
    data["status"] = to_string(session.status());
    data["configuration"] = std::move(active);
    data["time"] = seconds(player_.now());
  }

  Result<Answer> state(const std::string&) {
    Answer shown;
    shown.text = fmt::format("  {}\n", where());
    add_where(shown.data);
    List events;
    std::string handled;
    for (const std::string& event : player_.events_handled_here()) {
      handled += " " + event;
      events.emplace_back(event);
    }
    shown.text += fmt::format("  handles{}\n", handled.empty() ? " no event" : handled);
    shown.data["handles"] = std::move(events);
    return shown;
  }

  Result<Answer> data(const std::string& rest) {
    const Map all = player_.session().data(player_.chart());
    Answer shown;
    if (rest.empty()) {
      for (const auto& [name, value] : all) shown.text += fmt::format("  {} = {}\n", name, to_json(value));
      if (all.empty()) shown.text = "  no data\n";
      shown.data["data"] = all;
      return shown;
    }
    const Value* value = all.find(rest);
    if (!value) {
      std::vector<std::string> names;
      for (const auto& [name, unused] : all) names.push_back(name);
      return fail("chart.no-data", fmt::format("\"{}\" has no value here{}", rest, did_you_mean(rest, names)));
    }
    shown.text = fmt::format("  {}\n", to_json(*value));
    shown.data["data"] = Map{{rest, *value}};
    return shown;
  }

  Result<Answer> eval(const std::string& rest) {
    if (rest.empty()) return fail("chart.usage", "eval EXPRESSION");
    auto value = player_.evaluate(rest);
    if (!value) return tl::unexpected(std::move(value.error()));
    Answer shown;
    shown.text = fmt::format("  {}\n", *value ? to_json(**value) : std::string("undefined"));
    if (*value)
      shown.data["value"] = **value;
    else
      shown.data["undefined"] = true;
    return shown;
  }

  Result<Answer> timers(const std::string&) {
    Answer shown;
    List list;
    add_timers(player_.session(), shown.text, list);
    if (list.empty()) shown.text = "  nothing is on its way\n";
    shown.data["timers"] = std::move(list);
    return shown;
  }

  void add_timers(const scxml::Session& session, std::string& text, List& list) const {
    for (const scxml::Timer& timer : session.timers()) {
      const double in = seconds(timer.due - player_.now());
      text += fmt::format("  {} in {} s{}  ({})\n", timer.event.name, to_json(Value(in)),
                          timer.target.empty() ? "" : " to " + timer.target, session.id());
      list.push_back(Map{{"event", timer.event.name}, {"in", in}, {"target", timer.target}, {"session", session.id()}});
    }
    for (const scxml::Invocation& invocation : session.invocations()) {
      if (invocation.child) add_timers(*invocation.child, text, list);
    }
  }

  Result<Answer> history(const std::string&) {
    Answer shown;
    List list;
    for (const std::string& line : history_) {
      shown.text += fmt::format("  {}\n", line);
      list.emplace_back(line);
    }
    shown.data["history"] = std::move(list);
    return shown;
  }

  Result<Answer> save(const std::string& rest) {
    if (rest.empty()) return fail("chart.usage", "save FILE");
    auto saved = player_.save();
    if (!saved) return tl::unexpected(std::move(saved.error()));
    if (auto written = text::write_file(rest, to_json(*saved) + "\n"); !written)
      return tl::unexpected(std::move(written.error()));
    return Answer{fmt::format("  saved to {}\n", rest), Map{{"saved", rest}}};
  }

  Result<Answer> help(const std::string&) { return Answer{std::string(kHelp), Map{{"help", kHelp}}}; }

  using Handler = Result<Answer> (Shell::*)(const std::string&);
  static const std::array<std::pair<std::string_view, Handler>, 12> kCommands;

  ChartPlayer& player_;
  bool json_;
  Map start_data_;
  bool prompt_;
  bool failed_ = false;
  std::vector<std::string> history_;
};

const std::array<std::pair<std::string_view, Shell::Handler>, 12> Shell::kCommands{{{"send", &Shell::send},
                                                                                    {"wait", &Shell::wait},
                                                                                    {"back", &Shell::back},
                                                                                    {"restart", &Shell::restart},
                                                                                    {"state", &Shell::state},
                                                                                    {"data", &Shell::data},
                                                                                    {"eval", &Shell::eval},
                                                                                    {"timers", &Shell::timers},
                                                                                    {"history", &Shell::history},
                                                                                    {"save", &Shell::save},
                                                                                    {"restore", &Shell::restore},
                                                                                    {"help", &Shell::help}}};

// NAME=VALUE, where the value is JSON if it can be read as such, else text.
std::optional<Map> start_data(const std::vector<std::string>& given, const scxml::Chart& chart) {
  std::vector<std::string> names;
  for (const scxml::DataItem& item : chart.data()) names.push_back(item.id);
  Map data;
  for (const std::string& text : given) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    if (equals == std::string::npos || std::find(names.begin(), names.end(), name) == names.end()) {
      say(fmt::format("--data {}: must be NAME=VALUE with a <data> of the chart{}", text, did_you_mean(name, names)));
      return std::nullopt;
    }
    const std::string value = text.substr(equals + 1);
    const auto json = text::parse_json(value);
    data[name] = json ? *json : Value(value);
  }
  return data;
}

}  // namespace

int chart(const ChartCommand& command) {
  scxml::LoadOptions options;
  options.read = reader_beside(command.file);
  auto source = text::read_file(command.file);
  if (!source) {
    say(to_string(source.error()));
    return kInvalidInput;
  }
  const auto loaded = scxml::load(*source, command.file, options);
  say(loaded.diagnostics);
  if (!loaded.ok()) return kInvalidInput;
  auto data = start_data(command.data, *loaded.value);
  if (!data) return kUsage;
  const auto script_max = project::parse_duration(command.script_max);
  if (!script_max || *script_max <= Duration(0)) {
    say(fmt::format("--script-max {}: not a duration such as 2 s", command.script_max));
    return kUsage;
  }
  ChartPlayer player(*loaded.value, sentree::studio::host_for(*loaded.value, options), command.seed, *script_max);
  return leave(Shell(player, command, *std::move(data)).run());
}

}  // namespace sentree::cli
