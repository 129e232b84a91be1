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

void add_fields(const idl::Type& type, int depth, std::set<std::string>& fields) {
  if (type.element != nullptr && depth < kReplyNestingMax) add_fields(*type.element, depth + 1, fields);
  if (type.kind != idl::Kind::kStruct || depth >= kReplyNestingMax) return;
  for (const idl::Field& field : type.structure->fields) {
    if (fields.insert(field.name).second || depth < 2) add_fields(*field.type, depth + 1, fields);
  }
}

// What is known of a chart before it begins.
struct Given {
  std::map<std::string, std::set<double>> numbers;
  std::map<std::string, std::set<std::string>> texts;
  std::set<std::string> fields;  // of interfaces
  std::string service;           // whose replies are looked at
  bool strict = false;           // what is no comparison with constants is an error
};

// One chart's comparisons.
class Comparisons {
 public:
  Comparisons(const scxml::Chart& chart, Given given, Distinctions& uses)
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
    for (std::size_t i = 0; i < model_.transition_code.size(); ++i) {
      const scxml::TransitionCode& transition = model_.transition_code[i];
      conditions_.insert(transition.condition);
      if (!is_of_others(chart_.transitions()[i].events)) continue;
      others_.insert(transition.condition);
      leave_out(transition.content);
    }
  }

  void operator()() {
    for (std::size_t i = 0; i < trees_.size(); ++i) {
      if (!trees_[i]) continue;
      expression_ = i;
      const auto id = static_cast<scxml::ExpressionId>(i);
      is_looked_at_ = given_.strict && !others_.contains(id);
      if (conditions_.contains(id)) truth(trees_[i]->root());
      for (const scxml::ScriptNode& node : trees_[i]->nodes) {
        if (node.kind == Node::kUnary && node.text == "!") truth(node.operands[0]);
        if (node.kind == Node::kConditional) truth(node.operands[0]);
        if (node.kind == Node::kMember && node.text == "exception") exception(*trees_[i], node);
        if (node.kind != Node::kBinary) continue;
        if (node.text == "&&" || node.text == "||") {
          truth(node.operands[0]);
        } else if (is_comparison(node.text)) {
          compare(node);
        } else if (node.text == "in") {
          look_for_member(node);
        }
      }
    }
  }

 private:
  // Events of other services only, so that no reply of this one is in them.
  bool is_of_others(const std::vector<std::string>& events) const {
    const std::string own = given_.service + ".";
    return !events.empty() && std::all_of(events.begin(), events.end(), [&](const std::string& event) {
      return event.ends_with(".reply") && !event.starts_with(own);
    });
  }
  void leave_out(const scxml::Block& block) {
    for (const scxml::Action& action : block) {
      if (const auto* assign = std::get_if<scxml::Assign>(&action.what)) {
        others_.insert(assign->expr);
      } else if (const auto* branches = std::get_if<scxml::If>(&action.what)) {
        for (const scxml::If::Branch& branch : branches->branches) {
          others_.insert(branch.condition);
          leave_out(branch.body);
        }
      }
    }
  }

  // Whether a part of an expression is made of a reply.
  bool is_of_reply(const ScriptTree& tree, std::uint32_t id, int depth) const {
    const scxml::ScriptNode& node = tree.at(id);
    if (node.kind == Node::kMember && (tree.path(id) + ".").starts_with("_event.data.result.")) return true;
    if (node.kind == Node::kName) return depth > 0 && is_variable_of_reply(node.text, depth - 1);
    return std::any_of(node.operands.begin(), node.operands.end(),
                       [&](std::uint32_t operand) { return is_of_reply(tree, operand, depth); });
  }
  bool is_variable_of_reply(const std::string& name, int depth) const {
    const auto found = assigned_.find(name);
    return found != assigned_.end() &&
           std::any_of(found->second.begin(), found->second.end(), [&](scxml::ExpressionId expression) {
             return trees_[expression] && !others_.contains(expression) &&
                    is_of_reply(*trees_[expression], trees_[expression]->root(), depth);
           });
  }
  // What it tells apart is not known.
  void give_up(const ScriptTree& tree, std::uint32_t id, int depth, const std::string& why) {
    if (!is_looked_at_ || uses_.trouble || !is_of_reply(tree, id, depth)) return;
    std::string what;
    for (std::uint32_t node = 0; node <= id && what.empty(); ++node) {
      if (tree.path(node).starts_with("_event.data.result") && is_of_reply(tree, node, 0)) what = tree.path(node);
    }
    uses_.trouble = Diagnostic{
        Severity::kError, "verify.any-reply",
        fmt::format("{} {}, so that which of its values are told apart is not known: only comparisons with constants, "
                    "after + - * / by constants, tell that. Write a model of the service",
                    what.empty() ? "a reply" : what, why),
        chart_.span(model_.expressions[expression_].place)};
  }

  // What is wanted to be true or false: numbers are unless they are 0, texts unless they are empty.
  void truth(std::uint32_t id) {
    const ScriptTree& tree = *trees_[expression_];
    const scxml::ScriptNode& node = tree.at(id);
    if (node.kind == Node::kBinary && (is_comparison(node.text) || node.text == "in" || node.text == "instanceof"))
      return;
    if (node.kind == Node::kBinary && (node.text == "&&" || node.text == "||")) {
      truth(node.operands[1]);  // the other one is looked at anyway
      return;
    }
    if (node.kind == Node::kConditional) {
      truth(node.operands[1]);
      truth(node.operands[2]);
      return;
    }
    if (node.kind == Node::kUnary && node.text == "!") return;
    if (!is_of_reply(tree, id, kFollowedMax)) return;
    for (const std::string& name : sources(tree, id, kFollowedMax)) {
      uses_.texts[name].insert("");
      uses_.absent.insert(name);
    }
    equal(tree, id, 0, kFollowedMax);
  }

  void look_for_assignments(const scxml::Block& block) {
    for (const scxml::Action& action : block) {
      if (const auto* assign = std::get_if<scxml::Assign>(&action.what)) {
        if (assign->expr != scxml::kNoExpression && assign->location != scxml::kNoExpression)
          assigned_[model_.expressions[assign->location].text].push_back(assign->expr);
      } else if (const auto* branches = std::get_if<scxml::If>(&action.what)) {
        for (const scxml::If::Branch& branch : branches->branches) {
          conditions_.insert(branch.condition);
          look_for_assignments(branch.body);
        }
      } else if (const auto* foreach = std::get_if<scxml::Foreach>(&action.what)) {
        look_for_assignments(*foreach->body);
      }
    }
  }

  // Whether it is what a reply holds, as it is.
  bool is_plain(const ScriptTree& tree, std::uint32_t id, int depth) const {
    const scxml::ScriptNode& node = tree.at(id);
    if (node.kind == Node::kMember || !is_of_reply(tree, id, depth)) return true;
    if (node.kind == Node::kConditional)
      return is_plain(tree, node.operands[1], depth) && is_plain(tree, node.operands[2], depth);
    if (node.kind != Node::kName) return false;
    const auto found = assigned_.find(node.text);
    return found == assigned_.end() || depth == 0 ||
           std::all_of(found->second.begin(), found->second.end(), [&](scxml::ExpressionId expression) {
             return !trees_[expression] || is_plain(*trees_[expression], trees_[expression]->root(), depth - 1);
           });
  }

  // 'member' in value
  void look_for_member(const scxml::ScriptNode& in) {
    const ScriptTree& tree = *trees_[expression_];
    const std::set<std::string> members = text_constants(tree, in.operands[0]);
    uses_.absent.insert(members.begin(), members.end());
    uses_.names.insert(members.begin(), members.end());
    if (members.empty()) give_up(tree, in.operands[1], kFollowedMax, "is looked into for members without a name");
  }

  // Any reply throws nothing that holds anything.
  void exception(const ScriptTree& tree, const scxml::ScriptNode& member) {
    if (!given_.strict || uses_.trouble || tree.path(member.operands[0]) != "_event.data") return;
    uses_.trouble = Diagnostic{Severity::kError, "verify.any-reply",
                               "_event.data.exception is looked at, and which of its values are told apart is not "
                               "known. Write a model of the service",
                               chart_.span(model_.expressions[expression_].place)};
  }

  void compare(const scxml::ScriptNode& comparison) {
    const std::uint32_t left = comparison.operands[0];
    const std::uint32_t right = comparison.operands[1];
    const bool is_order = comparison.text.front() == '<' || comparison.text.front() == '>';
    const ScriptTree& tree = *trees_[expression_];
    for (const auto& [value, constant] : {std::pair(left, right), std::pair(right, left)}) {
      if (tree.at(constant).kind == Node::kNothing) {
        const auto names = sources(tree, value, kFollowedMax);
        uses_.absent.insert(names.begin(), names.end());
        continue;
      }
      if (tree.at(value).kind == Node::kUnary && tree.at(value).text == "typeof") {
        // Types are the interface's, but for what is not there.
        const auto names = sources(tree, tree.at(value).operands[0], kFollowedMax);
        uses_.absent.insert(names.begin(), names.end());
        continue;
      }
      const std::set<std::string> texts = text_constants(tree, constant);
      const bool is_text = std::any_of(texts.begin(), texts.end(),
                                       [](const std::string& text) { return numbers_in(Value(text)).empty(); });
      if (is_text && is_order) give_up(tree, value, kFollowedMax, "is ordered as a text");
      if (is_text && !is_plain(tree, value, kFollowedMax))
        give_up(tree, value, kFollowedMax, "is changed before it is compared with a text");
      for (const std::string& text : texts) {
        for (const std::string& name : sources(tree, value, kFollowedMax)) uses_.texts[name].insert(text);
        for (const double number : numbers_in(Value(text))) equal(tree, value, number, kFollowedMax);
      }
      const std::set<double> numbers = constants(tree, constant, kFollowedMax);
      for (const double number : numbers) equal(tree, value, number, kFollowedMax);
      const bool is_known = !texts.empty() || !numbers.empty() || tree.at(constant).kind == Node::kTruth;
      // What is handed back is that value or another one.
      const bool is_handed = !is_order && tree.path(constant).starts_with("_event.data.args.");
      const bool is_alike = is_handed || is_of_reply(tree, constant, kFollowedMax);
      if (!is_known && is_alike && is_of_reply(tree, value, kFollowedMax)) {
        const auto names = sources(tree, value, kFollowedMax);
        uses_.several.insert(names.begin(), names.end());
      }
      if (!is_known && !is_alike) give_up(tree, value, kFollowedMax, "is compared with what is no constant");
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
      const auto given = given_.numbers.find(node.text);
      if (given != given_.numbers.end()) return given->second;
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
    if (node.kind == Node::kCall) return constants_of_call(tree, node, depth);
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

  // Of functions of which it is known.
  std::set<double> constants_of_call(const ScriptTree& tree, const scxml::ScriptNode& node, int depth) const {
    const std::string function = tree.path(node.operands[0]);
    if (function != "Math.min" && function != "Math.max") return {};
    std::set<double> all;
    for (std::size_t i = 1; i < node.operands.size(); ++i) {
      const auto some = constants(tree, node.operands[i], depth);
      if (some.empty()) return {};
      all.insert(some.begin(), some.end());  // one of them
    }
    return all;
  }
  std::set<std::string> text_constants(const ScriptTree& tree, std::uint32_t id) const {
    const scxml::ScriptNode& node = tree.at(id);
    if (node.kind == Node::kText) return {node.text};
    const auto given = node.kind == Node::kName ? given_.texts.find(node.text) : given_.texts.end();
    return given != given_.texts.end() ? given->second : std::set<std::string>();
  }

  // A part of an expression tells apart what is below, at and above `number`: so what it is made of does at others.
  void equal(const ScriptTree& tree, std::uint32_t id, double number, int depth) {
    const scxml::ScriptNode& node = tree.at(id);
    if (!std::isfinite(number)) return;
    if (node.kind == Node::kMember) {
      uses_.numbers[node.text].insert(number);
      if (node.text != "result" && !given_.fields.contains(node.text))
        give_up(tree, id, depth, fmt::format("has its {} looked at", node.text));
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
      const std::set<double> left = constants(tree, node.operands[0], depth);
      const std::set<double> right = constants(tree, node.operands[1], depth);
      for (const double known : left) equal(tree, node.operands[1], inverse(node.text, number, known, true), depth);
      for (const double known : right) equal(tree, node.operands[0], inverse(node.text, number, known, false), depth);
      if (left.empty() && right.empty())
        give_up(tree, id, depth, fmt::format("is compared after {} with what is no constant", node.text));
    } else if (node.kind == Node::kConditional) {
      equal(tree, node.operands[1], number, depth);
      equal(tree, node.operands[2], number, depth);
    } else if (node.kind == Node::kCall) {
      equal_call(tree, id, number, depth);
    } else if (node.kind == Node::kUnary && node.text == "+") {
      equal(tree, node.operands[0], number, depth);
    } else if (node.kind == Node::kBinary && (node.text == "||" || node.text == "&&")) {
      // The second one, or the first one, which is looked at by itself.
      equal(tree, node.operands[0], number, depth);
      equal(tree, node.operands[1], number, depth);
    } else if (node.kind == Node::kUnary || node.kind == Node::kBinary || node.kind == Node::kIndex) {
      const bool is_truth = node.text == "!" || is_comparison(node.text);
      if (!is_truth)
        give_up(tree, id, depth, node.kind == Node::kIndex ? "chooses by an index" : "is compared after " + node.text);
    }
  }

  void equal_call(const ScriptTree& tree, std::uint32_t id, double number, int depth) {
    const scxml::ScriptNode& node = tree.at(id);
    const scxml::ScriptNode& callee = tree.at(node.operands[0]);
    const std::string function = tree.path(node.operands[0]);
    // [a, b].indexOf(value)
    if (callee.kind == Node::kMember && callee.text == "indexOf" && node.operands.size() == 2 &&
        tree.at(callee.operands[0]).kind == Node::kList) {
      for (const std::uint32_t one : tree.at(callee.operands[0]).operands) {
        for (const std::string& text : text_constants(tree, one)) {
          for (const std::string& name : sources(tree, node.operands[1], depth)) uses_.texts[name].insert(text);
        }
        for (const double constant : constants(tree, one, depth)) equal(tree, node.operands[1], constant, depth);
      }
      return;
    }
    // Those that grow with what they are given, or fall with it, and not by more.
    static const std::set<std::string> kSteady{"Math.min",   "Math.max", "Math.floor", "Math.ceil",
                                               "Math.round", "Math.abs", "Number"};
    if (!kSteady.contains(function))
      give_up(tree, id, depth, fmt::format("is given to {}()", function.empty() ? "a function" : function));
    for (std::size_t i = 1; i < node.operands.size(); ++i) {
      equal(tree, node.operands[i], number, depth);
      if (function == "Math.abs") equal(tree, node.operands[i], -number, depth);
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
  Given given_;
  Distinctions& uses_;
  std::vector<std::optional<ScriptTree>> trees_;  // by expression
  std::map<std::string, std::vector<scxml::ExpressionId>> assigned_;
  std::set<scxml::ExpressionId> conditions_;
  std::set<scxml::ExpressionId> others_;  // of transitions for events of other services
  std::size_t expression_ = 0;
  bool is_looked_at_ = false;
};

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
  Given nothing;
  nothing.service = service;
  nothing.strict = true;
  for (const auto& [name, of] : plan.services) {
    for (const idl::Method* method : of.service->methods) add_fields(*method->result, 0, nothing.fields);
  }
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
    Given given = nothing;
    for (const project::SkillConstant& constant : leaf.constants) {
      given.numbers[constant.id] = numbers_in(constant.value);
      if (constant.value.as_string() != nullptr) given.texts[constant.id] = {*constant.value.as_string()};
    }
    for (const bt::PortFact& port : plan.tree.ports(leaf.node)) {
      const std::string name(port.name);
      if (port.text.find('{') != std::string_view::npos) continue;
      given.texts[name] = {std::string(port.text)};
      if (const auto numbers = numbers_in(Value(std::string(port.text))); !numbers.empty())
        given.numbers[name] = numbers;
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
  for (const monitor::Model& monitor : plan.monitors) {
    Given given = nothing;
    given.strict = monitor.origin() == nullptr;
    Comparisons(monitor.chart(), std::move(given), uses)();
  }
  return uses;
}

Look look(const Distinctions& distinctions, const idl::Method& method, const Value& result, bool exact) {
  Look out;
  if (auto alike = Looking(distinctions, exact, out)(*method.result, result, "result", "result", 0))
    out.alike = std::move(*alike);
  return out;
}

}  // namespace sentree::verify
