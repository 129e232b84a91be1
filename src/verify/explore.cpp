#include "sentree/verify/explore.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <new>
#include <utility>

#include "sentree/verify/detail/scout.h"
#include "sentree/verify/periods.h"

namespace sentree::verify {

namespace {

using SteadyClock = std::chrono::steady_clock;

const std::string kInterrupted = "interrupted";
const std::string kNoMemory = "there is no more memory";
// Code of a period that a limit has ended.
const std::string kLimit = "verify.limit";

// States that are gone through ahead at a time; as many as are worth it.
constexpr std::uint32_t kAheadMin = 64;
constexpr std::uint32_t kAheadMax = 8192;
// Shares of that work. The same for any number of threads, so that what is known when is the same too.
constexpr std::size_t kShares = 32;

class Explorer {
 public:
  Explorer(const project::Plan& plan, const Options& options) : options_(options), periods_(plan, options) {}

  Result<Graph> operator()() {
    if (auto begun = periods_.begin(); !begun) return tl::unexpected(begun.error());
    started_ = SteadyClock::now();
    periods_.on_the_way([this]() -> Result<void> {
      std::string reached = limit_now();
      if (reached.empty()) return {};
      return fail(kLimit, std::move(reached));
    });
    if (options_.each && !options_.tells_what_is_said) {
      for (std::size_t i = 0; i < kShares; ++i) scouts_.push_back(std::make_unique<Scout>(periods_));
      if (!scouts_.front()->can()) scouts_.clear();
    }
    Graph& graph = periods_.graph();
    try {
      if (auto done = expand_all(); !done) return tl::unexpected(done.error());
      if (!graph.limit.empty()) {
        if (auto done = go_on_without_faults(); !done) return tl::unexpected(done.error());
      }
    } catch (const std::bad_alloc&) {
      // Edges that are there lead to states that are there.
      scouts_.clear();
      Graph::Node& node = graph.nodes[at_];
      if (is_faultless_) {
        forget_edges(at_);
      } else {
        node.edges = static_cast<std::uint32_t>(graph.edges.size()) - node.first_edge;
        graph.partial = at_;
      }
      graph.limit = kNoMemory;
      graph.complete = false;
      return std::move(graph);
    }
    // How likely something is can depend on any order.
    if (graph.reduced && graph.probabilistic) return std::move(graph);
    graph.complete = graph.limit.empty();
    if (graph.complete) graph.complete_to = graph.nodes.back().depth + 1;
    // What grows without end, most likely; of ticks somebody wanted so many.
    if (!graph.complete && !graph.limit.ends_with(" ticks") && !too_many_ways_) {
      graph.grows = periods_.most_varied(3);
    }
    return std::move(graph);
  }

 private:
  // One state after the other, until a limit is reached.
  Result<void> expand_all() {
    Graph& graph = periods_.graph();
    for (std::uint32_t& at = at_; at < graph.nodes.size(); ++at) {
      graph.nodes[at].first_edge = static_cast<std::uint32_t>(graph.edges.size());
      graph.limit = limit(graph.nodes[at].depth);
      graph.complete_to = graph.nodes[at].depth;  // of those before all is known
      if (!graph.limit.empty()) break;
      if (at >= ahead_end_) go_ahead(at);
      if (graph.nodes[at].ended) continue;
      if (!follow_scout(at)) {
        if (auto done = expand(at); !done) return tl::unexpected(done.error());
      }
      if (graph.reduced && graph.probabilistic) return {};
      graph.nodes[at].edges = static_cast<std::uint32_t>(graph.edges.size()) - graph.nodes[at].first_edge;
      if (!graph.limit.empty()) {
        graph.partial = at;
        break;
      }
      periods_.drop();
      if (options_.progress && at % 1024 == 0) options_.progress(graph.nodes.size(), graph.edges.size());
    }
    return {};
  }

  std::string limit(std::uint32_t depth) const {
    if (depth >= options_.ticks) return fmt::format("the limit of {} ticks", options_.ticks);
    if (periods_.graph().nodes.size() > allowed(options_.states))
      return fmt::format("the limit of {} states", options_.states);
    return limit_now();
  }
  // What can also be reached between two ways of one state.
  std::string limit_now() const {
    if (options_.interrupted && options_.interrupted()) return kInterrupted;
    if (options_.time && SteadyClock::now() - started_ > allowed(*options_.time)) return "the limit of time";
    if (periods_.bytes() > allowed(options_.memory))
      return fmt::format("the limit of memory ({} MB; --memory)", options_.memory / 1'000'000);
    return {};
  }
  // Where faults may come, a quarter is kept for what goes on without them.
  template <class T>
  T allowed(T all) const {
    return options_.faults.empty() || is_faultless_ ? all : all - all / 4;
  }

  // Faults multiply states, and hide behind a limit what goes wrong without any. So what no fault has touched by now
  // is gone on from to its end, without faults.
  Result<void> go_on_without_faults() {
    Graph& graph = periods_.graph();
    std::uint32_t& at = at_;
    if (options_.faults.empty() || graph.limit == kInterrupted) return {};
    const std::string limit_of_all = std::exchange(graph.limit, {});
    Untouched untouched(graph);
    untouched.reach(0);
    if (graph.partial != UINT32_MAX && untouched.is[at]) {
      forget_edges(at);
      graph.partial = UINT32_MAX;
    } else if (graph.partial != UINT32_MAX) {
      ++at;
      periods_.drop();
    }
    graph.faultless_from = at;
    untouched.begin = at;
    is_faultless_ = true;
    periods_.leave_faults_out();
    for (; at < graph.nodes.size(); ++at) {
      graph.nodes[at].first_edge = static_cast<std::uint32_t>(graph.edges.size());
      if (graph.nodes[at].ended) continue;
      untouched.now = at;
      if (untouched.is[at]) {
        graph.faultless_to = graph.nodes[at].depth;
        graph.limit = limit(graph.nodes[at].depth);
        if (graph.limit.empty()) {
          if (auto done = expand(at); !done) return done;
        }
        if (!graph.limit.empty()) {
          forget_edges(at);
          break;
        }
        graph.nodes[at].edges = static_cast<std::uint32_t>(graph.edges.size()) - graph.nodes[at].first_edge;
        for (std::size_t e = graph.nodes[at].first_edge; e < graph.edges.size(); ++e)
          untouched.reach(graph.edges[e].to);
      }
      periods_.drop();
    }
    graph.faultless_complete = graph.limit.empty() && !untouched.missed;
    graph.limit = limit_of_all;
    return {};
  }

  void forget_edges(std::uint32_t at) {
    Graph& graph = periods_.graph();
    graph.edges.resize(graph.nodes[at].first_edge);
    if (options_.tells_what_is_said) graph.said.resize(graph.edges.size());
    graph.nodes[at].edges = 0;
  }

  // States to which a way without faults leads.
  struct Untouched {
    explicit Untouched(const Graph& of) : graph(of) {}

    void reach(std::uint32_t first) {
      is.resize(graph.nodes.size());
      if (is[first]) return;
      std::vector<std::uint32_t> open{first};
      while (!open.empty()) {
        const std::uint32_t at = open.back();
        open.pop_back();
        if (is[at]) continue;
        is[at] = true;
        const Graph::Node& node = graph.nodes[at];
        // It was left out, since only a fault had led to it by then.
        missed = missed || (at >= begin && at <= now && !node.ended);
        for (std::size_t e = node.first_edge; e < std::size_t{node.first_edge} + node.edges; ++e) {
          const auto& made = graph.decisions[graph.edges[e].made];
          if (std::none_of(made.begin(), made.end(),
                           [](const Made& one) { return one.kind == Made::Kind::kFault && one.alternative > 0; }))
            open.push_back(graph.edges[e].to);
        }
      }
    }

    const Graph& graph;
    std::vector<bool> is;
    std::uint32_t begin = UINT32_MAX;  // from which on nothing is gone on from but what is untouched,
    std::uint32_t now = 0;             // up to which
    bool missed = false;
  };

  // Has the states from `at` on gone through by what is known, where there are many.
  void go_ahead(std::uint32_t at) {
    ahead_begin_ = at;
    const auto states = static_cast<std::uint32_t>(periods_.graph().nodes.size());
    const std::uint32_t count = std::min(ahead_, states - at);
    ahead_end_ = at + count;
    scouted_ = !scouts_.empty() && count >= kAheadMin;
    if (!scouted_) return;
    share_ = static_cast<std::uint32_t>((count + kShares - 1) / kShares);
    for_each(options_.each, kShares, [&](std::size_t i) {
      const std::uint32_t begin = std::min(ahead_end_, at + static_cast<std::uint32_t>(i) * share_);
      scouts_[i]->explore(begin, std::min(ahead_end_, begin + share_));
    });
    std::size_t unknown = 0;
    for (const auto& scout : scouts_)
      unknown += static_cast<std::size_t>(
          std::count_if(scout->found().begin(), scout->found().end(), [](const auto& from) { return !from.known; }));
    if (unknown * 4 < count)
      ahead_ = std::min(2 * ahead_, kAheadMax);
    else
      ahead_ = std::max(ahead_ / 2, kAheadMin);
  }

  // Takes over what a scout has found; false: it did not know its way.
  bool follow_scout(std::uint32_t at) {
    if (!scouted_) return false;
    const Scout& scout = *scouts_[(at - ahead_begin_) / share_];
    const Scout::From& from = scout.found()[(at - ahead_begin_) % share_];
    if (!from.known) return false;
    Graph& graph = periods_.graph();
    graph.reduced = graph.reduced || from.leaves_out;
    for (std::size_t i = from.first; i < from.first + from.count; ++i) {
      const Periods::Scouted way = scout.way(i);
      const std::uint32_t to = periods_.adopt(way, graph.nodes[at].depth + 1);
      graph.edges.push_back({at, to, way.seen, way.made});
    }
    return true;
  }

  // Every way in which the next period of a state can go, but for orders that nobody tells apart.
  Result<void> expand(std::uint32_t at) {
    Graph& graph = periods_.graph();
    ways_.begin();
    for (std::size_t ways = 0;; ++ways) {
      if (ways >= kWaysMax) {
        too_many_ways_ = true;
        graph.limit = fmt::format(
            "tick {} can go on in more than {} ways ({}): leave less open at one instant, or draw some of them with "
            "--runs",
            graph.nodes[at].depth + 1, kWaysMax, left_open());
        return {};
      }
      if (ways % 64 == 63) graph.limit = limit_now();
      if (!graph.limit.empty()) return {};
      const auto way = periods_.go_on(at, ways_.script());
      if (!way && way.error().code == kLimit) {
        graph.limit = way.error().message;
        return {};
      }
      if (!way) return tl::unexpected(told(way.error(), graph.nodes[at].depth + 1));
      graph.edges.push_back({at, way->to, periods_.keep_seen(), periods_.keep_made()});
      if (options_.tells_what_is_said) graph.said.push_back(periods_.said());
      if (ways_.next(periods_)) continue;
      graph.reduced = graph.reduced || ways_.leaves_out();
      return {};
    }
  }

  // What was decided in the last period: "17 times m.door of 3".
  std::string left_open() const {
    std::map<std::string, std::size_t> times;
    for (const Made& made : periods_.made()) {
      if (made.count < 2) continue;
      if (made.kind != Made::Kind::kChoice) {
        ++times[made.kind == Made::Kind::kOrder ? "which part is first" : "a fault"];
        continue;
      }
      const ChoicePoint& point = periods_.graph().choices[made.what];
      ++times[fmt::format("{}{}{} of {}", point.model, point.name.empty() ? " at " : ".",
                          point.name.empty() ? point.place : point.name, made.count)];
    }
    std::string text;
    for (const auto& [what, count] : times)
      text += fmt::format("{}{}{}", text.empty() ? "" : ", ", count > 1 ? fmt::format("{} times ", count) : "", what);
    return text;
  }

  // With when it comes, and what was chosen then.
  Diagnostic told(Diagnostic error, std::uint32_t tick) const {
    std::string chosen;
    for (const Made& made : periods_.made()) {
      if (made.kind != Made::Kind::kChoice || made.count < 2) continue;
      const ChoicePoint& point = periods_.graph().choices[made.what];
      chosen +=
          fmt::format(", {} chooses {}{}", point.model, point.name.empty() ? "" : point.name + " = ", point.value);
    }
    error.message += fmt::format(" (tick {}{})", tick, chosen);
    return error;
  }

  const Options& options_;
  Periods periods_;
  Ways ways_;
  SteadyClock::time_point started_;
  std::uint32_t at_ = 0;  // the state that is being expanded
  bool too_many_ways_ = false;
  bool is_faultless_ = false;
  // States that scouts have gone through, a share each.
  std::vector<std::unique_ptr<Scout>> scouts_;
  bool scouted_ = false;
  std::uint32_t ahead_ = kAheadMin;
  std::uint32_t ahead_begin_ = 0;
  std::uint32_t ahead_end_ = 0;
  std::uint32_t share_ = 1;
};

}  // namespace

Diagnostic too_many_alternatives(const project::Plan& plan, const mission::Choice& choice) {
  // `place` is FILE:LINE, with the file as the project has it.
  const std::size_t colon = choice.place.rfind(':');
  const auto model = std::find_if(plan.models.begin(), plan.models.end(),
                                  [&](const project::ModelPlan& one) { return one.name == choice.model; });
  SourceSpan span;
  if (colon != std::string::npos && model != plan.models.end())
    span = {model->chart.file(), std::atoi(choice.place.c_str() + colon + 1), 1, 0};
  return {Severity::kError, "verify.choice",
          fmt::format("{}: {}() leaves {} alternatives open; at most {} can be tried{}", choice.model, choice.function,
                      choice.count, kAlternativesMax,
                      std::string_view(choice.function) == "between" ? ": take a greater step" : ""),
          std::move(span)};
}

Diagnostics obstacles(const project::Plan& plan) {
  Diagnostics out = mission::VirtualHost::obstacles(plan);
  const auto way_out = [](scxml::Ambient what) {
    switch (what) {
      case scxml::Ambient::kInvokeId: return "give it an id";
      case scxml::Ambient::kIdText: return "compare ids, cancel and send by them, or give what they are of an id";
      default: return "let a model decide (chance, choose), or wait by delayed <send>s";
    }
  };
  const auto look = [&](const scxml::Chart& chart, const std::string& whose) {
    for (const scxml::AmbientUse& use : chart.ambient()) {
      if (use.what == scxml::Ambient::kIds) continue;
      out.push_back({Severity::kError, "verify.clock",
                     fmt::format("{} asks for {}, so that no state of it ever comes again; {}", whose, use.name,
                                 way_out(use.what)),
                     use.span});
    }
  };
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (leaf.chart) look(*leaf.chart, "skill " + leaf.name);
  }
  for (const project::ModelPlan& model : plan.models) look(model.chart, "model " + model.name);
  for (const monitor::Model& model : plan.monitors) {
    look(model.chart(), "monitor " + model.name());
    for (const char* const name : {"monitor.violated", "monitor.satisfied", "monitor.given_up"}) {
      // One that listens to whatever comes is not about these.
      if (!model.listens_to(name) || model.listens_to("nobody.nothing")) continue;
      out.push_back({Severity::kError, "verify.monitor",
                     fmt::format("monitor {} waits for {}, which nobody says where every behaviour is tried: each "
                                 "requirement is judged by itself",
                                 model.name(), name),
                     SourceSpan{plan.scenario.project.file}});
      break;
    }
  }
  std::vector<std::string> modelled;
  for (const project::ModelPlan& model : plan.models)
    modelled.insert(modelled.end(), model.serves.begin(), model.serves.end());
  for (const project::Injection& injection : plan.scenario.timeline) {
    const auto error = [&](std::string message) {
      out.push_back({Severity::kError, "verify.fault", std::move(message), injection.span});
    };
    if (std::holds_alternative<project::intervention::Breakpoint>(injection.what))
      error("nobody is there whom a timeline could let break, where every behaviour is tried; leave it out");
    const auto* const call = std::get_if<project::intervention::Call>(&injection.what);
    if (call == nullptr) continue;
    const std::string service = call->method.substr(0, call->method.rfind('.'));
    if (std::find(modelled.begin(), modelled.end(), service) != modelled.end()) continue;
    std::string there;
    for (const std::string& one : modelled) there += (there.empty() ? "" : ", ") + one;
    error(
        fmt::format("a timeline can call only what models serve ({}), and {} is none of it{}; let a model choose what "
                    "may happen there",
                    there.empty() ? "nothing here" : there, service, did_you_mean(service, modelled)));
  }
  return out;
}

Duration Graph::judged(const Edge& edge) const {
  const Duration all = lasts(edge);
  return nodes[edge.to].cut_off && all > Duration(0) ? all - Duration(1) : all;
}

Duration Graph::lasts(const Edge& edge) const {
  if (edge.from == 0) return Duration(0);
  const Node& to = nodes[edge.to];
  const Duration begun = (to.at - TimePoint{}) % period;
  return to.ended && begun > Duration(0) ? begun : period;
}

void for_each(const Each& each, std::size_t count, const std::function<void(std::size_t)>& work) {
  if (each) return each(count, work);
  for (std::size_t i = 0; i < count; ++i) work(i);
}

Result<Graph> explore(const project::Plan& plan, const Options& options) {
  auto graph = Explorer(plan, options)();
  if (!graph && graph.error().code == "bt.asks-time" && options.times == bt::Times::kFromNow) {
    Options apart = options;
    apart.times = bt::Times::kAbsolute;
    return explore(plan, apart);
  }
  if (!graph || !graph->reduced || !graph->probabilistic) return graph;
  Options all = options;
  all.reduce_orders = false;
  return Explorer(plan, all)();
}

}  // namespace sentree::verify
