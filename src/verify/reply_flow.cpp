#include "sentree/verify/detail/reply_flow.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace sentree::verify {

using scxml::ExpressionId;
using scxml::ScriptTree;
using Node = scxml::ScriptNode::Kind;

bool is_comparison(const std::string& sign) {
  return sign == "<" || sign == ">" || sign == "<=" || sign == ">=" || sign == "==" || sign == "===" || sign == "!=" ||
         sign == "!==";
}

bool is_steady(const std::string& function) {
  static const std::set<std::string> kSteady{"Math.min",   "Math.max", "Math.floor", "Math.ceil",
                                             "Math.round", "Math.abs", "Number"};
  return kSteady.contains(function);
}

ReplyFlow::ReplyFlow(const scxml::Chart& chart, std::string service, const ReplyTypes& types, std::set<std::string> far,
                     const std::string& answer)
    : chart_(chart), service_(std::move(service)), types_(types), far_(std::move(far)), answer_(answer) {
  const scxml::Model& model = chart.model();
  for (const scxml::Expression& expression : model.expressions)
    trees_.push_back(scxml::parse_script_expression(expression.text));
  for (const scxml::Variable& variable : model.variables)
    use(variable.expr, Role::kAssigned, variable.id, std::nullopt);
  for (const scxml::StateCode& state : model.state_code) {
    for (const scxml::Block& block : state.onentry) look(block, std::nullopt);
    for (const scxml::Block& block : state.onexit) look(block, std::nullopt);
    if (state.donedata) look(*state.donedata, Role::kGiven, std::nullopt);
  }
  for (std::size_t i = 0; i < model.transition_code.size(); ++i) {
    const scxml::TransitionCode& transition = model.transition_code[i];
    const Where where = methods(chart.transitions()[i].events);
    use(transition.condition, Role::kCondition, {}, where);
    look(transition.content, where);
  }
  for (const scxml::Invoke& invoke : model.invokes) look(invoke);
  for (const ExpressionId script : model.scripts)
    use(script, Role::kDecides, "is looked at in a <script>", std::nullopt);
  follow();
}

void ReplyFlow::look(const scxml::Invoke& invoke) {
  for (const ExpressionId expression : {invoke.type.expr, invoke.src.expr})
    use(expression, Role::kDecides, "decides what is invoked", std::nullopt);
  look(invoke.payload, Role::kDecides, std::nullopt);
  look(invoke.finalize, std::nullopt);
}

void ReplyFlow::use(ExpressionId expression, Role role, std::string name, const Where& where) {
  if (expression == scxml::kNoExpression) return;
  if (where && where->empty()) foreign_.insert(expression);
  if (where && trees_[expression]) where_[&*trees_[expression]] = *where;
  if (role == Role::kAssigned && !name.empty()) assigned_[name].push_back(expression);
  uses_.push_back({expression, role, std::move(name)});
}

// Only where all events are replies it is known whose.
ReplyFlow::Where ReplyFlow::methods(const std::vector<std::string>& events) const {
  std::set<std::string> all;
  const std::string own = service_ + ".";
  constexpr std::string_view kReply = ".reply";
  for (const std::string& event : events) {
    if (!event.ends_with(kReply)) return std::nullopt;
    if (!event.starts_with(own)) continue;
    const std::string method = event.substr(own.size(), event.size() - own.size() - kReply.size());
    if (!types_.results.contains(method)) return std::nullopt;
    all.insert(method);
  }
  return events.empty() ? Where() : all;
}

void ReplyFlow::look(const scxml::Payload& payload, Role role, const Where& where) {
  for (const auto* params : {&payload.namelist, &payload.params}) {
    for (const scxml::Param& param : *params)
      use(param.expr, role, role == Role::kDecides ? "is handed on in an event" : param.name, where);
  }
  use(payload.content_expr, Role::kDecides, "is handed on as a whole", where);
}

void ReplyFlow::look(const scxml::Send& send, const Where& where) {
  for (const ExpressionId expression : {send.event.expr, send.target.expr, send.type.expr})
    use(expression, Role::kDecides, "decides which event is sent", where);
  use(send.delay.expr, Role::kDecides, "decides when an event comes", where);
  const bool is_answer = !answer_.empty() && send.event.constant == answer_;
  const Role role = send.type.constant == "thrift" ? Role::kArgument : is_answer ? Role::kGiven : Role::kDecides;
  look(send.payload, role, where);
}

void ReplyFlow::look(const scxml::Block& block, const Where& where) {
  for (const scxml::Action& action : block) {
    if (const auto* assign = std::get_if<scxml::Assign>(&action.what)) {
      if (assign->location == scxml::kNoExpression) continue;
      const scxml::Expression& location = chart_.model().expressions[assign->location];
      use(assign->expr, Role::kAssigned, location.slot ? location.text : std::string(), where);
    } else if (const auto* branches = std::get_if<scxml::If>(&action.what)) {
      for (const scxml::If::Branch& branch : branches->branches) {
        use(branch.condition, Role::kCondition, {}, where);
        look(branch.body, where);
      }
    } else if (const auto* foreach = std::get_if<scxml::Foreach>(&action.what)) {
      use(foreach->array, Role::kDecides, "is gone through item by item", where);
      // What its items are is not known.
      if (foreach->item != scxml::kNoExpression) scripted_.insert(chart_.model().expressions[foreach->item].text);
      if (foreach->index != scxml::kNoExpression) scripted_.insert(chart_.model().expressions[foreach->index].text);
      look(*foreach->body, where);
    } else if (const auto* log = std::get_if<scxml::Log>(&action.what)) {
      use(log->expr, Role::kLogged, {}, where);
    } else if (const auto* script = std::get_if<scxml::Script>(&action.what)) {
      use(script->code, Role::kDecides, "is looked at in a <script>", where);
      for (const std::string& name : scxml::names_in_script(chart_.model().expressions[script->code].text))
        scripted_.insert(name);
    } else if (const auto* cancel = std::get_if<scxml::Cancel>(&action.what)) {
      use(cancel->sendid_expr, Role::kDecides, "decides what is cancelled", where);
    } else if (const auto* send = std::get_if<scxml::Send>(&action.what)) {
      look(*send, where);
    }
  }
}

// Variables to which something of a reply is assigned, and those to which one of these is.
void ReplyFlow::follow() {
  for (bool is_more = true; is_more;) {
    is_more = false;
    for (const auto& [variable, expressions] : assigned_) {
      if (of_reply_.contains(variable)) continue;
      if (!std::any_of(expressions.begin(), expressions.end(), [&](ExpressionId id) {
            return trees_[id] ? is_of_reply(*trees_[id], trees_[id]->root()) : mentions_reply(id);
          }))
        continue;
      of_reply_.insert(variable);
      is_more = true;
    }
  }
}

const std::vector<ExpressionId>& ReplyFlow::assigned(const std::string& variable) const {
  static const std::vector<ExpressionId> kNone;
  const auto found = assigned_.find(variable);
  return found == assigned_.end() ? kNone : found->second;
}

bool ReplyFlow::is_foreign(const ScriptTree& tree) const {
  const auto where = where_.find(&tree);
  return where != where_.end() && where->second.empty();
}

bool ReplyFlow::is_direct(const ScriptTree& tree, std::uint32_t node) const {
  return !is_foreign(tree) && (tree.path(node) + ".").starts_with("_event.data.result.");
}

bool ReplyFlow::is_of_reply(const ScriptTree& tree, std::uint32_t id) const {
  const scxml::ScriptNode& node = tree.at(id);
  if (node.kind == Node::kUnary && (node.text == "!" || node.text == "typeof")) return false;
  if (node.kind == Node::kBinary && (is_comparison(node.text) || node.text == "in" || node.text == "instanceof"))
    return false;
  if (node.kind == Node::kConditional)
    return is_of_reply(tree, node.operands[1]) || is_of_reply(tree, node.operands[2]);
  if (const std::string path = tree.path(id); !path.empty()) {
    if (!(path + ".").starts_with("_event.")) {
      const std::string variable = path.substr(0, path.find('.'));
      return far_.contains(variable) || (of_reply_.contains(variable) && !is_truth_value(tree, id));
    }
    if (is_foreign(tree)) return false;
    return path == "_event" || path == "_event.data" || (is_direct(tree, id) && !is_truth_value(tree, id)) ||
           (path.starts_with("_event.data.") && far_.contains(path.substr(12, path.find('.', 12) - 12)));
  }
  return std::any_of(node.operands.begin(), node.operands.end(),
                     [&](std::uint32_t operand) { return is_of_reply(tree, operand); });
}

// A member that is one wherever it is: both values are tried, and so all that can be made of it.
bool ReplyFlow::is_truth_value(const ScriptTree& tree, std::uint32_t id) const {
  if (tree.at(id).kind != Node::kMember) return false;
  const auto kinds = kinds_of_member(tree, id);
  return kinds.size() == 1 && kinds.contains(idl::Kind::kBool);
}

std::set<idl::Kind> ReplyFlow::kinds_of_member(const ScriptTree& tree, std::uint32_t id) const {
  const std::string& name = tree.at(id).text;
  std::set<idl::Kind> all;
  if (name != "result") {
    if (const auto found = types_.members.find(name); found != types_.members.end()) all = found->second;
    return all;
  }
  const auto where = where_.find(&tree);
  for (const auto& [method, kinds] : types_.results) {
    if (where == where_.end() || where->second.contains(method)) all.insert(kinds.begin(), kinds.end());
  }
  return all;
}

bool ReplyFlow::mentions_reply(ExpressionId expression) const {
  const std::set<std::string> names = scxml::names_in_script(chart_.model().expressions[expression].text);
  if (names.contains("_event") && names.contains("data") && !foreign_.contains(expression)) return true;
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return of_reply_.contains(name) || far_.contains(name); });
}

template <class Visit>
void ReplyFlow::visit_plain(const ScriptTree& tree, std::uint32_t id, std::set<std::string>& seen,
                            const Visit& visit) const {
  const scxml::ScriptNode& node = tree.at(id);
  if (node.kind == Node::kConditional) {
    visit_plain(tree, node.operands[1], seen, visit);
    visit_plain(tree, node.operands[2], seen, visit);
  } else if (node.kind == Node::kName) {
    if (!seen.insert(node.text).second) return;
    if (far_.contains(node.text)) visit(tree, id);
    for (const ExpressionId expression : assigned(node.text)) {
      if (trees_[expression]) visit_plain(*trees_[expression], trees_[expression]->root(), seen, visit);
    }
  } else {
    visit(tree, id);
  }
}

std::set<std::string> ReplyFlow::sources(const ScriptTree& tree, std::uint32_t id) const {
  std::set<std::string> all;
  std::set<std::string> seen;
  visit_plain(tree, id, seen, [&](const ScriptTree& in, std::uint32_t node) {
    if (in.at(node).kind == Node::kMember) all.insert(in.at(node).text);
  });
  return all;
}

bool ReplyFlow::forwards() const {
  const auto& invokes = chart_.model().invokes;
  return std::any_of(invokes.begin(), invokes.end(), [](const scxml::Invoke& invoke) { return invoke.autoforward; });
}

std::size_t ReplyFlow::held(const std::string& source) const {
  const auto found = types_.places.find(source);
  const std::size_t inside = found == types_.places.end() ? 1 : found->second;
  std::size_t sum = 0;
  for (const std::string& variable : of_reply_) {
    std::size_t most = 0;
    for (const ExpressionId one : assigned(variable)) {
      if (!trees_[one]) continue;
      if (kinds(*trees_[one], trees_[one]->root()).contains(idl::Kind::kStruct))
        most = inside;
      else if (sources(*trees_[one], trees_[one]->root()).contains(source))
        most = std::max<std::size_t>(most, 1);
    }
    sum += most;
  }
  return sum;
}

bool ReplyFlow::sees_reply() const {
  for (std::size_t id = 0; id < trees_.size(); ++id) {
    if (!trees_[id]) {
      if (mentions_reply(static_cast<ExpressionId>(id))) return true;
      continue;
    }
    const ScriptTree& tree = *trees_[id];
    std::set<std::uint32_t> inner;  // of longer paths
    for (const scxml::ScriptNode& node : tree.nodes) {
      if (node.kind == Node::kMember) inner.insert(node.operands[0]);
    }
    for (std::uint32_t node = 0; node < tree.nodes.size(); ++node) {
      if (tree.path(node) == "_event.data.exception") return true;
      if (!inner.contains(node) && (is_direct(tree, node) || is_of_reply(tree, node))) return true;
    }
  }
  return forwards();
}

std::set<idl::Kind> ReplyFlow::kinds(const ScriptTree& tree, std::uint32_t id) const {
  std::set<idl::Kind> all;
  std::set<std::string> seen;
  visit_plain(tree, id, seen, [&](const ScriptTree& in, std::uint32_t node) {
    if (in.at(node).kind == Node::kMember && is_of_reply(in, node)) all.merge(kinds_of_member(in, node));
  });
  return all;
}

bool ReplyFlow::is_of_text(const ScriptTree& tree, std::uint32_t id) const {
  std::set<std::string> seen;
  return is_of_text(tree, id, seen);
}

bool ReplyFlow::is_of_text(const ScriptTree& tree, std::uint32_t id, std::set<std::string>& seen) const {
  const scxml::ScriptNode& node = tree.at(id);
  if (!is_of_reply(tree, id)) return false;
  if (node.kind == Node::kMember && kinds_of_member(tree, id).contains(idl::Kind::kString)) return true;
  if (node.kind == Node::kName && seen.insert(node.text).second) {
    const auto& all = assigned(node.text);
    return std::any_of(all.begin(), all.end(), [&](ExpressionId one) {
      return trees_[one] && is_of_text(*trees_[one], trees_[one]->root(), seen);
    });
  }
  return std::any_of(node.operands.begin(), node.operands.end(),
                     [&](std::uint32_t operand) { return is_of_text(tree, operand, seen); });
}

bool ReplyFlow::is_far(const ScriptTree& tree, std::uint32_t id) const {
  bool is_any = false;
  std::set<std::string> seen;
  visit_plain(tree, id, seen, [&](const ScriptTree& in, std::uint32_t node) {
    for (std::uint32_t part = 0; part <= node; ++part)
      is_any = is_any || (in.at(part).kind == Node::kName && far_.contains(in.at(part).text)) ||
               (in.path(part).starts_with("_event.data.") && far_.contains(in.at(part).text));
  });
  return is_any;
}

bool ReplyFlow::is_plain(const ScriptTree& tree, std::uint32_t id) const {
  bool is_all = true;
  std::set<std::string> seen;
  visit_plain(tree, id, seen, [&](const ScriptTree& in, std::uint32_t node) {
    is_all = is_all && (in.at(node).kind == Node::kMember || !is_of_reply(in, node));
  });
  return is_all;
}

std::set<std::string> ReplyFlow::given() const {
  std::set<std::string> all;
  for (const Use& use : uses_) {
    if (use.role != Role::kGiven) continue;
    const auto& tree = trees_[use.expression];
    if (tree ? is_of_reply(*tree, tree->root()) : mentions_reply(use.expression)) all.insert(use.name);
  }
  return all;
}

namespace {

// One expression, part by part.
class Parts {
 public:
  Parts(const ReplyFlow& flow, const ReplyFlow::Use& use, const ScriptTree& tree)
      : flow_(flow), use_(use), tree_(tree) {}

  /// Why what is made of a reply is not understood; empty: it is.
  std::string operator()() {
    for (std::uint32_t node = 0; node < tree_.nodes.size() && why_.empty(); ++node) look(node);
    return why_;
  }

 private:
  bool is_of_reply(std::uint32_t node) const { return flow_.is_of_reply(tree_, node); }
  bool may_be_text(std::uint32_t node) const {
    return is_of_reply(node) && flow_.kinds(tree_, node).contains(idl::Kind::kString);
  }

  void look(std::uint32_t id) {
    const scxml::ScriptNode& node = tree_.at(id);
    const auto any = [&] {
      return std::any_of(node.operands.begin(), node.operands.end(),
                         [&](std::uint32_t one) { return is_of_reply(one); });
    };
    switch (node.kind) {
      case Node::kMember: return member(id);
      case Node::kIndex:
        if (is_of_reply(node.operands[1])) why_ = "chooses by an index";
        if (is_of_reply(node.operands[0])) why_ = "is looked into by an index";
        return;
      case Node::kCall: return call(node);
      case Node::kList:
      case Node::kRecord:
        // As an argument it is handed on as it is.
        if (use_.role != ReplyFlow::Role::kArgument && any()) why_ = "is kept in an object";
        return;
      case Node::kUnary:
        if ((node.text == "++" || node.text == "--" || node.text == "~") && any()) why_ = "is changed by " + node.text;
        if ((node.text == "+" || node.text == "-") && may_be_text(node.operands[0])) why_ = kCounts;
        return;
      case Node::kBinary: return binary(node);
      case Node::kAssignment:
        if (any()) why_ = "is assigned inside an expression";
        return;
      case Node::kOpaque:
        if (flow_.mentions_reply(use_.expression)) why_ = "is looked at in a function";
        return;
      default: return;
    }
  }

  void member(std::uint32_t id) {
    const scxml::ScriptNode& node = tree_.at(id);
    if (!is_of_reply(id)) return;
    const auto kinds = flow_.kinds(tree_, node.operands[0]);
    const bool is_struct = kinds.empty() || kinds.contains(idl::Kind::kStruct);
    if (tree_.path(id).empty()) {
      why_ = "is looked into after it was changed";
    } else if (node.text != "data" && node.text != "result" &&
               !(is_struct && flow_.types().fields->contains(node.text)) && !flow_.is_far(tree_, id)) {
      why_ = fmt::format("has its {} looked at", node.text);
    }
  }

  void call(const scxml::ScriptNode& node) {
    const bool is_given = std::any_of(node.operands.begin() + 1, node.operands.end(),
                                      [&](std::uint32_t one) { return is_of_reply(one); });
    const std::string function = tree_.path(node.operands[0]);
    const scxml::ScriptNode& callee = tree_.at(node.operands[0]);
    if (callee.kind == Node::kMember && callee.text == "indexOf" && tree_.at(callee.operands[0]).kind == Node::kList &&
        !is_of_reply(callee.operands[0]))
      return;
    if (is_of_reply(node.operands[0])) {
      why_ = callee.kind == Node::kMember ? fmt::format("is asked for {}()", callee.text) : "is called";
    } else if (is_given && !is_steady(function)) {
      why_ = "is given to " + (function.empty() ? "a function" : function + "()");
    } else if (std::any_of(node.operands.begin() + 1, node.operands.end(),
                           [&](std::uint32_t one) { return may_be_text(one); })) {
      why_ = kCounts;
    }
  }

  void binary(const scxml::ScriptNode& node) {
    const std::uint32_t left = node.operands[0];
    const std::uint32_t right = node.operands[1];
    if (is_comparison(node.text)) {
      for (const auto& [value, other] : {std::pair(left, right), std::pair(right, left)}) {
        if (is_of_reply(value)) compared(node.text, value, tree_.at(other));
      }
    } else if (node.text == "in") {
      if (is_of_reply(left)) why_ = "is looked for among members";
    } else if (node.text == "instanceof") {
      if (is_of_reply(left) || is_of_reply(right)) why_ = "is asked for its class";
    } else if (node.text == "-" || node.text == "*" || node.text == "/") {
      if (may_be_text(left) || may_be_text(right)) why_ = kCounts;
    }
  }

  void compared(const std::string& sign, std::uint32_t value, const scxml::ScriptNode& other) {
    const bool is_strict = sign.size() == 3;
    const auto kinds = flow_.kinds(tree_, value);
    const auto may_be = [&](idl::Kind kind) { return kinds.contains(kind); };
    const bool may_be_number = may_be(idl::Kind::kI8) || may_be(idl::Kind::kI16) || may_be(idl::Kind::kI32) ||
                               may_be(idl::Kind::kI64) || may_be(idl::Kind::kDouble);
    if (other.kind == Node::kNothing && !flow_.is_plain(tree_, value)) {
      why_ = "is changed before it is asked whether it is there";
    } else if (other.kind == Node::kTruth) {
      // Of another type it never is the same.
      if (!flow_.is_plain(tree_, value)) why_ = "is changed before it is compared with a truth value";
      if (!is_strict && (may_be_number || may_be(idl::Kind::kString)))
        why_ = fmt::format("is compared by {} with a truth value", sign);
    } else if (!is_strict && may_be(idl::Kind::kString) && other.kind != Node::kText && other.kind != Node::kNothing) {
      // A variable may hold a text, and then counts as one.
      const bool is_order = sign.front() == '<' || sign.front() == '>';
      const bool may_be_text = other.kind == Node::kName || other.kind == Node::kMember;
      if (is_order || !may_be_text) why_ = kCounts;
    }
  }

  static constexpr const char* kCounts = "is a text that counts as a number";

  const ReplyFlow& flow_;
  const ReplyFlow::Use& use_;
  const ScriptTree& tree_;
  std::string why_;
};

}  // namespace

std::optional<UnknownUse> unknown_use(const ReplyFlow& flow, const LookedAt& looked_at) {
  using Role = ReplyFlow::Role;
  for (const ReplyFlow::Use& use : flow.uses()) {
    if (use.role == Role::kLogged && !looked_at.logs) continue;
    const auto& tree = flow.tree(use.expression);
    const auto unknown = [&](std::string why) { return UnknownUse{use.expression, std::move(why)}; };
    if (!tree) {
      if (flow.mentions_reply(use.expression))
        return unknown(use.role == Role::kDecides ? use.name : "is in an expression that cannot be read");
      continue;
    }
    if (std::string why = Parts(flow, use, *tree)(); !why.empty()) return unknown(std::move(why));
    if (!flow.is_of_reply(*tree, tree->root())) continue;
    if (use.role == Role::kDecides) return unknown(use.name);
    if (use.role == Role::kAssigned && use.name.empty()) return unknown("is kept in a member of a variable");
    if (use.role == Role::kLogged) return unknown("is logged, and a monitor looks at that");
    if (use.role == Role::kGiven && looked_at.outputs.contains(use.name))
      return unknown(fmt::format("is given as the output {}, which a monitor looks at", use.name));
    if (use.role == Role::kArgument && looked_at.arguments.contains(use.name))
      return unknown(
          fmt::format("is handed on as the argument {} of a call, which a monitor or a model looks at", use.name));
  }
  return std::nullopt;
}

}  // namespace sentree::verify
