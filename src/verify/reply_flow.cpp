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

bool hides_names(const std::set<std::string>& names_in_script) {
  static const std::set<std::string> kHiding{"eval", "Function", "constructor", "this", "globalThis", "with"};
  return std::any_of(kHiding.begin(), kHiding.end(),
                     [&](const std::string& word) { return names_in_script.contains(word); });
}

namespace {

constexpr std::string_view kData = "_event.data.";
constexpr std::string_view kArguments = "_event.data.args";

// Calls of functions that only look at what they are given.
bool only_looks(const ScriptTree& tree, const scxml::ScriptNode& call) {
  static const std::set<std::string> kFunctions{"String",     "Number", "Boolean",       "parseInt",
                                                "parseFloat", "isNaN",  "Array.isArray", "isFinite"};
  static const std::set<std::string> kMethods{"toFixed", "toString", "toPrecision", "trim",  "toUpperCase",
                                              "join",    "substr",   "substring",   "slice", "toLowerCase",
                                              "concat",  "indexOf",  "charAt",      "split"};
  const std::uint32_t callee = call.operands[0];
  const std::string path = tree.path(callee);
  // What replaces values gets them.
  if (path == "JSON.stringify") return call.operands.size() < 3 || tree.at(call.operands[2]).kind == Node::kNothing;
  if (kFunctions.contains(path) || path.starts_with("Math.")) return true;
  return tree.at(callee).kind == Node::kMember && kMethods.contains(tree.at(callee).text);
}

bool changes(const scxml::ScriptNode& node) {
  return node.kind == Node::kAssignment || (node.kind == Node::kUnary && (node.text == "++" || node.text == "--"));
}

// Names that a script may give another value.
std::set<std::string> assigned_in(const std::string& script) {
  static const std::set<std::string_view> kBehind{
      "=", "+=", "-=", "*=", "/=", "%=", "<<=", ">>=", ">>>=", "&=", "|=", "^=", "++", "--", "in"};
  static const std::set<std::string_view> kBefore{"++", "--", "function", "delete"};
  const auto tokens = scxml::script_tokens(script);
  if (!tokens) return scxml::names_in_script(script);
  std::set<std::string> names;
  for (std::size_t i = 0; i < tokens->size(); ++i) {
    const auto raw = [&](std::size_t at) { return at < tokens->size() ? (*tokens)[at].raw : std::string_view(); };
    const bool is_assigned = kBehind.contains(raw(i + 1)) || (i > 0 && kBefore.contains(raw(i - 1)));
    if ((*tokens)[i].kind == scxml::ScriptToken::Kind::kName && is_assigned) names.emplace(raw(i));
    // (name) = value
    if ((raw(i) == ")" && raw(i + 1) != "in" && kBehind.contains(raw(i + 1))) ||
        (raw(i) == "(" && i > 0 && (raw(i - 1) == "++" || raw(i - 1) == "--")))
      return scxml::names_in_script(script);
  }
  return names;
}

}  // namespace

ReplyFlow::ReplyFlow(const scxml::Chart& chart, std::string service, const ReplyTypes& types, std::set<std::string> far,
                     Answer answer)
    : chart_(chart), service_(std::move(service)), types_(types), far_(std::move(far)), answer_(std::move(answer)) {
  const scxml::Model& model = chart.model();
  for (const scxml::Expression& expression : model.expressions)
    trees_.push_back(scxml::parse_script_expression(expression.text));
  for (const scxml::Variable& variable : model.variables) {
    use(variable.expr, Role::kAssigned, variable.id, std::nullopt);
    if (variable.expr == scxml::kNoExpression && variable.content) scripted_.insert(variable.id);
  }
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
  note_changes();
  follow();
  for (const auto& tree : trees_) {
    for (std::uint32_t node = 0; tree && node < tree->nodes.size(); ++node) {
      if (std::string sent = echo(*tree, node); !sent.empty()) echoes_.insert(std::move(sent));
    }
  }
}

// Whatever is assigned by scripts, by functions and inside expressions, or written by the engine.
void ReplyFlow::note_changes() {
  const auto& expressions = chart_.model().expressions;
  for (std::size_t id = 0; id < expressions.size(); ++id) {
    const auto& tree = trees_[id];
    const bool is_script = expressions[id].use == scxml::ExpressionUse::kScript;
    const bool may_change =
        is_script || !tree || std::any_of(tree->nodes.begin(), tree->nodes.end(), [](const scxml::ScriptNode& node) {
          return changes(node) || node.kind == Node::kOpaque;
        });
    if (!hiding_ && hides_names(scxml::names_in_script(expressions[id].text))) hiding_ = static_cast<ExpressionId>(id);
    if (may_change) scripted_.merge(assigned_in(expressions[id].text));
  }
  if (types_.defaulted == nullptr) return;
  for (const std::string& argument : *types_.defaulted) scripted_.insert(fmt::format("{}.{}", kArguments, argument));
}

void ReplyFlow::look(const scxml::Invoke& invoke) {
  for (const ExpressionId expression : {invoke.type.expr, invoke.src.expr})
    use(expression, Role::kDecides, "decides what is invoked", std::nullopt);
  look(invoke.payload, Role::kDecides, std::nullopt);
  look(invoke.finalize, std::nullopt);
  // Where an empty <finalize> writes.
  for (const auto* params : {&invoke.payload.namelist, &invoke.payload.params}) {
    for (const scxml::Param& param : *params) {
      if (param.location != scxml::kNoExpression)
        scripted_.merge(scxml::names_in_script(chart_.model().expressions[param.location].text));
    }
  }
  if (invoke.idlocation != scxml::kNoExpression)
    scripted_.merge(scxml::names_in_script(chart_.model().expressions[invoke.idlocation].text));
}

void ReplyFlow::use(ExpressionId expression, Role role, std::string name, const Where& where) {
  if (expression == scxml::kNoExpression) return;
  if (where && where->empty()) foreign_.insert(expression);
  if (where && trees_[expression]) where_[&*trees_[expression]] = *where;
  if (role == Role::kAssigned && !name.empty()) assigned_[name].push_back(expression);
  if (role == Role::kArgument) assigned_[fmt::format("{}.{}", kArguments, name)].push_back(expression);
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

void ReplyFlow::look(const scxml::Payload& payload, Role role, const Where& where, const std::string& call) {
  for (const auto* params : {&payload.namelist, &payload.params}) {
    for (const scxml::Param& param : *params) {
      if (param.expr == scxml::kNoExpression) continue;
      use(param.expr, role, role == Role::kDecides ? "is handed on in an event" : param.name, where);
      uses_.back().call = call;
    }
  }
  use(payload.content_expr, Role::kDecides, "is handed on as a whole", where);
}

void ReplyFlow::look(const scxml::Send& send, const Where& where) {
  for (const ExpressionId expression : {send.event.expr, send.target.expr, send.type.expr})
    use(expression, Role::kDecides, "decides which event is sent", where);
  use(send.delay.expr, Role::kDecides, "decides when an event comes", where);
  if (send.idlocation != scxml::kNoExpression)
    scripted_.merge(scxml::names_in_script(chart_.model().expressions[send.idlocation].text));
  if (send.type.constant == "thrift") {
    const bool is_named = !send.target.constant.empty() && !send.event.constant.empty();
    look(send.payload, Role::kArgument, where,
         is_named ? send.target.constant + "." + send.event.constant : std::string());
    return;
  }
  if (answer_.event.empty() || send.event.constant != answer_.event) return look(send.payload, Role::kDecides, where);
  look(send.payload, Role::kGiven, where);
  for (const auto* params : {&send.payload.namelist, &send.payload.params}) {
    for (const scxml::Param& param : *params) {
      if (param.expr == scxml::kNoExpression) continue;
      if (answer_.status.empty() || param.name == answer_.status)
        use(param.expr, Role::kDecides, "decides how a tick is answered", where);
      // A name under which replies are read.
      if (param.name == "result") use(param.expr, Role::kDecides, "comes back as the result of an answer", where);
      assigned_[fmt::format("{}{}", kData, param.name)].push_back(param.expr);
    }
  }
}

void ReplyFlow::look(const scxml::Block& block, const Where& where) {
  for (const scxml::Action& action : block) {
    if (const auto* assign = std::get_if<scxml::Assign>(&action.what)) {
      if (assign->location == scxml::kNoExpression) continue;
      const scxml::Expression& location = chart_.model().expressions[assign->location];
      use(assign->expr, Role::kAssigned, location.slot ? location.text : std::string(), where);
      if (!location.slot) use(assign->location, Role::kDecides, "has a member changed", where);
      if (!location.slot || assign->expr == scxml::kNoExpression)
        scripted_.merge(scxml::names_in_script(location.text));
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
      if (std::none_of(expressions.begin(), expressions.end(), [&](ExpressionId id) { return is_of_reply(id); }))
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

bool ReplyFlow::is_of_reply(ExpressionId expression) const {
  const auto& tree = trees_[expression];
  return tree ? is_of_reply(*tree, tree->root()) : mentions_reply(expression);
}

std::string ReplyFlow::echo(const ScriptTree& tree, std::uint32_t node) const {
  if (tree.at(node).kind != Node::kMember) return {};
  std::string path = tree.path(node);
  return path.starts_with(kData) && path != "_event.data.result" && assigned_.contains(path) ? path : std::string();
}

bool ReplyFlow::is_any_sent() const {
  return std::any_of(of_reply_.begin(), of_reply_.end(),
                     [](const std::string& variable) { return variable.starts_with(kData); });
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
    return is_event_of_reply(tree, id, path);
  }
  return std::any_of(node.operands.begin(), node.operands.end(),
                     [&](std::uint32_t operand) { return is_of_reply(tree, operand); });
}

bool ReplyFlow::is_event_of_reply(const ScriptTree& tree, std::uint32_t id, const std::string& path) const {
  static const std::set<std::string> kFacts{"_event.name",   "_event.type",       "_event.sendid",
                                            "_event.origin", "_event.origintype", "_event.invokeid"};
  if (path == kArguments) return is_any_sent();
  if (path.starts_with(kData)) {
    if (far_.contains(path.substr(kData.size(), path.find('.', kData.size()) - kData.size()))) return true;
    for (std::size_t end = path.size(); end > kData.size() && end != std::string::npos;
         end = path.rfind('.', end - 1)) {
      if (of_reply_.contains(path.substr(0, end))) return true;
    }
    return is_direct(tree, id) && !is_truth_value(tree, id);
  }
  if (path != "_event" && path != "_event.data") return !kFacts.contains(path.substr(0, path.find('.', 7)));
  return !is_foreign(tree) || is_any_sent() || !far_.empty();
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
  if (names.contains("_event") && (!foreign_.contains(expression) || is_any_sent() || !far_.empty())) return true;
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
  } else if (const std::string sent = echo(tree, id); node.kind == Node::kName || !sent.empty()) {
    const std::string& variable = sent.empty() ? node.text : sent;
    if (!seen.insert(variable).second) return;
    if (far_.contains(node.text)) visit(tree, id);
    for (const ExpressionId expression : assigned(variable)) {
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
    // What comes back counts where somebody looks at it.
    if (variable.starts_with(kData) && !echoes_.contains(variable)) continue;
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
  const std::string sent = echo(tree, id);
  if (sent.empty() && node.kind == Node::kMember && kinds_of_member(tree, id).contains(idl::Kind::kString)) return true;
  if (const std::string& variable = sent.empty() ? node.text : sent;
      (node.kind == Node::kName || !sent.empty()) && seen.insert(variable).second) {
    const auto& all = assigned(variable);
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
    if (use.role == Role::kGiven && is_of_reply(use.expression)) all.insert(use.name);
  }
  return all;
}

std::set<std::pair<std::string, std::string>> ReplyFlow::passed() const {
  std::set<std::pair<std::string, std::string>> all;
  for (const Use& use : uses_) {
    if (use.role == Role::kArgument && is_of_reply(use.expression)) all.emplace(use.call, use.name);
  }
  return all;
}

namespace {

// One expression, part by part.
class Parts {
 public:
  Parts(const ReplyFlow& flow, const ReplyFlow::Use& use, const ScriptTree& tree)
      : flow_(flow), use_(use), tree_(tree) {
    const auto add = [&](std::uint32_t node) { looked_into_.insert(node); };
    for (const scxml::ScriptNode& node : tree.nodes) {
      const bool is_test = node.text == "&&" || node.text == "!" || node.text == "typeof";
      if (node.kind == Node::kMember || node.kind == Node::kConditional ||
          ((node.kind == Node::kBinary || node.kind == Node::kUnary) && is_test))
        add(node.operands[0]);
      if (node.kind == Node::kBinary && is_comparison(node.text)) {
        if (tree.at(node.operands[1]).kind == Node::kNothing) add(node.operands[0]);
        if (tree.at(node.operands[0]).kind == Node::kNothing) add(node.operands[1]);
      }
    }
  }

  /// Why what is made of a reply is not understood; empty: it is.
  std::string operator()() {
    for (std::uint32_t node = 0; node < tree_.nodes.size() && why_.empty(); ++node) look(node);
    return why_;
  }
  /// The same of what nobody looks at: it may yet be kept by the way.
  std::string kept() {
    for (std::uint32_t id = 0; id < tree_.nodes.size() && why_.empty(); ++id) {
      const scxml::ScriptNode& node = tree_.at(id);
      if (changes(node) || node.kind == Node::kOpaque || (node.kind == Node::kCall && !only_looks(tree_, node)))
        look(id);
    }
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
      case Node::kName:
        if (node.text == "_event" && is_of_reply(id)) whole(id);
        return;
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
    const std::string path = tree_.path(id);
    if (!flow_.echo(tree_, id).empty()) return;
    if (path == kArguments || path == "_event.data") return whole(id);
    if (!flow_.echo(tree_, node.operands[0]).empty()) {
      why_ = "is looked into where it comes back as an argument";
      return;
    }
    const auto kinds = flow_.kinds(tree_, node.operands[0]);
    const bool is_struct = kinds.empty() || kinds.contains(idl::Kind::kStruct);
    if (tree_.path(id).empty()) {
      why_ = "is looked into after it was changed";
    } else if (node.text != "data" && node.text != "result" &&
               !(is_struct && flow_.types().fields->contains(node.text)) && !flow_.is_far(tree_, id)) {
      why_ = fmt::format("has its {} looked at", node.text);
    }
  }

  // All that an event holds, with what was sent and comes back in it.
  void whole(std::uint32_t id) {
    if (flow_.is_sent() && !looked_into_.contains(id)) why_ = "is kept among all that its event holds";
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
  std::set<std::uint32_t> looked_into_;  // parts of which only a member goes on, or whether they are there
  std::string why_;
};

}  // namespace

std::optional<UnknownUse> unknown_use(const ReplyFlow& flow, const LookedAt& looked_at) {
  using Role = ReplyFlow::Role;
  if (flow.hiding()) return UnknownUse{*flow.hiding(), "may be looked at by way of eval, this or the like"};
  for (const ReplyFlow::Use& use : flow.uses()) {
    const auto& tree = flow.tree(use.expression);
    const auto unknown = [&](std::string why) { return UnknownUse{use.expression, std::move(why)}; };
    if (!tree) {
      if (flow.mentions_reply(use.expression))
        return unknown(use.role == Role::kDecides ? use.name : "is in an expression that cannot be read");
      continue;
    }
    Parts parts(flow, use, *tree);
    const bool is_unseen = use.role == Role::kLogged && !looked_at.logs;
    if (std::string why = is_unseen ? parts.kept() : parts(); !why.empty()) return unknown(std::move(why));
    if (is_unseen) continue;
    if (!flow.is_of_reply(*tree, tree->root())) continue;
    if (use.role == Role::kDecides) return unknown(use.name);
    if (use.role == Role::kAssigned && use.name.empty()) return unknown("is kept in a member of a variable");
    if (use.role == Role::kLogged) return unknown("is logged, and a monitor looks at that");
    if (use.role == Role::kGiven && looked_at.outputs.contains(use.name))
      return unknown(fmt::format("is given as the output {}, which a monitor looks at", use.name));
    if (use.role != Role::kArgument) continue;
    if (looked_at.arguments.contains(use.name))
      return unknown(
          fmt::format("is handed on as the argument {} of a call, which a monitor or a model looks at", use.name));
    if (looked_at.published.contains(use.name) && (use.call.empty() || looked_at.topics.contains(use.call)))
      return unknown(fmt::format("is published as {}, which a model looks at", use.name));
    if (const auto compared = looked_at.handed_back.find(use.name);
        compared != looked_at.handed_back.end() &&
        (!flow.is_plain(*tree, tree->root()) || flow.sources(*tree, tree->root()) != compared->second))
      return unknown(
          fmt::format("is handed on as the argument {} of a call, which a monitor compares with another "
                      "reply",
                      use.name));
  }
  return std::nullopt;
}

}  // namespace sentree::verify
