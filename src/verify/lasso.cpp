#include "sentree/verify/detail/lasso.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

namespace sentree::verify {

namespace {

using Fair = std::set<std::uint32_t>;  // choices, by their place in a list of what they are called

// With a name "MODEL.NAME", wherever it stands; else "MODEL at FILE:LINE". Empty: a fault.
std::string called(const ChoicePoint& choice) {
  if (choice.model.empty()) return {};
  return choice.name.empty() ? fmt::format("{} at {}", choice.model, choice.place)
                             : fmt::format("{}.{}", choice.model, choice.name);
}

class Lassos {
 public:
  Lassos(const Graph& graph, const Branching& branching, const std::vector<Step>& steps, const Places& owing,
         const Allowed& goes_on)
      : graph_(graph), of_(branching), steps_(steps), owing_(owing), goes_on_(goes_on), components_(branching) {
    std::map<std::string, std::uint32_t> known;
    for (const ChoicePoint& choice : graph.choices) {
      const std::string name = called(choice);
      const auto next = static_cast<std::uint32_t>(names_.size());
      choice_of_.push_back(name.empty() ? kNone : known.try_emplace(name, next).first->second);
      if (choice_of_.back() == next) names_.push_back(name);
    }
    for (const std::uint32_t at : owing_) {
      if (of_.places[at].drawn) continue;
      each_arc(at, [&](std::uint32_t arc) {
        if (choice_of(arc) != kNone) all_.insert(choice_of(arc));
      });
    }
  }

  Owing operator()(const JudgeOptions& options) {
    Owing out;
    Fair fair = all_;
    if (!options.all_fair) {
      std::erase_if(fair, [&](std::uint32_t choice) {
        return std::find(options.fair.begin(), options.fair.end(), names_[choice]) == options.fair.end();
      });
    }
    const Places found = fair_component(fair);
    if (found.empty()) {
      for (const std::uint32_t choice : needed_of(std::move(fair))) out.fair.push_back(names_[choice]);
      std::sort(out.fair.begin(), out.fair.end());
      return out;
    }
    out.loop = round(found, fair);
    if (fair != all_ && fair_component(all_).empty()) {
      const Fair needed = needed_of(all_, fair);
      for (const std::uint32_t choice : needed) {
        if (fair.contains(choice)) continue;
        Fair others = needed;
        others.erase(choice);
        avoid(fair_component(others), choice, out.avoided);
      }
    }
    return out;
  }

 private:
  template <class Do>
  void each_arc(std::uint32_t at, const Do& what) const {
    const Branching::Place& place = of_.places[at];
    for (std::uint32_t arc = place.first; arc < place.first + place.count; ++arc) what(arc);
  }
  [[nodiscard]] std::uint32_t choice_of(std::uint32_t arc) const {
    const std::uint32_t what = of_.arcs[arc].what;
    return what == Branching::kNone ? kNone : choice_of_[what];
  }
  [[nodiscard]] bool is_fair(std::uint32_t arc, const Fair& fair) const {
    return choice_of(arc) != kNone && fair.contains(choice_of(arc));
  }

  // Of which no choice can be left out without a loop.
  Fair needed_of(Fair fair, const Fair& kept = {}) {
    for (const std::uint32_t choice : Fair(fair)) {
      if (kept.contains(choice)) continue;
      Fair others = fair;
      others.erase(choice);
      if (fair_component(others).empty()) fair = std::move(others);
    }
    return fair;
  }

  // Places of a loop on which what is fair is taken; empty: there is none.
  Places fair_component(const Fair& fair) {
    const auto found =
        components_.without(owing_, goes_on_, [&](const Places& component, const std::vector<bool>& inside) {
          std::set<std::uint32_t> taken;
          std::map<std::uint32_t, Places> offered;  // alternative: at which places
          Places bad;
          for (const std::uint32_t at : component) {
            if (components_.draws_away(at, goes_on_, inside)) bad.push_back(at);
            if (of_.places[at].drawn) continue;
            each_arc(at, [&](std::uint32_t arc) {
              if (!is_fair(arc, fair)) return;
              offered[of_.arcs[arc].what].push_back(at);
              if (goes_on_[arc] && inside[of_.arcs[arc].to]) taken.insert(of_.arcs[arc].what);
            });
          }
          for (const auto& [what, places] : offered) {
            if (!taken.contains(what)) bad.insert(bad.end(), places.begin(), places.end());
          }
          return bad;
        });
    return found.empty() ? Places() : *std::min_element(found.begin(), found.end(), [](const auto& a, const auto& b) {
      return *std::min_element(a.begin(), a.end()) < *std::min_element(b.begin(), b.end());
    });
  }

  // Tells alternatives of a choice that are offered in a component, and lead away from it.
  void avoid(const Places& component, std::uint32_t choice, std::vector<std::string>& told) const {
    const std::set<std::uint32_t> inside(component.begin(), component.end());
    std::set<std::string> offered;
    std::set<std::string> taken;
    std::string place;
    for (const std::uint32_t at : component) {
      each_arc(at, [&](std::uint32_t arc) {
        if (choice_of(arc) != choice) return;
        const ChoicePoint& point = graph_.choices[of_.arcs[arc].what];
        const std::string name = point.name.empty() ? point.model : names_[choice];
        offered.insert(fmt::format("{} = {}", name, point.value));
        if (goes_on_[arc] && inside.contains(of_.arcs[arc].to)) taken.insert(fmt::format("{} = {}", name, point.value));
        if (point.name.empty()) place = " at " + point.place;
      });
    }
    for (const std::string& one : offered) {
      if (!taken.contains(one)) told.push_back(one + place);
    }
  }

  // A shortest way from a place to an arc that is the last one, by arcs inside.
  std::vector<std::uint32_t> way(std::uint32_t from, const std::vector<bool>& inside,
                                 const std::function<bool(std::uint32_t arc)>& is_last) const {
    std::unordered_map<std::uint32_t, std::pair<std::uint32_t, std::uint32_t>> by;  // place: from where, by which arc
    std::deque<std::uint32_t> queue{from};
    while (!queue.empty()) {
      const std::uint32_t at = queue.front();
      queue.pop_front();
      std::vector<std::uint32_t> arcs;
      each_arc(at, [&](std::uint32_t arc) {
        const std::uint32_t to = of_.arcs[arc].to;
        if (!arcs.empty() || !goes_on_[arc] || !inside[to]) return;
        if (is_last(arc)) {
          arcs.push_back(arc);
        } else if (to != from && by.try_emplace(to, at, arc).second) {
          queue.push_back(to);
        }
      });
      if (arcs.empty()) continue;
      for (std::uint32_t back = at; back != from; back = by.at(back).first) arcs.push_back(by.at(back).second);
      std::reverse(arcs.begin(), arcs.end());
      return arcs;
    }
    return {};
  }

  // Ticks that a way takes.
  [[nodiscard]] std::size_t ticks_of(const std::vector<std::uint32_t>& arcs) const {
    return static_cast<std::size_t>(std::count_if(
        arcs.begin(), arcs.end(), [&](std::uint32_t arc) { return of_.arcs[arc].step != Branching::kNone; }));
  }

  // In how many ticks each place is reached.
  [[nodiscard]] std::vector<std::uint32_t> depths() const {
    std::vector<std::uint32_t> depths(of_.places.size(), kNone);
    std::deque<std::uint32_t> queue{0};
    depths[0] = 0;
    while (!queue.empty()) {
      const std::uint32_t at = queue.front();
      queue.pop_front();
      each_arc(at, [&](std::uint32_t arc) {
        const bool takes_a_tick = of_.arcs[arc].step != Branching::kNone;
        const std::uint32_t to = of_.arcs[arc].to;
        if (depths[to] <= depths[at] + (takes_a_tick ? 1 : 0)) return;
        depths[to] = depths[at] + (takes_a_tick ? 1 : 0);
        takes_a_tick ? queue.push_back(to) : queue.push_front(to);
      });
    }
    return depths;
  }

  // The pair with which the fewest ticks begin, of the way there and once round; of the first ones of a great
  // component.
  std::uint32_t first_of_shortest(Places component, const std::vector<bool>& inside) const {
    constexpr std::size_t kTriedMax = 1000;
    const std::vector<std::uint32_t> depth = depths();
    std::erase_if(component, [&](std::uint32_t at) { return of_.places[at].pair != at; });
    std::sort(component.begin(), component.end());
    if (component.size() > kTriedMax) component.resize(kTriedMax);
    std::uint32_t best = component.front();
    std::size_t fewest = SIZE_MAX;
    for (const std::uint32_t begin : component) {
      if (depth[begin] >= fewest) continue;
      const std::size_t ticks =
          depth[begin] + ticks_of(way(begin, inside, [&](std::uint32_t arc) { return of_.arcs[arc].to == begin; }));
      if (ticks >= fewest) continue;
      fewest = ticks;
      best = begin;
    }
    return best;
  }

  // Once round, through an arc for each alternative that is fair or drawn there.
  Lasso round(const Places& component, const Fair& fair) const {
    std::vector<bool> inside(of_.places.size());
    std::set<std::uint32_t> owed;
    for (const std::uint32_t at : component) inside[at] = true;
    const auto counts = [&](std::uint32_t from, std::uint32_t arc) {
      return of_.places[from].drawn ? of_.arcs[arc].what != Branching::kNone : is_fair(arc, fair);
    };
    std::vector<std::uint32_t> source(of_.arcs.size());
    for (const std::uint32_t at : component) {
      each_arc(at, [&](std::uint32_t arc) {
        source[arc] = at;
        if (goes_on_[arc] && inside[of_.arcs[arc].to] && counts(at, arc)) owed.insert(of_.arcs[arc].what);
      });
    }
    Lasso out{.begin = *std::min_element(component.begin(), component.end()), .edges = {}};  // reached first: a pair
    if (owed.empty()) out.begin = first_of_shortest(component, inside);
    std::uint32_t at = out.begin;
    const auto go = [&](const std::function<bool(std::uint32_t)>& is_last) {
      const auto arcs = way(at, inside, is_last);
      for (const std::uint32_t arc : arcs) {
        if (of_.arcs[arc].step != Branching::kNone) out.edges.push_back(steps_[of_.arcs[arc].step].edge);
        if (counts(source[arc], arc)) owed.erase(of_.arcs[arc].what);
        at = of_.arcs[arc].to;
      }
    };
    while (!owed.empty()) {
      const std::uint32_t what = *owed.begin();
      go([&](std::uint32_t arc) { return of_.arcs[arc].what == what; });
      owed.erase(what);
    }
    if (at != out.begin || out.edges.empty()) go([&](std::uint32_t arc) { return of_.arcs[arc].to == out.begin; });
    return out;
  }

  const Graph& graph_;
  const Branching& of_;
  const std::vector<Step>& steps_;
  const Places& owing_;
  const Allowed& goes_on_;
  Components components_;
  static constexpr std::uint32_t kNone = UINT32_MAX;
  std::vector<std::string> names_;        // of choices
  std::vector<std::uint32_t> choice_of_;  // by alternative, as in the graph; kNone: a fault
  Fair all_;                              // that are offered where something is owed
};

}  // namespace

Owing owing_for_ever(const Graph& graph, const Branching& branching, const std::vector<Step>& steps,
                     const Places& owing, const Allowed& goes_on, const JudgeOptions& options) {
  return Lassos(graph, branching, steps, owing, goes_on)(options);
}

}  // namespace sentree::verify
