#include "sentree/cli/verify_findings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "sentree/base/shown.h"
#include "sentree/studio/reached.h"

namespace sentree::cli {

namespace {

class Telling {
 public:
  explicit Telling(const Findings& found) : found_(found) {}

  std::string text() const {
    const verify::Graph& graph = found_.result.graph;
    std::string models;
    for (const project::ModelPlan& model : found_.plan.models) {
      std::string serves;
      for (const std::string& service : model.serves) serves += (serves.empty() ? "" : ", ") + service;
      const bool is_any = std::any_of(found_.any.begin(), found_.any.end(),
                                      [&](const auto& m) { return "any_" + m.service == model.name; });
      models += (models.empty() ? "" : ", ") + (is_any ? serves : model.name) +
                (is_any ? ": any reply" : fmt::format(" ({})", serves));
    }
    std::string out = fmt::format("models      {}   {}\n", models.empty() ? "none" : models, basis());
    for (const verify::MadeModel& any : found_.any) {
      for (const std::string& tried : any.tried) out += fmt::format("any reply   {}.{}\n", any.service, tried);
    }
    out += fmt::format("explored    {} states, {} periods, {}   {:.2f} s\n", grouped(graph.nodes.size()),
                       grouped(graph.edges.size()), how_far(), found_.result.explored_s);
    for (const verify::Untried& one : found_.asked.untried) out += fmt::format("not tried   {}\n", to_string(one.told));
    if (!graph.grows.empty()) out += fmt::format("            most values had {}\n", graph.grows);
    std::size_t width = 0;
    for (const auto& judgement : found_.result.judgements) width = std::max(width, judgement.requirement.size());
    for (const auto& judgement : found_.result.judgements) {
      out += fmt::format("{:<{}}   {}\n", judgement.requirement, width, told(judgement));
      if (const auto shown = found_.shown.find(judgement.requirement); shown != found_.shown.end())
        out += shown->second.story;
    }
    for (const std::string& problem : graph.problems) out += fmt::format("! {}\n", problem);
    constexpr std::size_t kShownMax = 12;
    for (std::size_t i = 0; i < std::min(found_.result.not_reached.size(), kShownMax); ++i)
      out += fmt::format("{}{}\n", i == 0 ? "not reached " : "            ", found_.result.not_reached[i]);
    if (found_.result.not_reached.size() > kShownMax)
      out += fmt::format("            … and {} more (--json has all)\n", found_.result.not_reached.size() - kShownMax);
    return out;
  }

  Value value(const campaign::Coverage& reached) const {
    const verify::Graph& graph = found_.result.graph;
    List requirements;
    for (const auto& judgement : found_.result.judgements) {
      Map one{{"name", judgement.requirement},
              {"verdict", to_string(judgement.finding)},
              {"vacuous", !judgement.vacuous.empty()},
              {"complete", graph.complete && judgement.limit.empty()},
              {"states", static_cast<std::int64_t>(judgement.states)},
              {"first_violation", Value()},
              {"counterexample", Value()},
              {"probability", Value()}};
      if (!judgement.vacuous.empty()) one["vacuous_because"] = judgement.vacuous;
      if (!judgement.never_seen.empty()) {
        List never_seen;
        for (const std::string& what : judgement.never_seen) never_seen.emplace_back(what);
        one["never_seen"] = std::move(never_seen);
      }
      if (!judgement.error.empty()) one["error"] = judgement.error;
      if (!judgement.limit.empty()) one["undecided_because"] = judgement.limit;
      List fair;
      for (const std::string& name : judgement.fair) fair.emplace_back(name);
      one["fair"] = std::move(fair);
      if (judgement.path) {
        one["first_violation"] = Map{{"tick", static_cast<std::int64_t>(tick_of(*judgement.path))},
                                     {"time", seconds(judgement.at)},
                                     {"observation", judgement.observation}};
        const ShownCounterexample& shown = found_.shown.at(judgement.requirement);
        Map example{{"scenario", shown.scenario},
                    {"recording", shown.recording},
                    {"choices", static_cast<std::int64_t>(shown.choices)},
                    {"chosen", chosen_value(judgement)},
                    {"orders", static_cast<std::int64_t>(shown.orders)}};
        if (judgement.path->loop) {
          example["loop"] = Map{{"from", static_cast<std::int64_t>(tick_of(*judgement.path))},
                                {"ticks", static_cast<std::int64_t>(shown.loop_ticks)}};
        }
        one["counterexample"] = std::move(example);
      }
      if (!judgement.avoided.empty()) {
        List avoided;
        for (const std::string& name : judgement.avoided) avoided.emplace_back(name);
        one["holds_if_fair"] = std::move(avoided);
      }
      one["can_stay_open"] = judgement.can_stay_open.has_value();
      if (judgement.least) {
        const auto bounds = [](const verify::Judgement::Probability& p) {
          return Map{{"low", p.low}, {"high", p.high}};
        };
        one["probability"] = Map{{"low", judgement.least->low},       {"high", judgement.greatest->high},
                                 {"least", bounds(*judgement.least)}, {"greatest", bounds(*judgement.greatest)},
                                 {"method", "interval iteration"},    {"confidence", 1.0}};
      }
      requirements.emplace_back(std::move(one));
    }
    List not_reached;
    for (const std::string& what : found_.result.not_reached) not_reached.emplace_back(what);
    List problems;
    for (const std::string& what : graph.problems) problems.emplace_back(what);
    List models;
    for (const project::ModelPlan& model : found_.plan.models) {
      List serves;
      for (const std::string& service : model.serves) serves.emplace_back(service);
      models.emplace_back(Map{{"name", model.name},
                              {"chart", model.chart.name()},
                              {"fingerprint", fmt::format("{:016x}", model.chart.fingerprint())},
                              {"serves", std::move(serves)}});
    }
    Map any;
    for (const verify::MadeModel& model : found_.any) {
      List tried;
      for (const std::string& line : model.tried) tried.emplace_back(line);
      any[model.service] = Map{{"file", model.file}, {"tried", std::move(tried)}};
    }
    Map limits{{"complete_to_tick", static_cast<std::int64_t>(graph.complete_to)}, {"same_hash", same_hash()}};
    if (!graph.limit.empty()) limits["ended_by"] = graph.limit;
    if (!found_.asked.untried.empty()) {
      List not_tried;
      for (const verify::Untried& one : found_.asked.untried) not_tried.emplace_back(to_string(one.told));
      limits["not_tried"] = std::move(not_tried);
    }
    if (!graph.grows.empty()) limits["most_values"] = graph.grows;
    return Map{{"tool", "sentree verify"},
               {"version", SENTREE_VERSION},
               {"models", std::move(models)},
               {"any_reply", std::move(any)},
               {"order", found_.asked.explore.order == verify::Order::kAny ? "any" : "virtual"},
               {"orders_left_out", graph.reduced},
               {"faults", static_cast<std::int64_t>(found_.asked.explore.faults.size())},
               {"faults_at_most", static_cast<std::int64_t>(found_.asked.explore.faults_at_most)},
               {"requirements", std::move(requirements)},
               {"states", static_cast<std::int64_t>(graph.nodes.size())},
               {"transitions", static_cast<std::int64_t>(graph.edges.size())},
               {"complete", graph.complete},
               {"coverage",
                Map{{"not_reached", std::move(not_reached)},
                    {"kinds", *studio::coverage_value(reached, found_.plan.scenario.project.folder).find("kinds")}}},
               {"problems", std::move(problems)},
               {"limits", std::move(limits)},
               {"wall_s", found_.result.explored_s}};
  }

 private:
  std::string how_far() const {
    const verify::Graph& graph = found_.result.graph;
    if (graph.complete) return "complete";
    return graph.limit.empty() ? "not complete" : fmt::format("up to tick {}: {}", graph.complete_to, graph.limit);
  }

  std::string basis() const {
    std::string text = found_.asked.explore.faults.empty()
                           ? "no faults"
                           : fmt::format("{} faults, {} at a time", found_.asked.explore.faults.size(),
                                         found_.asked.explore.faults_at_most);
    return text + (found_.asked.explore.order == verify::Order::kAny ? ", any order at one instant"
                                                                     : ", order of virtual time");
  }

  // What models chose in one place, or which faults came, on a path.
  struct Chosen {
    std::string name;
    std::string place;
    std::vector<std::string> values;  // as JSON; what faults do in words
    std::size_t times = 0;
  };

  // In the order of their first; of faults those that the scenario still has.
  std::vector<Chosen> chosen(const verify::Judgement& judgement) const {
    const verify::Path& path = *judgement.path;
    const verify::Graph& graph = found_.result.graph;
    std::map<std::string, std::size_t> faults = found_.shown.at(judgement.requirement).faults;
    std::vector<Chosen> all;
    for (const std::uint32_t edge : path.edges) {
      for (const verify::Made& made : graph.decisions[graph.edges[edge].made]) {
        const bool is_fault = made.kind == verify::Made::Kind::kFault && made.alternative > 0;
        if (!is_fault && (made.kind != verify::Made::Kind::kChoice || made.count < 2)) continue;
        const verify::ChoicePoint& point = graph.choices[made.what];
        const std::string name = is_fault ? point.function : point.model + (point.name.empty() ? "" : "." + point.name);
        const std::string& place = graph.places[made.place];
        const std::string& value = is_fault ? point.name : point.value;
        if (is_fault && point.function == "fault" && !path.loop && faults[value]-- == 0) {
          faults[value] = 0;
          continue;
        }
        auto one = std::find_if(all.begin(), all.end(),
                                [&](const Chosen& known) { return known.name == name && known.place == place; });
        if (one == all.end()) one = all.insert(all.end(), {name, place, {}, 0});
        ++one->times;
        if (std::find(one->values.begin(), one->values.end(), value) == one->values.end()) one->values.push_back(value);
      }
    }
    return all;
  }

  // "robot.plugs_in = false at models/robot.scxml:33 (9 times)"
  static std::string text_of(const std::vector<Chosen>& all) {
    constexpr std::size_t kShownMax = 6;
    std::string out;
    for (std::size_t i = 0; i < std::min(all.size(), kShownMax); ++i) {
      const Chosen& one = all[i];
      out += fmt::format("{}{} = ", i == 0 ? "" : ", ", one.name);
      for (std::size_t v = 0; v < std::min(one.values.size(), kShownMax); ++v)
        out += (v == 0 ? "" : " | ") + one.values[v];
      if (one.values.size() > kShownMax) out += " | …";
      if (!one.place.empty()) out += " at " + one.place;
      if (one.times > 1) out += fmt::format(" ({} times)", one.times);
    }
    return all.size() > kShownMax ? out + ", …" : out;
  }

  List chosen_value(const verify::Judgement& judgement) const {
    List out;
    for (const Chosen& one : chosen(judgement)) {
      List values;
      for (const std::string& value : one.values) values.emplace_back(value);
      Map entry{{"name", one.name}, {"values", std::move(values)}, {"times", static_cast<std::int64_t>(one.times)}};
      entry["place"] = one.place.empty() ? Value() : Value(one.place);
      out.emplace_back(std::move(entry));
    }
    return out;
  }

  // The first ones, which will do.
  static std::string few(const std::vector<std::string>& all, std::string_view between = ", ") {
    constexpr std::size_t kShownMax = 8;
    if (all.size() <= kShownMax) return fmt::format("{}", fmt::join(all, between));
    return fmt::format("{}{}… ({} in all)", fmt::join(all.begin(), all.begin() + kShownMax, between), between,
                       all.size());
  }

  // At which it happens, or with which what comes again for ever begins.
  static std::size_t tick_of(const verify::Path& path) { return path.loop ? *path.loop + 1 : path.edges.size(); }

  // Of an instant that is none of a tick: on which side of that tick it is.
  std::string_view beside_tick(std::size_t tick, TimePoint at) const {
    const TimePoint of_tick = TimePoint{} + found_.result.graph.period * (static_cast<std::int64_t>(tick) - 1);
    return at < of_tick ? "before " : at > of_tick ? "behind " : "";
  }

  std::string told(const verify::Judgement& judgement) const {
    if (!judgement.error.empty()) return "ERROR    " + judgement.error;
    std::string out;
    if (judgement.finding == verify::Finding::kRefuted) {
      const ShownCounterexample& shown = found_.shown.at(judgement.requirement);
      const std::size_t tick = tick_of(*judgement.path);
      out = fmt::format("REFUTED  {}tick {} ({} s)", judgement.path->loop ? "" : beside_tick(tick, judgement.at), tick,
                        shortest_decimal(seconds(judgement.at)));
      if (judgement.path->loop)
        out += fmt::format(": from here {} ticks can come again for ever", shown.loop_ticks);
      else if (judgement.state == "the mission ends")
        out += ": the mission ends, and it is still owed";
      else
        out += judgement.observation.empty() ? ": time passed" : ": " + judgement.observation;
      out += fmt::format("   {} .mcap", shown.scenario);
      if (const std::string what = text_of(chosen(judgement)); !what.empty()) out += "\n  chosen: " + what;
      if (shown.orders > 0) {
        out +=
            fmt::format("\n  needs messages of one instant in another order than that of virtual time, at {} instant{}",
                        shown.orders, shown.orders == 1 ? "" : "s");
      }
      if (!judgement.avoided.empty()) {
        out += "\n  holds if what is offered again and again is taken again and again; a loop can avoid " +
               few(judgement.avoided, " or ");
      }
    } else if (judgement.finding == verify::Finding::kHolds) {
      out = judgement.vacuous.empty() ? "holds" : "holds VACUOUSLY: " + judgement.vacuous;
      if (judgement.vacuous.empty()) out += fmt::format("    {} states with it", grouped(judgement.states));
      if (judgement.vacuous.empty() && !judgement.never_seen.empty())
        out += fmt::format("\n  never seen: {}", fmt::join(judgement.never_seen, ", "));
    } else {
      out = judgement.limit.empty() ? fmt::format("not refuted up to tick {}", found_.result.graph.complete_to)
                                    : "not decided: " + judgement.limit;
    }
    if (!judgement.fair.empty() && judgement.finding == verify::Finding::kHolds)
      out += fmt::format(" (if fair: {})", few(judgement.fair));
    if (judgement.can_stay_open)
      out += fmt::format("\n  can stay open when the mission ends, at tick {}", judgement.can_stay_open->edges.size());
    if (judgement.least) {
      const double alike = 1e-9 * judgement.greatest->high;
      out += fmt::format("\n  violated with probability {:.10g}", judgement.least->low);
      if (judgement.greatest->low - judgement.least->high > alike)
        out += fmt::format(" to {:.10g}, as what is left open is chosen", judgement.greatest->low);
      if (judgement.greatest->high - judgement.greatest->low > alike)
        out += fmt::format("; bounds: {:.10g} to {:.10g}", judgement.least->low, judgement.greatest->high);
    }
    return out;
  }

  // A bound on the probability that two of the states that were taken for one are not: as if hashes were drawn.
  double same_hash() const {
    const auto states = static_cast<double>(found_.result.graph.nodes.size());
    return found_.asked.explore.exact ? 0 : std::ldexp(states * states, -129);
  }

  const Findings& found_;
};

}  // namespace

std::string to_text(const Findings& findings) { return Telling(findings).text(); }

Value to_value(const Findings& findings, const campaign::Coverage& reached) { return Telling(findings).value(reached); }

}  // namespace sentree::cli
