#include "sentree/mission/carry.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "sentree/bt/carry.h"
#include "sentree/monitor/carry.h"
#include "sentree/scxml/carry.h"
#include "sentree/sim/state.h"

namespace sentree::mission {

namespace {

constexpr std::size_t kGone = Carried::kGone;

class Mapping {
 public:
  Mapping(const project::Plan& before, const State& state, const project::Plan& after)
      : before_(before), old_(state), after_(after) {}

  Loaded<Carried> carry() {
    // All that belongs to no part of the plan stays as it is.
    State& next = out_.state;
    next = old_;
    next.queue.clear();
    tree();
    skills();
    models();
    monitors();
    world();
    for (const Waiting& waiting : old_.queue) {
      if (auto what = delivery(waiting.what)) next.queue.push_back({waiting.when, waiting.rank, waiting.order, *what});
    }
    if (problems_.empty()) {
      // Whatever a step takes for granted of a state is looked at there.
      const auto saved = save(after_, next);
      const auto back = saved ? restore(after_, *saved) : tl::unexpected(saved.error());
      if (!back) problems_.push_back(back.error());
    }
    Loaded<Carried> carried;
    carried.diagnostics = std::move(problems_);
    if (carried.diagnostics.empty()) carried.value = std::move(out_);
    return carried;
  }

 private:
  void refuse(std::string what, const SourceSpan& span = {}) {
    problems_.push_back({Severity::kError, "mission.cannot-carry", std::move(what), span});
  }
  void refuse_for(const std::string& whom, Diagnostics problems) {
    for (Diagnostic& problem : problems) {
      problem.message = fmt::format("{}: {}", whom, problem.message);
      problems_.push_back(std::move(problem));
    }
  }
  void changed(std::string what) { out_.changes.push_back(std::move(what)); }

  void tree() {
    auto carried = bt::carry(before_.tree, old_.tree.tree, after_.tree);
    for (Diagnostic& problem : carried.diagnostics) problems_.push_back(std::move(problem));
    out_.leaf_of.assign(before_.leaves.size(), kGone);
    TreeState& next = out_.state.tree;
    next = old_.tree;
    next.leaves.clear();
    if (carried.ok()) next.tree = std::move(carried.value->state);
    for (std::size_t i = 0; i < before_.leaves.size(); ++i) {
      const project::LeafPlan& leaf = before_.leaves[i];
      const auto known = old_.tree.leaves.find(i);
      const bt::NodeId node = carried.ok() ? carried.value->node_of[leaf.node] : bt::kNoNode;
      const auto same = std::find_if(after_.leaves.begin(), after_.leaves.end(), [&](const project::LeafPlan& other) {
        return carried.ok() ? other.node == node : other.name == leaf.name;
      });
      if (same == after_.leaves.end()) {
        changed(fmt::format("leaf {} is gone", leaf.name));
        if (known != old_.tree.leaves.end() && (known->second.outstanding != 0 || known->second.halt_call != 0))
          refuse(fmt::format("leaf {} owes an answer, and is gone", leaf.name), before_.tree.span(leaf.node));
        continue;
      }
      out_.leaf_of[i] = static_cast<std::size_t>(same - after_.leaves.begin());
      if (known != old_.tree.leaves.end()) next.leaves[out_.leaf_of[i]] = known->second;
    }
    if (carried.ok()) nodes(carried.value->node_of);
    const auto gone = [&](std::size_t leaf) { return leaf >= out_.leaf_of.size() || out_.leaf_of[leaf] == kGone; };
    next.deadline.leaf = gone(next.deadline.leaf) ? 0 : out_.leaf_of[next.deadline.leaf];
    for (std::size_t i = 0; i < after_.leaves.size(); ++i) {
      if (std::find(out_.leaf_of.begin(), out_.leaf_of.end(), i) == out_.leaf_of.end())
        changed(fmt::format("leaf {} is new", after_.leaves[i].name));
    }
  }

  // What is other in nodes that are the same, and which of those with children are not there on both sides.
  void nodes(const std::vector<bt::NodeId>& node_of) {
    const bt::Tree& was = before_.tree;
    const bt::Tree& is = after_.tree;
    std::vector<bool> known(is.size(), false);
    for (bt::NodeId node = 0; node < was.size(); ++node) {
      const bt::NodeId other = node_of[node];
      if (other == bt::kNoNode) {
        if (!was.is_external(node)) changed(fmt::format("node {} is gone", was.path(node)));
        continue;
      }
      known[other] = true;
      const auto then = said_of(was, node);
      const auto now = said_of(is, other);
      for (const auto& [name, text] : then) {
        const auto found = now.find(name);
        if (found == now.end())
          changed(fmt::format("{} of {} is gone", name, was.path(node)));
        else if (found->second != text)
          changed(fmt::format("{} of {} is \"{}\", not \"{}\"", name, was.path(node), found->second, text));
      }
      for (const auto& [name, text] : now) {
        if (!then.contains(name)) changed(fmt::format("{} of {} is new: \"{}\"", name, was.path(node), text));
      }
    }
    for (bt::NodeId node = 0; node < is.size(); ++node) {
      if (!known[node] && !is.is_external(node)) changed(fmt::format("node {} is new", is.path(node)));
    }
  }

  // Ports and conditions, as written.
  static std::map<std::string_view, std::string_view> said_of(const bt::Tree& tree, bt::NodeId node) {
    std::map<std::string_view, std::string_view> said;
    for (const bt::PortFact& port : tree.ports(node)) said[port.name] = port.text;
    for (const auto& [kind, script] : tree.conditions(node)) said[kind] = script;
    return said;
  }

  void skills() {
    auto& skills = out_.state.skills;
    skills.assign(after_.leaves.size(), {});
    for (std::size_t i = 0; i < before_.leaves.size(); ++i) {
      const project::LeafPlan& leaf = before_.leaves[i];
      const SkillState& skill = old_.skills[i];
      if (out_.leaf_of[i] == kGone) {
        if (skill.running()) refuse(fmt::format("the skill of {} is at work, and its leaf is gone", leaf.name), {});
        continue;
      }
      const project::LeafPlan& other = after_.leaves[out_.leaf_of[i]];
      SkillState& next = skills[out_.leaf_of[i]];
      next = skill;
      if (!leaf.chart || !other.chart) {
        refuse(fmt::format("the skill of {} is no chart of this run", leaf.name));
        continue;
      }
      if (leaf.chart->fingerprint() != other.chart->fingerprint()) {
        changed(fmt::format("the chart of {} is another one", leaf.name));
        next.latest = {
            .transition = std::nullopt, .event = skill.latest.event, .transitions = skill.latest.transitions};
      }
      if (skill.running() && leaf.protocol.has_value() != other.protocol.has_value())
        refuse(fmt::format("the skill of {} is at work, and is ticked in another way now", leaf.name));
      if (skill.running()) {
        auto session = scxml::carry(*leaf.chart, skill.session, *other.chart);
        if (session.ok())
          next.session = std::move(*session.value);
        else
          refuse_for("the skill of " + leaf.name, std::move(session.diagnostics));
      } else if (leaf.chart->fingerprint() != other.chart->fingerprint()) {
        next.session = scxml::Session();  // its next run begins anew
      }
      std::erase_if(next.goals, [&](const SkillState::Goal& goal) {
        const auto service = after_.services.find(goal.service);
        return service == after_.services.end() || !is_action(*service->second.service);
      });
      std::erase_if(next.heard, [&](const Shared<Publication>& heard) {
        return std::find(other.latest.begin(), other.latest.end(), heard->topic) == other.latest.end();
      });
      for (SkillState::Line& line : next.lines) {
        for (const Shared<Call>& call : line.waiting) check(call);
      }
    }
  }

  void models() {
    auto& models = out_.state.models;
    models.assign(after_.models.size(), {});
    model_of_.assign(before_.models.size(), kGone);
    std::vector<bool> known(after_.models.size(), false);
    for (std::size_t i = 0; i < before_.models.size(); ++i) {
      const project::ModelPlan& model = before_.models[i];
      const auto same = std::find_if(after_.models.begin(), after_.models.end(),
                                     [&](const project::ModelPlan& other) { return other.name == model.name; });
      if (same == after_.models.end()) {
        refuse(fmt::format("model {} is gone, and what it stands for with it", model.name));
        continue;
      }
      const auto index = static_cast<std::size_t>(same - after_.models.begin());
      model_of_[i] = index;
      known[index] = true;
      models[index] = old_.models[i];
      auto session = scxml::carry(model.chart, old_.models[i].session, same->chart);
      if (session.ok())
        models[index].session = std::move(*session.value);
      else
        refuse_for("model " + model.name, std::move(session.diagnostics));
      for (ModelState::OpenCall& open : models[index].open) {
        open.leaf = caller(open.leaf);
        check(open.call);
      }
    }
    for (std::size_t i = 0; i < known.size(); ++i) {
      if (!known[i]) refuse(fmt::format("model {} is new; a model begins with its run", after_.models[i].name));
    }
  }

  void monitors() {
    auto& memory = out_.state.monitors;
    memory.states.clear();
    for (const monitor::Model& model : after_.monitors) {
      const auto same = std::find_if(before_.monitors.begin(), before_.monitors.end(),
                                     [&](const monitor::Model& other) { return other.name() == model.name(); });
      if (same == before_.monitors.end()) {
        changed(fmt::format("monitor {} is new, and begins now", model.name()));
        memory.states.push_back(monitor::start(model, old_.now));
        continue;
      }
      const monitor::State& state = old_.monitors.states[static_cast<std::size_t>(same - before_.monitors.begin())];
      if (same->chart().fingerprint() != model.chart().fingerprint())
        changed(fmt::format("the chart of monitor {} is another one", model.name()));
      auto carried = monitor::carry(*same, state, model, old_.now);
      if (carried.ok())
        memory.states.push_back(std::move(*carried.value));
      else
        refuse_for("monitor " + model.name(), std::move(carried.diagnostics));
    }
    for (std::size_t i = 0; i < before_.monitors.size(); ++i) {
      const std::string& name = before_.monitors[i].name();
      const bool stays = std::any_of(after_.monitors.begin(), after_.monitors.end(),
                                     [&](const monitor::Model& model) { return model.name() == name; });
      if (stays) continue;
      // What it has found must not be lost.
      if (old_.monitors.states[i].verdict == monitor::Verdict::kViolated)
        refuse(fmt::format("monitor {} is violated, and is gone", name));
      changed(fmt::format("monitor {} is gone", name));
    }
  }

  void world() {
    out_.state.world.reset();
    if (!old_.world) return;
    if (after_.world == nullptr) {
      changed("the simulated world is gone");
      return;
    }
    auto world = sim::restore(*after_.world, sim::save(*old_.world));
    if (world)
      out_.state.world = std::move(*world);
    else
      refuse("the simulated world: " + world.error().message);
  }

  [[nodiscard]] std::size_t caller(std::size_t leaf) {
    if (leaf == ServeCall::kOutside) return leaf;
    if (out_.leaf_of[leaf] != kGone) return out_.leaf_of[leaf];
    refuse(fmt::format("a call of {} is open, and its leaf is gone", before_.leaves[leaf].name));
    return ServeCall::kOutside;
  }

  void check(const Shared<Call>& call) {
    const auto service = after_.services.find(call->service);
    if (service == after_.services.end() || service->second.service->find(call->method) == nullptr)
      refuse(
          fmt::format("a call of {}.{} is on its way, and there is no such method now", call->service, call->method));
  }

  // Nothing: it was for a leaf that is gone, and no longer matters.
  std::optional<Delivery> delivery(Delivery what) {
    if (auto* to_tree = std::get_if<TreeDelivery>(&what.what)) {
      const bool stays = std::visit(
          [&](auto& about) {
            if constexpr (requires { about.leaf; }) {
              about.leaf = out_.leaf_of[about.leaf];
              return about.leaf != kGone;
            } else {
              return true;
            }
          },
          *to_tree);
      return stays ? std::optional(std::move(what)) : std::nullopt;
    }
    if (auto* to_skill = std::get_if<SkillDelivery>(&what.what)) {
      what.leaf = out_.leaf_of[what.leaf];
      if (what.leaf == kGone) return std::nullopt;
      std::visit(
          [&](const auto& about) {
            if constexpr (requires { about.call; }) check(about.call);
          },
          *to_skill);
      return what;
    }
    auto& to_model = std::get<ModelDelivery>(what.what);
    what.leaf = model_of_[what.leaf];
    if (what.leaf == kGone) return std::nullopt;
    if (auto* serve = std::get_if<ServeCall>(&to_model)) {
      serve->leaf = caller(serve->leaf);
      check(serve->call);
    }
    return what;
  }

  const project::Plan& before_;
  const State& old_;
  const project::Plan& after_;
  Carried out_;
  Diagnostics problems_;
  std::vector<std::size_t> model_of_;
};

}  // namespace

Loaded<Carried> carry(const project::Plan& before, const State& state, const project::Plan& after) {
  return Mapping(before, state, after).carry();
}

}  // namespace sentree::mission
