#include "sentree/cli/report_coverage.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "sentree/draw/chart.h"
#include "sentree/graph/chart.h"
#include "sentree/studio/reached.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

using Kind = campaign::Coverage::Kind;
using Thing = campaign::Coverage::Thing;

// Things never reached that a report lists, of each kind.
constexpr std::size_t kListedMax = 200;

std::string short_name(const std::string& file) {
  const std::size_t slash = file.rfind('/');
  return slash == std::string::npos ? file : file.substr(slash + 1);
}

std::string counts_table(const campaign::Coverage& coverage) {
  std::string html = "<div class=card><table><tr><th>what<th>reached<th>of</tr>\n";
  for (const Kind kind :
       {Kind::kNode, Kind::kState, Kind::kTransition, Kind::kGuard, Kind::kMethod, Kind::kRequirement}) {
    const auto count = coverage.count(kind);
    if (count.of == 0) continue;
    html += fmt::format("<tr><td>{}<td>{}<td>{}</tr>\n", campaign::to_string(kind), count.reached, count.of);
  }
  return html + "</table></div>\n";
}

std::string missing_table(const campaign::Coverage& coverage) {
  std::string rows;
  std::map<Kind, std::size_t> listed;
  for (const auto& [thing, reached] : coverage.things()) {
    if (reached || ++listed[thing.kind] > kListedMax) continue;
    const std::string what = thing.kind == Kind::kRequirement ? "put to the test" : thing.what;
    rows += fmt::format("<tr><td>{}<td><code>{}</code><td><code>{}</code></tr>\n", campaign::to_string(thing.kind),
                        text::xml_escape(short_name(thing.of)), text::xml_escape(what));
  }
  if (rows.empty()) return "<p>Everything was reached.</p>\n";
  std::string html = fmt::format(
      "<details class=card><summary>Never reached</summary><div "
      "class=scroll><table><tr><th>kind<th>of<th>what</tr>\n{}</table></div>",
      rows);
  for (const auto& [kind, count] : listed) {
    if (count > kListedMax)
      html += fmt::format("<p class=soft>… and {} {} more</p>", count - kListedMax, campaign::to_string(kind));
  }
  return html + "</details>\n";
}

// What was never reached of one chart, by line of its file.
struct NeverReached {
  std::set<std::string> states;
  std::set<int> transitions;
  std::map<int, std::string> guards;  // "never true", "never false", "never evaluated"
};

NeverReached never_reached(const campaign::Coverage& coverage, const std::string& file) {
  NeverReached never;
  for (const auto& [thing, reached] : coverage.things()) {
    if (reached || thing.of != file) continue;
    const std::size_t colon = thing.at.rfind(':');
    const int line = colon == std::string::npos ? 0 : std::atoi(thing.at.c_str() + colon + 1);
    if (thing.kind == Kind::kState) never.states.insert(thing.what);
    if (thing.kind == Kind::kTransition) never.transitions.insert(line);
    if (thing.kind == Kind::kGuard) {
      std::string& said = never.guards[line];
      said = !said.empty() ? "never evaluated" : thing.what.ends_with(": true") ? "never true" : "never false";
    }
  }
  return never;
}

std::string chart_picture(const scxml::Chart& chart, const NeverReached& never) {
  std::vector<scxml::StateIndex> states;
  std::vector<scxml::TransitionIndex> transitions;
  draw::Chart picture = graph::drawing_of(chart, nullptr, 0xFFFFFFFFU, &states, &transitions);
  for (std::size_t i = 0; i < picture.states.size(); ++i) {
    if (states[i] == scxml::kNoState || chart.states()[states[i]].id.empty()) continue;
    picture.states[i].active = !never.states.contains(chart.states()[states[i]].id);
    if (!picture.states[i].active) picture.states[i].lines.emplace_back("never reached");
  }
  for (std::size_t i = 0; i < picture.transitions.size(); ++i) {
    if (transitions[i] >= chart.transitions().size()) continue;
    const int line = chart.span(chart.transitions()[transitions[i]].place).line;
    std::string& condition = picture.transitions[i].condition;
    if (const auto guard = never.guards.find(line); guard != never.guards.end() && !condition.empty())
      condition += ": " + guard->second;
    else if (never.transitions.contains(line))
      picture.transitions[i].event += " (never taken)";
  }
  picture.title = short_name(chart.file());
  return fmt::format("<div class=card><div class=\"scroll tree\">{}</div></div>\n", draw::to_svg(picture));
}

}  // namespace

std::string coverage_section(const ReportCommand& command, const project::Plan& plan) {
  std::string html = "<h2>Coverage</h2>\n";
  const auto reached = studio::reached_by(command.file, command.recorded_code);
  if (!reached)
    return fmt::format("{}<p class=soft>What was reached of charts and guards is not known: {}</p>\n", html,
                       text::xml_escape(reached.error().message));
  html += counts_table(reached->coverage) + missing_table(reached->coverage);
  // The files of `plan` lie in another folder than those that were executed again.
  std::map<std::string, std::string> files;
  for (const auto& [thing, is_reached] : reached->coverage.things()) {
    if (thing.kind == Kind::kState) files.emplace(short_name(thing.of), thing.of);
  }
  std::set<std::string> drawn;
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (!leaf.chart || !drawn.insert(leaf.chart->file()).second) continue;
    const auto file = files.find(short_name(leaf.chart->file()));
    if (file != files.end()) html += chart_picture(*leaf.chart, never_reached(reached->coverage, file->second));
  }
  return html;
}

}  // namespace sentree::cli
