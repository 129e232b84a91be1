#include "sentree/project/detail/check_skills.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "sentree/bt/model.h"
#include "sentree/project/detail/check_monitor.h"

namespace sentree::project {

namespace {

void check_inputs(const bt::Tree& tree, const LeafPlan& leaf, bool has_plugins, ChartMemory& charts,
                  Diagnostics& diagnostics) {
  const ChartFacts facts = charts.facts(*leaf.chart);
  const auto ports = tree.ports(leaf.node);
  // A constant that the chart does not know has been told, and may be what is missing.
  const auto& data = leaf.chart->data();
  const bool is_told = std::any_of(leaf.constants.begin(), leaf.constants.end(), [&](const SkillConstant& constant) {
    return std::none_of(data.begin(), data.end(), [&](const auto& item) { return item.id == constant.id; });
  });
  for (const scxml::DataItem& item : leaf.chart->data()) {
    if (item.has_value || facts.is_written(item.id)) continue;
    const auto port =
        std::find_if(ports.begin(), ports.end(), [&](const bt::PortFact& p) { return p.name == item.id; });
    const bool is_output = port != ports.end() && !port->input;
    const bool is_given = port != ports.end() && !port->text.empty();
    const bool is_constant = std::any_of(leaf.constants.begin(), leaf.constants.end(),
                                         [&](const SkillConstant& constant) { return constant.id == item.id; });
    if (is_constant || is_told) continue;
    if (is_given || is_output || !facts.needs(item.id)) continue;
    add(diagnostics, Severity::kError, "check.missing-input",
        fmt::format(
            "input \"{}\" of {} has no value, and {}:{} needs one: write {}=\"…\" here, or give the <data> an expr",
            item.id, leaf.name, leaf.chart->file(), item.place.line, item.id),
        tree.span(leaf.node));
  }
  for (const bt::UnwrittenEntry& entry : tree.model().unwritten) {
    if (entry.node != leaf.node) continue;
    const auto item = std::find_if(data.begin(), data.end(), [&](const auto& d) { return d.id == entry.port; });
    const bool fails = item != data.end() && !item->has_value && !facts.is_written(item->id) && facts.needs(item->id);
    add(diagnostics, fails && !has_plugins ? Severity::kError : Severity::kWarning, "check.unwritten-entry",
        fmt::format("input \"{}\" of {} reads blackboard entry \"{}\", which nothing in the tree writes", entry.port,
                    leaf.name, entry.entry),
        tree.span(leaf.node));
  }
}

void check_entries(const bt::Tree& tree, const Project& project, Diagnostics& diagnostics) {
  std::vector<std::string> known;
  const auto is_known = [&](const std::string& leaf) {
    return std::find(known.begin(), known.end(), leaf) != known.end();
  };
  for (const bt::NodeId node : tree.external_leaves()) {
    known.emplace_back(tree.name(node));
    known.emplace_back(tree.registration(node));
  }
  for (const SkillEntry& entry : project.skills) {
    if (is_known(entry.leaf)) continue;
    // Misspelt is only what nobody else is called.
    std::vector<std::string> free;
    for (const std::string& leaf : known) {
      if (project.skill(leaf, leaf) == nullptr) free.push_back(leaf);
    }
    const std::string near = did_you_mean(entry.leaf, free);
    add(diagnostics, near.empty() ? Severity::kWarning : Severity::kError, "check.unused-skill",
        fmt::format("the mission has no leaf \"{}\"{}", entry.leaf, near), entry.span);
  }
}

}  // namespace

void check_skills(const bt::Tree& tree, const std::vector<LeafPlan>& leaves,
                  const std::map<std::string, ServicePlan>& services, const monitor::Vocabulary& vocabulary,
                  const Project& project, ChartMemory& charts, Diagnostics& diagnostics) {
  check_entries(tree, project, diagnostics);
  // Of services that could not be read it has been said.
  const bool are_services_known = services.size() == project.services.size();
  std::set<std::string> checked;
  // Findings of skills depend on what is called alone.
  monitor::Vocabulary called;
  called.services = vocabulary.services;
  const auto context = charts.context(called, services);
  for (const LeafPlan& leaf : leaves) {
    if (!leaf.chart) continue;
    check_inputs(tree, leaf, !project.plugins.empty(), charts, diagnostics);
    if (!are_services_known || !checked.insert(leaf.chart->file()).second) continue;
    SkillUse use;
    for (const LeafPlan& other : leaves) {
      if (!other.chart || !(*other.chart == *leaf.chart)) continue;
      for (const bt::PortFact& port : tree.ports(other.node)) use.given.emplace(port.name);
      for (const SkillConstant& constant : other.constants) use.given.insert(constant.id);
      use.topics.insert(other.subscribes.begin(), other.subscribes.end());
      if (other.protocol) {
        use.protocols.push_back(*other.protocol);
      } else {
        use.is_condition = use.is_condition || other.condition;
        use.is_native = true;
      }
    }
    charts.add_findings(
        *leaf.chart, use, context,
        [&](Diagnostics& found) { check_skill_events(charts.facts(*leaf.chart), services, vocabulary, use, found); },
        diagnostics);
  }
}

}  // namespace sentree::project
