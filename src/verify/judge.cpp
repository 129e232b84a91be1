#include "sentree/verify/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "sentree/base/flat_map.h"
#include "sentree/verify/monitor_memory.h"

namespace sentree::verify {

namespace {

// A pair of a state of the mission and a state of the monitor.
struct Pair {
  std::uint32_t node = 0;
  std::uint32_t core = 0;
  std::uint32_t parent = UINT32_MAX;
  std::uint32_t edge = 0;  // by which it was reached first
};

// An edge between pairs.
struct Step {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::uint32_t edge = 0;
  bool discharged = false;
};

class Judge {
 public:
  Judge(const Graph& graph, const monitor::Model& model, const JudgeOptions& options)
      : graph_(graph), model_(model), options_(options), memory_(graph, model) {}

  Judgement operator()() {
    out_.requirement = model_.name();
    const auto begin = memory_.begin();
    if (begin) add({0, *begin, UINT32_MAX, 0});
    for (std::uint32_t at = 0; at < pairs_.size(); ++at) {
      if (!follow(at)) break;
      if (out_.finding == Finding::kRefuted && !wants_all()) break;
    }
    if (memory_.error()) {
      out_.error = to_string(*memory_.error());
      return std::move(out_);
    }
    out_.states = pairs_.size();
    if (out_.finding != Finding::kRefuted) {
      look_for_loops();
      if (out_.finding != Finding::kRefuted) out_.finding = graph_.complete ? Finding::kHolds : Finding::kUnknown;
      if (out_.finding == Finding::kHolds) out_.vacuous = vacuity();
    }
    if (wants_all()) probability();
    return std::move(out_);
  }

 private:
  [[nodiscard]] bool wants_all() const { return options_.probabilities && graph_.probabilistic && graph_.complete; }

  std::pair<std::uint32_t, bool> add(Pair pair) {
    const std::uint64_t key = (std::uint64_t{pair.node} << 32U) | pair.core;
    const auto [found, is_new] = pair_of_.try_emplace(key, static_cast<std::uint32_t>(pairs_.size()));
    if (is_new) pairs_.push_back(pair);
    return {*found, is_new};
  }

  bool follow(std::uint32_t at) {
    const Pair pair = pairs_[at];
    if (memory_.kept(pair.core).violated) return true;  // what comes then changes nothing
    const Graph::Node& node = graph_.nodes[pair.node];
    if (node.ended) {
      if (memory_.kept(pair.core).owes && out_.finding != Finding::kRefuted) {
        refute(at, "", node.at, "");
        out_.state = "the mission ends";
      } else if (memory_.kept(pair.core).owes_until && !out_.can_stay_open) {
        out_.can_stay_open = path_to(at);
      }
      return true;
    }
    for (std::uint32_t e = node.first_edge; e < node.first_edge + node.edges; ++e) {
      const Edge& edge = graph_.edges[e];
      const Duration period = span_of(edge);
      const auto* outcome = memory_.after(pair.core, memory_.heard(edge.seen), period);
      if (outcome == nullptr) return false;
      const auto [to, is_new] = add({edge.to, outcome->core, at, e});
      steps_.push_back({at, to, e, outcome->discharged});
      if (outcome->violated && out_.finding != Finding::kRefuted) {
        // The time on this path, which need not be one of the shortest to its state of the mission.
        refute(to, outcome->observation, time_of(at) + outcome->after, outcome->state);
        if (!wants_all()) return true;
      }
    }
    return true;
  }

  // Before the first period no time has passed.
  [[nodiscard]] Duration span_of(const Edge& edge) const { return edge.from == 0 ? Duration(0) : graph_.period; }

  [[nodiscard]] TimePoint time_of(std::uint32_t at) const {
    TimePoint time{};
    for (; pairs_[at].parent != UINT32_MAX; at = pairs_[at].parent) time += span_of(graph_.edges[pairs_[at].edge]);
    return time;
  }

  [[nodiscard]] Path path_to(std::uint32_t at) const {
    Path path;
    for (; pairs_[at].parent != UINT32_MAX; at = pairs_[at].parent) path.edges.push_back(pairs_[at].edge);
    std::reverse(path.edges.begin(), path.edges.end());
    return path;
  }

  void refute(std::uint32_t at, const std::string& observation, TimePoint time, const std::string& state) {
    out_.finding = Finding::kRefuted;
    out_.path = path_to(at);
    out_.at = time;
    out_.observation = observation;
    out_.state = state;
  }

  // ---- obligations without a bound

  // By node, steps from it that go on owing.
  using Adjacent = std::vector<std::vector<std::uint32_t>>;

  // An alternative of a choice that has a name.
  using Alternative = std::pair<std::string, std::string>;  // "MODEL.NAME", value

  [[nodiscard]] std::vector<Alternative> named(const Edge& edge) const {
    std::vector<Alternative> all;
    for (const Made& made : graph_.decisions[edge.made]) {
      if (made.kind != Made::Kind::kChoice || made.count < 2) continue;
      const ChoicePoint& point = graph_.choices[made.what];
      if (!point.name.empty()) all.emplace_back(fmt::format("{}.{}", point.model, point.name), point.value);
    }
    return all;
  }

  // Chances that are not 0 come again and again, with probability 1.
  [[nodiscard]] bool is_fair(const Made& made) const {
    if (made.probability >= 0) return true;
    const ChoicePoint& point = graph_.choices[made.what];
    if (point.name.empty() || none_fair_) return false;
    const std::string full = fmt::format("{}.{}", point.model, point.name);
    return all_fair_ || std::find(options_.fair.begin(), options_.fair.end(), full) != options_.fair.end();
  }

  [[nodiscard]] std::vector<std::uint32_t> fair_alternatives(std::uint32_t edge) const {
    std::vector<std::uint32_t> all;
    for (const Made& made : graph_.decisions[graph_.edges[edge].made]) {
      if (made.kind == Made::Kind::kChoice && made.count > 1 && is_fair(made)) all.push_back(made.what);
    }
    return all;
  }

  void look_for_loops() {
    const bool owes =
        std::any_of(memory_.all().begin(), memory_.all().end(), [](const auto& kept) { return kept.owes; });
    if (!owes) return;
    steps_of_.assign(pairs_.size(), {});
    all_steps_of_.assign(pairs_.size(), {});
    for (std::uint32_t s = 0; s < steps_.size(); ++s) {
      const Step& step = steps_[s];
      all_steps_of_[step.from].push_back(s);
      const bool goes_on =
          !step.discharged && memory_.kept(pairs_[step.from].core).owes && memory_.kept(pairs_[step.to].core).owes;
      if (goes_on) steps_of_[step.from].push_back(s);
    }
    all_fair_ = options_.all_fair;
    const auto found = fair_component();
    if (found.empty()) {
      // Whether it would hold without fairness too.
      none_fair_ = true;
      if (const auto unfair = fair_component(); !unfair.empty()) {
        std::set<std::string> names;
        for (const Alternative& avoided : avoided_in(unfair)) names.insert(avoided.first);
        out_.fair.assign(names.begin(), names.end());
      }
      return;
    }
    if (!all_fair_) {
      all_fair_ = true;
      if (fair_component().empty()) {
        std::set<std::string> names;
        for (const Alternative& avoided : avoided_in(found))
          names.insert(fmt::format("{} = {}", avoided.first, avoided.second));
        out_.avoided.assign(names.begin(), names.end());
      }
    }
    show_loop(found);
  }

  // Pairs of a cycle on which what is fair is taken; empty: there is none.
  std::vector<std::uint32_t> fair_component() const {
    std::vector<std::vector<std::uint32_t>> work;
    std::vector<std::uint32_t> all;
    for (std::uint32_t at = 0; at < pairs_.size(); ++at) {
      if (!steps_of_[at].empty()) all.push_back(at);
    }
    work.push_back(std::move(all));
    while (!work.empty()) {
      const std::vector<std::uint32_t> nodes = std::move(work.back());
      work.pop_back();
      for (auto& component : components(nodes)) {
        const std::set<std::uint32_t> inside(component.begin(), component.end());
        std::set<std::uint32_t> taken;
        std::map<std::uint32_t, std::set<std::uint32_t>> offered;  // alternative: by whom
        for (const std::uint32_t at : component) {
          for (const std::uint32_t s : all_steps_of_[at]) {
            for (const std::uint32_t what : fair_alternatives(steps_[s].edge)) offered[what].insert(at);
          }
          for (const std::uint32_t s : steps_of_[at]) {
            if (!inside.contains(steps_[s].to)) continue;
            for (const std::uint32_t what : fair_alternatives(steps_[s].edge)) taken.insert(what);
          }
        }
        std::set<std::uint32_t> bad;
        for (const auto& [what, by] : offered) {
          if (!taken.contains(what)) bad.insert(by.begin(), by.end());
        }
        if (bad.empty()) return component;
        std::erase_if(component, [&](std::uint32_t at) { return bad.contains(at); });
        if (!component.empty()) work.push_back(std::move(component));
      }
    }
    return {};
  }

  // Strongly connected components with a step inside (Tarjan 1972), without recursion.
  std::vector<std::vector<std::uint32_t>> components(const std::vector<std::uint32_t>& nodes) const {
    std::unordered_map<std::uint32_t, std::uint32_t> index;
    std::unordered_map<std::uint32_t, std::uint32_t> low;
    std::set<std::uint32_t> allowed(nodes.begin(), nodes.end());
    std::set<std::uint32_t> on_stack;
    std::vector<std::uint32_t> stack;
    std::vector<std::vector<std::uint32_t>> found;
    struct Frame {
      std::uint32_t at;
      std::size_t next;
    };
    for (const std::uint32_t root : nodes) {
      if (index.contains(root)) continue;
      std::vector<Frame> frames{{root, 0}};
      while (!frames.empty()) {
        Frame& frame = frames.back();
        const std::uint32_t at = frame.at;
        if (frame.next == 0) {
          const auto number = static_cast<std::uint32_t>(index.size());
          index[at] = low[at] = number;
          stack.push_back(at);
          on_stack.insert(at);
        }
        if (frame.next < steps_of_[at].size()) {
          const std::uint32_t to = steps_[steps_of_[at][frame.next++]].to;
          if (!allowed.contains(to)) continue;
          if (!index.contains(to))
            frames.push_back({to, 0});
          else if (on_stack.contains(to))
            low[at] = std::min(low[at], index[to]);
          continue;
        }
        if (frame.next == steps_of_[at].size()) ++frame.next;
        if (low[at] == index[at]) {
          std::vector<std::uint32_t> component;
          std::uint32_t top = 0;
          do {
            top = stack.back();
            stack.pop_back();
            on_stack.erase(top);
            component.push_back(top);
          } while (top != at);
          const bool loops = component.size() > 1 || std::any_of(steps_of_[at].begin(), steps_of_[at].end(),
                                                                 [&](std::uint32_t s) { return steps_[s].to == at; });
          if (loops) found.push_back(std::move(component));
        }
        const std::uint32_t done_low = low[at];
        frames.pop_back();
        if (!frames.empty()) low[frames.back().at] = std::min(low[frames.back().at], done_low);
      }
    }
    return found;
  }

  // What is offered in a component and not taken on it.
  std::vector<Alternative> avoided_in(const std::vector<std::uint32_t>& component) const {
    const std::set<std::uint32_t> inside(component.begin(), component.end());
    std::set<Alternative> offered;
    std::set<Alternative> taken;
    for (const std::uint32_t at : component) {
      for (const std::uint32_t s : all_steps_of_[at]) {
        for (Alternative& one : named(graph_.edges[steps_[s].edge])) offered.insert(std::move(one));
      }
      for (const std::uint32_t s : steps_of_[at]) {
        if (!inside.contains(steps_[s].to)) continue;
        for (Alternative& one : named(graph_.edges[steps_[s].edge])) taken.insert(std::move(one));
      }
    }
    std::vector<Alternative> out;
    std::set_difference(offered.begin(), offered.end(), taken.begin(), taken.end(), std::back_inserter(out));
    return out;
  }

  // A shortest way from one pair to any of others, by steps inside; the steps.
  std::vector<std::uint32_t> way(std::uint32_t from, const std::set<std::uint32_t>& inside,
                                 const std::function<bool(std::uint32_t step)>& is_last) const {
    std::unordered_map<std::uint32_t, std::uint32_t> by;
    std::deque<std::uint32_t> queue{from};
    while (!queue.empty()) {
      const std::uint32_t at = queue.front();
      queue.pop_front();
      for (const std::uint32_t s : steps_of_[at]) {
        if (!inside.contains(steps_[s].to)) continue;
        const bool last = is_last(s);
        if (!last && (steps_[s].to == from || by.contains(steps_[s].to))) continue;
        if (!last) {
          by[steps_[s].to] = s;
          queue.push_back(steps_[s].to);
          continue;
        }
        std::vector<std::uint32_t> steps{s};
        for (std::uint32_t back = at; back != from; back = steps_[by[back]].from) steps.push_back(by[back]);
        std::reverse(steps.begin(), steps.end());
        return steps;
      }
    }
    return {};
  }

  // Once round, through a step for each fair alternative that is taken there.
  void show_loop(const std::vector<std::uint32_t>& component) {
    const std::set<std::uint32_t> inside(component.begin(), component.end());
    const std::uint32_t begin = *inside.begin();  // the pair that was reached first
    all_fair_ = options_.all_fair;
    std::set<std::uint32_t> owed;
    for (const std::uint32_t at : component) {
      for (const std::uint32_t s : steps_of_[at]) {
        if (!inside.contains(steps_[s].to)) continue;
        for (const std::uint32_t what : fair_alternatives(steps_[s].edge)) owed.insert(what);
      }
    }
    std::vector<std::uint32_t> round;
    std::uint32_t at = begin;
    const auto go = [&](const std::function<bool(std::uint32_t)>& is_last) {
      for (const std::uint32_t s : way(at, inside, is_last)) {
        round.push_back(steps_[s].edge);
        for (const std::uint32_t what : fair_alternatives(steps_[s].edge)) owed.erase(what);
        at = steps_[s].to;
      }
    };
    while (!owed.empty()) {
      const std::uint32_t what = *owed.begin();
      go([&](std::uint32_t s) {
        const auto alternatives = fair_alternatives(steps_[s].edge);
        return std::find(alternatives.begin(), alternatives.end(), what) != alternatives.end();
      });
    }
    if (at != begin || round.empty()) go([&](std::uint32_t s) { return steps_[s].to == begin; });
    Path path = path_to(begin);
    path.loop = path.edges.size();
    path.edges.insert(path.edges.end(), round.begin(), round.end());
    out_.finding = Finding::kRefuted;
    out_.at = time_of(begin);
    out_.path = std::move(path);
    out_.observation.clear();
    out_.state = "for ever";
  }

  // ----

  std::string vacuity() const {
    if (!memory_.ever_heard()) return "no observation that it waits for is ever made";
    const monitor::Origin* origin = model_.origin();
    if (origin == nullptr) return {};
    switch (origin->requirement.pattern) {
      case monitor::Pattern::kRespond:
      case monitor::Pattern::kKeepFor:
      case monitor::Pattern::kKeepUntil:
      case monitor::Pattern::kNotFor:
      case monitor::Pattern::kHoldsFor: break;
      default: return {};
    }
    return memory_.ever_owed() ? "" : "it is never triggered, or what it asks for holds then at once";
  }

  // Least (or greatest) over what is left open, mean over what is drawn, of a value at the end of each of `steps`,
  // which begin alike up to decision `depth`. They come as they were tried: what goes on alike stands beside each
  // other.
  double mean(std::span<const std::uint32_t> steps, std::size_t depth, bool least,
              const std::vector<double>& values) const {
    const auto& first = made_of(steps.front());
    if (depth >= first.size()) return values[steps_[steps.front()].to];
    const bool is_drawn = first[depth].probability >= 0;
    double result = is_drawn ? 0 : least ? 2 : -1;
    for (std::size_t begin = 0; begin < steps.size();) {
      const Made& made = made_of(steps[begin])[depth];
      std::size_t end = begin + 1;
      while (end < steps.size() && made_of(steps[end])[depth].alternative == made.alternative) ++end;
      if (!is_drawn || made.probability > 0) {
        const double inner = mean(steps.subspan(begin, end - begin), depth + 1, least, values);
        result = is_drawn ? result + made.probability * inner
                 : least  ? std::min(result, inner)
                          : std::max(result, inner);
      }
      begin = end;
    }
    return result;
  }
  [[nodiscard]] const std::vector<Made>& made_of(std::uint32_t step) const {
    return graph_.decisions[graph_.edges[steps_[step].edge].made];
  }

  // Whether what is left open can be chosen so that only `allowed` pairs are reached, whatever is drawn.
  bool can_stay(std::span<const std::uint32_t> steps, std::size_t depth, const std::vector<bool>& allowed) const {
    const auto& first = made_of(steps.front());
    if (depth >= first.size()) return allowed[steps_[steps.front()].to];
    const bool is_drawn = first[depth].probability >= 0;
    for (std::size_t begin = 0; begin < steps.size();) {
      const Made& made = made_of(steps[begin])[depth];
      std::size_t end = begin + 1;
      while (end < steps.size() && made_of(steps[end])[depth].alternative == made.alternative) ++end;
      if (!is_drawn || made.probability > 0) {
        if (can_stay(steps.subspan(begin, end - begin), depth + 1, allowed) != is_drawn) return !is_drawn;
      }
      begin = end;
    }
    return is_drawn;
  }

  // Of ever reaching a violation, over all ways in which what is left open may be chosen: bounds from below and above
  // (Haddad, Monmege 2018: interval iteration). From above, pairs count as 0 from which no violation can be reached;
  // for the least, those from which it can be avoided. The bound of the greatest from above stays 1 where a cycle can
  // be chosen for ever.
  void probability() {
    const std::size_t n = pairs_.size();
    std::vector<std::vector<std::uint32_t>> steps(n);
    std::vector<std::vector<std::uint32_t>> before(n);
    for (std::uint32_t s = 0; s < steps_.size(); ++s) {
      steps[steps_[s].from].push_back(s);
      before[steps_[s].to].push_back(steps_[s].from);
    }
    const auto violated = [&](std::uint32_t i) { return memory_.kept(pairs_[i].core).violated; };
    std::vector<bool> can(n);
    std::deque<std::uint32_t> queue;
    for (std::uint32_t i = 0; i < n; ++i) {
      if (!violated(i)) continue;
      can[i] = true;
      queue.push_back(i);
    }
    while (!queue.empty()) {
      const std::uint32_t at = queue.front();
      queue.pop_front();
      for (const std::uint32_t from : before[at]) {
        if (can[from]) continue;
        can[from] = true;
        queue.push_back(from);
      }
    }
    std::vector<bool> avoids(n);
    for (std::uint32_t i = 0; i < n; ++i) avoids[i] = !violated(i);
    for (bool changed = graph_.nondeterministic; changed;) {
      changed = false;
      for (std::uint32_t i = 0; i < n; ++i) {
        if (!avoids[i] || steps[i].empty() || can_stay(steps[i], 0, avoids)) continue;
        avoids[i] = false;
        changed = true;
      }
    }
    const auto bounds = [&](bool least) {
      std::vector<double> low(n);
      std::vector<double> high(n);
      const auto is_zero = [&](std::uint32_t i) { return !can[i] || (least && graph_.nondeterministic && avoids[i]); };
      for (std::uint32_t i = 0; i < n; ++i) {
        low[i] = violated(i) ? 1 : 0;
        high[i] = is_zero(i) ? 0 : 1;
      }
      constexpr int kRoundsMax = 1'000'000;
      constexpr double kEnough = 1e-10;
      bool changed = true;
      for (int round = 0; round < kRoundsMax && changed && high[0] - low[0] > kEnough; ++round) {
        changed = false;
        for (std::uint32_t i = static_cast<std::uint32_t>(n); i-- > 0;) {
          if (violated(i) || is_zero(i) || steps[i].empty()) continue;
          const double l = std::max(low[i], mean(steps[i], 0, least, low));
          const double h = std::min(high[i], mean(steps[i], 0, least, high));
          changed = changed || l != low[i] || h != high[i];
          low[i] = l;
          high[i] = h;
        }
      }
      return Judgement::Probability{low[0], high[0]};
    };
    out_.least = bounds(true);
    out_.greatest = graph_.nondeterministic ? bounds(false) : *out_.least;
  }

  const Graph& graph_;
  const monitor::Model& model_;
  const JudgeOptions& options_;
  MonitorMemory memory_;
  Judgement out_;
  std::vector<Pair> pairs_;
  FlatMap<std::uint64_t, WordHash> pair_of_;
  std::vector<Step> steps_;
  Adjacent steps_of_;  // those that go on owing
  Adjacent all_steps_of_;
  bool all_fair_ = false;
  bool none_fair_ = false;
};

}  // namespace

std::string_view to_string(Finding finding) {
  switch (finding) {
    case Finding::kHolds: return "holds";
    case Finding::kRefuted: return "refuted";
    case Finding::kUnknown: return "unknown";
  }
  return "";
}

Judgement judge(const Graph& graph, const monitor::Model& model, const JudgeOptions& options) {
  return Judge(graph, model, options)();
}

}  // namespace sentree::verify
