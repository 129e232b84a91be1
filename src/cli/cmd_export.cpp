#include <fmt/format.h>

#include <time.h>

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "sentree/base/json.h"
#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/groot/log.h"
#include "sentree/project/plan.h"
#include "sentree/project/scenario_text.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/text/file.h"

namespace sentree::cli {

namespace {

constexpr std::size_t kPieceSize = 1U << 20U;

bool is_of_project(const std::filesystem::path& file) {
  constexpr std::array<std::string_view, 7> kParts{".xml", ".scxml", ".req", ".yaml", ".yml", ".thrift", ".mcap"};
  return std::find(kParts.begin(), kParts.end(), file.extension().string()) != kParts.end();
}

// Where an export goes: a file, or standard output.
class Output {
 public:
  explicit Output(std::string file) : file_(std::move(file)) {}
  std::string& text() {
    if (file_.empty() && text_.size() > kPieceSize) flush();
    return text_;
  }
  bool end() {
    if (file_.empty()) {
      flush();
      return true;
    }
    const auto written = text::write_file(file_, text_);
    if (!written) say(to_string(written.error()));
    return written.has_value();
  }

 private:
  void flush() {
    print(text_);
    text_.clear();
  }
  std::string file_;
  std::string text_;
};

// RFC 4180.
void append_csv(std::string& out, std::string_view field) {
  if (field.find_first_of(",\"\r\n") == std::string_view::npos) {
    out += field;
    return;
  }
  out += '"';
  for (const char c : field) {
    out += c;
    if (c == '"') out += '"';
  }
  out += '"';
}

Result<void> to_csv(replay::RecordedRun& run, Output& output) {
  output.text() += "time_s,sequence,tick,kind,source,target,name,call,data\r\n";
  return run.each([&](const Message& message) {
    std::string& out = output.text();
    out += fmt::format("{},{},{},", shortest_decimal(seconds(message.time)), message.sequence, message.tick);
    out += to_string(message.kind);
    for (const std::string* field : {&message.source, &message.target, &message.name}) {
      out += ',';
      append_csv(out, *field);
    }
    out += fmt::format(",{},", message.call);
    append_csv(out, message.data.is_null() ? std::string() : to_json(message.data));
    out += "\r\n";
    return true;
  });
}

// Every message of every topic on a line of its own.
Result<void> to_ndjson(replay::RecordedRun& run, Output& output) {
  record::Reader& reader = run.reader();
  return reader.read({}, [&](const record::RawMessage& message) {
    const record::Channel& channel = reader.channels().at(message.channel);
    if (channel.encoding != "json") return true;
    std::string& out = output.text();
    out += "{\"topic\":";
    append_json_string(out, channel.topic);
    out += fmt::format(",\"time_ns\":{},\"data\":", message.log_time);
    out += message.data;
    out += "}\n";
    return true;
  });
}

// The JSON form of trace events, which Perfetto and chrome://tracing open: a track per node with its statuses, a track
// per caller and service with its calls, and instants.
Result<void> to_trace(replay::RecordedRun& run, Output& output) {
  std::map<std::string, std::int64_t> tracks;
  bool first = true;
  const auto emit = [&](const Map& event) {
    std::string& out = output.text();
    if (!first) out += ",\n";
    first = false;
    append_json(out, event);
  };
  const auto track = [&](const std::string& name) {
    const auto [entry, is_new] = tracks.try_emplace(name, static_cast<std::int64_t>(tracks.size() + 1));
    if (is_new)
      emit(
          Map{{"ph", "M"}, {"pid", 1}, {"tid", entry->second}, {"name", "thread_name"}, {"args", Map{{"name", name}}}});
    return entry->second;
  };
  const auto micros = [](TimePoint time) { return static_cast<double>(time.time_since_epoch().count()) / 1e3; };
  struct Open {
    TimePoint since{};
    std::string what;
  };
  std::map<std::string, Open> nodes;
  std::map<std::uint64_t, Open> calls;
  const auto slice = [&](const std::string& on, const Open& open, TimePoint until, Value args) {
    emit(Map{{"ph", "X"},
             {"pid", 1},
             {"tid", track(on)},
             {"name", open.what},
             {"ts", micros(open.since)},
             {"dur", micros(until) - micros(open.since)},
             {"args", std::move(args)}});
  };
  output.text() += "{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n";
  auto read = run.each([&](const Message& message) {
    if (message.name == "node.status") {
      Open& open = nodes[message.source];
      if (!open.what.empty() && open.what != "IDLE") slice("node " + message.source, open, message.time, Map());
      const Value* to = message.data.find("to");
      open = {message.time, to != nullptr ? std::string(to->text()) : std::string()};
    } else if (message.kind == MessageKind::kRequest) {
      calls[message.call] = {message.time, message.name.substr(0, message.name.rfind('.'))};
    } else if (message.kind != MessageKind::kEvent) {
      const auto open = calls.find(message.call);
      if (open == calls.end()) return true;
      slice(message.source == "mission" || message.target == "mission" ? "ticks" : message.source + " calls",
            open->second, message.time, message.data);
      calls.erase(open);
    } else if (message.name != "mission.tick") {
      emit(Map{{"ph", "i"},
               {"s", "g"},
               {"pid", 1},
               {"tid", track("events")},
               {"name", message.name},
               {"ts", micros(message.time)},
               {"args", message.data}});
    }
    return true;
  });
  for (const auto& [node, open] : nodes) {
    if (!open.what.empty() && open.what != "IDLE") slice("node " + node, open, run.ended(), Map());
  }
  output.text() += "\n]}\n";
  return read;
}

// Microseconds since 1970 of a time like 2026-01-02T10:15:00Z; 0 if it is none.
std::int64_t epoch_us(const std::string& time) {
  std::tm utc{};
  const char* end = strptime(time.c_str(), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return end != nullptr && *end == '\0' ? static_cast<std::int64_t>(timegm(&utc)) * 1'000'000 : 0;
}

// The logs of Groot: the recorded tree, and every change of a node's status.
Result<void> to_groot(replay::RecordedRun& run, replay::RecordedCode code, decltype(groot::write_fbl)& write,
                      Output& output) {
  auto scenario = run.scenario(code);
  if (scenario.ok()) scenario.value->virtual_time = false;  // parts in other processes are of no interest here
  const auto plan = scenario.ok() ? project::prepare(std::move(*scenario.value)) : Loaded<project::Plan>();
  say(scenario.diagnostics);
  if (!plan.ok()) {
    say(run.errors_in(plan.diagnostics));
    return fail("record.no-project", "the recording's tree cannot be loaded", SourceSpan{run.path()});
  }
  const bt::Tree& tree = plan.value->tree;
  std::vector<groot::Transition> transitions;
  auto read = run.each([&](const Message& message) {
    const Value* node = message.name == "node.status" ? message.data.find("node") : nullptr;
    const Value* from = message.data.find("from");
    const Value* to = message.data.find("to");
    const std::int64_t* index = node != nullptr ? node->as_int() : nullptr;
    if (index == nullptr || from == nullptr || to == nullptr) return true;
    const auto before = bt::parse_status(from->text());
    const auto after = bt::parse_status(to->text());
    if (*index >= 0 && *index < static_cast<std::int64_t>(tree.size()) && before && after)
      transitions.push_back({message.time, static_cast<bt::NodeId>(*index), *before, *after});
    return true;
  });
  if (!read) return read;
  const std::int64_t began_us = epoch_us(run.fact("started"));
  const auto file = write(tree, transitions, began_us);
  if (!file) return tl::unexpected(file.error());
  output.text() += *file;
  return {};
}

// The run as a scenario that does the same again.
Result<void> to_scenario(replay::RecordedRun& run, Output& output) {
  auto text = replay::recorded_scenario_text(run);
  if (!text) return tl::unexpected(text.error());
  output.text() += *text;
  return {};
}

}  // namespace

int export_recording(const ExportCommand& command) {
  if (!command.output.empty()) {
    std::error_code error;
    const std::filesystem::path out = command.output;
    if (!may_write(out, "", {command.file})) return kUsage;
    if (command.format != "scenario" && is_of_project(out) && std::filesystem::exists(out, error)) {
      say(fmt::format("{} is there, and a part of projects; name another file, or remove it", command.output));
      return kUsage;
    }
  }
  auto run = replay::RecordedRun::open(command.file);
  if (!run) {
    say(to_string(run.error()));
    return kInvalidInput;
  }
  Output output(command.output);
  const auto exported = command.format == "csv"        ? to_csv(*run, output)
                        : command.format == "ndjson"   ? to_ndjson(*run, output)
                        : command.format == "scenario" ? to_scenario(*run, output)
                        : command.format == "btlog" ? to_groot(*run, command.recorded_code, groot::write_btlog, output)
                        : command.format == "fbl"   ? to_groot(*run, command.recorded_code, groot::write_fbl, output)
                                                    : to_trace(*run, output);
  say_each(run->reader().problems());
  if (!exported) {
    say(to_string(exported.error()));
    return kInvalidInput;
  }
  return output.end() ? kOk : kEnvironment;
}

}  // namespace sentree::cli
