#include "sentree/project/loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "sentree/project/project.h"
#include "sentree/project/yaml_reader.h"

namespace sentree::project {

namespace {

std::uint64_t in_first_round(const ScenarioLoop::Range& of, std::uint64_t number) {
  return number <= of.last ? number : of.first + (number - of.first) % (of.last - of.first + 1);
}

bool is_in(const ScenarioLoop::Range& of, std::uint64_t number) { return number >= of.first && number <= of.last; }

// [FIRST, LAST]
std::optional<ScenarioLoop::Range> read_range(const text::YamlNode& node) {
  if (node.kind != text::YamlNode::Kind::kSequence || node.items.size() != 2) return std::nullopt;
  const auto whole = [](const text::YamlNode& item) -> std::optional<std::uint64_t> {
    const auto number = item.number();
    constexpr double kMost = 1e15;
    if (!number || !(*number >= 1 && *number <= kMost) ||
        *number != static_cast<double>(static_cast<std::uint64_t>(*number)))
      return std::nullopt;
    return static_cast<std::uint64_t>(*number);
  };
  const auto first = whole(node.items[0]);
  const auto last = whole(node.items[1]);
  if (!first || !last || *last < *first) return std::nullopt;
  return ScenarioLoop::Range{*first, *last};
}

// When the tick of a number is.
TimePoint tick_time(const Scenario& scenario, std::uint64_t tick) {
  return TimePoint{} + scenario.project.period * static_cast<std::int64_t>(tick - 1);
}

Duration length_of(const Scenario& scenario) {
  const ScenarioLoop::Range& ticks = scenario.loop->ticks;
  return scenario.project.period * static_cast<std::int64_t>(ticks.last - ticks.first + 1);
}

// What is behind the tick before the loop belongs to it.
bool is_before(const Scenario& scenario, const Injection& injection) {
  return scenario.loop->ticks.first > 1 && injection.at <= tick_time(scenario, scenario.loop->ticks.first - 1);
}

// What stands, by what it says, under which number.
class Standing {
 public:
  explicit Standing(const Scenario& scenario) {
    for (const DelayFault& delay : scenario.delays) put(intervention::Delay{.message = delay.message, .by = delay.by});
  }
  void put(const Intervention& what) {
    if (!stands(what)) return;
    says_.push_back(to_json(Value(to_entry(what))));
    last_[says_.back()] = says_.size();
  }
  // The latest that says what that of the number says.
  [[nodiscard]] std::uint64_t like(std::uint64_t number) const {
    return number >= 1 && number <= says_.size() ? last_.at(says_[number - 1]) : number;
  }

 private:
  std::vector<std::string> says_;  // by number
  std::map<std::string, std::uint64_t> last_;
};

}  // namespace

std::uint64_t ScenarioLoop::choice(const std::string& model, std::uint64_t number) const {
  const auto range = choices.find(model);
  return range == choices.end() ? number : in_first_round(range->second, number);
}

std::uint64_t ScenarioLoop::order(std::uint64_t number) const {
  return orders ? in_first_round(*orders, number) : number;
}

void read_loop(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics) {
  YamlReader reader(node, "loop", diagnostics);
  ScenarioLoop loop{.ticks = {}, .choices = {}, .orders = {}, .span = node.span};
  const auto from = reader.integer("from");
  const auto to = reader.integer("to");
  const text::YamlNode* const choices = reader.mapping("choices");
  const text::YamlNode* const orders = reader.node("orders");
  // Times of ticks are counted in nanoseconds.
  constexpr std::chrono::hours kLongest{24 * 365 * 100};
  if (!from || !to || *from < 1 || *to < *from || *to > kLongest / scenario.project.period) {
    reader.error(node.span, "scenario.loop",
                 "loop needs \"from\" and \"to\": its first and its last tick, from 1, the last not before the first");
    return;
  }
  loop.ticks = {static_cast<std::uint64_t>(*from), static_cast<std::uint64_t>(*to)};
  const auto range = [&](const text::YamlNode& of, const std::string& what) {
    const auto read = read_range(of);
    if (!read)
      reader.error(of.span, "scenario.loop",
                   fmt::format("{} of a loop are [FIRST, LAST]: the numbers of those in its first round", what));
    return read;
  };
  if (choices != nullptr) {
    std::vector<std::string> names;
    for (const ModelEntry& model : scenario.project.models) names.push_back(model.name);
    for (const auto& [name, numbers] : choices->entries) {
      if (std::find(names.begin(), names.end(), name.scalar) == names.end())
        reader.error(name.span, "scenario.loop",
                     fmt::format("the project has no model \"{}\"{}", name.scalar, did_you_mean(name.scalar, names)));
      if (const auto read = range(numbers, "choices")) loop.choices[name.scalar] = *read;
    }
  }
  if (orders != nullptr) loop.orders = range(*orders, "orders");
  scenario.loop = std::move(loop);
  for (const Injection& injection : scenario.timeline) {
    if (injection.at <= tick_time(scenario, scenario.loop->ticks.last)) continue;
    reader.error(injection.span, "scenario.loop",
                 fmt::format("this is behind the last tick of the loop, {}, and so never comes", *to));
  }
}

Result<void> unroll(Scenario& scenario) {
  std::erase_if(scenario.timeline, [](const Injection& injection) { return injection.again; });
  if (!scenario.loop) return {};
  // As they come, in which order they are numbered.
  std::vector<Injection> timeline = scenario.timeline;
  std::stable_sort(timeline.begin(), timeline.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  std::vector<Injection> round;
  Standing standing(scenario);
  for (const Injection& injection : timeline) {
    standing.put(injection.what);
    if (!is_before(scenario, injection)) round.push_back(injection);
  }
  const TimePoint end = TimePoint{} + scenario.duration;
  const Duration length = length_of(scenario);
  for (Duration shift = length; !round.empty() && round.front().at + shift <= end; shift += length) {
    for (Injection again : round) {
      again.at += shift;
      if (again.at > end) break;
      if (scenario.timeline.size() >= kLoopInjectionsMax)
        return fail("scenario.loop",
                    fmt::format("the loop's timeline has more than {} entries until the run ends; let "
                                "its duration be shorter",
                                kLoopInjectionsMax),
                    scenario.loop->span);
      again.again = true;
      if (auto* clear = std::get_if<intervention::Clear>(&again.what)) clear->id = standing.like(clear->id);
      standing.put(again.what);
      scenario.timeline.push_back(std::move(again));
    }
  }
  return {};
}

void write_out(Scenario& scenario) {
  if (!scenario.loop) return;
  const ScenarioLoop loop = *scenario.loop;
  const std::uint64_t ticks = loop.ticks.last - loop.ticks.first + 1;
  const Duration left = TimePoint{} + scenario.duration - tick_time(scenario, loop.ticks.first);
  const auto all =
      static_cast<std::uint64_t>(std::clamp<std::int64_t>(left / length_of(scenario) + 1, 1, kLoopRoundsMax));
  const auto again = [&](auto& list, const auto& range_of) {
    const auto first = list;
    const std::uint64_t rounds = std::min(all, kLoopEntriesMax / (first.size() + 1) + 1);
    for (std::uint64_t round = 1; round < rounds; ++round) {
      for (auto one : first) {
        const ScenarioLoop::Range* const range = range_of(one);
        if (range == nullptr || !is_in(*range, one.number)) continue;
        one.number += round * (range->last - range->first + 1);
        if (one.tick > 0) one.tick += round * ticks;
        one.span = {};  // it stands nowhere
        list.push_back(std::move(one));
      }
    }
  };
  if (scenario.choices) {
    again(*scenario.choices, [&](const ScenarioChoice& one) {
      const auto range = loop.choices.find(one.model);
      return range == loop.choices.end() ? nullptr : &range->second;
    });
  }
  again(scenario.orders, [&](const ScenarioOrder&) { return loop.orders ? &*loop.orders : nullptr; });
  (void)unroll(scenario);  // as far as it goes
  for (Injection& injection : scenario.timeline) injection.again = false;
  scenario.loop.reset();
}

}  // namespace sentree::project
