#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sentree/campaign/summary.h"
#include "sentree/text/xml.h"

namespace sentree::campaign {

namespace {

constexpr const char* kStyle = R"(
:root{color-scheme:light dark;--ink:#1c2733;--soft:#5b6b7b;--line:#d5dde5;--paper:#fff;--bar:#3b76b8;--bad:#c0392b;--good:#2e8b57}
@media(prefers-color-scheme:dark){:root{--ink:#e4eaf0;--soft:#93a3b3;--line:#33414f;--paper:#141b22;--bar:#6aa5e0;--bad:#e8705f;--good:#62c08a}}
body{font:15px/1.45 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:60rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.4rem}h2{font-size:1.1rem;margin-top:2rem}table{border-collapse:collapse;width:100%}
th,td{text-align:left;padding:.25rem .6rem .25rem 0;border-bottom:1px solid var(--line);vertical-align:top}
th{color:var(--soft);font-weight:600}td.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
code{font-size:.9em}.soft{color:var(--soft)}.plots{display:flex;flex-wrap:wrap;gap:1.5rem}
svg text{fill:var(--soft);font:11px system-ui,sans-serif}svg .bar{fill:var(--bar)}svg .bad{fill:var(--bad)}
svg .axis{stroke:var(--line)}svg .range{stroke:var(--ink);stroke-width:1.5}
)";

std::string short_percent(double rate) { return fmt::format("{:.4g} %", rate * 100); }

// A rate with its interval on a line from 0 to 100 %.
std::string rate_svg(double rate, const Interval& interval, bool bad) {
  constexpr double kWidth = 260;
  return fmt::format(
      R"(<svg width="280" height="18" role="img" aria-label="{}"><line class="axis" x1="0" x2="{:.0f}" y1="9" y2="9"/>)"
      R"(<rect class="{}" x="0" y="4" width="{:.1f}" height="10"/><line class="range" x1="{:.1f}" x2="{:.1f}" y1="9" y2="9"/></svg>)",
      short_percent(rate), kWidth, bad ? "bad" : "bar", rate * kWidth, interval.low * kWidth, interval.high * kWidth);
}

std::string histogram_svg(const Tally& tally, double factor, const std::string& unit) {
  const auto bins = tally.histogram(40);
  if (bins.empty()) return "<p class=\"soft\">no values</p>";
  constexpr double kWidth = 420;
  constexpr double kHeight = 140;
  std::uint64_t most = 1;
  for (const auto& [low, count] : bins) most = std::max(most, count);
  const double step = kWidth / static_cast<double>(bins.size());
  std::string out = fmt::format(R"(<svg width="440" height="170" role="img">)");
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const double height = kHeight * static_cast<double>(bins[i].second) / static_cast<double>(most);
    out += fmt::format(
        R"(<rect class="bar" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"><title>from {:.4g} {}: {}</title></rect>)",
        static_cast<double>(i) * step, kHeight - height, std::max(1.0, step - 1), height, bins[i].first * factor, unit,
        bins[i].second);
  }
  out += fmt::format(R"(<line class="axis" x1="0" x2="{0:.0f}" y1="{1:.0f}" y2="{1:.0f}"/>)", kWidth, kHeight);
  out +=
      fmt::format(R"(<text x="0" y="158">{:.4g} {}</text><text x="{:.0f}" y="158" text-anchor="end">{:.4g} {}</text>)",
                  tally.least() * factor, unit, kWidth, tally.most() * factor, unit);
  out += fmt::format(R"(<text x="{:.0f}" y="158" text-anchor="middle">median {:.4g} {}</text></svg>)", kWidth / 2,
                     tally.quantile(0.5) * factor, unit);
  return out;
}

std::string bin_name(const Factor& factor, std::size_t bin) {
  if (factor.kind != Factor::Kind::kNumber) return factor.bins[bin];
  if (factor.may_be_absent && bin == 0) return factor.bins[0];
  const bool is_first = bin == (factor.may_be_absent ? 1U : 0U);
  if (bin + 1 == factor.bins.size()) return "from " + factor.bins[bin - 1];
  return is_first ? "below " + factor.bins[bin] : fmt::format("{} to {}", factor.bins[bin - 1], factor.bins[bin]);
}

// The outcome by the level of a factor.
std::string effect_svg(const Summary& summary, std::size_t outcome, std::size_t index) {
  const Factor& factor = summary.factors()[index];
  const auto& groups = summary.groups(outcome, index);
  const bool is_time = outcome + 1 == summary.outcomes();
  double most = is_time ? 0.0 : 1e-9;
  const auto mean = [](const Group& group) {
    return group.count == 0 ? 0.0 : group.sum / static_cast<double>(group.count);
  };
  for (const Group& group : groups) most = std::max(most, mean(group));
  constexpr double kWidth = 300;
  constexpr double kHeight = 90;
  const double step = kWidth / static_cast<double>(std::max<std::size_t>(1, groups.size()));
  std::string out = R"(<svg width="320" height="120" role="img">)";
  for (std::size_t bin = 0; bin < groups.size(); ++bin) {
    const double height = most > 0 ? kHeight * mean(groups[bin]) / most : 0.0;
    out += fmt::format(
        R"(<rect class="{}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"><title>{}: {} of {} runs</title></rect>)",
        is_time ? "bar" : "bad", static_cast<double>(bin) * step, kHeight - height, std::max(1.0, step - 2), height,
        text::xml_escape(bin_name(factor, bin)),
        is_time ? fmt::format("{:.1f} s", mean(groups[bin])) : short_percent(mean(groups[bin])), groups[bin].count);
  }
  out += fmt::format(R"(<line class="axis" x1="0" x2="{0:.0f}" y1="{1:.0f}" y2="{1:.0f}"/>)", kWidth, kHeight);
  out +=
      fmt::format(R"(<text x="0" y="106">{}</text><text x="{:.0f}" y="106" text-anchor="end">{}</text>)",
                  text::xml_escape(bin_name(factor, 0)), kWidth, text::xml_escape(bin_name(factor, groups.size() - 1)));
  out += fmt::format(R"(<text x="0" y="118">highest {}</text></svg>)",
                     is_time ? fmt::format("{:.1f} s", most) : short_percent(most));
  return out;
}

}  // namespace

std::string to_page(const Summary& summary, const std::string& title, const std::string& again,
                    const std::map<std::string, std::string>& minimal) {
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title><meta name=\"viewport\" "
      "content=\"width=device-width\"><style>{}</style></head><body>\n",
      text::xml_escape(title), kStyle);
  const double counted = std::max<double>(1.0, static_cast<double>(summary.counted()));
  out += fmt::format(
      "<h1>{}</h1>\n<p>{} runs, seed {}, {} of them counted; intervals of {} (Clopper–Pearson).{}</p>\n<p "
      "class=\"soft\">Any "
      "run again: <code>{}</code></p>\n",
      text::xml_escape(title), summary.runs(), summary.asked().seed, summary.counted(),
      short_percent(summary.asked().confidence),
      summary.ended_by().empty() ? "" : fmt::format(" Ended early: {}.", text::xml_escape(summary.ended_by())),
      text::xml_escape(again));
  const auto rate_row = [&](const std::string& name, const std::string& what, std::uint64_t hits, bool bad) {
    const auto known = summary.rate(hits).interval;
    const double rate = static_cast<double>(hits) / counted;
    const auto file = minimal.find(name);
    return fmt::format(
        "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{} to "
        "{}</td><td>{}</td><td>{}</td></tr>\n",
        text::xml_escape(name), what, hits, short_percent(rate), short_percent(known.low), short_percent(known.high),
        rate_svg(rate, known, bad),
        bad && file != minimal.end() ? fmt::format("<code>{}</code>", text::xml_escape(file->second)) : "");
  };
  out +=
      "<h2>Rates</h2>\n<table><tr><th></th><th></th><th>runs</th><th>rate</th><th>interval</th><th></th><th>least "
      "scenario</th></tr>\n";
  out += rate_row("mission", "SUCCESS", summary.ended(Outcome::kSuccess), false);
  out += rate_row("mission", "FAILURE", summary.ended(Outcome::kFailure), true);
  out += rate_row("mission", "RUNNING at the end", summary.ended(Outcome::kRunning), false);
  for (const auto& requirement : summary.requirements()) {
    out +=
        rate_row(requirement.name,
                 requirement.untested == 0 ? "violated"
                                           : fmt::format("violated; not put to the test in {}", requirement.untested),
                 requirement.violated, true);
  }
  out += "</table>\n";
  if (!summary.tests().empty()) {
    out +=
        "<h2>Expected</h2>\n<table><tr><th>expectation</th><th>verdict</th><th>runs</th><th>of them so</th><th>says "
        "either of</th></tr>\n";
    for (const SequentialTest& test : summary.tests()) {
      out += fmt::format(
          "<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{} to "
          "{}</td></tr>\n",
          text::xml_escape(test.expectation().text), to_string(test.state()), test.runs(), test.hits(),
          short_percent(test.indifference().low), short_percent(test.indifference().high));
    }
    out += "</table>\n";
  }
  out += fmt::format(
      "<div class=\"plots\"><div><h2>Time to goal</h2>{}</div><div><h2>Least charge of the "
      "battery</h2>{}</div></div>\n",
      histogram_svg(summary.time_to_goal(), 1, "s"), histogram_svg(summary.battery(), 100, "%"));
  out +=
      "<h2>What matters</h2>\n<p class=\"soft\">Share of an outcome's variance that a factor explains alone, where "
      "that is "
      "no chance; below it the outcome by tenths of the factor's values.</p>\n";
  for (std::size_t outcome = 0; outcome < summary.outcomes(); ++outcome) {
    const auto causes = summary.causes(outcome);
    if (causes.empty()) continue;
    out += fmt::format("<h3>{}</h3>\n<div class=\"plots\">", text::xml_escape(summary.outcome_name(outcome)));
    for (const auto& cause : causes) {
      out += fmt::format("<div><b>{}</b> {:.1f} %<br>{}</div>", text::xml_escape(summary.factors()[cause.factor].name),
                         cause.influence.share * 100, effect_svg(summary, outcome, cause.factor));
    }
    out += "</div>\n";
  }
  out +=
      "<h2>Worst runs</h2>\n<table><tr><th>run</th><th>seed</th><th>mission</th><th>time</th><th>least "
      "charge</th><th>violated</th></tr>\n";
  for (const Row& row : summary.worst()) {
    std::string violated;
    for (std::size_t i = 0; i < row.requirements.size(); ++i) {
      if (row.requirements[i].verdict == Verdict::kViolated)
        violated += (violated.empty() ? "" : ", ") + summary.requirements()[i].name;
    }
    out += fmt::format(
        "<tr><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td><td class=\"n\">{:.1f} s</td><td "
        "class=\"n\">{}</td><td>{}</td></tr>\n",
        row.run, row.seed, to_string(row.outcome), row.time_s,
        row.battery_least ? fmt::format("{:.1f} %", *row.battery_least * 100) : "", text::xml_escape(violated));
  }
  out += "</table>\n";
  for (const auto& [name, rows, count] :
       {std::tuple{"Lost", &summary.lost(), summary.ended(Outcome::kLost)},
        std::tuple{"Invalid", &summary.invalid(), summary.ended(Outcome::kInvalid)}}) {
    if (count == 0) continue;
    out += fmt::format("<h2>{} runs: {}</h2>\n<p class=\"soft\">They count in no rate.</p><table>\n", name, count);
    for (const auto& row : *rows)
      out += fmt::format("<tr><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td></tr>\n", row.run, row.seed,
                         text::xml_escape(row.why));
    out += "</table>\n";
  }
  return out + "</body></html>\n";
}

}  // namespace sentree::campaign
