#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/report.h"
#include "sentree/cli/report_coverage.h"
#include "sentree/cli/verdicts.h"
#include "sentree/cli/watched_work.h"
#include "sentree/draw/tree.h"
#include "sentree/graph/tree.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

// Bars of one row of the timeline; more are drawn as if they were one.
constexpr std::size_t kBarsMax = 4000;

struct Bar {
  TimePoint from{};
  TimePoint to{};
  std::string status;
  std::uint64_t tick = 0;  // the root's, of the last answer
  bool halted = false;
};

struct Facts {
  std::vector<runtime::MonitorReport> monitors;
  std::vector<std::vector<Bar>> bars;              // by leaf
  std::vector<std::map<std::string, int>> counts;  // by node: how often it came to each status
  std::vector<Message> interventions;
  std::uint64_t observations = 0;
};

constexpr std::string_view kStyle = R"(
:root{color-scheme:light dark;--ink:#1b1f24;--soft:#5b6470;--page:#f5f6f8;--card:#fff;--line:#dfe3e8;--run:#3c78d8;--ok:#2e8b57;--bad:#c0392b;--skip:#8e7cc3}
@media(prefers-color-scheme:dark){:root{--ink:#e6e9ee;--soft:#9aa4b1;--page:#111418;--card:#1a1e24;--line:#2e343d;--run:#6fa0f0;--ok:#4fb37d;--bad:#e8695b;--skip:#b4a7d6}}
*{box-sizing:border-box}
body{font:15px/1.55 system-ui,sans-serif;color:var(--ink);background:var(--page);max-width:76rem;margin:0 auto;padding:2rem 1.25rem 4rem}
h1{font-size:1.7rem;line-height:1.2;margin:0 0 1rem}h2{font-size:1.15rem;margin:2.25rem 0 .75rem}h3{font-size:1rem;margin:0}
.card{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:1rem 1.25rem;margin:0 0 .75rem}
.card.bad{border-left:4px solid var(--bad)}.card.good{border-left:4px solid var(--ok)}
.facts{display:grid;grid-template-columns:repeat(auto-fit,minmax(11rem,1fr));gap:.75rem 1.5rem;margin:0}
.facts div{min-width:0}.facts dt{color:var(--soft);font-size:.8rem}.facts dd{margin:0;font-weight:600;overflow-wrap:anywhere}
.badge{display:inline-block;border-radius:999px;padding:0 .6rem;margin-left:.5rem;font-size:.8rem;font-weight:600;border:1px solid currentColor}
.violated{color:var(--bad)}.satisfied{color:var(--ok)}.undecided{color:var(--soft)}
p{margin:.35rem 0}.soft{color:var(--soft)}
table{border-collapse:collapse;width:100%;margin-top:.75rem;font-size:.9rem}td,th{padding:.25rem .9rem .25rem 0;text-align:left;vertical-align:top;border-top:1px solid var(--line)}
th{color:var(--soft);font-weight:normal;border-top:0}td:first-child{white-space:nowrap;font-variant-numeric:tabular-nums}
code{font:.86em/1.45 ui-monospace,monospace;overflow-wrap:anywhere}tr.key td,tr.key code{font-weight:600}
td:nth-child(2) code{overflow-wrap:normal}.card>.scroll:first-child table{margin-top:0}.tree .background{fill:none}
.tl{display:block;min-width:46rem;width:100%;height:auto}.tl text{fill:var(--ink);font:12px system-ui,sans-serif}.tl .axis{stroke:var(--line)}.tl .time{fill:var(--soft)}
.RUNNING{fill:var(--run)}.SUCCESS{fill:var(--ok)}.FAILURE{fill:var(--bad)}.SKIPPED{fill:var(--skip)}.mark{stroke:var(--bad);stroke-width:1.5;stroke-dasharray:4 3}
.legend{display:flex;flex-wrap:wrap;gap:1rem;color:var(--soft);font-size:.85rem;margin:.5rem 0 0}.legend svg{width:12px;height:12px;margin-right:.35rem;vertical-align:-1px}
.scroll{overflow-x:auto}.tree svg{max-width:100%;height:auto}
@media print{body{background:none}.card{break-inside:avoid}}
)";

std::string timeline(const project::Plan& plan, const Facts& facts, TimePoint end) {
  constexpr double kLeft = 190, kWidth = 800, kRow = 22;
  const double span = std::max(seconds(end), 1e-3);
  const int decimals = span < 0.1 ? 4 : span < 10.0 ? 2 : 1;
  const auto x = [&](TimePoint time) { return kLeft + kWidth * std::min(seconds(time) / span, 1.0); };
  const double height = kRow * static_cast<double>(plan.leaves.size()) + 30;
  std::string svg = fmt::format(
      "<div class=\"card\"><div class=scroll><svg class=tl viewBox=\"0 0 {:.0f} {:.0f}\" role=img "
      "aria-label=\"Status of each leaf over time\">\n",
      kLeft + kWidth + 34, height);
  for (int i = 0; i <= 8; ++i) {
    const double at = kLeft + kWidth * i / 8;
    svg += fmt::format("<line class=axis x1={0:.1f} x2={0:.1f} y1=0 y2={1:.0f} />", at, height - 22);
    svg += fmt::format("<text class=time x={:.1f} y={:.0f} text-anchor=middle>{:.{}f} s</text>\n", at, height - 6,
                       span * i / 8, decimals);
  }
  for (std::size_t i = 0; i < plan.leaves.size(); ++i) {
    const double y = kRow * static_cast<double>(i);
    svg += fmt::format("<text x={:.0f} y={:.0f} text-anchor=end>{}</text>\n", kLeft - 8, y + 15,
                       text::xml_escape(plan.leaves[i].name));
    for (const Bar& bar : facts.bars[i]) {
      svg += fmt::format(
          "<rect class={} rx=2 x={:.2f} y={:.0f} width={:.2f} height=16><title>{} {}: {:.3f} to {:.3f} "
          "s</title></rect>\n",
          bar.status, x(bar.from), y + 3, std::max(x(bar.to) - x(bar.from), 1.0), text::xml_escape(plan.leaves[i].name),
          bar.status, seconds(bar.from), seconds(bar.to));
    }
  }
  for (const runtime::MonitorReport& monitor : facts.monitors) {
    if (!monitor.decision || monitor.verdict != monitor::Verdict::kViolated) continue;
    svg += fmt::format(
        "<line class=mark x1={0:.1f} x2={0:.1f} y1=0 y2={1:.0f}><title>{2} violated at {3:.3f} s</title></line>\n",
        x(monitor.decision->at), height - 22, text::xml_escape(monitor.name), seconds(monitor.decision->at));
  }
  svg += "</svg></div>\n<div class=legend>";
  for (const char* status : {"RUNNING", "SUCCESS", "FAILURE"})
    svg += fmt::format("<span><svg viewBox=\"0 0 12 12\"><rect class={} rx=2 width=12 height=12 /></svg>{}</span>",
                       status, status);
  if (svg.find("class=mark") != std::string::npos) svg += "<span>dashed: a requirement was violated</span>";
  return svg + "</div></div>\n";
}

std::string coverage(const project::Plan& plan, const Facts& facts) {
  draw::Tree picture = graph::drawing_of(plan.tree, nullptr, {.ports = false, .conditions = false});
  std::size_t reached = 0;
  for (std::size_t node = 0; node < picture.nodes.size() && node < facts.counts.size(); ++node) {
    const auto& counts = facts.counts[node];
    std::string line;
    for (const auto& [status, count] : counts) line += fmt::format("{}{} {}", line.empty() ? "" : ", ", status, count);
    reached += counts.empty() ? 0 : 1;
    picture.nodes[node].lines.push_back(counts.empty() ? "never ticked" : line);
    if (!counts.empty()) {
      picture.nodes[node].status = counts.contains("FAILURE")   ? draw::TreeStatus::kFailure
                                   : counts.contains("SUCCESS") ? draw::TreeStatus::kSuccess
                                                                : draw::TreeStatus::kRunning;
    }
  }
  return fmt::format(
      "<div class=\"card\"><p>{} of {} nodes were ticked.</p>\n<div class=\"scroll tree\">{}</div></div>\n", reached,
      picture.nodes.size(), draw::to_svg(picture));
}

struct WitnessRow {
  const Message* message = nullptr;
  std::string what;  // HTML
  bool is_key = false;
};

// Ticks that only follow each other are one row.
std::string witness_table(const std::vector<WitnessRow>& rows) {
  std::string html = "<div class=scroll><table><tr><th>time<th>observation<th>from<th>what it says</tr>\n";
  const auto is_plain_tick = [](const WitnessRow& row) { return row.message->name == "mission.tick" && !row.is_key; };
  for (std::size_t i = 0; i < rows.size();) {
    std::size_t last = i;
    while (is_plain_tick(rows[i]) && last + 1 < rows.size() && is_plain_tick(rows[last + 1])) ++last;
    const WitnessRow& row = rows[i];
    std::string time = fmt::format("{:.3f}", seconds(row.message->time));
    std::string name = fmt::format("<code>{}</code>", text::xml_escape(row.message->name));
    std::string what = row.what;
    if (last > i) {
      time += fmt::format(" – {:.3f}", seconds(rows[last].message->time));
      name += fmt::format(" × {}", last - i + 1);
      if (!what.empty()) what += " … " + rows[last].what;
    }
    html += fmt::format("<tr{}><td>{} s<td>{}<td>{}<td><code>{}</code></tr>\n", row.is_key ? " class=key" : "", time,
                        name, text::xml_escape(row.message->source), what);
    i = last + 1;
  }
  return html + "</table></div>";
}

std::string verdicts(const project::Plan& plan, const Facts& facts) {
  if (facts.monitors.empty()) return "<p>The project has no monitors.</p>\n";
  std::string html;
  for (std::size_t i = 0; i < facts.monitors.size(); ++i) {
    const runtime::MonitorReport& monitor = facts.monitors[i];
    const std::string verdict(to_string(monitor.verdict));
    html += fmt::format("<div class=\"card{}\"><h3>{}<span class=\"badge {}\">{}</span></h3>\n",
                        monitor.verdict == monitor::Verdict::kViolated    ? " bad"
                        : monitor.verdict == monitor::Verdict::kSatisfied ? " good"
                                                                          : "",
                        text::xml_escape(monitor.name), verdict, verdict);
    if (const monitor::Origin* origin = plan.monitors[i].origin()) {
      if (!origin->requirement.prose.empty())
        html += fmt::format("<p>{}</p>\n", text::xml_escape(origin->requirement.prose));
      html += fmt::format("<p class=soft><code>{}</code></p>\n", text::xml_escape(origin->requirement.text()));
    }
    if (!monitor.standing.empty()) html += fmt::format("<p class=soft>{}</p>\n", text::xml_escape(monitor.standing));
    if (!monitor.vacuity.empty()) html += fmt::format("<p>It {}.</p>\n", text::xml_escape(monitor.vacuity));
    if (!monitor.failure.empty())
      html += fmt::format("<p class=violated>given up: {}</p>\n", text::xml_escape(monitor.failure));
    if (!monitor.decision) {
      html += "</div>\n";
      continue;
    }
    const auto& explanation = monitor.explanation;
    html += fmt::format("<p>Decided at <b>{:.3f} s</b>", seconds(monitor.decision->at));
    if (!monitor.leaf.empty()) html += fmt::format(" while <b>{}</b> was at work", text::xml_escape(monitor.leaf));
    if (explanation && explanation->triggered)
      html += fmt::format(", owed since {:.3f} s", seconds(*explanation->triggered));
    html += monitor.decision->deciding ? ".</p>\n" : "; nothing was observed then: a deadline passed.</p>\n";
    std::vector<WitnessRow> rows;
    if (explanation) {
      for (const auto& step : explanation->steps) {
        std::string what;
        for (const std::string& set : step.set) what += (what.empty() ? "" : ", ") + text::xml_escape(set);
        if (step.is_trigger)
          what += (what.empty() ? "" : " ") + ("← from here on it " + text::xml_escape(explanation->owed));
        if (step.is_deciding) what += (what.empty() ? "← " : " ← ") + verdict;
        rows.push_back({&step.observation, what, step.is_trigger || step.is_deciding});
      }
    } else {
      for (const Message& message : monitor.decision->witness)
        rows.push_back({&message, text::xml_escape(to_json(message.data)), false});
    }
    if (!monitor.decision->witness_complete)
      html += "<p class=soft>Earlier observations are no longer known.</p>\n";
    else if (!monitor.decision->witness_minimal)
      html += "<p class=soft>Some of these may not matter: there are too many to try.</p>\n";
    html += witness_table(rows) + "</div>\n";
  }
  return html;
}

// "simulation.setBatteryCharge {"percent":10}".
std::string intervention(const Value& data) {
  const Value* what = data.find("what");
  const Map* members = data.as_map();
  if (what == nullptr || members == nullptr) return to_json(data);
  std::string text(what->text());
  for (const auto& [name, value] : *members) {
    if (name == "what" || (value.as_map() != nullptr && value.as_map()->size() == 0)) continue;
    text += (name == "args" ? " " : fmt::format(" {} ", name)) + to_json(value);
  }
  return text;
}

std::string page(const ReportCommand& command, replay::RecordedRun& run, const project::Plan& plan,
                 const Facts& facts) {
  std::string html =
      "<!doctype html>\n<html lang=en><meta charset=utf-8><meta name=viewport content=\"width=device-width\">\n";
  html += fmt::format("<title>{}</title>\n<style>{}</style>\n", text::xml_escape(run.fact("scenario")), kStyle);
  html += fmt::format("<h1>{}</h1>\n<div class=card><dl class=facts>\n", text::xml_escape(run.fact("scenario")));
  const auto row = [&](std::string_view name, const std::string& value) {
    if (!value.empty()) html += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", name, text::xml_escape(value));
  };
  row("Mission", run.fact("mission") + (run.fact("reason").empty() ? "" : fmt::format(" ({})", run.fact("reason"))));
  row("Ended by", run.reader().complete() ? run.fact("ended_by") : "nothing: the recording was cut off");
  row("Run time", fmt::format("{:.3f} s, {} time, seed {}", seconds(run.ended()), run.fact("clock"), run.fact("seed")));
  row("Started", run.fact("started"));
  row("Observations", std::to_string(facts.observations));
  html += "</dl></div>\n<h2>Verdicts</h2>\n" + verdicts(plan, facts);
  html += "<h2>Timeline</h2>\n" + timeline(plan, facts, run.ended());
  if (!facts.interventions.empty()) {
    html += "<h2>Interventions</h2>\n<div class=card><div class=scroll><table><tr><th>time<th>by<th>what</tr>\n";
    for (const Message& message : facts.interventions)
      html += fmt::format("<tr><td>{:.3f} s<td>{}<td><code>{}</code></tr>\n", seconds(message.time),
                          text::xml_escape(message.source), text::xml_escape(intervention(message.data)));
    html += "</table></div></div>\n";
  }
  return fmt::format("{}<h2>Tree coverage</h2>\n{}{}</html>\n", html, coverage(plan, facts),
                     coverage_section(command, plan));
}

int write_report(const ReportCommand& command, replay::RecordedRun& run, const project::Plan& project) {
  Facts facts;
  facts.bars.resize(project.leaves.size());
  facts.counts.resize(project.tree.size());
  Verdicts verdicts(project.monitors);
  std::map<std::string, std::size_t> leaves;
  for (std::size_t i = 0; i < project.leaves.size(); ++i) leaves[project.leaves[i].name] = i;
  const auto read = run.each([&](Message message) {
    ++facts.observations;
    replay::restore_numbers(project, message);
    verdicts.observe(message);
    if (message.name == "scenario.injection") facts.interventions.push_back(message);
    if (message.name == "node.status") {
      const Value* node = message.data.find("node");
      const Value* to = message.data.find("to");
      if (node != nullptr && to != nullptr && node->as_int() != nullptr && to->text() != "IDLE" &&
          *node->as_int() >= 0 && *node->as_int() < static_cast<std::int64_t>(facts.counts.size()))
        ++facts.counts[static_cast<std::size_t>(*node->as_int())][std::string(to->text())];
      return true;
    }
    if (!message.name.ends_with(".tick.reply") && !message.name.ends_with(".halt.request")) return true;
    const bool halted = message.name.ends_with(".halt.request");
    const auto leaf = leaves.find(halted ? message.target : message.source);
    if (leaf == leaves.end()) return true;
    std::vector<Bar>& bars = facts.bars[leaf->second];
    const Value* answer = message.data.find("status");
    const std::string status(answer != nullptr ? answer->text() : "");
    const TimePoint until = message.time + project.scenario.project.period;
    // In real time a tick is a little late.
    const bool goes_on = !bars.empty() && !bars.back().halted && message.tick <= bars.back().tick + 1;
    if (halted) {
      if (!bars.empty()) {
        bars.back().to = std::min(bars.back().to, message.time);
        bars.back().halted = true;
      }
    } else if (goes_on && (bars.back().status == status || bars.size() >= kBarsMax)) {
      bars.back().to = until;
      bars.back().tick = message.tick;
    } else {
      if (!bars.empty()) bars.back().to = goes_on ? message.time : std::min(bars.back().to, message.time);
      bars.push_back({.from = message.time, .to = until, .status = status, .tick = message.tick});
    }
    return true;
  });
  say_each(run.reader().problems());
  if (!read) {
    say(to_string(read.error()));
    return kInvalidInput;
  }
  facts.monitors = verdicts.finish(run.judged_until());
  const std::string html = page(command, run, project, facts);
  if (command.output.empty()) {
    print(html);
    return kOk;
  }
  const auto written = text::write_file(command.output, html);
  if (!written) say(to_string(written.error()));
  return written ? kOk : kEnvironment;
}

}  // namespace

int report(const ReportCommand& command) {
  if (!command.output.empty() && !may_write(command.output, "<!doctype html", {command.file})) return kUsage;
  auto run = replay::RecordedRun::open(command.file);
  if (!run) {
    say(to_string(run.error()));
    return kInvalidInput;
  }
  auto scenario = run->scenario(command.recorded_code);
  say(scenario.diagnostics);
  if (!scenario.ok()) return kInvalidInput;
  scenario.value->virtual_time = false;
  const auto plan = project::prepare(std::move(*scenario.value));
  if (!plan.ok()) {
    say(run->errors_in(plan.diagnostics));
    return kInvalidInput;
  }
  return watched_work(
      *plan.value, false, [&] { return write_report(command, *run, *plan.value); },
      [&](Diagnostics found) { return run->errors_in(std::move(found)); });
}

}  // namespace sentree::cli
