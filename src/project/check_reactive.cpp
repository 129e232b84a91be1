#include "sentree/project/detail/check_reactive.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "sentree/bt/model.h"

namespace sentree::project {

namespace {

// Whether the tick with which a run of the chart begins cannot end it.
bool takes_time(const scxml::Chart& chart) {
  const auto states = chart.states();
  const std::vector<std::string> named = chart.events_sent();
  // What <raise> brings comes at once; what is sent comes later, or is a call.
  const auto is_raised = [&](const std::string& event) {
    const auto sends = chart.sends();
    return std::find(named.begin(), named.end(), event) != named.end() &&
           std::none_of(sends.begin(), sends.end(), [&](const scxml::SendInfo& send) { return send.event == event; });
  };
  const auto may_come_at_once = [&](const std::string& event) {
    return event == "tick" || event == "*" || event == "done" || event.starts_with("done.state") || is_raised(event);
  };
  for (const scxml::Transition& transition : chart.transitions()) {
    const bool ends = std::any_of(transition.targets.begin(), transition.targets.end(), [&](scxml::StateIndex target) {
      return states[target].kind == scxml::StateKind::kFinal && states[target].parent == 0;
    });
    const bool is_sent = std::any_of(transition.events.begin(), transition.events.end(), [&](const std::string& event) {
      return std::any_of(chart.sends().begin(), chart.sends().end(),
                         [&](const scxml::SendInfo& send) { return send.event == event; });
    });
    if (!ends || is_sent) continue;
    if (transition.events.empty() || std::any_of(transition.events.begin(), transition.events.end(), may_come_at_once))
      return false;
  }
  return true;
}

}  // namespace

void check_reactive(const bt::Tree& tree, const std::vector<LeafPlan>& leaves, Diagnostics& diagnostics) {
  if (tree.format() != 4) return;
  std::map<bt::NodeId, const LeafPlan*> slow;
  for (const LeafPlan& leaf : leaves) {
    if (!leaf.condition && leaf.chart && !leaf.protocol && takes_time(*leaf.chart)) slow.emplace(leaf.node, &leaf);
  }
  if (slow.size() < 2) return;
  for (bt::NodeId node = 0; node < tree.size(); ++node) {
    const bt::Kind kind = tree.model().nodes[node].kind;
    if (kind != bt::Kind::kReactiveSequence && kind != bt::Kind::kReactiveFallback) continue;
    for (const bt::NodeId child : tree.children(node)) {
      const auto first = slow.find(child);
      if (first == slow.end() || !tree.conditions(child).empty()) continue;
      const auto later = slow.lower_bound(tree.subtree_end(child));
      if (later == slow.end() || later->first >= tree.subtree_end(node)) continue;
      add(diagnostics, Severity::kWarning, "check.reactive",
          fmt::format(
              "{0} never gets to its end: {1} before it is an action that takes time, which the {2} starts anew "
              "at each tick and so halts {0}; make {1} a condition, or write Sequence",
              later->second->name, first->second->name, tree.registration(node)),
          tree.span(child));
      break;
    }
  }
}

}  // namespace sentree::project
