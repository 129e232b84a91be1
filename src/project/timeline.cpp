#include "sentree/project/timeline.h"

#include <algorithm>
#include <array>

namespace sentree::project {

namespace {

using Kind = Intervention::Kind;

constexpr std::array kKinds{Kind::kCall,  Kind::kStop,        Kind::kKill,  Kind::kRestart,
                            Kind::kDelay, Kind::kFalsify,     Kind::kForce, Kind::kBreakpoint,
                            Kind::kClear, Kind::kUnreachable, Kind::kLate};

std::string words() {
  std::string list;
  for (const Kind kind : kKinds) list += (list.empty() ? "" : ", ") + std::string(to_string(kind));
  return list;
}

void read_call(YamlReader& reader, Intervention& what) {
  what.target = reader.string("call").value_or("");
  if (!what.target.empty() && what.target.find('.') == std::string::npos) {
    reader.error(reader.span("call"), "scenario.call", "call \"" + what.target + "\" must be SERVICE.METHOD");
  }
  const auto* args = reader.mapping("args");
  what.args = args != nullptr ? args->value() : Value(Map());
}

std::uint64_t read_count(YamlReader& reader) {
  const auto count = reader.integer("count");
  if (!count) return 0;
  if (*count > 0) return static_cast<std::uint64_t>(*count);
  reader.error(reader.span("count"), "scenario.count",
               "count must be at least 1; leave it out for as long as it is not cleared");
  return 0;
}

void read_status(YamlReader& reader, Intervention& what, bool required) {
  what.status = required ? reader.required_string("status") : reader.string("status").value_or("");
  static const std::vector<std::string> kForced{"SUCCESS", "FAILURE", "RUNNING"};
  static const std::vector<std::string> kAny{"IDLE", "RUNNING", "SUCCESS", "FAILURE", "SKIPPED"};
  const auto& statuses = required ? kForced : kAny;
  if (what.status.empty() || std::find(statuses.begin(), statuses.end(), what.status) != statuses.end()) return;
  reader.error(reader.span("status"), "scenario.status",
               "there is no status \"" + what.status + "\"" + did_you_mean(what.status, statuses));
}

void read_breakpoint(YamlReader& reader, const SourceSpan& span, Intervention& what) {
  const auto node = reader.string("node");
  const auto chart = reader.string("chart");
  const auto message = reader.string("message");
  if ((node ? 1 : 0) + (chart ? 1 : 0) + (message ? 1 : 0) != 1) {
    reader.error(span, "scenario.breakpoint",
                 "a breakpoint needs one of \"node: PATH\", \"chart: NAME\" and \"message: PATTERN\"");
    return;
  }
  if (node) {
    what.point = Intervention::Point::kNode;
    what.target = *node;
    read_status(reader, what, false);
  } else if (chart) {
    what.point = Intervention::Point::kState;
    what.target = *chart;
    what.state = reader.required_string("state");
  } else {
    what.target = *message;
  }
}

// The member of the entry that is named like the kind.
void read_details(const text::YamlNode& node, Intervention& what, Diagnostics& diagnostics) {
  YamlReader reader(node, "\"" + std::string(to_string(what.kind)) + "\"", diagnostics);
  switch (what.kind) {
    case Kind::kDelay:
      what.target = reader.required_string("message");
      if (reader.node("by") == nullptr) reader.error(node.span, "project.missing-key", "\"delay\" needs \"by\"");
      what.by = reader.duration("by").value_or(Duration(0));
      what.count = read_count(reader);
      break;
    case Kind::kFalsify:
      what.target = reader.required_string("call");
      what.path = reader.string("path").value_or("");
      if (const auto* value = reader.node("value"); value != nullptr)
        what.value = value->value();
      else
        reader.error(node.span, "project.missing-key", "\"falsify\" needs \"value\"");
      what.count = read_count(reader);
      break;
    case Kind::kForce:
      what.target = reader.required_string("leaf");
      read_status(reader, what, true);
      what.count = read_count(reader);
      break;
    default: read_breakpoint(reader, node.span, what);
  }
}

}  // namespace

Intervention read_intervention(YamlReader& reader, const text::YamlNode& entry, Diagnostics& diagnostics) {
  Intervention what;
  std::vector<Kind> found;
  for (const Kind kind : kKinds) {
    if (reader.node(std::string(to_string(kind))) != nullptr) found.push_back(kind);
  }
  if (found.size() != 1) {
    reader.error(entry.span, found.empty() ? "project.missing-key" : "scenario.timeline",
                 "an entry of the timeline needs one of " + words());
    return what;
  }
  what.kind = found.front();
  const std::string word(to_string(what.kind));
  switch (what.kind) {
    case Kind::kCall: read_call(reader, what); break;
    case Kind::kKill:
    case Kind::kRestart:
    case Kind::kUnreachable:
    case Kind::kLate: what.target = reader.string(word).value_or(""); break;
    case Kind::kStop:
      if (const auto target = reader.string(word); target && *target != "mission") {
        reader.error(reader.span(word), "scenario.stop",
                     "only the mission can be stopped; to end \"" + *target + "\" write kill: " + *target);
      }
      break;
    case Kind::kClear: {
      const auto id = reader.integer(word);
      if (id && *id > 0)
        what.id = static_cast<std::uint64_t>(*id);
      else if (id)
        reader.error(reader.span(word), "scenario.clear", "what stands is numbered from 1");
      break;
    }
    default:
      if (const auto* details = reader.mapping(word)) read_details(*details, what, diagnostics);
  }
  return what;
}

void read_timeline(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics) {
  for (const text::YamlNode& entry : node.items) {
    YamlReader reader(entry, "an entry of the timeline", diagnostics);
    Injection injection;
    injection.span = entry.span;
    injection.at = TimePoint(reader.duration("at").value_or(Duration(0)));
    if (reader.node("at") == nullptr)
      reader.error(entry.span, "project.missing-key", "an entry of the timeline needs \"at\"");
    if (const auto source = reader.string("source")) {
      static const std::vector<std::string> kSources{"scenario", "studio", "control", "interrupt"};
      injection.source = *source;
      if (std::find(kSources.begin(), kSources.end(), *source) == kSources.end()) {
        reader.error(reader.span("source"), "scenario.source",
                     "nobody called \"" + *source + "\" does something to a run" + did_you_mean(*source, kSources) +
                         "; there are scenario, studio, control and interrupt");
      }
    }
    injection.what = read_intervention(reader, entry, diagnostics);
    scenario.timeline.push_back(std::move(injection));
  }
}

}  // namespace sentree::project
