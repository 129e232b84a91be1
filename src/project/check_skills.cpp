#include "sentree/project/check_skills.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "sentree/bt/model.h"
#include "sentree/project/check_monitor.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::project {

namespace {

using Node = scxml::ScriptNode::Kind;

void add(Diagnostics& diagnostics, Severity severity, std::string code, std::string message, SourceSpan span) {
  diagnostics.push_back({severity, std::move(code), std::move(message), std::move(span)});
}

// The roots of what a location names: "goal" of "goal.id".
std::string root_of(const scxml::ScriptTree& tree) {
  std::uint32_t node = tree.root();
  while (!tree.at(node).operands.empty()) node = tree.at(node).operands[0];
  return tree.at(node).text;
}

/// How a chart uses one of its data.
struct Use {
  bool needed = false;     ///< Calculated with, compared by size, or given to a service.
  bool asked_for = false;  ///< Whether it is there is looked at.
};

void note_use(const scxml::ScriptTree& tree, std::uint32_t id, const std::string& name, bool is_calculated, Use& use) {
  const scxml::ScriptNode& n = tree.at(id);
  if (n.kind == Node::kName && n.text == name) (is_calculated ? use.needed : use.asked_for) = true;
  const bool calculates = (n.kind == Node::kBinary && n.text != "&&" && n.text != "||" && n.text != "," &&
                           n.text.find("==") == std::string::npos && n.text != "!=") ||
                          n.kind == Node::kMember || (n.kind == Node::kUnary && n.text == "-");
  for (const std::uint32_t inner : n.operands) note_use(tree, inner, name, calculates, use);
}

bool needs(const scxml::Chart& chart, const std::string& data) {
  Use use;
  for (const scxml::Expression& expression : chart.model().expressions) {
    if (expression.text == data) continue;  // alone: an argument, see below; or a location
    if (const auto tree = scxml::parse_script_expression(expression.text))
      note_use(*tree, tree->root(), data, false, use);
  }
  for (const scxml::SendInfo& send : chart.sends()) {
    if (send.type != "thrift") continue;
    for (const scxml::SendParam& param : send.params) use.needed = use.needed || param.expression == data;
  }
  return use.needed && !use.asked_for;
}

// What charts do with their data: asked for each leaf, while many leaves run one chart.
class DataUses {
 public:
  bool is_written(const scxml::Chart& chart, const std::string& data) {
    return ask(written_, chart, data, project::is_written);
  }
  bool needs(const scxml::Chart& chart, const std::string& data) { return ask(needed_, chart, data, project::needs); }

 private:
  using Known = std::map<std::pair<const scxml::Model*, std::string>, bool>;
  static bool ask(Known& known, const scxml::Chart& chart, const std::string& data,
                  bool (*question)(const scxml::Chart&, const std::string&)) {
    const auto [answer, is_new] = known.try_emplace({&chart.model(), data});
    if (is_new) answer->second = question(chart, data);
    return answer->second;
  }

  Known written_;
  Known needed_;
};

void check_inputs(const bt::Tree& tree, const LeafPlan& leaf, bool has_plugins, DataUses& uses,
                  Diagnostics& diagnostics) {
  const auto ports = tree.ports(leaf.node);
  // A constant that the chart does not know has been told, and may be what is missing.
  const auto& data = leaf.chart->data();
  const bool is_told = std::any_of(leaf.constants.begin(), leaf.constants.end(), [&](const SkillConstant& constant) {
    return std::none_of(data.begin(), data.end(), [&](const auto& item) { return item.id == constant.id; });
  });
  for (const scxml::DataItem& item : leaf.chart->data()) {
    if (item.has_value || uses.is_written(*leaf.chart, item.id)) continue;
    const auto port =
        std::find_if(ports.begin(), ports.end(), [&](const bt::PortFact& p) { return p.name == item.id; });
    const bool is_output = port != ports.end() && !port->input;
    const bool is_given = port != ports.end() && !port->text.empty();
    const bool is_constant = std::any_of(leaf.constants.begin(), leaf.constants.end(),
                                         [&](const SkillConstant& constant) { return constant.id == item.id; });
    if (is_constant || is_told) continue;
    if (is_given || is_output || !uses.needs(*leaf.chart, item.id)) continue;
    add(diagnostics, Severity::kError, "check.missing-input",
        "input \"" + item.id + "\" of " + leaf.name + " has no value, and " + leaf.chart->file() + ":" +
            std::to_string(item.place.line) + " needs one: write " + item.id +
            "=\"…\" here, or give the <data> an expr",
        tree.span(leaf.node));
  }
  for (const bt::UnwrittenEntry& entry : tree.model().unwritten) {
    if (entry.node != leaf.node) continue;
    const auto item = std::find_if(data.begin(), data.end(), [&](const auto& d) { return d.id == entry.port; });
    const bool fails = item != data.end() && !item->has_value && !uses.is_written(*leaf.chart, item->id) &&
                       uses.needs(*leaf.chart, item->id);
    add(diagnostics, fails && !has_plugins ? Severity::kError : Severity::kWarning, "check.unwritten-entry",
        "input \"" + entry.port + "\" of " + leaf.name + " reads blackboard entry \"" + entry.entry +
            "\", which nothing in the tree writes",
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
        "the mission has no leaf \"" + entry.leaf + "\"" + near, entry.span);
  }
}

}  // namespace

bool is_written(const scxml::Chart& chart, const std::string& data) {
  const scxml::Model& model = chart.model();
  for (const scxml::Expression& expression : model.expressions) {
    if (expression.use == scxml::ExpressionUse::kScript) {
      if (scxml::names_in_script(expression.text).contains(data)) return true;
      continue;
    }
    const auto tree = scxml::parse_script_expression(expression.text);
    const bool is_location =
        expression.use == scxml::ExpressionUse::kLocation || expression.use == scxml::ExpressionUse::kItem;
    if (is_location && (!tree || root_of(*tree) == data)) return true;
    const bool may_write = !tree || std::any_of(tree->nodes.begin(), tree->nodes.end(), [](const auto& n) {
      return n.kind == Node::kAssignment || n.kind == Node::kOpaque || (n.kind == Node::kUnary && n.text.size() == 2);
    });
    if (may_write && scxml::names_in_script(expression.text).contains(data)) return true;
  }
  return false;
}

void check_skills(const bt::Tree& tree, const std::vector<LeafPlan>& leaves,
                  const std::map<std::string, ServicePlan>& services, const monitor::Vocabulary& vocabulary,
                  const Project& project, Diagnostics& diagnostics) {
  check_entries(tree, project, diagnostics);
  // Of services that could not be read it has been said.
  const bool are_services_known = services.size() == project.services.size();
  std::set<std::string> checked;
  DataUses uses;
  for (const LeafPlan& leaf : leaves) {
    if (!leaf.chart) continue;
    check_inputs(tree, leaf, !project.plugins.empty(), uses, diagnostics);
    if (!are_services_known || !checked.insert(leaf.chart->file()).second) continue;
    SkillUse use;
    for (const LeafPlan& other : leaves) {
      if (!other.chart || !(*other.chart == *leaf.chart)) continue;
      for (const bt::PortFact& port : tree.ports(other.node)) use.given.emplace(port.name);
      for (const SkillConstant& constant : other.constants) use.given.insert(constant.id);
      use.topics.insert(other.subscribes.begin(), other.subscribes.end());
      if (other.protocol) {
        use.protocols.push_back(&*other.protocol);
      } else {
        use.is_condition = use.is_condition || other.condition;
        use.is_native = true;
      }
    }
    check_skill_events(*leaf.chart, services, vocabulary, use, diagnostics);
  }
}

}  // namespace sentree::project
