#include "sentree/cli/verify_findings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <utility>

#include "sentree/base/shown.h"
#include "sentree/cli/verify_result.h"
#include "sentree/project/any_reply.h"
#include "sentree/project/cpp_nodes.h"
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
      const bool is_any = std::any_of(found_.any.begin(), found_.any.end(), [&](const auto& m) {
        return project::kAnyReplyPrefix + m.service == model.name;
      });
      models += (models.empty() ? "" : ", ") + (is_any ? serves : model.name) +
                (is_any           ? ": any reply"
                 : serves.empty() ? " (serves nothing)"
                                  : fmt::format(" ({})", serves));
    }
    std::string out = fmt::format("models      {}   {}\n", models.empty() ? "none" : models, basis());
    if (const std::string nodes = project::shown_cpp_nodes(found_.plan); !nodes.empty())
      out += fmt::format("in C++      {}, taken to look at nothing but their ports and what they keep{}\n", nodes,
                         graph.times_apart ? "; one asks for the time, so that no state comes again" : "");
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
      for (const auto* all : {&found_.shown, &found_.open}) {
        if (const auto shown = all->find(judgement.requirement); shown != all->end()) out += shown->second.story;
      }
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
    Map out = verify_result(found_.command, found_.plan, found_.any, found_.asked.explore.faults);
    List requirements;
    for (const auto& judgement : found_.result.judgements) requirements.emplace_back(value_of(judgement));
    out["requirements"] = std::move(requirements);
    out["states"] = static_cast<std::int64_t>(graph.nodes.size());
    out["transitions"] = static_cast<std::int64_t>(graph.edges.size());
    out["complete"] = graph.complete;
    out["orders_left_out"] = graph.reduced;
    out["coverage"] =
        Map{{"not_reached", to_list(found_.result.not_reached)},
            {"kinds", *studio::coverage_value(reached, found_.plan.scenario.project.folder).find("kinds")}};
    out["problems"] = to_list(graph.problems);
    Map& limits = *out["limits"].as_map();
    if (!graph.complete) limits["complete_to_tick"] = static_cast<std::int64_t>(graph.complete_to);
    if (graph.faultless_from != UINT32_MAX) {
      limits["without_faults"] =
          Map{{"complete", graph.faultless_complete}, {"to_tick", static_cast<std::int64_t>(graph.faultless_to)}};
    }
    limits["same_hash"] = same_hash();
    if (!graph.limit.empty()) limits["ended_by"] = graph.limit;
    if (!graph.grows.empty()) limits["most_values"] = graph.grows;
    for (const verify::Untried& one : found_.asked.untried)
      limits["not_tried"].as_list()->emplace_back(to_string(one.told));
    out["wall_s"] = found_.result.explored_s;
    return out;
  }

 private:
  // How far a limit let go on what no fault has touched; empty: no further.
  std::string faultless(const char* all, const char* part) const {
    const verify::Graph& graph = found_.result.graph;
    if (graph.faultless_from == UINT32_MAX) return {};
    if (graph.faultless_complete) return all;
    return graph.faultless_to > graph.complete_to ? fmt::format(fmt::runtime(part), graph.faultless_to) : std::string();
  }

  std::string how_far() const {
    const verify::Graph& graph = found_.result.graph;
    if (graph.complete) return "complete";
    if (graph.limit.empty()) return "not complete";
    return fmt::format("up to tick {}: {}{}", graph.complete_to, graph.limit,
                       faultless(", without faults all of it", ", without faults up to tick {}"));
  }

  std::string basis() const {
    std::string text =
        found_.asked.explore.faults.empty()
            ? "no faults"
            : fmt::format("{} fault{}, {} at a time", found_.asked.explore.faults.size(),
                          found_.asked.explore.faults.size() == 1 ? "" : "s", found_.asked.explore.faults_at_most);
    return text + (found_.asked.explore.order == verify::Order::kAny ? ", any order at one instant"
                                                                     : ", order of virtual time");
  }

  Map value_of(const verify::Judgement& judgement) const {
    Map one = requirement_result(judgement.requirement, to_string(judgement.finding));
    one["vacuous"] = !judgement.vacuous.empty();
    if (!judgement.vacuous.empty()) one["vacuous_because"] = judgement.vacuous;
    one["complete"] = found_.result.graph.complete && judgement.limit.empty();
    one["states"] = static_cast<std::int64_t>(judgement.states);
    one["fair"] = to_list(judgement.fair);
    one["holds_if_fair"] = to_list(judgement.avoided);
    one["can_stay_open"] = can_stay_open(judgement);
    one["never_seen"] = to_list(judgement.never_seen);
    if (judgement.path) {
      one["first_violation"] =
          Map{{"tick", static_cast<std::int64_t>(tick_of(*judgement.path))},
              {"time", seconds(judgement.at)},
              {"observation", judgement.observation.empty() ? Value() : Value(judgement.observation)}};
      one["counterexample"] = value_of(found_.shown.at(judgement.requirement), judgement);
    }
    if (judgement.least) {
      const auto bounds = [](const verify::Judgement::Probability& p) { return Map{{"low", p.low}, {"high", p.high}}; };
      Map probability = probability_result(judgement.least->low, judgement.greatest->high, "interval iteration", 1.0);
      probability["least"] = bounds(*judgement.least);
      probability["greatest"] = bounds(*judgement.greatest);
      one["probability"] = std::move(probability);
    }
    if (!judgement.limit.empty()) one["undecided_because"] = judgement.limit;
    if (!judgement.error.empty()) one["error"] = judgement.error;
    return one;
  }

  // Members of what is shown of a judgement.
  Map value_of(const ShownCounterexample& shown, const verify::Judgement& judgement) const {
    Map out{{"scenario", shown.scenario},
            {"recording", shown.recording},
            {"choices", static_cast<std::int64_t>(shown.choices)},
            {"chosen", chosen_value(chosen(shown, judgement))},
            {"orders", static_cast<std::int64_t>(shown.orders)},
            {"loop", Value()}};
    if (judgement.path->loop) {
      out["loop"] = Map{{"from", static_cast<std::int64_t>(tick_of(*judgement.path))},
                        {"ticks", static_cast<std::int64_t>(shown.loop_ticks)}};
    }
    return out;
  }

  Value can_stay_open(const verify::Judgement& judgement) const {
    if (!judgement.can_stay_open) return {};
    const verify::Judgement open = left_open(judgement);
    const auto shown = found_.open.find(judgement.requirement);
    Map out{{"tick", static_cast<std::int64_t>(tick_of(*open.path))}, {"time", seconds(open.at)}};
    for (auto& [name, value] : value_of(shown == found_.open.end() ? ShownCounterexample() : shown->second, open))
      out[name] = value;
    if (shown == found_.open.end()) out["scenario"] = out["recording"] = Value();
    return out;
  }

  // What models chose in one place, or which faults came, on a path.
  struct Chosen {
    std::string name;
    std::string place;
    std::vector<std::string> values;  // as JSON; what faults do in words
    std::size_t times = 0;
  };

  // In the order of their first, faults before the choices of their tick; of faults those that the scenario still has.
  std::vector<Chosen> chosen(const ShownCounterexample& shown, const verify::Judgement& judgement) const {
    std::vector<Chosen> all;
    const auto add = [&](const std::string& name, const std::string& place, const std::string& value) {
      auto one = std::find_if(all.begin(), all.end(),
                              [&](const Chosen& known) { return known.name == name && known.place == place; });
      if (one == all.end()) one = all.insert(all.end(), {name, place, {}, 0});
      ++one->times;
      if (std::find(one->values.begin(), one->values.end(), value) == one->values.end()) one->values.push_back(value);
    };
    const verify::Path& path = *judgement.path;
    const verify::Graph& graph = found_.result.graph;
    std::map<std::string, std::size_t> faults = shown.faults;
    auto choice = shown.chosen.begin();
    for (std::size_t i = 0; i < path.edges.size(); ++i) {
      for (const verify::Made& made : graph.decisions[graph.edges[path.edges[i]].made]) {
        // Just before its tick, which may be behind what violates it.
        const bool is_late = !path.loop && TimePoint{} + graph.period * static_cast<std::int64_t>(i) > judgement.at;
        if (made.kind != verify::Made::Kind::kFault || made.alternative == 0 || is_late) continue;
        const verify::ChoicePoint& point = graph.choices[made.what];
        if (point.function == "fault" && !path.loop && faults[point.name]-- == 0) {
          faults[point.name] = 0;
          continue;
        }
        add(point.function, "", point.name);
      }
      for (; choice != shown.chosen.end() && choice->tick == i + 1; ++choice)
        add(choice->name, choice->place, choice->value);
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

  static List chosen_value(const std::vector<Chosen>& all) {
    List out;
    for (const Chosen& one : all) {
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
        out += fmt::format(": from here {} tick{} can come again for ever", shown.loop_ticks,
                           shown.loop_ticks == 1 ? "" : "s");
      else if (judgement.state == "the mission ends")
        out += ": the mission ends, and it is still owed";
      else
        out += judgement.observation.empty() ? ": time passed" : ": " + judgement.observation;
      out += fmt::format("   {} .mcap", shown.scenario);
      if (const std::string what = text_of(chosen(shown, judgement)); !what.empty()) out += "\n  chosen: " + what;
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
      out = judgement.limit.empty()
                ? fmt::format("not refuted up to tick {}{}", found_.result.graph.complete_to,
                              faultless(", nor without faults", ", nor without faults up to tick {}"))
                : "not decided: " + judgement.limit;
    }
    if (!judgement.fair.empty() && judgement.finding == verify::Finding::kHolds)
      out += fmt::format(" (if fair: {})", few(judgement.fair));
    if (judgement.can_stay_open) out += told_open(judgement);
    if (judgement.least)
      out += "\n  violated with probability " + verify::to_string(*judgement.least, *judgement.greatest);
    else if (judgement.improbable_states && judgement.finding == verify::Finding::kRefuted)
      out += fmt::format("\n  with what probability was not worked out, of more than {} states; --runs estimates it",
                         *judgement.improbable_states);
    return out;
  }

  std::string told_open(const verify::Judgement& judgement) const {
    const verify::Judgement open = left_open(judgement);
    std::string out = fmt::format("\n  can stay open when the mission ends, at tick {} ({} s)", tick_of(*open.path),
                                  shortest_decimal(seconds(open.at)));
    const auto shown = found_.open.find(judgement.requirement);
    if (shown == found_.open.end()) return out;
    out += fmt::format("   {} .mcap", shown->second.scenario);
    if (const std::string what = text_of(chosen(shown->second, open)); !what.empty()) out += "\n  chosen: " + what;
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
