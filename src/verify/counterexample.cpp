#include "sentree/verify/counterexample.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "sentree/project/intervention.h"
#include "sentree/text/json.h"
#include "sentree/verify/detail/period.h"
#include "sentree/verify/gates.h"

namespace sentree::verify {

namespace {

// What a fault's entry in the graph says it does: the one of the options that is written so.
std::optional<project::Intervention> fault_of(const ChoicePoint& point, const project::VerifySection& section) {
  for (const project::Intervention& what : section.faults) {
    if (to_json(Value(project::to_entry(what))) == point.value) return what;
  }
  return std::nullopt;
}

using Timeline = std::vector<project::Injection>;

// The entries `kept` of a timeline in which a fault that ends names the entry of the one that began: with the numbers
// that these have in a run. What the scenario itself does names its own by the numbers that they have without others.
Timeline with_numbers(const Timeline& timeline, const project::Scenario& scenario,
                      const std::vector<std::size_t>& kept) {
  const std::size_t own = scenario.timeline.size();
  std::vector<std::size_t> order = kept;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return timeline[a].at < timeline[b].at; });
  std::uint64_t last = scenario.delays.size();
  std::map<std::size_t, std::uint64_t> numbers;
  for (const std::size_t entry : order) {
    if (project::stands(timeline[entry].what)) numbers[entry] = ++last;
  }
  std::map<std::uint64_t, std::size_t> entries;  // of the scenario's own, by their numbers without others
  for (auto one = scenario.timeline.begin(); one != scenario.timeline.end(); ++one) {
    if (project::stands(one->what))
      entries[number_of(scenario, one)] = static_cast<std::size_t>(one - scenario.timeline.begin());
  }
  Timeline out;
  for (const std::size_t entry : kept) {
    out.push_back(timeline[entry]);
    auto* const clear = std::get_if<project::intervention::Clear>(&out.back().what);
    if (clear == nullptr || (entry < own && clear->id <= scenario.delays.size())) continue;
    if (entry >= own) {
      clear->id = numbers[clear->id];
    } else if (const auto found = entries.find(clear->id); found != entries.end()) {
      clear->id = numbers[found->second];
    } else {
      clear->id += numbers.size();  // nothing of its own, nor of the others
    }
  }
  return out;
}

// The other way round.
Timeline with_entries(Timeline timeline, const project::Scenario& scenario) {
  std::vector<std::size_t> order(timeline.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return timeline[a].at < timeline[b].at; });
  std::uint64_t last = scenario.delays.size();
  std::map<std::uint64_t, std::size_t> entries;
  for (const std::size_t entry : order) {
    if (project::stands(timeline[entry].what)) entries[++last] = entry;
  }
  std::copy(scenario.timeline.begin(), scenario.timeline.end(), timeline.begin());
  for (std::size_t entry = scenario.timeline.size(); entry < timeline.size(); ++entry) {
    if (auto* clear = std::get_if<project::intervention::Clear>(&timeline[entry].what)) clear->id = entries[clear->id];
  }
  return timeline;
}

// Whether that entry ends what the other one begins.
bool ends(const Timeline& timeline, std::size_t entry, std::size_t begun) {
  if (const auto* clear = std::get_if<project::intervention::Clear>(&timeline[entry].what)) return clear->id == begun;
  const auto* restart = std::get_if<project::intervention::Restart>(&timeline[entry].what);
  const auto* kill = std::get_if<project::intervention::Kill>(&timeline[begun].what);
  return restart != nullptr && kill != nullptr && entry > begun && restart->part == kill->part;
}

// Takes away faults with their ends, then ends alone.
void without_faults(project::Scenario& example, const project::Scenario& scenario,
                    const std::function<bool(const project::Scenario&)>& violates) {
  const Timeline all = with_entries(example.timeline, scenario);
  std::vector<std::size_t> kept(all.size());
  std::iota(kept.begin(), kept.end(), 0U);
  for (std::size_t entry = all.size(); entry-- > scenario.timeline.size();) {
    std::vector<std::size_t> fewer;
    for (const std::size_t one : kept) {
      if (one != entry && !(one >= scenario.timeline.size() && ends(all, one, entry))) fewer.push_back(one);
    }
    if (fewer.size() == kept.size()) continue;
    project::Scenario tried = example;
    tried.timeline = with_numbers(all, scenario, fewer);
    if (!violates(tried)) continue;
    example = std::move(tried);
    kept = std::move(fewer);
  }
}

}  // namespace

project::Scenario counterexample(const Graph& graph, const Judgement& judgement, const project::Scenario& scenario) {
  project::Scenario made = scenario;
  made.virtual_time = true;
  made.factor = 1.0;
  made.choices.emplace();
  made.orders.clear();
  made.expect_nothing();
  // What is shown may come behind another violation.
  made.stop_when_violated = false;
  std::erase_if(made.source.entries, [](const auto& entry) { return entry.first.scalar == "stop_when_violated"; });
  made.verdicts[judgement.requirement] =
      judgement.path->loop || judgement.state == "the mission ends" ? "owed" : "violated";
  std::map<std::string, std::uint64_t> numbers;
  std::map<std::string, std::size_t> standing;  // faults, by what they say: their entries in the timeline
  std::uint64_t orders = 0;
  const auto& [edges, loop] = *judgement.path;
  std::map<std::string, std::uint64_t> numbers_before;  // of the loop
  std::uint64_t orders_before = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (loop == i) {
      numbers_before = numbers;
      orders_before = orders;
    }
    const TimePoint tick_time = TimePoint{} + graph.period * static_cast<std::int64_t>(i);
    for (const Made& decision : graph.decisions[graph.edges[edges[i]].made]) {
      if (decision.kind == Made::Kind::kOrder) {
        ++orders;
        if (decision.alternative > 0)
          made.orders.push_back({.number = orders, .first = graph.parts[decision.what], .tick = i + 1, .span = {}});
        continue;
      }
      if (decision.kind == Made::Kind::kFault) {
        if (decision.alternative == 0) continue;
        const ChoicePoint& point = graph.choices[decision.what];
        auto what = fault_of(point, scenario.project.verify);
        if (!what) continue;
        if (point.function == "end of fault") {
          if (const auto* kill = std::get_if<project::intervention::Kill>(&*what))
            what = project::intervention::Restart{std::string(kill->part)};
          else
            what = project::intervention::Clear{standing[point.value]};  // a number later on
        } else {
          standing[point.value] = made.timeline.size();
        }
        made.timeline.push_back({.at = tick_time, .what = *what, .source = "scenario", .span = {}});
        continue;
      }
      const ChoicePoint& point = graph.choices[decision.what];
      const std::uint64_t number = ++numbers[point.model];
      if (decision.alternative == 0) continue;
      const auto value = text::parse_json(point.value);
      made.choices->push_back({.model = point.model,
                               .number = number,
                               .name = point.name,
                               .value = value ? *value : Value(),
                               .tick = i + 1,
                               .place = graph.places[decision.place],
                               .span = {}});
    }
  }
  std::vector<std::size_t> all(made.timeline.size());
  std::iota(all.begin(), all.end(), 0U);
  made.timeline = with_numbers(made.timeline, scenario, all);
  made.duration = graph.period * static_cast<std::int64_t>(edges.size());
  if (!loop) return made;
  made.duration += graph.period * static_cast<std::int64_t>((edges.size() - *loop) * (kLoopRounds - 1));
  made.loop.emplace();
  made.loop->ticks = {*loop + 1, edges.size()};
  for (const auto& [model, last] : numbers) {
    const std::uint64_t before = numbers_before[model];
    if (last > before) made.loop->choices[model] = {before + 1, last};
  }
  if (orders > orders_before) made.loop->orders = {orders_before + 1, orders};
  return made;
}

void simplify(project::Scenario& example, const project::Scenario& scenario,
              const std::function<bool(const project::Scenario&)>& violates) {
  // Each try is a run: a long list is left as it is.
  constexpr std::size_t kTriedMax = 200;
  if (example.choices->size() + example.orders.size() + example.timeline.size() > kTriedMax) return;
  const auto without = [&](auto& list) {
    for (std::size_t i = list.size(); i-- > 0;) {
      const auto taken = list[i];
      list.erase(list.begin() + static_cast<std::ptrdiff_t>(i));
      if (!violates(example)) list.insert(list.begin() + static_cast<std::ptrdiff_t>(i), taken);
    }
  };
  without(example.orders);
  without(*example.choices);
  without_faults(example, scenario, violates);
}

Result<std::vector<Told>> retell(const project::Plan& plan) {
  class Listener final : public mission::Surroundings {
   public:
    explicit Listener(const project::Plan& of) : plan(of), gates(of) {}
    void observed(const Message& message) override {
      gates.observed(message, message.time);
      told.back().messages.push_back(message);
    }
    std::optional<mission::Veto> judge(const Message& request) override { return gates.judge(request, request.time); }
    std::optional<std::uint64_t> choose(const mission::Choice& choice) override {
      Told::Choice one{.number = choice.number, .alternatives = {}, .count = choice.count};
      for (std::uint64_t i = 0; i < std::min(choice.count, kAlternativesToldMax); ++i)
        one.alternatives.push_back(to_json(choice.alternative(i)));
      told.back().choices.push_back(std::move(one));
      return mission::scripted(plan.scenario, choice).value_or(0);
    }
    std::size_t order(std::uint64_t number, std::span<const mission::Delivery* const> due) override {
      const auto index = mission::scripted(plan, number, due);
      for (const project::ScenarioOrder& order : plan.scenario.orders) {
        if (index && order.number == number) told.back().firsts.push_back({told.back().messages.size(), order.first});
      }
      return index.value_or(0);
    }
    const project::Plan& plan;
    Gates gates;
    std::vector<Told> told;
  };
  mission::VirtualHost host(plan);
  Listener listener(plan);
  mission::State state = host.begin();
  const TimePoint end = TimePoint{} + plan.scenario.duration;
  while (!mission::VirtualHost::ended(state) && (state.tree.over || state.tree.planned < end)) {
    listener.told.push_back({.tick = listener.told.size() + 1, .at = {}, .messages = {}, .choices = {}, .firsts = {}});
    const auto done = period(host, state, listener, [] { return Result<void>(); });
    if (!done) return tl::unexpected(done.error());
    listener.told.back().at = state.now;
  }
  return std::move(listener.told);
}

}  // namespace sentree::verify
