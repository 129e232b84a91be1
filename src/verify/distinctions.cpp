#include "sentree/verify/detail/distinctions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>
#include <utility>

#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"
#include "sentree/verify/detail/mission_flow.h"
#include "sentree/verify/detail/reply_flow.h"

namespace sentree::verify {

namespace {

using scxml::ScriptTree;
using Node = scxml::ScriptNode::Kind;

// Of one variable or expression; beyond, what it can be is as good as unknown.
constexpr std::size_t kConstantsMax = 64;

double inverse(const std::string& sign, double result, double known, bool known_is_left) {
  if (sign == "+") return result - known;
  if (sign == "-") return known_is_left ? known - result : result + known;
  if (sign == "*") return result / known;
  return known_is_left ? known / result : result * known;
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

std::set<idl::Kind> kinds_of(const idl::Type& type) {
  std::set<idl::Kind> kinds{type.kind};
  const idl::Type* inner = type.element;
  for (int depth = 0; inner != nullptr && depth < kReplyNestingMax; ++depth, inner = inner->element)
    kinds.insert(inner->kind);
  return kinds;
}

void add_kinds(const idl::Type& type, int depth, std::map<std::string, std::set<idl::Kind>>& members) {
  if (type.element != nullptr && depth < kReplyNestingMax) add_kinds(*type.element, depth + 1, members);
  if (type.kind != idl::Kind::kStruct || depth >= kReplyNestingMax) return;
  for (const idl::Field& field : type.structure->fields) {
    const bool is_new = !members.contains(field.name);
    members[field.name].merge(kinds_of(*field.type));
    if (is_new || depth < 2) add_kinds(*field.type, depth + 1, members);
  }
}

// Names of members, of as much as is looked into of each reply.
class MemberNames {
 public:
  explicit MemberNames(std::set<std::string>& out) : out_(out) {}

  void add(const idl::Type& type, int depth = 0) {
    if (depth >= kReplyNestingMax) return;
    if (type.element != nullptr) add(*type.element, depth + 1);
    if (type.kind != idl::Kind::kStruct) return;
    const auto [seen, is_new] = seen_.try_emplace(type.structure, depth);
    if (!is_new && seen->second <= depth) return;
    seen->second = depth;
    for (const idl::Field& field : type.structure->fields) {
      out_.insert(field.name);
      add(*field.type, depth + 1);
    }
  }

 private:
  std::set<std::string>& out_;
  std::map<const idl::Struct*, int> seen_;  // and how deep at least
};

// In how many places values of a type have members, by name.
class MemberPlaces {
 public:
  using Counts = std::map<std::string, std::size_t>;

  const Counts& of(const idl::Type& type, int depth = 0) {
    static const Counts kNone;
    if (type.kind != idl::Kind::kStruct || depth >= kReplyNestingMax) return kNone;
    const auto known = known_.find({type.structure, depth});
    if (known != known_.end()) return known->second;
    Counts counts;
    const auto add = [&counts](const std::string& name, std::size_t more) {
      std::size_t& count = counts[name];
      count = std::min(count + more, kReplyPlacesMax);
    };
    for (const idl::Field& field : type.structure->fields) {
      add(field.name, 1);
      for (const auto& [name, count] : of(*field.type, depth + 1)) add(name, count);
    }
    return known_[{type.structure, depth}] = std::move(counts);
  }

 private:
  std::map<std::pair<const idl::Struct*, int>, Counts> known_;
};

// What is known of a chart before it begins.
struct Given {
  std::map<std::string, std::set<double>> numbers;
  std::map<std::string, std::set<std::string>> texts;
  std::set<std::string> open;    // what they hold is not known
  std::set<std::string> inputs;  // of them, those that hold something to begin with
};

// What a part of an expression can be, if it is made of constants only, and all that is made of them is known.
struct Constants {
  std::set<double> numbers;
  std::set<std::string> texts;

  // A port that is written down is a text that may count as a number.
  bool are_numbers() const {
    return std::all_of(texts.begin(), texts.end(),
                       [](const std::string& text) { return !numbers_in(Value(text)).empty(); });
  }
  bool add(const std::optional<Constants>& more) {
    if (!more) return false;
    numbers.insert(more->numbers.begin(), more->numbers.end());
    texts.insert(more->texts.begin(), more->texts.end());
    return numbers.size() <= kConstantsMax && texts.size() <= kConstantsMax;
  }
};

// What skills pass as arguments of calls, by name, beside what replies hold; nothing: that is not known.
using Passed = std::map<std::string, std::optional<Constants>>;

// One chart's comparisons.
class Comparisons {
 public:
  /// @param place    Of what the chart was written from; nothing: it has places of its own.
  /// @param monitor  Whose chart it is; empty: one that decides what the mission does.
  /// @param passed   To calls of which a monitor sees the arguments; null: those are the chart's own.
  Comparisons(const ReplyFlow& flow, Given given, Distinctions& uses, std::optional<SourceSpan> place = std::nullopt,
              std::string monitor = {}, const Passed* passed = nullptr)
      : flow_(flow),
        given_(std::move(given)),
        uses_(uses),
        place_(std::move(place)),
        monitor_(std::move(monitor)),
        passed_(passed) {
    for (const scxml::Expression& expression : expressions()) {
      for (const std::string& name : scxml::names_in_script(expression.text)) uses_.own.names.insert(name);
    }
    for (const ReplyFlow::Use& use : flow_.uses()) {
      if (use.role == ReplyFlow::Role::kCondition) conditions_.insert(use.expression);
    }
  }

  void operator()(const LookedAt& looked_at) {
    for (std::size_t i = 0; i < flow_.size(); ++i) {
      expression_ = static_cast<scxml::ExpressionId>(i);
      if (const auto& tree = flow_.tree(expression_)) look(*tree);
    }
    // Charts that compare stand side by side, so that what all of them keep is compared with one and the same reply.
    for (const std::string& name : compared_) uses_.at_once[name] += std::max<std::size_t>(flow_.held(name), 1);
    for (auto& [name, place] : ordered_) uses_.ordered[name].push_back({std::move(place), monitor_});
    if (flow_.forwards() && !uses_.trouble) {
      uses_.trouble = Diagnostic{Severity::kError, "verify.any-reply",
                                 "every reply is handed on to what the chart invokes (autoforward), and which of its "
                                 "values that tells apart is not known",
                                 place_ ? *place_ : flow_.chart().span(flow_.chart().states().front().place)};
    }
    if (uses_.trouble) return;
    if (const auto unknown = unknown_use(flow_, looked_at)) {
      expression_ = unknown->expression;
      const auto& tree = flow_.tree(expression_);
      give_up(tree ? &*tree : nullptr, unknown->why);
    }
  }

  /// What an expression can be beside what replies hold, if constants make that.
  std::optional<Constants> constants_of(scxml::ExpressionId expression) {
    const auto& tree = flow_.tree(expression);
    std::set<std::string> seen;
    Constants all;
    const bool is_known = tree && add_first(*tree, tree->root(), seen, all);
    return is_known ? std::optional(std::move(all)) : std::nullopt;
  }

 private:
  const std::vector<scxml::Expression>& expressions() const { return flow_.chart().model().expressions; }

  void look(const ScriptTree& tree) {
    if (conditions_.contains(expression_)) truth(tree.root());
    for (const scxml::ScriptNode& node : tree.nodes) {
      if (node.kind == Node::kText) uses_.own.words.insert(node.text);
      if (node.kind == Node::kUnary && node.text == "!") truth(node.operands[0]);
      if (node.kind == Node::kConditional) truth(node.operands[0]);
      if (node.kind == Node::kMember && node.text == "exception") exception(tree, node);
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

  // What a part of an expression that is made of a reply tells apart is not known.
  void give_up(const ScriptTree& tree, std::uint32_t id, const std::string& why) {
    if (!uses_.trouble && flow_.is_of_reply(tree, id)) give_up(&tree, why);
  }
  void give_up(const ScriptTree* tree, const std::string& why) {
    std::string what;
    for (std::uint32_t node = 0; tree != nullptr && node < tree->nodes.size() && what.empty(); ++node) {
      if (flow_.is_direct(*tree, node)) what = tree->path(node);
    }
    uses_.trouble = Diagnostic{
        Severity::kError, "verify.any-reply",
        fmt::format("{} {}, so that which of its values are told apart is not known: only comparisons with constants, "
                    "after + - * / by constants, tell that",
                    what.empty() ? "a reply" : what, why),
        place()};
  }
  SourceSpan place() const { return place_ ? *place_ : flow_.chart().span(expressions()[expression_].place); }
  const ScriptTree& here() const { return *flow_.tree(expression_); }

  // What is wanted to be true or false: numbers are unless they are 0, texts unless they are empty.
  void truth(std::uint32_t id) {
    const ScriptTree& tree = here();
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
    if (!flow_.is_of_reply(tree, id)) return;
    if (flow_.is_far(tree, id)) give_up(tree, id, kIsFar);
    for (const std::string& name : flow_.sources(tree, id)) {
      uses_.texts[name].insert("");
      uses_.absent.insert(name);
    }
    equal(tree, id, 0);
  }

  // 'member' in value
  void look_for_member(const scxml::ScriptNode& in) {
    const ScriptTree& tree = here();
    const std::set<std::string> members = text_constants(tree, in.operands[0]);
    uses_.absent.insert(members.begin(), members.end());
    uses_.own.names.insert(members.begin(), members.end());
    if (members.empty()) give_up(tree, in.operands[1], "is looked into for members without a name");
  }

  // Any reply throws nothing that holds anything.
  void exception(const ScriptTree& tree, const scxml::ScriptNode& member) {
    if (uses_.trouble || tree.path(member.operands[0]) != "_event.data") return;
    uses_.trouble = Diagnostic{Severity::kError, "verify.any-reply",
                               "_event.data.exception is looked at, and which of its values are told apart is not "
                               "known",
                               place()};
  }

  void compare(const scxml::ScriptNode& comparison) {
    const std::uint32_t left = comparison.operands[0];
    const std::uint32_t right = comparison.operands[1];
    compare(comparison.text, left, right);
    compare(comparison.text, right, left);
    // Two values that are both of replies: no constant tells them apart.
    const ScriptTree& tree = here();
    if (flow_.is_direct(tree, left) && flow_.is_direct(tree, right) && !uses_.trouble) {
      uses_.trouble = Diagnostic{Severity::kError, "verify.any-reply",
                                 fmt::format("{} is compared with {}, which is no constant; which of their values "
                                             "differ cannot be told",
                                             tree.path(left), tree.path(right)),
                                 place()};
    }
  }
  void compare(const std::string& sign, std::uint32_t value, std::uint32_t other) {
    const ScriptTree& tree = here();
    if (flow_.is_far(tree, value)) give_up(tree, value, kIsFar);
    const bool is_type = tree.at(value).kind == Node::kUnary && tree.at(value).text == "typeof";
    if (is_type || tree.at(other).kind == Node::kNothing) {
      // Types are the interface's, but for what is not there.
      const auto names = flow_.sources(tree, is_type ? tree.at(value).operands[0] : value);
      uses_.absent.insert(names.begin(), names.end());
      return;
    }
    if (flow_.types().throws && tree.path(value) == "_event.data.message" && !uses_.trouble)
      uses_.trouble = Diagnostic{Severity::kError, "verify.any-reply",
                                 "_event.data.message is compared, and what an error says is not known", place()};
    const bool is_order = sign.front() == '<' || sign.front() == '>';
    const std::set<std::string> texts = text_constants(tree, other);
    const bool is_text = std::any_of(texts.begin(), texts.end(),
                                     [](const std::string& text) { return numbers_in(Value(text)).empty(); });
    if (is_text && is_order) give_up(tree, value, "is ordered as a text");
    if ((is_text || (!texts.empty() && flow_.is_of_text(tree, value))) && !flow_.is_plain(tree, value))
      give_up(tree, value, "is changed before it is compared with a text");
    for (const std::string& text : texts) equal(tree, value, text);
    const std::set<double> numbers = constants(tree, other);
    for (const double number : numbers) equal(tree, value, number);
    if (!texts.empty() || !numbers.empty() || tree.at(other).kind == Node::kTruth) return;
    if (!flow_.is_of_reply(tree, value)) return;
    // What is handed back is that value or another one.
    const bool is_handed = passed_ != nullptr && !is_order && is_argument(tree, other);
    if (is_handed) {
      const auto passed = passed_->find(tree.at(other).text);
      if (passed != passed_->end() && !passed->second)
        return give_up(tree, value, "is compared with an argument that is no constant");
      if (passed != passed_->end()) {
        for (const std::string& text : passed->second->texts) equal(tree, value, text);
        for (const double number : passed->second->numbers) equal(tree, value, number);
      }
    } else {
      std::set<std::string> seen;
      Constants first;
      if (!is_alike(tree, value, other) || !add_first(tree, other, seen, first))
        return give_up(tree, value, "is compared with what is no constant");
      for (const std::string& text : first.texts) equal(tree, value, text);
      for (const double number : first.numbers) equal(tree, value, number);
    }
    const auto names = flow_.sources(tree, value);
    compared_.insert(names.begin(), names.end());
    for (const std::string& name : names) {
      if (is_order) ordered_.try_emplace(name, place());
    }
  }
  // A variable that is what a reply was may also be what it was before the first one. Whether that is known.
  bool add_first(const ScriptTree& in, std::uint32_t id, std::set<std::string>& seen, Constants& all) {
    const scxml::ScriptNode& node = in.at(id);
    if (node.kind == Node::kConditional)
      return add_first(in, node.operands[1], seen, all) && add_first(in, node.operands[2], seen, all);
    if (const std::string sent = flow_.echo(in, id); node.kind == Node::kName || !sent.empty())
      return add_first(sent.empty() ? node.text : sent, seen, all);
    if (flow_.is_of_reply(in, id)) return is_empty_first(in, id);
    return node.kind == Node::kTruth || all.add(known(in, id));
  }
  bool add_first(const std::string& variable, std::set<std::string>& seen, Constants& all) {
    if (!seen.insert(variable).second) return true;
    if (flow_.is_scripted(variable) || given_.inputs.contains(variable)) return false;
    Constants given;
    if (const auto numbers = given_.numbers.find(variable); numbers != given_.numbers.end())
      given.numbers = numbers->second;
    if (const auto texts = given_.texts.find(variable); texts != given_.texts.end()) given.texts = texts->second;
    const auto& assigned = flow_.assigned(variable);
    return all.add(given) && std::all_of(assigned.begin(), assigned.end(), [&](scxml::ExpressionId one) {
             const auto& tree = flow_.tree(one);
             return tree && add_first(*tree, tree->root(), seen, all);
           });
  }
  // What a variable holds before the first reply has no member, so far as that is known.
  bool is_empty_first(const ScriptTree& in, std::uint32_t id) const {
    const std::string path = in.path(id);
    const auto& assigned = flow_.assigned(path.substr(0, path.find('.')));
    return std::all_of(assigned.begin(), assigned.end(), [&](scxml::ExpressionId one) {
      const auto& tree = flow_.tree(one);
      if (!tree) return false;
      const scxml::ScriptNode& first = tree->at(tree->root());
      return flow_.is_of_reply(*tree, tree->root()) || first.kind == Node::kNumber || first.kind == Node::kText ||
             first.kind == Node::kTruth || first.kind == Node::kNothing ||
             (first.kind == Node::kUnary && first.text == "-") ||
             (first.kind == Node::kRecord && first.operands.empty());
    });
  }
  static bool is_argument(const ScriptTree& tree, std::uint32_t id) {
    constexpr std::string_view kArguments = "_event.data.args.";
    const std::string path = tree.path(id);
    return path.starts_with(kArguments) && path.find('.', kArguments.size()) == std::string::npos;
  }
  // Both are what replies hold under one name, and nothing else.
  bool is_alike(const ScriptTree& tree, std::uint32_t a, std::uint32_t b) const {
    return flow_.is_of_reply(tree, b) && flow_.is_plain(tree, a) && flow_.is_plain(tree, b) &&
           flow_.sources(tree, a) == flow_.sources(tree, b);
  }

  std::optional<Constants> known(const ScriptTree& tree, std::uint32_t id) {
    const scxml::ScriptNode& node = tree.at(id);
    switch (node.kind) {
      case Node::kNumber: return Constants{{node.number}, {}};
      case Node::kText: return Constants{numbers_in(Value(node.text)), {node.text}};
      case Node::kNothing: return Constants{};
      case Node::kName: return known(node.text);
      case Node::kMember: {
        const std::string sent = flow_.echo(tree, id);
        return sent.empty() ? std::nullopt : known(sent);
      }
      case Node::kConditional: {
        Constants all;
        const bool is_known = all.add(known(tree, node.operands[1])) && all.add(known(tree, node.operands[2]));
        return is_known ? std::optional(std::move(all)) : std::nullopt;
      }
      case Node::kCall: return known_of_call(tree, node);
      case Node::kUnary: {
        const auto operand = known(tree, node.operands[0]);
        if (node.text != "-" || !operand || !operand->are_numbers()) return std::nullopt;
        Constants all;
        for (const double number : operand->numbers) all.numbers.insert(-number);
        return all;
      }
      case Node::kBinary: return known_of_arithmetic(tree, node);
      default: return std::nullopt;
    }
  }
  std::optional<Constants> known(const std::string& variable) {
    // While it is looked at, it is computed from itself.
    const auto [at, is_new] = known_.try_emplace(variable);
    if (!is_new) return at->second;
    const auto& assigned = flow_.assigned(variable);
    const auto numbers = given_.numbers.find(variable);
    const auto texts = given_.texts.find(variable);
    const bool is_given = numbers != given_.numbers.end() || texts != given_.texts.end();
    if (given_.open.contains(variable) || flow_.is_scripted(variable) || flow_.is_of_reply(variable) ||
        (assigned.empty() && !is_given))
      return std::nullopt;
    Constants all;
    if (numbers != given_.numbers.end()) all.numbers = numbers->second;
    if (texts != given_.texts.end()) all.texts = texts->second;
    for (const scxml::ExpressionId one : assigned) {
      const auto& tree = flow_.tree(one);
      if (!tree || !all.add(known(*tree, tree->root()))) return std::nullopt;
    }
    return known_[variable] = std::move(all);
  }
  std::optional<Constants> known_of_arithmetic(const ScriptTree& tree, const scxml::ScriptNode& node) {
    static const std::set<std::string> kArithmetic{"+", "-", "*", "/"};
    if (!kArithmetic.contains(node.text)) return std::nullopt;
    const auto left = known(tree, node.operands[0]);
    const auto right = known(tree, node.operands[1]);
    if (!left || !right || !left->are_numbers() || !right->are_numbers()) return std::nullopt;
    Constants all;
    for (const double a : left->numbers) {
      for (const double b : right->numbers) {
        all.numbers.insert(node.text == "+" ? a + b : node.text == "-" ? a - b : node.text == "*" ? a * b : a / b);
        if (all.numbers.size() > kConstantsMax) return std::nullopt;
      }
    }
    return all;
  }
  std::optional<Constants> known_of_call(const ScriptTree& tree, const scxml::ScriptNode& node) {
    const std::string function = tree.path(node.operands[0]);
    if (function != "Math.min" && function != "Math.max") return std::nullopt;
    Constants all;
    for (std::size_t i = 1; i < node.operands.size(); ++i) {
      if (!all.add(known(tree, node.operands[i])) || !all.are_numbers()) return std::nullopt;  // one of them
    }
    all.texts.clear();
    return all;
  }
  std::set<double> constants(const ScriptTree& tree, std::uint32_t id) {
    const auto all = known(tree, id);
    return all ? all->numbers : std::set<double>();
  }
  std::set<std::string> text_constants(const ScriptTree& tree, std::uint32_t id) {
    const auto all = known(tree, id);
    return all ? all->texts : std::set<std::string>();
  }

  void equal(const ScriptTree& tree, std::uint32_t id, const std::string& text) {
    for (const std::string& name : flow_.sources(tree, id)) uses_.texts[name].insert(text);
    for (const double number : numbers_in(Value(text))) equal(tree, id, number);
  }
  // A part of an expression tells apart what is below, at and above `number`: so what it is made of does at others.
  void equal(const ScriptTree& tree, std::uint32_t id, double number) {
    const scxml::ScriptNode& node = tree.at(id);
    if (!std::isfinite(number)) return;
    if (const std::string sent = flow_.echo(tree, id); !sent.empty()) {
      equal_variable(tree, id, sent, number);
    } else if (node.kind == Node::kMember) {
      uses_.numbers[node.text].insert(number);
    } else if (node.kind == Node::kName) {
      equal_variable(tree, id, node.text, number);
    } else if (node.kind == Node::kUnary && node.text == "-") {
      equal(tree, node.operands[0], -number);
    } else if (node.kind == Node::kBinary &&
               (node.text == "+" || node.text == "-" || node.text == "*" || node.text == "/")) {
      const std::set<double> left = constants(tree, node.operands[0]);
      const std::set<double> right = constants(tree, node.operands[1]);
      for (const double known : left) equal(tree, node.operands[1], inverse(node.text, number, known, true));
      // What is endless is not tried, and of a number that has no end nothing else comes to that.
      for (const double known : left) {
        if (std::isinf(inverse(node.text, number, known, true))) endless(tree, node.operands[1], node.text);
      }
      // On both sides of 0 what is divided by it is far away.
      if (node.text == "/" && !left.empty()) equal(tree, node.operands[1], 0);
      for (const double known : right) equal(tree, node.operands[0], inverse(node.text, number, known, false));
      if (left.empty() && right.empty())
        give_up(tree, id, fmt::format("is compared after {} with what is no constant", node.text));
    } else if (node.kind == Node::kConditional) {
      equal(tree, node.operands[1], number);
      equal(tree, node.operands[2], number);
    } else if (node.kind == Node::kCall) {
      equal_call(tree, id, number);
    } else if (node.kind == Node::kUnary && node.text == "+") {
      equal(tree, node.operands[0], number);
    } else if (node.kind == Node::kBinary && (node.text == "||" || node.text == "&&")) {
      // The second one, or the first one, which is looked at by itself.
      equal(tree, node.operands[0], number);
      equal(tree, node.operands[1], number);
    } else if (node.kind == Node::kIndex) {
      give_up(tree, id, "chooses by an index");
    } else if (node.kind == Node::kUnary || node.kind == Node::kBinary) {
      give_up(tree, id, "is compared after " + node.text);
    }
  }

  void endless(const ScriptTree& tree, std::uint32_t id, const std::string& sign) {
    const auto kinds = flow_.kinds(tree, id);
    if (kinds.empty() || kinds.contains(idl::Kind::kDouble))
      give_up(tree, id, fmt::format("is compared after {} with what only an endless number comes to", sign));
  }

  void equal_variable(const ScriptTree& tree, std::uint32_t id, const std::string& variable, double number) {
    auto& before = followed_[variable];
    if (std::find(before.begin(), before.end(), number) != before.end()) return;
    if (!before.empty()) return give_up(tree, id, "is computed from what it was before");
    before.push_back(number);
    for (const scxml::ExpressionId expression : flow_.assigned(variable)) {
      if (flow_.tree(expression)) equal(*flow_.tree(expression), flow_.tree(expression)->root(), number);
    }
    before.pop_back();
  }

  void equal_call(const ScriptTree& tree, std::uint32_t id, double number) {
    const scxml::ScriptNode& node = tree.at(id);
    const scxml::ScriptNode& callee = tree.at(node.operands[0]);
    const std::string function = tree.path(node.operands[0]);
    // [a, b].indexOf(value)
    if (callee.kind == Node::kMember && callee.text == "indexOf" && node.operands.size() == 2 &&
        tree.at(callee.operands[0]).kind == Node::kList) {
      if (!flow_.is_of_reply(tree, node.operands[1])) return;
      if (flow_.is_far(tree, node.operands[1])) give_up(tree, id, kIsFar);
      for (const std::uint32_t one : tree.at(callee.operands[0]).operands) {
        const auto texts = text_constants(tree, one);
        const auto numbers = constants(tree, one);
        if (texts.empty() && numbers.empty()) give_up(tree, id, "is looked for among what is no constant");
        if (!texts.empty() && !flow_.is_plain(tree, node.operands[1]))
          give_up(tree, id, "is changed before it is compared with a text");
        for (const std::string& text : texts) {
          for (const std::string& name : flow_.sources(tree, node.operands[1])) uses_.texts[name].insert(text);
        }
        for (const double constant : numbers) equal(tree, node.operands[1], constant);
      }
      return;
    }
    if (!is_steady(function)) give_up(tree, id, "is given to " + (function.empty() ? "a function" : function + "()"));
    for (std::size_t i = 1; i < node.operands.size(); ++i) {
      for (const double at : jumps(function, number)) equal(tree, node.operands[i], at);
    }
  }

  // Where what is given to a function is when its value passes `number`.
  static std::vector<double> jumps(const std::string& function, double number) {
    if (function == "Math.abs") return {number, -number};
    if (function == "Math.floor") return {number, std::floor(number), std::floor(number) + 1};
    if (function == "Math.ceil") return {number, std::ceil(number), std::ceil(number) - 1};
    if (function == "Math.round")
      return {number, std::floor(number) - 0.5, std::ceil(number) - 0.5, std::floor(number) + 0.5,
              std::ceil(number) + 0.5};
    return {number};
  }

  static constexpr const char* kIsFar = "comes through the blackboard or a topic from another leaf and is compared";

  const ReplyFlow& flow_;
  Given given_;
  Distinctions& uses_;
  std::optional<SourceSpan> place_;
  std::string monitor_;
  const Passed* passed_;
  std::set<scxml::ExpressionId> conditions_;
  std::set<std::string> compared_;                         // names of values that are compared with earlier ones
  std::map<std::string, SourceSpan> ordered_;              // of those that are ordered, and where first
  std::map<std::string, std::optional<Constants>> known_;  // by variable
  std::map<std::string, std::vector<double>> followed_;    // variables on the way from a comparison to a reply
  scxml::ExpressionId expression_ = 0;
};

// What is known of a skill before it begins: constants of the project, and ports that are written down.
Given given_of(const project::Plan& plan, const project::LeafPlan& leaf) {
  Given given;
  for (const project::SkillConstant& constant : leaf.constants) {
    given.numbers[constant.id] = numbers_in(constant.value);
    if (constant.value.as_string() != nullptr) given.texts[constant.id] = {*constant.value.as_string()};
  }
  for (const bt::PortFact& port : plan.tree.ports(leaf.node)) {
    const std::string name(port.name);
    if (port.text.find('{') != std::string_view::npos) {
      given.open.insert(name);
      if (port.input) given.inputs.insert(name);
      continue;
    }
    given.texts[name] = {std::string(port.text)};
    if (const auto numbers = numbers_in(Value(std::string(port.text))); !numbers.empty()) given.numbers[name] = numbers;
  }
  return given;
}

// What there is to be looked at, by name.
LookedAt all_looked_at(const project::Plan& plan) {
  LookedAt all;
  for (const auto& [name, of] : plan.services) {
    for (const idl::Method* method : of.service->methods) {
      for (const idl::Field& parameter : method->arguments.fields) all.arguments.insert(parameter.name);
    }
  }
  for (const project::LeafPlan& leaf : plan.leaves) {
    for (const bt::PortFact& port : plan.tree.ports(leaf.node)) {
      all.inputs.emplace(port.name);
      all.outputs.emplace(port.name);
    }
  }
  all.published = all.arguments;
  all.logs = true;
  return all;
}

void add(const LookedAt& more, LookedAt& out) {
  out.arguments.insert(more.arguments.begin(), more.arguments.end());
  for (const auto& [name, sources] : more.handed_back) out.handed_back[name].insert(sources.begin(), sources.end());
  out.published.insert(more.published.begin(), more.published.end());
  out.topics.insert(more.topics.begin(), more.topics.end());
  out.inputs.insert(more.inputs.begin(), more.inputs.end());
  out.outputs.insert(more.outputs.begin(), more.outputs.end());
  out.logs = out.logs || more.logs;
}

// An argument of a call that is compared for equality: with the argument's own name.
struct HandedBack {
  scxml::ExpressionId expression = scxml::kNoExpression;
  std::uint32_t other = 0;
  std::string name;
};

// What a chart looks at of calls, publications, ticks, their answers and logs.
class Looking {
 public:
  /// @param all   What it looks at, if it keeps all that an event holds.
  /// @param handed  Gets the arguments that are only compared with what is no constant; null: they are looked at too.
  Looking(const LookedAt& all, LookedAt& out, std::vector<HandedBack>* handed)
      : all_(all), out_(out), handed_(handed) {}

  void operator()(const scxml::Chart& chart) {
    const auto& expressions = chart.model().expressions;
    for (std::size_t id = 0; id < expressions.size(); ++id) {
      const auto tree = scxml::parse_script_expression(expressions[id].text);
      const auto names = scxml::names_in_script(expressions[id].text);
      const bool is_opaque = !tree || std::any_of(tree->nodes.begin(), tree->nodes.end(),
                                                  [](const auto& node) { return node.kind == Node::kOpaque; });
      if (hides_names(names) || (is_opaque && names.contains("_event"))) add(all_, out_);
      if (tree) look(static_cast<scxml::ExpressionId>(id), *tree);
    }
  }

 private:
  void look(scxml::ExpressionId expression, const ScriptTree& tree) {
    std::set<std::uint32_t> inner;  // of longer paths, or only asked for
    std::map<std::uint32_t, std::uint32_t> compared;
    for (const scxml::ScriptNode& node : tree.nodes) {
      const bool is_test =
          (node.kind == Node::kBinary && node.text == "&&") || (node.kind == Node::kUnary && node.text == "!");
      if (node.kind == Node::kMember || is_test) inner.insert(node.operands[0]);
      if (node.kind != Node::kBinary || (node.text != "===" && node.text != "!==")) continue;
      compared.emplace(node.operands[0], node.operands[1]);
      compared.emplace(node.operands[1], node.operands[0]);
    }
    for (std::uint32_t id = 0; id < tree.nodes.size(); ++id) {
      const std::string path = tree.path(id);
      if (!path.starts_with("_event")) continue;
      const bool is_whole = !inner.contains(id);
      const auto other = compared.find(id);
      if (is_whole && (path == "_event" || path == "_event.data")) {
        add(all_, out_);
      } else if (const auto name = behind(path, "_event.data.args."); !name.empty()) {
        if (handed_ != nullptr && is_whole && other != compared.end() && path == "_event.data.args." + name)
          handed_->push_back({expression, other->second, name});
        else if (is_whole)
          out_.arguments.insert(name);
      } else if (path == "_event.data.args") {
        if (is_whole) out_.arguments.insert(all_.arguments.begin(), all_.arguments.end());
      } else if (const auto input = behind(path, "_event.data.inputs."); !input.empty()) {
        out_.inputs.insert(input);
      } else if (const auto output = behind(path, "_event.data.outputs."); !output.empty()) {
        out_.outputs.insert(output);
      } else if (path == "_event.data.inputs") {
        if (is_whole) out_.inputs.insert(all_.inputs.begin(), all_.inputs.end());
      } else if (path == "_event.data.outputs") {
        if (is_whole) out_.outputs.insert(all_.outputs.begin(), all_.outputs.end());
      } else if (const auto published = behind(path, "_event.data."); !published.empty()) {
        out_.published.insert(published);
        out_.logs = out_.logs || published == "text";
      }
    }
  }
  // The first name behind the beginning of a path.
  static std::string behind(const std::string& path, std::string_view beginning) {
    if (!path.starts_with(beginning)) return {};
    return path.substr(beginning.size(), path.find('.', beginning.size()) - beginning.size());
  }

  const LookedAt& all_;
  LookedAt& out_;
  std::vector<HandedBack>* handed_;
};

// An event of a monitor that is made by expressions.
struct MadeEvent {
  const project::MonitorEntry* monitor;
  const project::EventRename* rename;
};

// What events of monitors that are made by expressions look at: of what is called so, all.
std::vector<MadeEvent> made_events(const project::Plan& plan, const LookedAt& there, LookedAt& out) {
  std::vector<MadeEvent> all;
  for (const project::MonitorEntry& monitor : plan.scenario.project.monitors) {
    for (const project::EventRename& rename : monitor.events) {
      std::set<std::string> names = scxml::names_in_script(rename.when);
      for (const auto& [name, expression] : rename.data) names.merge(scxml::names_in_script(expression));
      if (names.empty()) continue;
      all.push_back({&monitor, &rename});
      if (names.contains("args")) out.arguments.insert(there.arguments.begin(), there.arguments.end());
      if (names.contains("inputs")) out.inputs.insert(there.inputs.begin(), there.inputs.end());
      if (names.contains("outputs")) out.outputs.insert(there.outputs.begin(), there.outputs.end());
      out.logs = out.logs || names.contains("text");
    }
  }
  return all;
}

// What skills pass, beside what is of a reply of the service.
Passed passed_to_calls(const project::Plan& plan, const std::string& service, const ReplyTypes& types,
                       const MissionFlow& mission) {
  Passed all;
  for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) {
    if (!plan.leaves[leaf].chart) continue;
    std::optional<ReplyFlow> own;
    const auto found = mission.flows().find(leaf);
    if (found == mission.flows().end())
      own.emplace(*plan.leaves[leaf].chart, service, types, std::set<std::string>(), ReplyFlow::Answer());
    const ReplyFlow& flow = own ? *own : found->second;
    Distinctions nothing;
    Comparisons reads(flow, given_of(plan, plan.leaves[leaf]), nothing);
    for (const ReplyFlow::Use& use : flow.uses()) {
      if (use.role != ReplyFlow::Role::kArgument) continue;
      // Who does not call the service passes no reply of it.
      const auto& tree = flow.tree(use.expression);
      const bool is_of_another = own && tree && flow.is_of_reply(*tree, tree->root());
      const auto constants = is_of_another ? std::nullopt : reads.constants_of(use.expression);
      auto& known = all.try_emplace(use.name, Constants()).first->second;
      if (known && !known->add(constants)) known.reset();
    }
  }
  for (const std::string& argument : *types.defaulted) all[argument].reset();
  return all;
}

// One that is made of replies of the service is not understood.
std::optional<Diagnostic> made_of_reply(const MadeEvent& event, const std::string& service,
                                        const idl::Service& interface) {
  for (const std::string& pattern : event.rename->on) {
    for (const idl::Method* method : interface.methods) {
      if (!project::matches_pattern(pattern, fmt::format("{}.{}.reply", service, method->name))) continue;
      return Diagnostic{Severity::kError, "verify.any-reply",
                        fmt::format("the event {} of monitor {} is made of a reply of {}, and which of its values are "
                                    "told apart is not known",
                                    event.rename->event, event.monitor->name, service),
                        event.rename->span};
    }
  }
  return std::nullopt;
}

// A call by a skill's chart.
struct Sent {
  std::size_t leaf;
  std::size_t place;                 // among the leaf's
  std::optional<std::string> event;  // nothing: an expression says which
};

// A monitor, and of which services it may see replies.
struct Seeing {
  const monitor::Model* monitor;
  bool is_gate = false;
  bool all = false;
  std::set<std::string> heads = {};  // of what it waits for, up to the first point
  std::vector<HandedBack> handed = {};
};

}  // namespace

struct MissionDistinctions::Common {
  explicit Common(const project::Plan& of) : plan(of) {}

  const project::Plan& plan;
  std::set<std::string> fields;
  std::set<std::string> defaulted;                // arguments of calls that need not be given
  std::map<std::string, std::vector<Sent>> sent;  // by service
  std::vector<Sent> sent_to_any;                  // an expression says to which
  std::vector<MadeEvent> made_events;
  LookedAt looked_at;               // by monitors, and by models that serve nothing
  std::vector<LookedAt> by_models;  // by model
  LookedAt by_all;
  std::map<std::string, std::size_t> served;  // services by which model
  std::vector<Seeing> monitors;
  std::shared_ptr<Distinctions::Mentioned> mentioned = std::make_shared<Distinctions::Mentioned>();
};

MissionDistinctions::~MissionDistinctions() = default;

MissionDistinctions::MissionDistinctions(const project::Plan& plan) {
  auto common = std::make_unique<Common>(plan);
  MemberNames names(common->fields);
  for (const auto& [name, of] : plan.services) {
    for (const idl::Method* method : of.service->methods) {
      names.add(*method->result);
      for (const idl::Field& parameter : method->arguments.fields) {
        if (parameter.default_value) common->defaulted.insert(parameter.name);
      }
    }
  }
  const LookedAt there = all_looked_at(plan);
  for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) {
    if (!plan.leaves[leaf].chart) continue;
    std::size_t place = 0;
    for (const scxml::SendInfo& send : plan.leaves[leaf].chart->sends()) {
      if (send.type != "thrift") continue;
      // What an expression names may be any method of it.
      (send.target ? common->sent[*send.target] : common->sent_to_any).push_back({leaf, place++, send.event});
    }
  }
  common->made_events = verify::made_events(plan, there, common->looked_at);
  std::set<std::size_t> gates;
  for (const project::GatePlan& gate : plan.gates) gates.insert(gate.monitor);
  for (const monitor::Model& monitor : plan.monitors) {
    Seeing seeing{.monitor = &monitor, .is_gate = gates.contains(common->monitors.size())};
    Looking(there, common->looked_at, &seeing.handed)(monitor.chart());
    for (const auto& transition : monitor.chart().transitions()) {
      for (const std::string& event : transition.events) {
        seeing.heads.insert(event.substr(0, event.find('.')));
        seeing.all = seeing.all || event == "*";
      }
    }
    // One whose events are called otherwise may get a reply under any name.
    const auto& entries = plan.scenario.project.monitors;
    const bool renames =
        std::any_of(entries.begin(), entries.end(), [](const auto& one) { return !one.events.empty(); });
    ReplyTypes none;
    none.fields = &common->fields;
    seeing.all = seeing.all || renames || ReplyFlow(monitor.chart(), "", none, {}, {}).sees_reply();
    common->monitors.push_back(std::move(seeing));
    for (const scxml::Expression& expression : monitor.chart().model().expressions) {
      common->mentioned->names.merge(scxml::names_in_script(expression.text));
      const auto tree = scxml::parse_script_expression(expression.text);
      for (std::size_t node = 0; tree && node < tree->nodes.size(); ++node) {
        if (tree->nodes[node].kind == Node::kText) common->mentioned->words.insert(tree->nodes[node].text);
      }
    }
  }
  for (std::size_t model = 0; model < plan.models.size(); ++model) {
    for (const std::string& service : plan.models[model].serves) common->served.emplace(service, model);
    Looking(there, common->by_models.emplace_back(), nullptr)(plan.models[model].chart);
    common->by_models.back().topics.insert(plan.models[model].subscribes.begin(), plan.models[model].subscribes.end());
    add(common->by_models.back(), common->by_all);
  }
  add(common->looked_at, common->by_all);
  for (bt::NodeId node = 0; node < plan.tree.size(); ++node) {
    for (const bt::PortFact& port : plan.tree.ports(node)) {
      common->mentioned->words.merge(scxml::names_in_script(port.text));
      // Texts in a script of the tree are between apostrophes.
      for (std::size_t at = port.text.find('\''); at != std::string_view::npos;) {
        const std::size_t end = port.text.find('\'', at + 1);
        if (end == std::string_view::npos) break;
        common->mentioned->words.emplace(port.text.substr(at + 1, end - at - 1));
        at = port.text.find('\'', end + 1);
      }
    }
  }
  common_ = std::move(common);
}

Distinctions MissionDistinctions::of(const std::string& service, std::vector<const idl::Method*>* methods) const {
  const project::Plan& plan = common_->plan;
  const idl::Service& interface = *plan.services.at(service).service;
  Distinctions uses;
  uses.common = common_->mentioned;
  ReplyTypes types;
  types.fields = &common_->fields;
  types.defaulted = &common_->defaulted;
  MemberPlaces places;
  for (const idl::Method* method : interface.methods) {
    types.results[method->name] = kinds_of(*method->result);
    types.throws = types.throws || !method->exceptions.empty();
    add_kinds(*method->result, 0, types.members);
    for (const auto& [name, count] : places.of(*method->result))
      types.places[name] = std::max(types.places[name], count);
  }
  for (const MadeEvent& event : common_->made_events) {
    if (!uses.trouble) uses.trouble = made_of_reply(event, service, interface);
  }
  LookedAt looked_at = common_->by_all;
  if (const auto served = common_->served.find(service); served != common_->served.end()) {
    // What is handed back to the service itself means what it said.
    looked_at = common_->looked_at;
    for (std::size_t model = 0; model < plan.models.size(); ++model) {
      if (model != served->second) add(common_->by_models[model], looked_at);
    }
  }
  std::vector<Sent> sent = common_->sent_to_any;
  if (const auto to_it = common_->sent.find(service); to_it != common_->sent.end())
    sent.insert(sent.end(), to_it->second.begin(), to_it->second.end());
  std::sort(sent.begin(), sent.end(),
            [](const Sent& a, const Sent& b) { return std::tie(a.leaf, a.place) < std::tie(b.leaf, b.place); });
  std::set<std::size_t> callers;
  for (const Sent& one : sent) {
    callers.insert(one.leaf);
    for (const idl::Method* method : interface.methods) {
      if ((one.event && *one.event != method->name) || method->oneway) continue;
      if (methods == nullptr || std::find(methods->begin(), methods->end(), method) != methods->end()) continue;
      methods->push_back(method);
    }
  }
  std::vector<std::unique_ptr<ReplyFlow>> seen;  // by monitor; null: sees nothing of it
  bool hands_back = false;                       // what replies held, so that it is compared
  for (const Seeing& seeing : common_->monitors) {
    const bool sees = seeing.all || seeing.heads.contains(service.substr(0, service.find('.')));
    auto& flow = seen.emplace_back();
    if (sees)
      flow = std::make_unique<ReplyFlow>(seeing.monitor->chart(), service, types, std::set<std::string>(),
                                         ReplyFlow::Answer());
    for (const HandedBack& handed : seeing.handed) {
      const ScriptTree* const tree = flow ? &*flow->tree(handed.expression) : nullptr;
      if (tree != nullptr && flow->is_of_reply(*tree, handed.other) && flow->is_plain(*tree, handed.other))
        looked_at.handed_back[handed.name].merge(flow->sources(*tree, handed.other));
      else
        looked_at.arguments.insert(handed.name);
      hands_back = hands_back || (tree != nullptr && flow->is_of_reply(*tree, handed.other));
    }
  }
  const MissionFlow mission(plan, service, types, std::move(callers));
  for (const auto& [leaf, flow] : mission.flows())
    Comparisons(flow, given_of(plan, plan.leaves[leaf]), uses)(looked_at);
  if (!uses.trouble) uses.trouble = mission.trouble(looked_at);
  const Passed passed = hands_back ? passed_to_calls(plan, service, types, mission) : Passed();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    const monitor::Model& monitor = *common_->monitors[i].monitor;
    std::optional<SourceSpan> place;
    if (monitor.origin() != nullptr) place = monitor.origin()->requirement.span;
    Comparisons(*seen[i], {}, uses, place, common_->monitors[i].is_gate ? "" : monitor.name(), &passed)(looked_at);
  }
  // What variables hold, and what the reply brings that just comes.
  for (auto& [name, count] : uses.at_once) {
    const auto found = types.places.find(name);
    count += found != types.places.end() ? found->second : 1;
  }
  return uses;
}

}  // namespace sentree::verify
