#include "sentree/verify/detail/branching.h"

#include <algorithm>
#include <deque>
#include <span>
#include <utility>

namespace sentree::verify {

Branching branching(const Graph& graph, std::size_t pairs, const std::vector<Step>& steps) {
  Branching out;
  out.places.resize(pairs);
  for (std::uint32_t pair = 0; pair < pairs; ++pair) out.places[pair].pair = pair;
  const auto made_of = [&](std::uint32_t step) -> const std::vector<Made>& {
    return graph.decisions[graph.edges[steps[step].edge].made];
  };
  struct Open {
    std::uint32_t place;
    std::uint32_t begin;
    std::uint32_t end;
    std::size_t depth;
  };
  std::deque<Open> open;
  for (std::uint32_t begin = 0, end = 0; begin < steps.size(); begin = end) {
    for (end = begin + 1; end < steps.size() && steps[end].from == steps[begin].from;) ++end;
    open.push_back({steps[begin].from, begin, end, 0});
    while (!open.empty()) {
      Open one = open.front();
      open.pop_front();
      const auto differs = [&](std::uint32_t s) {
        return made_of(s)[one.depth].alternative != made_of(one.begin)[one.depth].alternative;
      };
      // To the next decision that is taken in more than one way.
      while (one.end - one.begin > 1 && one.depth < made_of(one.begin).size() && !differs(one.end - 1)) ++one.depth;
      const bool decides = one.end - one.begin > 1 && one.depth < made_of(one.begin).size();
      out.places[one.place].first = static_cast<std::uint32_t>(out.arcs.size());
      for (std::uint32_t from = one.begin, to = one.begin; from < one.end; from = to) {
        to = from + 1;
        if (decides) {
          while (to < one.end && made_of(to)[one.depth].alternative == made_of(from)[one.depth].alternative) ++to;
          out.places[one.place].drawn = made_of(from)[one.depth].probability >= 0;
        }
        const Made* const made = decides ? &made_of(from)[one.depth] : nullptr;
        if (made != nullptr && made->probability == 0) continue;
        Branching::Arc arc{.to = steps[from].to, .step = from};
        if (made != nullptr) {
          const bool is_named =
              made->kind == Made::Kind::kChoice || (made->kind == Made::Kind::kFault && made->alternative > 0);
          arc.what = is_named ? made->what : Branching::kNone;
          arc.probability = made->probability;
        }
        if (to - from > 1) {
          arc.to = static_cast<std::uint32_t>(out.places.size());
          arc.step = Branching::kNone;
          out.places.push_back({.pair = steps[from].from});
          open.push_back({arc.to, from, to, one.depth + 1});
        }
        out.arcs.push_back(arc);
      }
      out.places[one.place].count = static_cast<std::uint32_t>(out.arcs.size()) - out.places[one.place].first;
    }
  }
  return out;
}

Components::Components(const Branching& of)
    : of_(of),
      among_(of.places.size()),
      inside_(of.places.size()),
      on_stack_(of.places.size()),
      index_(of.places.size(), Branching::kNone),
      low_(of.places.size()) {}

std::vector<Places> Components::strong(const Places& among, const Allowed& allowed) {
  for (const std::uint32_t at : among) among_[at] = true;
  std::uint32_t numbers = 0;
  std::vector<Places> found;
  Places stack;
  struct Frame {
    std::uint32_t at;
    std::uint32_t next;
  };
  std::vector<Frame> frames;  // instead of recursion
  const auto enter = [&](std::uint32_t at) {
    index_[at] = low_[at] = numbers++;
    stack.push_back(at);
    on_stack_[at] = true;
    frames.push_back({at, of_.places[at].first});
  };
  for (const std::uint32_t root : among) {
    if (index_[root] == Branching::kNone) enter(root);
    while (!frames.empty()) {
      Frame& frame = frames.back();
      const std::uint32_t at = frame.at;
      const Branching::Place& place = of_.places[at];
      if (frame.next < place.first + place.count) {
        const std::uint32_t arc = frame.next++;
        const std::uint32_t to = of_.arcs[arc].to;
        if (!allowed[arc] || !among_[to]) continue;
        if (index_[to] == Branching::kNone)
          enter(to);
        else if (on_stack_[to])
          low_[at] = std::min(low_[at], index_[to]);
        continue;
      }
      if (low_[at] == index_[at]) {
        Places component;
        do {
          component.push_back(stack.back());
          on_stack_[stack.back()] = false;
          stack.pop_back();
        } while (component.back() != at);
        bool loops = component.size() > 1;
        for (std::uint32_t arc = place.first; !loops && arc < place.first + place.count; ++arc)
          loops = allowed[arc] && of_.arcs[arc].to == at;
        if (loops) found.push_back(std::move(component));
      }
      const std::uint32_t low = low_[at];
      frames.pop_back();
      if (!frames.empty()) low_[frames.back().at] = std::min(low_[frames.back().at], low);
    }
  }
  for (const std::uint32_t at : among) {
    among_[at] = false;
    index_[at] = Branching::kNone;
  }
  return found;
}

bool Components::draws_away(std::uint32_t at, const Allowed& allowed, const std::vector<bool>& inside) const {
  const Branching::Place& place = of_.places[at];
  if (!place.drawn) return false;
  for (std::uint32_t arc = place.first; arc < place.first + place.count; ++arc) {
    if (!allowed[arc] || !inside[of_.arcs[arc].to]) return true;
  }
  return false;
}

std::vector<Places> Components::without(
    Places among, const Allowed& allowed,
    const std::function<Places(const Places& component, const std::vector<bool>& inside)>& bad) {
  std::vector<Places> found;
  std::vector<Places> work;
  work.push_back(std::move(among));
  while (!work.empty()) {
    const Places some = std::move(work.back());
    work.pop_back();
    for (Places& component : strong(some, allowed)) {
      for (const std::uint32_t at : component) inside_[at] = true;
      const Places out = bad(component, inside_);
      for (const std::uint32_t at : out) inside_[at] = false;
      Places left;
      std::copy_if(component.begin(), component.end(), std::back_inserter(left),
                   [&](std::uint32_t at) { return inside_[at]; });
      for (const std::uint32_t at : component) inside_[at] = false;
      if (out.empty())
        found.push_back(std::move(component));
      else if (!left.empty())
        work.push_back(std::move(left));
    }
  }
  return found;
}

std::vector<Places> Components::end(Places among, const Allowed& allowed) {
  return without(std::move(among), allowed, [&](const Places& component, const std::vector<bool>& inside) {
    Places bad;
    std::copy_if(component.begin(), component.end(), std::back_inserter(bad),
                 [&](std::uint32_t at) { return draws_away(at, allowed, inside); });
    return bad;
  });
}

}  // namespace sentree::verify
