#include "sentree/verify/counterexample.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "sentree/project/intervention.h"
#include "sentree/text/json.h"
#include "sentree/verify/gates.h"
#include "sentree/verify/period.h"

namespace sentree::verify {

namespace {

// What a fault's entry in the graph says it does: the one of the options that is written so.
std::optional<project::Intervention> fault_of(const ChoicePoint& point, const project::VerifySection& section) {
  for (const project::Intervention& what : section.faults) {
    if (to_json(Value(project::to_entry(what))) == point.value) return what;
  }
  return std::nullopt;
}

}  // namespace

project::Scenario counterexample(const Graph& graph, const Judgement& judgement, const project::Scenario& scenario) {
  project::Scenario made = scenario;
  made.virtual_time = true;
  made.factor = 1.0;
  made.choices.emplace();
  made.expect_nothing();
  made.verdicts[judgement.requirement] =
      judgement.path->loop || judgement.state == "the mission ends" ? "owed" : "violated";
  std::map<std::string, std::uint64_t> numbers;
  std::map<std::string, std::uint64_t> standing;  // faults, by what they say
  std::uint64_t last_id = 0;
  const auto stands_now = [&](const project::Intervention& what) {
    if (project::stands(what)) standing[to_json(Value(project::to_entry(what)))] = ++last_id;
  };
  // What the scenario does itself has numbers too.
  for (const project::DelayFault& delay : scenario.delays)
    stands_now(project::intervention::Delay{.message = delay.message, .by = delay.by});
  auto own = scenario.timeline.begin();
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
    for (; own != scenario.timeline.end() && own->at <= tick_time; ++own) stands_now(own->what);
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
            what = project::intervention::Clear{standing[point.value]};
        } else {
          stands_now(*what);
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

void simplify(project::Scenario& example, const std::function<bool(const project::Scenario&)>& violates) {
  // Each try is a run: a long list is left as it is.
  constexpr std::size_t kTriedMax = 200;
  if (example.choices->size() + example.orders.size() > kTriedMax) return;
  const auto without = [&](auto& list) {
    for (std::size_t i = list.size(); i-- > 0;) {
      const auto taken = list[i];
      list.erase(list.begin() + static_cast<std::ptrdiff_t>(i));
      if (!violates(example)) list.insert(list.begin() + static_cast<std::ptrdiff_t>(i), taken);
    }
  };
  without(example.orders);
  without(*example.choices);
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
      return mission::scripted(plan, number, due).value_or(0);
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
    listener.told.push_back({.tick = listener.told.size() + 1, .at = {}, .messages = {}, .choices = {}});
    const auto done = period(host, state, listener, [] { return Result<void>(); });
    if (!done) return tl::unexpected(done.error());
    listener.told.back().at = state.now;
  }
  return std::move(listener.told);
}

}  // namespace sentree::verify
