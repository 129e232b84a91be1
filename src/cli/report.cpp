#include "sentree/cli/report.h"

#include <fmt/format.h>

#include "sentree/project/intervention.h"

namespace sentree::cli {

namespace {

Value to_value(const Message& message) {
  Map map{{"time", seconds(message.time)},
          {"tick", static_cast<std::int64_t>(message.tick)},
          {"name", message.name},
          {"source", message.source}};
  if (!message.target.empty()) map["target"] = message.target;
  map["sequence"] = static_cast<std::int64_t>(message.sequence);
  map["data"] = message.data;
  return map;
}

double milliseconds(Duration duration) { return seconds(duration) * 1e3; }

// As much of a text as fits a line beside what else is told.
std::string shortened(std::string text) {
  constexpr std::size_t kShownMax = 160;
  if (text.size() <= kShownMax) return text;
  std::size_t end = kShownMax;
  const auto continues = [&] { return (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U; };  // UTF-8
  while (end > 0 && continues()) --end;
  return text.substr(0, end) + "…";
}

// The part of an observation's data that says most, short.
std::string brief(const Message& message) {
  const Value* shown = message.data.find("result");
  if (shown == nullptr) shown = message.data.find("status");
  if (shown == nullptr && message.kind == MessageKind::kError) shown = message.data.find("message");
  if (shown == nullptr && message.name == "process.exited") shown = message.data.find("how");
  if (shown == nullptr) shown = message.data.find("args");
  if (shown == nullptr) shown = message.data.find("inputs");
  if (shown == nullptr || shown->is_null()) return {};
  if (const Map* map = shown->as_map(); map != nullptr && map->empty()) return {};
  return shortened(shown->as_string() != nullptr ? *shown->as_string() : to_json(*shown));
}

}  // namespace

std::string time_column(TimePoint time) { return fmt::format("{:>8.3f} s", seconds(time)); }

std::string line(const Message& message) {
  std::string text = fmt::format("{}  {}", time_column(message.time), message.name);
  if (message.kind != MessageKind::kEvent)
    text += fmt::format("  {} → {}", message.source, message.target);
  else if (message.name == "node.status" || message.name.starts_with("monitor."))
    text += "  " + message.source;
  else if (message.name.starts_with("process."))
    text += "  " + message.target;
  if (message.name == "node.status") text += fmt::format("  {}", message.data.find("to")->text());
  const std::string detail = brief(message);
  if (!detail.empty()) text += "  " + detail;
  return text;
}

std::string Narrator::tell(const Message& message) {
  const auto say_line = [&](const std::string& what) { return fmt::format("{}  {}", time_column(message.time), what); };
  if (message.name == "scenario.injection") {
    const auto what = project::intervention_of(message);
    return say_line(fmt::format("{}: {}", message.source, what ? project::describe(*what) : to_json(message.data)));
  }
  if (message.name == "scenario.breakpoint")
    return say_line(fmt::format("breakpoint: {}", message.data.find("what")->text()));
  if (message.name == "mission.resumed") {
    const std::int64_t* wall = message.data.find("wall_ns")->as_int();
    return say_line(fmt::format("resumed; nobody was there for {:.3f} s", static_cast<double>(*wall) * 1e-9));
  }
  if (message.name == "mission.status")
    return say_line(fmt::format("mission: {}", message.data.find("status")->text()));
  if (message.name.ends_with(".log")) {
    return say_line(fmt::format("{}: {} {}", message.source, message.data.find("label")->text(),
                                message.data.find("text")->text()));
  }
  if (message.name.ends_with(".halt.reply")) {
    last_.erase(message.source);
    return say_line(message.source + ": halted");
  }
  if (message.name.ends_with(".tick.error"))
    return say_line(fmt::format("{}: {}", message.source, message.data.find("message")->text()));
  if (message.data.find("vetoed_by") != nullptr) {
    return say_line(fmt::format("{}: {} was {}", message.source, message.name.substr(0, message.name.rfind('.')),
                                message.data.find("message")->text()));
  }
  const bool is_watched = watched_ != nullptr && message.name == "node.status";
  if (!is_watched && !message.name.ends_with(".tick.reply")) return {};
  const std::string status(message.data.find(is_watched ? "to" : "status")->text());
  if (is_watched) {
    const auto node = static_cast<bt::NodeId>(*message.data.find("node")->as_int());
    if (!watched_->children(node).empty()) return {};
    if (status == "IDLE") {
      // What has ended is told again only if it ends otherwise; what was halted runs anew.
      const auto known = last_.find(message.source);
      if (known == last_.end() || known->second != "RUNNING") return {};
      last_.erase(known);
      return say_line(message.source + ": halted");
    }
  }
  std::string& last = last_[message.source];
  if (last == status) return {};
  last = status;
  std::string text = fmt::format("{}: {}", message.source, status);
  if (const Value* outputs = message.data.find("outputs"); outputs != nullptr && !outputs->as_map()->empty())
    text += " " + shortened(to_json(*outputs));
  return say_line(text);
}

namespace {

std::string gap_lines(const std::vector<runtime::Gap>& gaps, std::string_view indent) {
  std::string text;
  for (const runtime::Gap& gap : gaps) {
    text += fmt::format("{}nobody was there from {:.3f} s to {:.3f} s: what happened then was not observed\n", indent,
                        seconds(gap.from), seconds(gap.to));
  }
  return text;
}

Value to_value(const std::vector<runtime::Gap>& gaps) {
  List list;
  for (const runtime::Gap& gap : gaps)
    list.push_back(Map{{"from", seconds(gap.from)}, {"to", seconds(gap.to)}, {"wall_ms", milliseconds(gap.wall)}});
  return list;
}

double microseconds_each(const runtime::JournalCost& cost, std::uint64_t observations) {
  return observations > 0 ? 1000.0 * milliseconds(cost.spent) / static_cast<double>(observations) : 0.0;
}

}  // namespace

std::string story_without_witness(const runtime::MonitorReport& report) {
  const auto& decision = *report.decision;
  const std::string text = fmt::format(
      "{}  {} {} at {:.3f} s{}\n", decision.verdict == monitor::Verdict::kViolated ? "✗" : "✓", report.name,
      to_string(report.verdict), seconds(decision.at), decision.deciding ? "" : ", in silence: a deadline passed");
  return text + gap_lines(report.gaps, "   ") +
         (report.explanation ? monitor::story(*report.explanation, "   ") : std::string());
}

std::string story(const runtime::MonitorReport& report) {
  std::string text = story_without_witness(report);
  if (report.explanation) return text;
  const auto& decision = *report.decision;
  text += !decision.witness_complete ? "   The last observations before it (the earlier ones are no longer known):\n"
          : decision.witness_minimal
              ? "   The observations that led there, none of which can be left out:\n"
              : "   Observations that led there (some may not matter: there are too many to try):\n";
  constexpr std::size_t kShownMax = 40;
  const std::vector<Message>& witness = decision.witness;
  const auto is_tick = [&](std::size_t i) { return witness[i].name == "mission.tick"; };
  std::size_t lines = 0;
  for (std::size_t i = 0; i < witness.size(); ++i) {
    if (++lines > kShownMax) {
      text += fmt::format("   … and {} more (--json has all)\n", witness.size() - i);
      break;
    }
    // Ticks that only follow each other are one line, but for the last observation, which may be what decided.
    const std::size_t first = i;
    while (i + 2 < witness.size() && is_tick(i) && is_tick(i + 1)) ++i;
    if (i == first)
      text += fmt::format("   {}\n", line(witness[i]));
    else
      text += fmt::format("   {} to {:.3f} s  mission.tick, {} times\n", time_column(witness[first].time),
                          seconds(witness[i].time), i - first + 1);
  }
  return text;
}

Value to_value(const runtime::RunReport& report, Judged judged) {
  Map map{{"scenario", report.scenario},
          {"ok", judged == Judged::kByExpectations ? report.unmet.empty() : judged == Judged::kPassed},
          {"clock", report.virtual_time ? "virtual" : "real"},
          {"seed", static_cast<std::int64_t>(report.seed)},
          {"mission", to_string(report.mission)}};
  if (!report.reason.empty()) map["reason"] = report.reason;
  map["time"] = seconds(report.ended);
  map["ticks"] = static_cast<std::int64_t>(report.timing.ticks);
  map["observations"] = static_cast<std::int64_t>(report.observations);
  if (report.timed_out) map["timed_out"] = true;
  if (report.interrupted) map["interrupted"] = true;
  List monitors;
  for (const runtime::MonitorReport& monitor : report.monitors) {
    Map entry{{"monitor", monitor.name}, {"verdict", to_string(monitor.verdict)}};
    if (monitor.decision) {
      entry["time"] = seconds(monitor.decision->at);
      entry["state"] = monitor.decision->state;
      if (!monitor.leaf.empty()) entry["leaf"] = monitor.leaf;
      if (monitor.violations > 1) entry["violations"] = static_cast<std::int64_t>(monitor.violations);
      if (monitor.explanation) entry["explanation"] = monitor::to_value(*monitor.explanation);
      if (monitor.decision->deciding) entry["deciding"] = to_value(*monitor.decision->deciding);
      List witness;
      for (const Message& message : monitor.decision->witness) witness.push_back(to_value(message));
      entry["witness"] = std::move(witness);
      if (!monitor.decision->witness_complete) entry["witness_complete"] = false;
      if (!monitor.decision->witness_minimal) entry["witness_minimal"] = false;
    }
    if (!monitor.gaps.empty()) entry["gaps"] = to_value(monitor.gaps);
    if (monitor.vetoes > 0) entry["vetoes"] = static_cast<std::int64_t>(monitor.vetoes);
    if (!monitor.standing.empty()) entry["standing"] = monitor.standing;
    if (!monitor.vacuity.empty()) entry["vacuity"] = monitor.vacuity;
    if (!monitor.failure.empty()) entry["failure"] = monitor.failure;
    monitors.push_back(std::move(entry));
  }
  map["monitors"] = std::move(monitors);
  if (!report.gaps.empty()) map["gaps"] = to_value(report.gaps);
  if (report.journal) {
    const runtime::JournalCost& cost = *report.journal;
    Map journal{{"bytes", static_cast<std::int64_t>(cost.bytes)},
                {"writes", static_cast<std::int64_t>(cost.writes)},
                {"syncs", static_cast<std::int64_t>(cost.syncs)},
                {"snapshots", static_cast<std::int64_t>(cost.snapshots)},
                {"spent_ms", milliseconds(cost.spent)},
                {"waited_ms", milliseconds(cost.waited)},
                {"us_per_observation", microseconds_each(cost, report.observations)}};
    if (!cost.given_up.empty()) journal["given_up"] = cost.given_up;
    map["journal"] = std::move(journal);
  }
  if (!report.virtual_time) {
    const runtime::TickTiming& timing = report.timing;
    map["timing"] = Map{{"missed", static_cast<std::int64_t>(timing.missed)},
                        {"late_median_ms", milliseconds(timing.late_median)},
                        {"late_p99_ms", milliseconds(timing.late_p99)},
                        {"late_max_ms", milliseconds(timing.late_max)},
                        {"tick_median_ms", milliseconds(timing.tick_median)}};
    List processes;
    for (const runtime::ProcessReport& process : report.processes)
      processes.push_back(Map{{"name", process.name}, {"pid", process.pid}});
    map["processes"] = std::move(processes);
  }
  if (!report.problems.empty()) {
    List problems;
    for (const std::string& problem : report.problems) problems.push_back(problem);
    map["problems"] = std::move(problems);
  }
  if (!report.given_up.empty()) {
    List given_up;
    for (const std::string& why : report.given_up) given_up.push_back(why);
    map["given_up"] = std::move(given_up);
  }
  if (!report.error.empty()) map["error"] = report.error;
  List unmet;
  for (const std::string& sentence : report.unmet) unmet.push_back(sentence);
  map["unmet"] = std::move(unmet);
  return map;
}

std::string monitor_line(const runtime::MonitorReport& monitor) {
  const char* mark = monitor.verdict == monitor::Verdict::kViolated    ? "✗"
                     : monitor.verdict == monitor::Verdict::kSatisfied ? "✓"
                                                                       : "·";
  std::string text = fmt::format("  {} monitor {}: {}{}", mark, monitor.name, to_string(monitor.verdict),
                                 monitor.decision           ? fmt::format(" at {:.3f} s", seconds(monitor.decision->at))
                                 : monitor.standing.empty() ? std::string()
                                                            : fmt::format(" ({})", monitor.standing));
  if (monitor.violations > 1) text += fmt::format(", the last of {} times", monitor.violations);
  if (monitor.vetoes > 0) text += fmt::format(", vetoed {} of the requests", monitor.vetoes);
  if (!monitor.vacuity.empty()) text += "\n    it " + monitor.vacuity;
  if (!monitor.failure.empty()) text += "\n    given up: " + monitor.failure;
  return text + "\n";
}

std::string summary(const runtime::RunReport& report) {
  std::string text = fmt::format(
      "\n{}: mission {}{} after {:.1f} s, {} ticks, {} observations\n", report.scenario, to_string(report.mission),
      report.reason.empty() || report.mission != bt::Status::kFailure ? "" : fmt::format(" ({})", report.reason),
      seconds(report.ended), report.timing.ticks, report.observations);
  if (report.timed_out) text += "  ended by its time limit\n";
  if (report.interrupted) text += "  interrupted\n";
  for (const runtime::MonitorReport& monitor : report.monitors) text += monitor_line(monitor);
  // Of a mission that another program executes nobody knows.
  // A durable run takes its ticks when they are due by its own time, whatever the wall clock says.
  if (!report.virtual_time && !report.journal && report.timing.tick_median > Duration(0)) {
    text += fmt::format(
        "  ticks began late by {:.2f} ms (median), {:.2f} ms (99 %), {:.2f} ms (most); {} periods missed; a tick took "
        "{:.2f} ms (median)\n",
        milliseconds(report.timing.late_median), milliseconds(report.timing.late_p99),
        milliseconds(report.timing.late_max), report.timing.missed, milliseconds(report.timing.tick_median));
  }
  text += gap_lines(report.gaps, "  ");
  if (report.journal) {
    const runtime::JournalCost& cost = *report.journal;
    text +=
        fmt::format("  journal: {} bytes in {} writes, {} syncs, {} snapshots; {:.2f} µs an observation\n", cost.bytes,
                    cost.writes, cost.syncs, cost.snapshots, microseconds_each(cost, report.observations));
  }
  for (const std::string& problem : report.problems) text += fmt::format("  ! {}\n", problem);
  for (const std::string& sentence : report.unmet) text += fmt::format("  ✗ {}\n", sentence);
  return text;
}

std::string undone(const project::Scenario& scenario, const runtime::RunReport& report) {
  const project::Injection* first = nullptr;
  std::size_t count = 0;
  std::size_t all = 0;
  for (const project::Injection& entry : scenario.timeline) {
    if (entry.again) continue;
    ++all;
    if (entry.at <= report.ended) continue;
    ++count;
    if (first == nullptr || entry.at < first->at) first = &entry;
  }
  if (first == nullptr) return {};
  return fmt::format("  ended before {} of {} entries of the timeline, the first of them at {:.3f} s: {}\n", count, all,
                     seconds(first->at), project::describe(first->what));
}

}  // namespace sentree::cli
