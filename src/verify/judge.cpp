#include "sentree/verify/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <new>
#include <set>
#include <string>
#include <utility>

#include "sentree/base/flat_map.h"
#include "sentree/verify/detail/branching.h"
#include "sentree/verify/detail/lasso.h"
#include "sentree/verify/detail/probability.h"
#include "sentree/verify/detail/vacuity.h"
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

class Judge {
 public:
  Judge(const Graph& graph, const monitor::Model& model, const JudgeOptions& options)
      : graph_(graph), model_(model), options_(options), memory_(graph, model) {}
  ~Judge() {
    if (options_.taken != nullptr) *options_.taken -= taken_;
  }
  Judge(const Judge&) = delete;
  Judge& operator=(const Judge&) = delete;

  Judgement operator()() {
    out_.requirement = model_.name();
    const auto begin = memory_.begin();
    if (begin) add({0, *begin, UINT32_MAX, 0});
    bool all = true;
    for (std::uint32_t at = 0; all && at < pairs_.size(); ++at) {
      if (!follow(at)) break;
      if (out_.finding == Finding::kRefuted && !wants_all()) break;
      constexpr std::uint32_t kLooksOften = 1024;
      if (at % kLooksOften != kLooksOften - 1) continue;
      if (options_.interrupted && options_.interrupted())
        out_.limit = "interrupted, or out of time (--time), while it was judged";
      else if (takes_too_much())
        out_.limit = too_much();
      all = out_.limit.empty();
    }
    if (memory_.error()) {
      out_.error = to_string(*memory_.error());
      return std::move(out_);
    }
    out_.states = pairs_.size();
    if (!all) {
      if (out_.finding == Finding::kRefuted) {
        out_.limit.clear();
        out_.can_stay_open.reset();
      }
      return std::move(out_);
    }
    if (out_.finding != Finding::kRefuted) {
      look_for_loops();
      if (out_.finding != Finding::kRefuted) out_.finding = graph_.complete ? Finding::kHolds : Finding::kUnknown;
      if (out_.finding == Finding::kHolds && options_.vacuity) {
        Vacuity found = vacuity(graph_, model_, memory_);
        out_.vacuous = std::move(found.why);
        out_.never_seen = std::move(found.never_seen);
      }
    }
    if (out_.finding == Finding::kRefuted) out_.can_stay_open.reset();
    if (wants_all()) probability();
    return std::move(out_);
  }

  /// What is known when there is no more memory.
  Judgement without_memory() {
    out_.can_stay_open.reset();
    if (out_.finding != Finding::kRefuted) {
      out_.finding = Finding::kUnknown;
      out_.limit = "there was no more memory while it was judged; judge it alone (--only)";
    }
    return std::move(out_);
  }

 private:
  bool takes_too_much() {
    const std::uint64_t taken =
        memory_.bytes() + pair_of_.bytes() + pairs_.capacity() * sizeof(Pair) + steps_.capacity() * sizeof(Step);
    if (options_.taken == nullptr) return taken > options_.memory;
    *options_.taken += taken - taken_;
    taken_ = taken;
    return *options_.taken > options_.memory;
  }

  // What grows, and a way out.
  [[nodiscard]] std::string too_much() const {
    std::map<std::string, std::set<std::string>> values;
    for (const MonitorMemory::Kept& kept : memory_.all()) {
      kept.core.session.visit_data(
          model_.chart(), [&](const std::string& datum, const Value& value) { values[datum].insert(to_json(value)); });
    }
    std::string most;
    std::size_t count = 1;
    for (const auto& [datum, of] : values) {
      if (of.size() <= count) continue;
      most = datum;
      count = of.size();
    }
    return fmt::format(
        "the limit of memory while it was judged, with {} states of its own and {} together with the mission{}; judge "
        "it alone (--only), with a smaller bound or {}, or give it more (--memory)",
        memory_.all().size(), pairs_.size(), most.empty() ? "" : fmt::format(" (most values had {}: {})", most, count),
        model_.origin() != nullptr ? "number" : "fewer values in its chart");
  }

  [[nodiscard]] bool wants_all() {
    if (!options_.probabilities || !graph_.probabilistic || !graph_.complete) return false;
    if (pairs_.size() > options_.probable_states) out_.improbable_states = options_.probable_states;
    return !out_.improbable_states;
  }

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
        refute(at, "", time_of(at), "");
        out_.state = "the mission ends";
      } else if (memory_.kept(pair.core).owes_until && !out_.can_stay_open) {
        out_.can_stay_open = path_to(at);
        out_.open_at = time_of(at);
      }
      return true;
    }
    for (std::uint32_t e = node.first_edge; e < node.first_edge + node.edges; ++e) {
      const Edge& edge = graph_.edges[e];
      const auto* outcome = memory_.after(pair.core, memory_.heard(edge.seen), graph_.judged(edge));
      if (outcome == nullptr) return false;
      const auto [to, is_new] = add({edge.to, outcome->core, at, e});
      // Whether a loop is fair is not known where some ways on are not.
      const bool lacks_faults = options_.all_fair && pair.node >= graph_.faultless_from;
      if (pair.node != graph_.partial && !lacks_faults) steps_.push_back({at, to, e, outcome->discharged});
      if (outcome->violated && out_.finding != Finding::kRefuted) {
        // The time on this path, which need not be one of the shortest to its state of the mission.
        refute(to, outcome->observation, time_of(at) + outcome->after, outcome->state);
        if (!wants_all()) return true;
      }
    }
    return true;
  }

  [[nodiscard]] TimePoint time_of(std::uint32_t at) const {
    TimePoint time{};
    for (; pairs_[at].parent != UINT32_MAX; at = pairs_[at].parent) time += graph_.lasts(graph_.edges[pairs_[at].edge]);
    return time;
  }

  [[nodiscard]] Path path_to(std::uint32_t at) const {
    Path path;
    for (; pairs_[at].parent != UINT32_MAX; at = pairs_[at].parent) path.edges.push_back(pairs_[at].edge);
    std::reverse(path.edges.begin(), path.edges.end());
    return path;
  }

  void refute(std::uint32_t at, const std::string& observation, TimePoint time, const std::string& state) {
    out_.path = path_to(at);
    out_.finding = Finding::kRefuted;
    out_.at = time;
    out_.observation = observation;
    out_.state = state;
  }

  // ---- obligations without a bound

  [[nodiscard]] bool owes(std::uint32_t pair) const { return memory_.kept(pairs_[pair].core).owes; }

  void look_for_loops() {
    if (std::none_of(memory_.all().begin(), memory_.all().end(), [](const auto& kept) { return kept.owes; })) return;
    const Branching& of = branches();
    Places owing;
    for (std::uint32_t at = 0; at < of.places.size(); ++at) {
      if (owes(of.places[at].pair)) owing.push_back(at);
    }
    const Allowed goes_on = going_on();
    Owing found = owing_for_ever(graph_, of, steps_, owing, goes_on, options_);
    out_.fair = std::move(found.fair);
    out_.avoided = std::move(found.avoided);
    if (!found.loop) return;
    refute_by(*found.loop);
    drop_faults(owing, goes_on);
    drop_orders(owing, goes_on);
  }

  void refute_by(const Lasso& loop) {
    Path path = path_to(loop.begin);
    path.loop = path.edges.size();
    path.edges.insert(path.edges.end(), loop.edges.begin(), loop.edges.end());
    out_.finding = Finding::kRefuted;
    out_.at = time_of(loop.begin) + graph_.lasts(graph_.edges[loop.edges.front()]);
    out_.path = std::move(path);
    out_.observation.clear();
    out_.state = "for ever";
  }

  [[nodiscard]] static bool is_fault(const Made& made) {
    return made.kind == Made::Kind::kFault && made.alternative > 0;
  }

  // Looks for loops on which faults of the one that was found do not come, one after the other, the last first; then
  // for those on which they do not go.
  void drop_faults(const Places& owing, const Allowed& goes_on) {
    std::vector<bool> tried(graph_.choices.size());
    std::vector<bool> without(graph_.choices.size());
    const auto is_without = [&](const Made& made) { return is_fault(made) && without[made.what]; };
    for (const char* const function : {"fault", "end of fault"}) {
      const auto untried = [&]() -> std::optional<std::uint32_t> {
        const auto& edges = out_.path->edges;
        for (auto edge = edges.rbegin(); edge != edges.rend(); ++edge) {
          for (const Made& made : graph_.decisions[graph_.edges[*edge].made]) {
            if (is_fault(made) && !tried[made.what] && graph_.choices[made.what].function == function) return made.what;
          }
        }
        return std::nullopt;
      };
      for (auto fault = untried(); fault; fault = untried()) {
        if (options_.interrupted && options_.interrupted()) return;
        tried[*fault] = without[*fault] = true;
        without[*fault] = find_loop_without(is_without, owing, goes_on);
      }
    }
  }

  // Looks for loops on which everything comes in the order of virtual time, or else on which fewer parts are ever
  // before that; with no other faults than are needed.
  void drop_orders(const Places& owing, const Allowed& goes_on) {
    std::vector<bool> without(graph_.parts.size(), true);
    std::vector<bool> needed(graph_.choices.size());
    const auto is_other = [](const Made& made) { return made.kind == Made::Kind::kOrder && made.alternative > 0; };
    const auto is_without = [&](const Made& made) {
      return (is_fault(made) && !needed[made.what]) || (is_other(made) && without[made.what]);
    };
    std::set<std::uint32_t> first;  // other parts than in virtual time, on the loop that was found
    for (const std::uint32_t edge : out_.path->edges) {
      for (const Made& made : graph_.decisions[graph_.edges[edge].made]) {
        if (is_other(made)) first.insert(made.what);
        if (is_fault(made)) needed[made.what] = true;
      }
    }
    if (first.empty() || find_loop_without(is_without, owing, goes_on) || first.size() == 1) return;
    without.assign(without.size(), false);
    for (const std::uint32_t part : first) {
      if (options_.interrupted && options_.interrupted()) return;
      without[part] = true;
      without[part] = find_loop_without(is_without, owing, goes_on);
    }
  }

  // Refutes by a loop, and a way to it, without such decisions; false: there is none.
  bool find_loop_without(const std::function<bool(const Made&)>& is_left_out, Places owing, Allowed goes_on) {
    std::vector<bool> without(graph_.decisions.size());
    for (std::size_t i = 0; i < without.size(); ++i) {
      const auto& all = graph_.decisions[i];
      without[i] = std::any_of(all.begin(), all.end(), is_left_out);
    }
    const auto is_without = [&](const Step& step) { return without[graph_.edges[step.edge].made]; };
    const Branching& of = branches();
    for (std::size_t arc = 0; arc < of.arcs.size(); ++arc) {
      const std::uint32_t step = of.arcs[arc].step;
      if (step != Branching::kNone && is_without(steps_[step])) goes_on[arc] = false;
    }
    std::vector<Pair> pairs = pairs_;
    for (Pair& pair : pairs) pair.parent = UINT32_MAX;
    std::vector<std::uint32_t> reached{0};
    // Those of a pair stand beside each other, in the order of pairs.
    for (std::size_t i = 0; i < reached.size(); ++i) {
      const auto before = [](const Step& step, std::uint32_t pair) { return step.from < pair; };
      auto step = std::lower_bound(steps_.begin(), steps_.end(), reached[i], before);
      for (; step != steps_.end() && step->from == reached[i]; ++step) {
        Pair& to = pairs[step->to];
        if (step->to == 0 || to.parent != UINT32_MAX || is_without(*step)) continue;
        to.parent = step->from;
        to.edge = step->edge;
        reached.push_back(step->to);
      }
    }
    std::erase_if(owing, [&](std::uint32_t at) {
      const std::uint32_t pair = of.places[at].pair;
      return pair != 0 && pairs[pair].parent == UINT32_MAX;
    });
    const Owing found = owing_for_ever(graph_, of, steps_, owing, goes_on, options_);
    if (!found.loop) return false;
    pairs_ = std::move(pairs);
    refute_by(*found.loop);
    return true;
  }

  const Branching& branches() {
    if (!branching_) branching_ = branching(graph_, pairs_.size(), steps_);
    return *branching_;
  }

  // Arcs that go on owing.
  Allowed going_on() {
    const Branching& of = branches();
    Allowed all(of.arcs.size());
    for (std::size_t arc = 0; arc < all.size(); ++arc) {
      const std::uint32_t step = of.arcs[arc].step;
      all[arc] = step == Branching::kNone || (!steps_[step].discharged && owes(steps_[step].to));
    }
    return all;
  }

  // ---- probabilities

  // That it is violated, or owes for ever, or owes when the mission ends; and that it is none of that.
  void probability() {
    const bool can_owe =
        std::any_of(memory_.all().begin(), memory_.all().end(), [](const auto& kept) { return kept.owes; });
    const bool is_fair = options_.all_fair || !options_.fair.empty();
    // Fairness says nothing of how likely something is.
    if (can_owe && graph_.nondeterministic && is_fair) return;
    const Branching& of = branches();
    std::vector<bool> bad(of.places.size());
    std::vector<bool> good(of.places.size());
    Places going;
    Places owing;
    for (std::uint32_t at = 0; at < of.places.size(); ++at) {
      const Pair& pair = pairs_[of.places[at].pair];
      if (memory_.kept(pair.core).violated) {
        bad[at] = true;
      } else if (graph_.nodes[pair.node].ended) {
        (owes(of.places[at].pair) ? bad : good)[at] = true;
      } else {
        going.push_back(at);
        if (owes(of.places[at].pair)) owing.push_back(at);
      }
    }
    Components components(of);
    const Allowed goes_on = going_on();
    for (const Places& component : components.end(std::move(owing), goes_on)) {
      for (const std::uint32_t at : component) bad[at] = true;
    }
    out_.greatest = greatest_chance(of, bad, options_.interrupted);
    out_.least = *out_.greatest;
    if (!graph_.nondeterministic) return;
    std::vector<bool> inside(of.places.size());
    for (const Places& component : components.end(std::move(going), Allowed(of.arcs.size(), true))) {
      for (const std::uint32_t at : component) inside[at] = true;
      const bool is_good = std::any_of(component.begin(), component.end(), [&](std::uint32_t at) {
        const Branching::Place& place = of.places[at];
        bool found = !owes(place.pair);
        for (std::uint32_t arc = place.first; !found && arc < place.first + place.count; ++arc)
          found = !goes_on[arc] && inside[of.arcs[arc].to];
        return found;
      });
      for (const std::uint32_t at : component) {
        inside[at] = false;
        if (is_good) good[at] = true;
      }
    }
    const Judgement::Probability avoided = greatest_chance(of, good, options_.interrupted);
    // The difference of two numbers near 1 is only as sure as these are written.
    constexpr double kRounded = std::numeric_limits<double>::epsilon();
    out_.least = Judgement::Probability{avoided.high < 1 ? std::max(0.0, 1 - avoided.high - kRounded) : 0,
                                        avoided.low < 1 ? std::min(1.0, 1 - avoided.low + kRounded) : 0};
  }

  const Graph& graph_;
  const monitor::Model& model_;
  const JudgeOptions& options_;
  MonitorMemory memory_;
  Judgement out_;
  std::vector<Pair> pairs_;
  FlatMap<std::uint64_t, WordHash> pair_of_;
  std::vector<Step> steps_;
  std::uint64_t taken_ = 0;             // bytes, as it was looked at last
  std::optional<Branching> branching_;  // when it is wanted, of all pairs
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

namespace {

// With so many digits, not above (or not below) what it is.
std::string rounded_chance(double number, int digits, bool up) {
  if (number == 0) return "0";
  const double unit = std::pow(10.0, std::floor(std::log10(number)) - (digits - 1));
  const double units = number / unit;
  // What is that but for the last bits of a double.
  const double near = std::round(units);
  const bool is_near = std::abs(units - near) < 1e-9 * near;
  return fmt::format("{:.{}g}", (is_near ? near : up ? std::ceil(units) : std::floor(units)) * unit, digits);
}

// As far as it is known.
std::string told_chance(double low, double high) {
  constexpr int kDigitsMax = 10;
  constexpr int kDigitsMin = 3;
  for (int digits = kDigitsMax; digits >= kDigitsMin; --digits) {
    std::string text = fmt::format("{:.{}g}", low, digits);
    if (text == fmt::format("{:.{}g}", high, digits)) return text;
  }
  if (low == 0) return "at most " + rounded_chance(high, 2, true);
  return fmt::format("between {} and {}", rounded_chance(low, kDigitsMin, false),
                     rounded_chance(high, kDigitsMin, true));
}

}  // namespace

std::string to_string(const Judgement::Probability& least, const Judgement::Probability& greatest) {
  if (greatest.low - least.high <= 1e-9 * greatest.high)
    return told_chance(std::min(least.low, greatest.low), std::max(least.high, greatest.high));
  return fmt::format("{} to {}, as what is left open is chosen", told_chance(least.low, least.high),
                     told_chance(greatest.low, greatest.high));
}

Judgement left_open(const Judgement& judgement) {
  Judgement shown;
  shown.requirement = judgement.requirement;
  shown.finding = judgement.finding;
  shown.path = judgement.can_stay_open;
  shown.at = judgement.open_at;
  shown.state = "the mission ends";
  return shown;
}

Judgement judge(const Graph& graph, const monitor::Model& model, const JudgeOptions& options) {
  Judge judge(graph, model, options);
  try {
    return judge();
  } catch (const std::bad_alloc&) {
    return judge.without_memory();
  }
}

}  // namespace sentree::verify
