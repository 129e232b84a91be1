#include "sentree/verify/detail/mission_flow.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/scxml/script_syntax.h"

namespace sentree::verify {

namespace {

// The entry of the blackboard that a port is bound to; empty: none.
std::string entry_of(const bt::PortFact& port) {
  if (port.text == "{=}") return std::string(port.name);
  if (port.text.size() < 3 || port.text.front() != '{' || port.text.back() != '}') return {};
  // One of the root blackboard is the same from everywhere.
  const std::size_t first = port.text[1] == '@' ? 2 : 1;
  return std::string(port.text.substr(first, port.text.size() - first - 1));
}

}  // namespace

MissionFlow::MissionFlow(const project::Plan& plan, std::string service, const ReplyTypes& types,
                         std::set<std::size_t> callers)
    : plan_(plan), service_(std::move(service)), types_(types), callers_(std::move(callers)) {
  for (const std::size_t leaf : callers_) follow(leaf);
  for (std::size_t before = 0; entries_.size() + passed_.size() > before;) {
    before = entries_.size() + passed_.size();
    for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) follow(leaf);
    for (bt::NodeId node = 0; node < plan.tree.size(); ++node) follow(node);
  }
}

std::optional<Diagnostic> MissionFlow::trouble(const LookedAt& looked_at) const {
  if (entries_.empty()) return std::nullopt;
  for (const project::LeafPlan& leaf : plan_.leaves) {
    for (const std::string& input : far_inputs(leaf)) {
      if (!looked_at.inputs.contains(input)) continue;
      return Diagnostic{Severity::kError, "verify.any-reply",
                        fmt::format("a reply of {} comes through the blackboard into the input {} of {}, at which a "
                                    "monitor looks, so that which of its values are told apart is not known",
                                    service_, input, leaf.name),
                        plan_.tree.span(leaf.node)};
    }
  }
  std::set<bt::NodeId> charted;
  for (const project::LeafPlan& leaf : plan_.leaves) {
    if (leaf.chart) charted.insert(leaf.node);
  }
  for (bt::NodeId node = 0; node < plan_.tree.size(); ++node) {
    for (const auto& [name, script] : plan_.tree.conditions(node)) {
      if (const auto entry = mentioned(script); !entry.empty()) return told(node, entry);
    }
    const std::string_view id = plan_.tree.registration(node);
    const bool is_script = id == "Script" || id == "ScriptCondition" || id == "Precondition";
    if (!plan_.tree.subtree_id(node).empty() || charted.contains(node)) continue;
    for (const bt::PortFact& port : plan_.tree.ports(node)) {
      const bool is_bound = port.text.find('{') != std::string_view::npos;
      // Its name need not be one of a script.
      if (const auto bound = entry_of(port); entries_.contains(bound)) return told(node, bound);
      if (const auto entry = is_bound || is_script ? mentioned(port.text) : ""; !entry.empty())
        return told(node, entry);
    }
  }
  return std::nullopt;
}

std::string MissionFlow::mentioned(std::string_view text) const {
  for (const std::string& name : scxml::names_in_script(text)) {
    if (entries_.contains(name)) return name;
  }
  return {};
}
Diagnostic MissionFlow::told(bt::NodeId node, const std::string& entry) const {
  return {Severity::kError, "verify.any-reply",
          fmt::format("{} looks at the entry {} of the blackboard, into which a reply of {} goes, so that which of its "
                      "values are told apart is not known",
                      plan_.tree.name(node), entry, service_),
          plan_.tree.span(node)};
}

std::set<std::string> MissionFlow::far_inputs(const project::LeafPlan& leaf) const {
  std::set<std::string> far;
  for (const bt::PortFact& port : plan_.tree.ports(leaf.node)) {
    const bool is_bound = port.text.find('{') != std::string_view::npos;
    if (port.input && is_bound && (entries_.contains(entry_of(port)) || !mentioned(port.text).empty()))
      far.emplace(port.name);
  }
  return far;
}

void MissionFlow::follow(std::size_t leaf) {
  const project::LeafPlan& of = plan_.leaves[leaf];
  if (!of.chart) return;
  const auto ports = plan_.tree.ports(of.node);
  std::set<std::string> far = far_inputs(of);
  for (const auto& [call, argument] : passed_) {
    const bool is_heard = call.empty()
                              ? !of.subscribes.empty()
                              : std::find(of.subscribes.begin(), of.subscribes.end(), call) != of.subscribes.end();
    if (is_heard) far.insert(argument);
  }
  if (far.empty() && !callers_.contains(leaf)) return;
  auto flow = flows_.find(leaf);
  if (flow == flows_.end() || far != far_[leaf]) {
    if (flow != flows_.end()) flows_.erase(flow);
    ReplyFlow::Answer answer;
    if (of.protocol) answer = {of.protocol->answer, of.protocol->param};
    flow = flows_.try_emplace(leaf, *of.chart, service_, types_, far, std::move(answer)).first;
    far_[leaf] = std::move(far);
  }
  passed_.merge(flow->second.passed());
  for (const std::string& given : flow->second.given()) {
    for (const bt::PortFact& port : ports) {
      if (port.name == given && port.output) add(entry_of(port));
    }
  }
}
// Through the ports of a SubTree, either way.
void MissionFlow::follow(bt::NodeId node) {
  if (entries_.empty() || plan_.tree.subtree_id(node).empty()) return;
  for (const bt::PortFact& port : plan_.tree.ports(node)) {
    const std::string outer = entry_of(port);
    if (entries_.contains(outer)) add(std::string(port.name));
    if (entries_.contains(std::string(port.name))) add(outer);
  }
}
void MissionFlow::add(const std::string& entry) {
  if (!entry.empty()) entries_.insert(entry);
}

}  // namespace sentree::verify
