#include "sentree/verify/distinctions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::verify {

namespace {

using scxml::ScriptTree;
using Node = scxml::ScriptNode::Kind;

// Variables that are followed from a comparison to what was assigned to them.
constexpr int kFollowedMax = 8;

double inverse(const std::string& sign, double result, double known, bool known_is_left) {
  if (sign == "+") return result - known;
  if (sign == "-") return known_is_left ? known - result : result + known;
  if (sign == "*") return result / known;
  return known_is_left ? known / result : result * known;
}

bool is_comparison(const std::string& sign) {
  return sign == "<" || sign == ">" || sign == "<=" || sign == ">=" || sign == "==" || sign == "===" || sign == "!=" ||
         sign == "!==";
}

// One chart's comparisons.
class Comparisons {
 public:
  Comparisons(const scxml::Chart& chart, std::map<std::string, std::set<double>> given, Distinctions& uses)
      : model_(chart.model()), chart_(chart), given_(std::move(given)), uses_(uses) {
    for (const scxml::Expression& expression : model_.expressions) {
      for (const std::string& name : scxml::names_in_script(expression.text)) uses_.names.insert(name);
      trees_.push_back(scxml::parse_script_expression(expression.text));
      if (!trees_.back()) continue;
      for (const scxml::ScriptNode& node : trees_.back()->nodes) {
        if (node.kind == Node::kText) uses_.words.insert(node.text);
      }
    }
    for (const scxml::Variable& variable : model_.variables) {
      if (variable.expr != scxml::kNoExpression) assigned_[variable.id].push_back(variable.expr);
    }
    for (const scxml::StateCode& state : model_.state_code) {
      for (const scxml::Block& block : state.onentry) look_for_assignments(block);
      for (const scxml::Block& block : state.onexit) look_for_assignments(block);
    }
    for (const scxml::TransitionCode& transition : model_.transition_code) look_for_assignments(transition.content);
  }

  void operator()() {
    for (std::size_t i = 0; i < trees_.size(); ++i) {
      if (!trees_[i]) continue;
      expression_ = i;
      for (const scxml::ScriptNode& node : trees_[i]->nodes) {
        if (node.kind != Node::kBinary || !is_comparison(node.text)) continue;
        compare(node.operands[0], node.operands[1]);
      }
    }
  }

 private:
  void look_for_assignments(const scxml::Block& block) {
    for (const scxml::Action& action : block) {
      if (const auto* assign = std::get_if<scxml::Assign>(&action.what)) {
        if (assign->expr != scxml::kNoExpression && assign->location != scxml::kNoExpression)
          assigned_[model_.expressions[assign->location].text].push_back(assign->expr);
      } else if (const auto* branches = std::get_if<scxml::If>(&action.what)) {
        for (const scxml::If::Branch& branch : branches->branches) look_for_assignments(branch.body);
      } else if (const auto* foreach = std::get_if<scxml::Foreach>(&action.what)) {
        look_for_assignments(*foreach->body);
      }
    }
  }

  void compare(std::uint32_t left, std::uint32_t right) {
    const ScriptTree& tree = *trees_[expression_];
    for (const auto& [value, constant] : {std::pair(left, right), std::pair(right, left)}) {
      if (tree.at(constant).kind == Node::kText) {
        for (const std::string& name : sources(tree, value, kFollowedMax))
          uses_.texts[name].insert(tree.at(constant).text);
        continue;
      }
      for (const double number : constants(tree, constant, kFollowedMax)) equal(tree, value, number, kFollowedMax);
    }
    // Two values that are both of replies: no constant tells them apart.
    const auto of_reply = [&](std::uint32_t node) {
      return constants(tree, node, kFollowedMax).empty() && tree.at(node).kind == Node::kMember &&
             tree.path(node).starts_with("_event.data.result");
    };
    if (of_reply(left) && of_reply(right) && !uses_.trouble) {
      const scxml::Expression& expression = model_.expressions[expression_];
      uses_.trouble = Diagnostic{Severity::kError, "verify.any-reply",
                                 fmt::format("{} is compared with {}, which is no constant; which of their values "
                                             "differ cannot be told. Write a model of the service",
                                             tree.path(left), tree.path(right)),
                                 chart_.span(expression.place)};
    }
  }

  // The numbers that a part of an expression can be, if it is made of constants only.
  std::set<double> constants(const ScriptTree& tree, std::uint32_t id, int depth) const {
    const scxml::ScriptNode& node = tree.at(id);
    if (node.kind == Node::kNumber) return {node.number};
    if (node.kind == Node::kName) {
      const auto given = given_.find(node.text);
      if (given != given_.end()) return given->second;
      const auto found = assigned_.find(node.text);
      if (found == assigned_.end() || depth == 0) return {};
      std::set<double> all;
      for (const scxml::ExpressionId expression : found->second) {
        if (!trees_[expression]) continue;
        const auto some = constants(*trees_[expression], trees_[expression]->root(), depth - 1);
        all.insert(some.begin(), some.end());
      }
      return all;
    }
    if (node.kind == Node::kUnary && node.text == "-") {
      std::set<double> all;
      for (const double number : constants(tree, node.operands[0], depth)) all.insert(-number);
      return all;
    }
    if (node.kind != Node::kBinary) return {};
    std::set<double> all;
    for (const double a : constants(tree, node.operands[0], depth)) {
      for (const double b : constants(tree, node.operands[1], depth)) {
        if (node.text == "+") all.insert(a + b);
        if (node.text == "-") all.insert(a - b);
        if (node.text == "*") all.insert(a * b);
        if (node.text == "/" && b != 0) all.insert(a / b);
      }
    }
    return all;
  }

  // A part of an expression tells apart what is below, at and above `number`: so what it is made of does at others.
  void equal(const ScriptTree& tree, std::uint32_t id, double number, int depth) {
    const scxml::ScriptNode& node = tree.at(id);
    if (!std::isfinite(number)) return;
    if (node.kind == Node::kMember) {
      uses_.numbers[node.text].insert(number);
    } else if (node.kind == Node::kName) {
      const auto found = assigned_.find(node.text);
      if (found == assigned_.end() || depth == 0) return;
      for (const scxml::ExpressionId expression : found->second) {
        if (trees_[expression]) equal(*trees_[expression], trees_[expression]->root(), number, depth - 1);
      }
    } else if (node.kind == Node::kUnary && node.text == "-") {
      equal(tree, node.operands[0], -number, depth);
    } else if (node.kind == Node::kBinary &&
               (node.text == "+" || node.text == "-" || node.text == "*" || node.text == "/")) {
      for (const double known : constants(tree, node.operands[0], depth))
        equal(tree, node.operands[1], inverse(node.text, number, known, true), depth);
      for (const double known : constants(tree, node.operands[1], depth))
        equal(tree, node.operands[0], inverse(node.text, number, known, false), depth);
    } else if (node.kind == Node::kConditional) {
      equal(tree, node.operands[1], number, depth);
      equal(tree, node.operands[2], number, depth);
    } else if (node.kind == Node::kCall) {
      for (std::size_t i = 1; i < node.operands.size(); ++i) equal(tree, node.operands[i], number, depth);
    }
  }

  // The names under which what a part of an expression holds was read.
  std::set<std::string> sources(const ScriptTree& tree, std::uint32_t id, int depth) const {
    const scxml::ScriptNode& node = tree.at(id);
    if (node.kind == Node::kMember) return {node.text};
    std::set<std::string> all;
    if (node.kind != Node::kName || depth == 0) return all;
    if (const auto found = assigned_.find(node.text); found != assigned_.end()) {
      for (const scxml::ExpressionId expression : found->second) {
        if (!trees_[expression]) continue;
        const auto some = sources(*trees_[expression], trees_[expression]->root(), depth - 1);
        all.insert(some.begin(), some.end());
      }
    }
    return all;
  }

  const scxml::Model& model_;
  const scxml::Chart& chart_;
  std::map<std::string, std::set<double>> given_;
  Distinctions& uses_;
  std::vector<std::optional<ScriptTree>> trees_;  // by expression
  std::map<std::string, std::vector<scxml::ExpressionId>> assigned_;
  std::size_t expression_ = 0;
};
std::set<double> numbers_in(const Value& value) {
  if (value.is_number()) return {value.number()};
  std::set<double> all;
  if (const std::string* text = value.as_string()) {
    char* end = nullptr;
    const double number = std::strtod(text->c_str(), &end);
    if (end != text->c_str() && *end == '\0') all.insert(number);
  }
  return all;
}

// Looks at one reply.
class Looking {
 public:
  Looking(const Distinctions& distinctions, bool exact, Look& out)
      : known_(distinctions), exact_(exact || distinctions.trouble), out_(out) {}

  // @param name  Under which expressions read it. Nothing: it is not looked at.
  std::optional<Value> operator()(const idl::Type& type, const Value& value, const std::string& name,
                                  const std::string& path, int depth) {
    const bool named = exact_ || name == "result" || known_.names.contains(name);
    switch (type.kind) {
      case idl::Kind::kVoid:
      case idl::Kind::kBinary: return std::nullopt;
      case idl::Kind::kStruct: return record(*type.structure, value, path, depth);
      case idl::Kind::kList:
      case idl::Kind::kSet: return items(type, value, name, path, depth);
      case idl::Kind::kMap: return named ? shown(path, value, value) : std::nullopt;
      case idl::Kind::kBool: return named ? shown(path, value, value) : std::nullopt;
      case idl::Kind::kEnum:
        if (!named) return std::nullopt;
        return shown(path, value, exact_ || known_.words.contains(std::string(value.text())) ? value : Value());
      case idl::Kind::kString: {
        if (!named) return std::nullopt;
        const auto texts = known_.texts.find(name);
        if (exact_) return shown(path, value, value);
        if (texts == known_.texts.end()) return hand(name, value);
        return shown(path, value, texts->second.contains(std::string(value.text())) ? value : Value());
      }
      case idl::Kind::kI8:
      case idl::Kind::kI16:
      case idl::Kind::kI32:
      case idl::Kind::kI64:
      case idl::Kind::kDouble: {
        if (!named) return std::nullopt;
        if (exact_ || !value.is_number()) return shown(path, value, value);
        const auto numbers = known_.numbers.find(name);
        if (numbers == known_.numbers.end()) return hand(name, value);
        return shown(path, value, Value(place(numbers->second, value.number())));
      }
    }
    return std::nullopt;
  }

 private:
  // 2 i: the i-th constant itself; 2 i + 1: between it and the one below. What is as near as rounding is the constant.
  static std::int64_t place(const std::set<double>& constants, double number) {
    std::int64_t below = 0;
    for (const double constant : constants) {
      if (std::abs(number - constant) <= 1e-9 * std::max(1.0, std::abs(constant))) return 2 * below;
      if (number < constant) break;
      ++below;
    }
    return 2 * below - 1;
  }

  std::optional<Value> shown(const std::string& path, const Value& value, Value alike) {
    out_.shown.emplace_back(path, value);
    return alike;
  }
  std::optional<Value> hand(const std::string& name, const Value& value) {
    out_.handed.emplace_back(name, value);
    return std::nullopt;
  }

  std::optional<Value> record(const idl::Struct& type, const Value& value, const std::string& path, int depth) {
    Map alike;
    if (depth >= kReplyNestingMax) return std::nullopt;
    for (const idl::Field& field : type.fields) {
      const Value* const member = value.find(field.name);
      if (member == nullptr) continue;
      const std::string inner = path == "result" ? field.name : fmt::format("{}.{}", path, field.name);
      if (auto seen = (*this)(*field.type, *member, field.name, inner, depth + 1)) alike.append(field.name, *seen);
    }
    return Value(std::move(alike));
  }

  std::optional<Value> items(const idl::Type& type, const Value& value, const std::string& name,
                             const std::string& path, int depth) {
    const List* const list = value.as_list();
    if (list == nullptr || depth >= kReplyNestingMax) return std::nullopt;
    if (!exact_ && name != "result" && !known_.names.contains(name)) return std::nullopt;
    List alike;
    for (std::size_t i = 0; i < list->size(); ++i) {
      auto seen = (*this)(*type.element, (*list)[i], name, fmt::format("{}[{}]", path, i), depth + 1);
      alike.push_back(seen ? std::move(*seen) : Value());
    }
    return Value(std::move(alike));
  }

  const Distinctions& known_;
  bool exact_;
  Look& out_;
};

}  // namespace

Distinctions distinctions(const project::Plan& plan, const std::string& service,
                          std::vector<const idl::Method*>* methods) {
  const idl::Service& interface = *plan.services.at(service).service;
  Distinctions uses;
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (!leaf.chart) continue;
    bool calls = false;
    for (const scxml::SendInfo& send : leaf.chart->sends()) {
      // What an expression names may be any method of it.
      if (send.type != "thrift" || (send.target && *send.target != service)) continue;
      calls = true;
      for (const idl::Method* method : interface.methods) {
        if ((send.event && *send.event != method->name) || method->oneway) continue;
        if (methods == nullptr || std::find(methods->begin(), methods->end(), method) != methods->end()) continue;
        methods->push_back(method);
      }
    }
    if (!calls) continue;
    std::map<std::string, std::set<double>> given;
    for (const project::SkillConstant& constant : leaf.constants) given[constant.id] = numbers_in(constant.value);
    for (const bt::PortFact& port : plan.tree.ports(leaf.node)) {
      if (const auto numbers = numbers_in(Value(std::string(port.text))); !numbers.empty())
        given[std::string(port.name)] = numbers;
    }
    Comparisons(*leaf.chart, std::move(given), uses)();
  }
  for (bt::NodeId node = 0; node < plan.tree.size(); ++node) {
    for (const bt::PortFact& port : plan.tree.ports(node)) {
      for (const std::string& word : scxml::names_in_script(port.text)) uses.words.insert(word);
      // Texts in a script of the tree are between apostrophes.
      for (std::size_t at = port.text.find('\''); at != std::string_view::npos;) {
        const std::size_t end = port.text.find('\'', at + 1);
        if (end == std::string_view::npos) break;
        uses.words.emplace(port.text.substr(at + 1, end - at - 1));
        at = port.text.find('\'', end + 1);
      }
    }
  }
  for (const monitor::Model& monitor : plan.monitors) Comparisons(monitor.chart(), {}, uses)();
  return uses;
}

Look look(const Distinctions& distinctions, const idl::Method& method, const Value& result, bool exact) {
  Look out;
  if (auto alike = Looking(distinctions, exact, out)(*method.result, result, "result", "result", 0))
    out.alike = std::move(*alike);
  return out;
}

}  // namespace sentree::verify
