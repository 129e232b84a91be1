#include "sentree/verify/lasso.h"

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

using Names = std::set<std::string>;  // "MODEL.NAME"

class Lassos {
 public:
  Lassos(const Graph& graph, const Branching& branching, const std::vector<Step>& steps, const Places& owing,
         const Allowed& goes_on)
      : graph_(graph), of_(branching), steps_(steps), owing_(owing), goes_on_(goes_on), components_(branching) {
    for (const ChoicePoint& choice : graph.choices)
      names_.push_back(choice.name.empty() || choice.model.empty() ? ""
                                                                   : fmt::format("{}.{}", choice.model, choice.name));
    for (const std::uint32_t at : owing_) {
      if (of_.places[at].drawn) continue;
      each_arc(at, [&](std::uint32_t arc) {
        if (is_named(arc)) all_.insert(names_[of_.arcs[arc].what]);
      });
    }
  }

  Owing operator()(const JudgeOptions& options) {
    Owing out;
    Names fair = options.all_fair ? all_ : Names(options.fair.begin(), options.fair.end());
    std::erase_if(fair, [&](const std::string& name) { return !all_.contains(name); });
    const Places found = fair_component(fair);
    if (found.empty()) {
      const Names needed = needed_of(std::move(fair));
      out.fair.assign(needed.begin(), needed.end());
      return out;
    }
    out.loop = round(found, fair);
    if (fair != all_ && fair_component(all_).empty()) {
      const Names needed = needed_of(all_);
      for (const std::string& name : needed) {
        Names others = needed;
        others.erase(name);
        for (const std::string& value : avoided_in(fair_component(others), name))
          out.avoided.push_back(fmt::format("{} = {}", name, value));
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
  [[nodiscard]] bool is_named(std::uint32_t arc) const {
    const std::uint32_t what = of_.arcs[arc].what;
    return what != Branching::kNone && !names_[what].empty();
  }
  [[nodiscard]] bool is_fair(std::uint32_t arc, const Names& fair) const {
    return is_named(arc) && fair.contains(names_[of_.arcs[arc].what]);
  }

  // Of which no choice can be left out without a loop.
  Names needed_of(Names fair) {
    for (const std::string& name : Names(fair)) {
      Names others = fair;
      others.erase(name);
      if (fair_component(others).empty()) fair = std::move(others);
    }
    return fair;
  }

  // Places of a loop on which what is fair is taken; empty: there is none.
  Places fair_component(const Names& fair) {
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

  // Alternatives of a choice that are offered in a component, and lead away from it.
  std::set<std::string> avoided_in(const Places& component, const std::string& name) const {
    const std::set<std::uint32_t> inside(component.begin(), component.end());
    std::set<std::string> offered;
    std::set<std::string> taken;
    for (const std::uint32_t at : component) {
      each_arc(at, [&](std::uint32_t arc) {
        if (!is_named(arc) || names_[of_.arcs[arc].what] != name) return;
        const std::string& value = graph_.choices[of_.arcs[arc].what].value;
        offered.insert(value);
        if (goes_on_[arc] && inside.contains(of_.arcs[arc].to)) taken.insert(value);
      });
    }
    std::erase_if(offered, [&](const std::string& value) { return taken.contains(value); });
    return offered;
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

  // Once round, through an arc for each alternative that is fair or drawn there.
  Lasso round(const Places& component, const Names& fair) const {
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
  std::vector<std::string> names_;  // of choices; empty: it has none
  Names all_;                       // that are offered where something is owed
};

}  // namespace

Owing owing_for_ever(const Graph& graph, const Branching& branching, const std::vector<Step>& steps,
                     const Places& owing, const Allowed& goes_on, const JudgeOptions& options) {
  return Lassos(graph, branching, steps, owing, goes_on)(options);
}

}  // namespace sentree::verify
