#include "sentree/campaign/coverage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "sentree/runtime/inside.h"
#include "sentree/runtime/local_skill.h"

namespace sentree::campaign {

namespace {

using Kind = Coverage::Kind;
using Thing = Coverage::Thing;

constexpr std::array<std::string_view, 6> kKindNames{"nodes",  "states",  "transitions",
                                                     "guards", "methods", "requirements"};
// Things not reached that people are shown of each kind.
constexpr std::size_t kShownMax = 12;

std::string place(const SourceSpan& span) {
  return span.line > 0 ? fmt::format("{}:{}", span.file, span.line) : std::string();
}

bool is_a_place_to_be(const scxml::State& state) {
  return state.kind != scxml::StateKind::kRoot && !state.is_history();
}

Thing state_thing(const scxml::Chart& chart, scxml::StateIndex index) {
  const scxml::State& state = chart.states()[index];
  const std::string at = place(chart.span(state.place));
  return {Kind::kState, chart.file(), state.id.empty() ? at : state.id, at};
}

// A condition may be written over several lines.
std::string in_one_line(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const bool is_space = c == ' ' || c == '\t' || c == '\n' || c == '\r';
    if (!is_space)
      line += c;
    else if (!line.empty() && line.back() != ' ')
      line += ' ';
  }
  return line;
}

Thing transition_thing(const scxml::Chart& chart, scxml::TransitionIndex index) {
  const scxml::Transition& transition = chart.transitions()[index];
  std::string what = chart.states()[transition.source].id;
  for (const std::string& event : transition.events)
    what += (&event == &transition.events.front() ? " on " : " ") + event;
  if (!transition.condition.empty()) what += " if " + in_one_line(transition.condition);
  for (const scxml::StateIndex target : transition.targets) what += " → " + chart.states()[target].id;
  return {Kind::kTransition, chart.file(), std::move(what), place(chart.span(transition.place))};
}

Thing guard_thing(const scxml::Chart& chart, scxml::TransitionIndex index, bool holds) {
  Thing thing = transition_thing(chart, index);
  thing.kind = Kind::kGuard;
  thing.what += holds ? ": true" : ": false";
  return thing;
}

Thing requirement_thing(const monitor::Model& model) {
  const monitor::Origin* origin = model.origin();
  return {Kind::kRequirement, model.name(), "",
          origin != nullptr ? place(origin->requirement.span) : place({model.chart().file(), 1, 1})};
}

// <initial> and <history> have transitions too, which belong to no state's list.
std::vector<scxml::TransitionIndex> transitions_of(const scxml::Chart& chart) {
  std::vector<scxml::TransitionIndex> all;
  for (const scxml::State& state : chart.states())
    all.insert(all.end(), state.transitions.begin(), state.transitions.end());
  return all;
}

std::vector<std::string> statuses_of(const bt::Tree& tree, bt::NodeId node) {
  std::vector<std::string> statuses{"SUCCESS", "FAILURE"};
  if (tree.category(node) == bt::Category::kAction) statuses.emplace_back("RUNNING");
  return statuses;
}

constexpr std::array<std::string_view, 3> kCallOutcomes{"reply", "error", "late"};

}  // namespace

std::string_view to_string(Kind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }

void Coverage::add(const project::Plan& plan) {
  const auto can = [this](Thing thing) { things_.emplace(std::move(thing), false); };
  for (bt::NodeId node = 0; node < plan.tree.size(); ++node) {
    for (std::string& status : statuses_of(plan.tree, node))
      can({Kind::kNode, plan.tree.path(node), std::move(status), place(plan.tree.span(node))});
  }
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (!leaf.chart || !leaf.at.empty()) continue;
    const scxml::Chart& chart = *leaf.chart;
    for (scxml::StateIndex state = 0; state < chart.states().size(); ++state) {
      if (is_a_place_to_be(chart.states()[state])) can(state_thing(chart, state));
    }
    for (const scxml::TransitionIndex transition : transitions_of(chart)) {
      can(transition_thing(chart, transition));
      if (chart.transitions()[transition].condition.empty()) continue;
      for (const bool holds : {true, false}) can(guard_thing(chart, transition, holds));
    }
    for (const scxml::SendInfo& send : scxml::sends_with_invoked(chart)) {
      if (send.type != "thrift" || !send.target || !send.event) continue;
      const auto service = plan.services.find(*send.target);
      if (service == plan.services.end()) continue;
      const idl::Method* method = service->second.service->find(*send.event);
      if (method == nullptr || method->oneway) continue;
      for (const std::string_view outcome : kCallOutcomes)
        can({Kind::kMethod, fmt::format("{}.{}", *send.target, *send.event), std::string(outcome), ""});
    }
  }
  for (const monitor::Model& model : plan.monitors) can(requirement_thing(model));
}

void Coverage::add(const Coverage& other) {
  for (const auto& [thing, reached] : other.things_) {
    bool& here = things_[thing];
    here = here || reached;
  }
}

void Coverage::reach(const Thing& thing) {
  if (const auto found = things_.find(thing); found != things_.end()) found->second = true;
}

Coverage::Met::Met(const project::Plan& plan)
    : nodes(plan.tree.size()),
      states(plan.leaves.size()),
      transitions(plan.leaves.size()),
      guards(plan.leaves.size()) {}

void Coverage::reach(const project::Plan& plan, const Met& met) {
  for (bt::NodeId node = 0; node < met.nodes.size(); ++node) {
    for (const std::string& status : met.nodes[node])
      reach({Kind::kNode, plan.tree.path(node), status, place(plan.tree.span(node))});
  }
  for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) {
    if (!plan.leaves[leaf].chart) continue;
    const scxml::Chart& chart = *plan.leaves[leaf].chart;
    std::set<scxml::StateIndex> states = met.states[leaf];
    for (const scxml::TransitionIndex index : met.transitions[leaf]) {
      reach(transition_thing(chart, index));
      // What a chart only passes through it does not rest in.
      const scxml::Transition& transition = chart.transitions()[index];
      states.insert(transition.source);
      states.insert(transition.targets.begin(), transition.targets.end());
    }
    for (const auto& [index, holds] : met.guards[leaf]) reach(guard_thing(chart, index, holds));
    for (scxml::StateIndex state : states) {
      for (; state != scxml::kNoState; state = chart.states()[state].parent) {
        if (is_a_place_to_be(chart.states()[state])) reach(state_thing(chart, state));
      }
    }
  }
  for (const auto& [call, outcome] : met.calls) reach({Kind::kMethod, call, outcome, ""});
  for (const monitor::Model& model : plan.monitors) {
    if (met.tested.contains(model.name())) reach(requirement_thing(model));
  }
}

std::vector<std::uint32_t> Coverage::reached_of(const Coverage& known) const {
  std::vector<std::uint32_t> reached;
  std::uint32_t place = 0;
  auto at = things_.begin();
  for (auto of = known.things_.begin(); of != known.things_.end(); ++of, ++place) {
    while (at != things_.end() && at->first < of->first) ++at;
    if (at == things_.end()) break;
    if (at->first == of->first && at->second) reached.push_back(place);
  }
  return reached;
}

void Coverage::reach(std::span<const std::uint32_t> things) {
  std::uint32_t place = 0;
  auto wanted = things.begin();
  for (auto at = things_.begin(); at != things_.end() && wanted != things.end(); ++at, ++place) {
    if (*wanted != place) continue;
    at->second = true;
    ++wanted;
  }
}

Coverage::Count Coverage::count(Kind kind) const {
  Count count;
  for (const auto& [thing, reached] : things_) {
    if (thing.kind != kind) continue;
    ++count.of;
    count.reached += reached ? 1 : 0;
  }
  return count;
}

Coverage::Count Coverage::all() const {
  Count count;
  for (const auto& [thing, reached] : things_) {
    ++count.of;
    count.reached += reached ? 1 : 0;
  }
  return count;
}

Value Coverage::to_value() const {
  const auto value = [](const Count& count) {
    return Map{{"reached", static_cast<std::int64_t>(count.reached)}, {"of", static_cast<std::int64_t>(count.of)}};
  };
  Map out{{"all", value(all())}};
  for (std::size_t i = 0; i < kKindNames.size(); ++i)
    out[std::string(kKindNames[i])] = value(count(static_cast<Kind>(i)));
  List missing;
  for (const auto& [thing, reached] : things_) {
    if (reached) continue;
    Map one{{"kind", to_string(thing.kind)}, {"of", thing.of}, {"what", thing.what}};
    if (!thing.at.empty()) one["at"] = thing.at;
    missing.emplace_back(std::move(one));
  }
  out["not_reached"] = std::move(missing);
  return out;
}

std::string Coverage::to_text() const {
  std::string out;
  for (std::size_t i = 0; i < kKindNames.size(); ++i) {
    const Count counted = count(static_cast<Kind>(i));
    if (counted.of == 0) continue;
    out += fmt::format("{:<13} {:>5} of {:<5} {:>5.1f} %\n", kKindNames[i], counted.reached, counted.of,
                       100.0 * static_cast<double>(counted.reached) / static_cast<double>(counted.of));
    std::size_t shown = 0;
    for (const auto& [thing, reached] : things_) {
      if (reached || thing.kind != static_cast<Kind>(i)) continue;
      if (++shown > kShownMax) continue;
      out += fmt::format(
          "  never {}{}{}\n", thing.kind == Kind::kRequirement ? thing.of + " put to the test" : thing.of,
          thing.what.empty() ? "" : ": " + thing.what, thing.at.empty() ? "" : fmt::format("   ({})", thing.at));
    }
    if (shown > kShownMax) out += fmt::format("  … and {} more (--json has all)\n", shown - kShownMax);
  }
  return out;
}

class CoverageWatch::Impl {
 public:
  Impl(const project::Plan& plan, Coverage& coverage, runtime::RunOptions& options)
      : plan_(plan), coverage_(coverage), met_(plan) {
    options.listeners.emplace_back([this](const Message& message) { observe(message); });
    options.on_skill_step = [this, before = std::move(options.on_skill_step)](std::size_t leaf,
                                                                              const runtime::Skill& skill) {
      if (before) before(leaf, skill);
      rests(leaf, skill);
    };
    options.on_begin = [this, before = std::move(options.on_begin)](runtime::RunInside& inside) {
      if (before) before(inside);
      for (std::size_t leaf = 0; leaf < plan_.leaves.size(); ++leaf) {
        if (runtime::SkillActor* skill = inside.skill(leaf)) {
          skill->watch_transitions(
              [this, leaf](scxml::TransitionIndex transition) {
                const std::lock_guard lock(mutex_);
                met_.transitions[leaf].insert(transition);
              },
              [this, leaf](scxml::TransitionIndex transition, bool holds) {
                const std::lock_guard lock(mutex_);
                met_.guards[leaf].emplace(transition, holds);
              });
        }
      }
    };
  }

  void look() {
    const std::lock_guard lock(mutex_);
    coverage_.reach(plan_, met_);
  }

  void finish(const runtime::RunReport& report) {
    for (const monitor::Model& model : plan_.monitors) {
      const auto told = std::find_if(report.monitors.begin(), report.monitors.end(),
                                     [&](const auto& monitor) { return monitor.name == model.name(); });
      if (told != report.monitors.end() && told->vacuity.empty()) met_.tested.insert(model.name());
    }
    look();
  }

 private:
  void observe(const Message& message) {
    const std::lock_guard lock(mutex_);
    if (message.name == "node.status") {
      const Value* node = message.data.find("node");
      const Value* to = message.data.find("to");
      if (node == nullptr || to == nullptr || node->as_int() == nullptr) return;
      const auto index = static_cast<std::size_t>(*node->as_int());
      if (index < met_.nodes.size()) met_.nodes[index].insert(std::string(to->text()));
      return;
    }
    if (message.kind != MessageKind::kReply && message.kind != MessageKind::kError) return;
    if (!plan_.services.contains(message.target)) return;
    const bool is_error = message.kind == MessageKind::kError;
    const std::string call = message.name.substr(0, message.name.rfind('.'));
    const Value* kind = is_error ? message.data.find("kind") : nullptr;
    met_.calls.emplace(call, !is_error ? "reply" : kind != nullptr && kind->text() == "late" ? "late" : "error");
  }

  void rests(std::size_t leaf, const runtime::Skill& skill) {
    const std::lock_guard lock(mutex_);
    const scxml::Chart& chart = skill.chart();
    for (scxml::StateIndex state = 0; state < chart.states().size(); ++state) {
      if (skill.session().is_active(state)) met_.states[leaf].insert(state);
    }
  }

  const project::Plan& plan_;
  Coverage& coverage_;
  std::mutex mutex_;  // in real time actors are threads
  Coverage::Met met_;
};

CoverageWatch::CoverageWatch(const project::Plan& plan, Coverage& coverage, runtime::RunOptions& options)
    : impl_(std::make_unique<Impl>(plan, coverage, options)) {
  coverage.add(plan);
}
CoverageWatch::~CoverageWatch() = default;
void CoverageWatch::look() { impl_->look(); }
void CoverageWatch::finish(const runtime::RunReport& report) { impl_->finish(report); }

}  // namespace sentree::campaign
