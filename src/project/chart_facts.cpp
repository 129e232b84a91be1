#include "sentree/project/chart_facts.h"

#include <algorithm>

namespace sentree::project {

namespace {

using Node = scxml::ScriptNode::Kind;
using Trees = std::vector<std::optional<scxml::ScriptTree>>;

// The root of what a location names: "goal" of "goal.id".
const std::string& root_of(const scxml::ScriptTree& tree) {
  std::uint32_t node = tree.root();
  while (!tree.at(node).operands.empty()) node = tree.at(node).operands[0];
  return tree.at(node).text;
}

/// How a chart uses one of its data.
struct Use {
  bool needed = false;     ///< Calculated with, compared by size, or given to a service.
  bool asked_for = false;  ///< Whether it is there is looked at.
};

bool is_of_event(const scxml::ScriptTree& tree, std::uint32_t id) {
  while (tree.at(id).kind == Node::kMember || tree.at(id).kind == Node::kIndex) id = tree.at(id).operands[0];
  return tree.at(id).kind == Node::kName && tree.at(id).text == "_event";
}

void note_use(const scxml::ScriptTree& tree, std::uint32_t id, const std::string& name, bool is_calculated, Use& use) {
  const scxml::ScriptNode& n = tree.at(id);
  if (n.kind == Node::kName && n.text == name) (is_calculated ? use.needed : use.asked_for) = true;
  const bool calculates = (n.kind == Node::kBinary && n.text != "&&" && n.text != "||" && n.text != "," &&
                           n.text.find("==") == std::string::npos && n.text != "!=") ||
                          n.kind == Node::kMember || (n.kind == Node::kUnary && n.text == "-");
  // What comes with an event is hardly the same as what is not there: that asks for the value.
  const bool compares_with_event =
      n.kind == Node::kBinary && n.text.find("==") != std::string::npos &&
      std::any_of(n.operands.begin(), n.operands.end(), [&](std::uint32_t inner) { return is_of_event(tree, inner); });
  for (const std::uint32_t inner : n.operands) {
    const bool is_it = tree.at(inner).kind == Node::kName && tree.at(inner).text == name;
    if (!compares_with_event || !is_it) note_use(tree, inner, name, calculates, use);
  }
}

bool is_needed(const scxml::Model& model, const Trees& trees, const std::string& data) {
  Use use;
  for (std::size_t i = 0; i < trees.size(); ++i) {
    if (model.expressions[i].text == data) continue;  // alone: an argument, see below; or a location
    if (trees[i]) note_use(*trees[i], trees[i]->root(), data, false, use);
  }
  for (const scxml::SendInfo& send : model.sends) {
    if (send.type != "thrift") continue;
    for (const scxml::SendParam& param : send.params) use.needed = use.needed || param.expression == data;
  }
  return use.needed && !use.asked_for;
}

bool may_be_written(const scxml::Model& model, const Trees& trees, const std::string& data) {
  for (std::size_t i = 0; i < trees.size(); ++i) {
    const scxml::Expression& expression = model.expressions[i];
    const auto& tree = trees[i];
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

template <class Question>
bool ask(std::map<std::string, bool>& known, const std::string& data, const Question& question) {
  const auto [answer, is_new] = known.try_emplace(data);
  if (is_new) answer->second = question();
  return answer->second;
}

}  // namespace

ChartFacts::ChartFacts(const scxml::Chart& chart) : facts_(std::make_shared<Facts>(Facts{chart, {}, {}, {}})) {
  const auto& expressions = chart.model().expressions;
  facts_->trees.reserve(expressions.size());
  for (const scxml::Expression& expression : expressions) {
    facts_->trees.push_back(expression.use == scxml::ExpressionUse::kScript
                                ? std::nullopt
                                : scxml::parse_script_expression(expression.text));
  }
}

bool ChartFacts::is_written(const std::string& data) const {
  return ask(facts_->written, data, [&] { return may_be_written(chart().model(), facts_->trees, data); });
}

bool ChartFacts::needs(const std::string& data) const {
  return ask(facts_->needed, data, [&] { return is_needed(chart().model(), facts_->trees, data); });
}

}  // namespace sentree::project
