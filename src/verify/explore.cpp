#include "sentree/verify/explore.h"

#include <utility>

#include "sentree/verify/periods.h"

namespace sentree::verify {

namespace {

using SteadyClock = std::chrono::steady_clock;

const std::string kMemory = "the limit of memory";

class Explorer {
 public:
  Explorer(const project::Plan& plan, const Options& options) : options_(options), periods_(plan, options) {}

  Result<Graph> operator()() {
    if (auto begun = periods_.begin(); !begun) return tl::unexpected(begun.error());
    started_ = SteadyClock::now();
    Graph& graph = periods_.graph();
    for (std::uint32_t at = 0; at < graph.nodes.size(); ++at) {
      graph.limit = limit(graph.nodes[at].depth);
      if (!graph.limit.empty()) break;
      graph.nodes[at].first_edge = static_cast<std::uint32_t>(graph.edges.size());
      if (graph.nodes[at].ended) continue;
      if (auto done = expand(at); !done) return tl::unexpected(done.error());
      graph.nodes[at].edges = static_cast<std::uint32_t>(graph.edges.size()) - graph.nodes[at].first_edge;
      if (!graph.limit.empty()) break;
      graph.complete_to = graph.nodes[at].depth + 1;
      periods_.drop();
      if (options_.progress && at % 1024 == 0) options_.progress(graph.nodes.size(), graph.edges.size());
    }
    graph.complete = graph.limit.empty();
    // What grows without end, most likely.
    if (graph.limit == kMemory || graph.limit.ends_with(" states")) {
      if (const std::string most = periods_.most_varied(3); !most.empty()) graph.limit += "; most values had " + most;
    }
    return std::move(graph);
  }

 private:
  std::string limit(std::uint32_t depth) const {
    if (depth >= options_.ticks) return "the limit of " + std::to_string(options_.ticks) + " ticks";
    if (periods_.graph().nodes.size() > options_.states)
      return "the limit of " + std::to_string(options_.states) + " states";
    return limit_now();
  }
  // What can also be reached between two ways of one state.
  std::string limit_now() const {
    if (options_.interrupted && options_.interrupted()) return "interrupted";
    if (options_.time && SteadyClock::now() - started_ > *options_.time) return "the limit of time";
    if (periods_.bytes() > options_.memory) return kMemory;
    return {};
  }

  // Every way in which the next period of a state can go.
  Result<void> expand(std::uint32_t at) {
    Graph& graph = periods_.graph();
    script_.clear();
    for (std::size_t ways = 0;; ++ways) {
      if (ways >= kWaysMax) {
        return fail("verify.choice", "tick " + std::to_string(graph.nodes[at].depth + 1) + " can go on in more than " +
                                         std::to_string(kWaysMax) + " ways; leave less open at one instant");
      }
      if (ways % 64 == 63) graph.limit = limit_now();
      if (!graph.limit.empty()) return {};
      const auto way = periods_.go_on(at, script_);
      if (!way) return tl::unexpected(way.error());
      graph.edges.push_back({at, way->to, periods_.keep_seen(), periods_.keep_made()});
      // The next: the last decision that has an alternative left takes it.
      std::vector<Made>& made = periods_.made();
      while (!made.empty() && made.back().alternative + 1 >= made.back().count) made.pop_back();
      if (made.empty()) return {};
      script_.clear();
      for (const Made& one : made) script_.push_back(one.alternative);
      ++script_.back();
    }
  }

  const Options& options_;
  Periods periods_;
  std::vector<std::uint32_t> script_;
  SteadyClock::time_point started_;
};

}  // namespace

Diagnostics obstacles(const project::Plan& plan) {
  Diagnostics out = mission::VirtualHost::obstacles(plan);
  const auto look = [&](const scxml::Chart& chart, const std::string& whose) {
    for (const scxml::AmbientUse& use : chart.ambient()) {
      if (use.what == scxml::Ambient::kIds) continue;
      out.push_back({Severity::kError, "verify.clock",
                     whose + " asks for " + use.name +
                         ", so that no state of it ever comes again; let a model decide (chance, choose), or wait by "
                         "delayed <send>s",
                     use.span});
    }
  };
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (leaf.chart) look(*leaf.chart, "skill " + leaf.name);
  }
  for (const project::ModelPlan& model : plan.models) look(model.chart, "model " + model.name);
  for (const monitor::Model& model : plan.monitors) look(model.chart(), "monitor " + model.name());
  for (const project::Injection& injection : plan.scenario.timeline) {
    if (std::holds_alternative<project::intervention::Call>(injection.what) ||
        std::holds_alternative<project::intervention::Breakpoint>(injection.what)) {
      out.push_back({Severity::kError, "verify.fault",
                     "a timeline cannot call services or break here; what a person may do is a choice of the model",
                     injection.span});
    }
  }
  return out;
}

Result<Graph> explore(const project::Plan& plan, const Options& options) { return Explorer(plan, options)(); }

}  // namespace sentree::verify
