#include "sentree/project/model_choices.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::project {

namespace {

using scxml::ScriptNode;
using scxml::ScriptTree;
using Node = ScriptNode::Kind;

// As it is written: 4, not 4.0.
Value number(double number) {
  constexpr double kIntegersMax = 1e15;
  return std::abs(number) < kIntegersMax && number == std::floor(number) ? Value(static_cast<std::int64_t>(number))
                                                                         : Value(number);
}

std::optional<Value> constant_of_script(const ScriptTree& tree, std::uint32_t id) {
  const ScriptNode& n = tree.at(id);
  switch (n.kind) {
    case Node::kNumber: return number(n.number);
    case Node::kText: return Value(n.text);
    case Node::kTruth: return Value(n.number != 0);
    case Node::kUnary:
      if (n.text == "-" && tree.at(n.operands[0]).kind == Node::kNumber) return number(-tree.at(n.operands[0]).number);
      return std::nullopt;
    default: return std::nullopt;
  }
}

const std::set<std::string> kChoosing{"choose", "pick", "between", "chance", "draw", "fresh"};

void add_alternatives(const ScriptTree& tree, const ScriptNode& call, std::size_t first, Alternatives& alternatives) {
  for (std::size_t i = first; i < call.operands.size(); ++i) {
    if (auto value = constant_of_script(tree, call.operands[i]))
      alternatives.values.push_back(std::move(*value));
    else
      alternatives.open = true;
  }
}

void look_for_choices(const scxml::Chart& chart, KnownChoices& found) {
  for (const scxml::Expression& expression : chart.model().expressions) {
    const auto tree = expression.use == scxml::ExpressionUse::kScript ? std::nullopt
                                                                      : scxml::parse_script_expression(expression.text);
    // A function's body is not looked into.
    const bool is_opaque = !tree || std::any_of(tree->nodes.begin(), tree->nodes.end(),
                                                [](const ScriptNode& n) { return n.kind == Node::kOpaque; });
    if (is_opaque) {
      for (const std::string& name : scxml::names_in_script(expression.text)) {
        found.open = found.open || name == "pick";
        found.all.open = found.all.open || kChoosing.contains(name);
      }
    }
    if (!tree) continue;
    for (const ScriptNode& n : tree->nodes) {
      if (n.kind != Node::kCall) continue;
      const std::string function = tree->path(n.operands[0]);
      if (function == "chance") {
        found.all.values.insert(found.all.values.end(), {Value(false), Value(true)});
      } else if (function == "choose") {
        add_alternatives(*tree, n, 1, found.all);
      } else if (function == "between") {
        found.all.numbers = true;
      } else if (function == "draw") {
        found.all.open = true;
      } else if (function == "pick") {
        add_alternatives(*tree, n, 2, found.all);
        if (n.operands.size() >= 2 && tree->at(n.operands[1]).kind == Node::kText)
          add_alternatives(*tree, n, 2, found.by_name[tree->at(n.operands[1]).text]);
        else
          found.open = true;
      }
    }
  }
}

}  // namespace

KnownChoices choices_of(const scxml::Chart& chart) {
  KnownChoices found;
  for (const scxml::Chart& one : scxml::with_invoked(chart)) look_for_choices(one, found);
  if (scxml::invokes_unknown(chart)) found.open = found.all.open = true;
  return found;
}

Diagnostic no_such_fair(const std::string& fair, const std::vector<std::string>& choices, const SourceSpan& span) {
  constexpr std::size_t kShownMax = 12;
  std::string there;
  for (std::size_t i = 0; i < std::min(choices.size(), kShownMax); ++i) there += (i > 0 ? ", " : "") + choices[i];
  if (choices.size() > kShownMax) there += fmt::format(", … ({} in all)", choices.size());
  return {Severity::kError, "verify.fair",
          fmt::format("no model makes a choice called \"{}\"; a choice gets a name by pick('NAME', …), and is called "
                      "MODEL.NAME{}{}",
                      fair, there.empty() ? "" : "; there are ", there) +
              did_you_mean(fair, choices),
          span};
}

}  // namespace sentree::project
