#include "sentree/project/detail/expression_type.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "sentree/base/value.h"
namespace sentree::project {

namespace {

using monitor::DataType;
using scxml::ScriptNode;
using scxml::ScriptTree;
using TypeKind = DataType::Kind;
using Node = ScriptNode::Kind;

/// Forms that one expression may have before it counts as anything.
constexpr std::size_t kFormsMax = 32;

const ExpressionType& number() {
  static const ExpressionType kNumber = of(DataType{.kind = TypeKind::kNumber, .name = "number"});
  return kNumber;
}
const ExpressionType& truth() {
  static const ExpressionType kTruth = of(DataType{.kind = TypeKind::kTruth, .name = "bool"});
  return kTruth;
}

ExpressionType of_constant(const Value& value) {
  if (value.as_bool() != nullptr) return truth();
  if (value.is_number()) return number();
  if (const std::string* text = value.as_string())
    return of(DataType{.kind = TypeKind::kText, .name = "text", .samples = {*text}, .samples_are_all = true});
  return {};
}

bool all_of_kind(const ExpressionType& type, TypeKind kind) {
  return !type.open && !type.forms.empty() &&
         std::all_of(type.forms.begin(), type.forms.end(), [&](const Form& form) { return form->kind == kind; });
}

std::string_view shown(TypeKind kind) {
  switch (kind) {
    case TypeKind::kNumber: return "a number";
    case TypeKind::kTruth: return "true or false";
    case TypeKind::kText: return "a text";
    case TypeKind::kRecord: return "a record";
    default: return "a list";
  }
}

// Whether a text can be what an integer of 64 bits is beyond 2^53: "9007199254740993".
bool is_wide_decimal(const DataType& number, const DataType& text) {
  if (!number.is_wide || text.kind != TypeKind::kText || !text.words.empty()) return false;
  const auto is_beyond = [](std::string_view sample) {
    if (sample.starts_with('-')) sample.remove_prefix(1);
    constexpr std::string_view kLargest = "9007199254740992";
    return std::all_of(sample.begin(), sample.end(), [](char c) { return c >= '0' && c <= '9'; }) &&
           !sample.starts_with('0') &&
           (sample.size() > kLargest.size() || (sample.size() == kLargest.size() && sample > kLargest));
  };
  return !text.samples_are_all || std::any_of(text.samples.begin(), text.samples.end(), is_beyond);
}

std::string quoted(const std::string& name) { return fmt::format("\"{}\"", name); }

bool is_equality(const std::string& sign) { return sign == "===" || sign == "!==" || sign == "==" || sign == "!="; }
bool is_order(const std::string& sign) { return sign == "<" || sign == ">" || sign == "<=" || sign == ">="; }

/// One expression.
class Reader {
 public:
  Reader(const ScriptTree& tree, const ExpressionScope& scope, const SourceSpan& span, Diagnostics* diagnostics)
      : tree_(tree), scope_(scope), span_(span), out_(diagnostics) {}

  ExpressionType whole(bool is_condition) {
    ExpressionType type = visit(tree_.root());
    if (is_condition) check_condition(tree_.root(), type);
    return type;
  }

 private:
  void add(Severity severity, std::string code, std::string message) {
    if (out_ == nullptr) return;
    Diagnostic diagnostic{severity, std::move(code), std::move(message), span_};
    if (std::find(out_->begin(), out_->end(), diagnostic) == out_->end()) out_->push_back(std::move(diagnostic));
  }
  void error(std::string code, std::string message) { add(Severity::kError, std::move(code), std::move(message)); }

  [[nodiscard]] const ScriptNode& at(std::uint32_t id) const { return tree_.at(id); }
  [[nodiscard]] std::string name_of(std::uint32_t id) const {
    std::string path = tree_.path(id);
    if (!path.empty()) return path;
    const ScriptNode& n = at(id);
    if (n.kind == Node::kMember) return fmt::format("{}.{}", name_of(n.operands[0]), n.text);
    if (n.kind != Node::kIndex) return "it";
    const ScriptNode& index = at(n.operands[1]);
    return fmt::format("{}[{}]", name_of(n.operands[0]),
                       index.kind == Node::kNumber ? plain_decimal(index.number) : "…");
  }

  ExpressionType visit(std::uint32_t id) {
    const ScriptNode& n = at(id);
    switch (n.kind) {
      case Node::kNumber: return number();
      case Node::kText: return of_constant(Value(n.text));
      case Node::kTruth: return truth();
      case Node::kName: return name(n.text);
      case Node::kMember: return member(id);
      case Node::kIndex: {
        const ExpressionType object = visit(n.operands[0]);
        visit(n.operands[1]);
        const ScriptNode& index = at(n.operands[1]);
        return index.kind == Node::kText ? member_of(object, index.text, name_of(n.operands[0])) : items_of(object);
      }
      case Node::kCall: return call(id);
      case Node::kRecord: return record(n);
      case Node::kUnary: return unary(n);
      case Node::kBinary: return binary(id);
      case Node::kConditional: {
        check_condition(n.operands[0], visit(n.operands[0]));
        ExpressionType result = visit(n.operands[1]);
        join(result, visit(n.operands[2]));
        return result;
      }
      case Node::kList:
        for (const std::uint32_t item : n.operands) {
          visit(item);
          if (at(item).kind == Node::kNothing && at(item).text == "hole") {
            add(Severity::kWarning, "check.hole", "a list has nothing between two commas, which is undefined");
            break;
          }
        }
        return list();
      default:
        for (const std::uint32_t inner : n.operands) visit(inner);
        return {};
    }
  }

  ExpressionType name(const std::string& text) {
    if (const auto found = scope_.names->find(text); found != scope_.names->end()) return found->second;
    const bool is_function = scope_.functions != nullptr && scope_.functions->contains(text);
    if (scope_.open || is_function || scxml::is_script_global(text)) return {};
    std::vector<std::string> known{"_event"};
    if (scope_.functions != nullptr) known.insert(known.end(), scope_.functions->begin(), scope_.functions->end());
    for (const auto& [declared, type] : *scope_.names) known.push_back(declared);
    error("check.unknown-name",
          fmt::format("{} is declared nowhere: no <data> is called so{}{}", quoted(text), did_you_mean(text, known),
                      did_you_mean(text, known).empty() ? "; a text is written in quotes" : ""));
    return {};
  }

  ExpressionType member(std::uint32_t id) {
    const ScriptNode& n = at(id);
    const ScriptNode& object = at(n.operands[0]);
    if (object.kind == Node::kName && object.text == "_event") {
      if (n.text == "data") return scope_.event.value_or(ExpressionType());
      static const std::vector<std::string> kFields{"name",       "type",     "sendid", "origin",
                                                    "origintype", "invokeid", "data",   "raw"};
      if (std::find(kFields.begin(), kFields.end(), n.text) == kFields.end()) {
        error("check.unknown-member", fmt::format("an event has no member {}{}; what it carries is in _event.data",
                                                  quoted(n.text), did_you_mean(n.text, kFields)));
      }
      return {};
    }
    return member_of(visit(n.operands[0]), n.text, name_of(n.operands[0]));
  }

  ExpressionType member_of(const ExpressionType& object, const std::string& wanted, const std::string& path) {
    if (object.open) return {};
    ExpressionType result{.open = false, .forms = {}};
    std::vector<std::string> known;
    std::string owner;
    bool any = false;
    bool some_lack_it = false;
    for (const Form& shared : object.forms) {
      const DataType& form = shared;
      if (is_list(form)) {
        const auto& functions = functions_of_lists();
        if (wanted == "length" || std::find(functions.begin(), functions.end(), wanted) != functions.end()) return {};
        owner = "a list";
        known.insert(known.end(), functions.begin(), functions.end());
        known.emplace_back("length");
        continue;
      }
      if (!form.items.empty()) {
        any = true;
        join(result, of(Form(shared, form.items.begin()->type)));
        continue;
      }
      if (form.kind == TypeKind::kUnknown || form.kind == TypeKind::kOther) return {};
      if (form.kind == TypeKind::kText && form.words.empty()) return {};  // its functions
      if (form.kind == TypeKind::kText || form.kind == TypeKind::kNumber || form.kind == TypeKind::kTruth) {
        static const std::vector<std::string> kOfAll{
            "length",        "indexOf",       "toString",    "toFixed",     "valueOf", "charAt", "slice",
            "split",         "toLowerCase",   "toUpperCase", "startsWith",  "search",  "match",  "replace",
            "substring",     "toPrecision",   "concat",      "lastIndexOf", "substr",  "trim",   "charCodeAt",
            "localeCompare", "toExponential", "endsWith",    "includes"};
        if (std::find(kOfAll.begin(), kOfAll.end(), wanted) != kOfAll.end()) return {};
        owner = fmt::format("{} is {} and", path, shown(form.kind));
        continue;
      }
      if (owner.empty()) owner = form.name.empty() ? path : form.name;
      const auto found = std::find_if(form.members.begin(), form.members.end(),
                                      [&](const monitor::DataMember& m) { return m.name == wanted; });
      for (const monitor::DataMember& m : form.members) known.push_back(m.name);
      if (found == form.members.end()) {
        some_lack_it = true;
        continue;
      }
      any = true;
      join(result, of(Form(shared, found->type)));
    }
    if (some_lack_it) {
      for (Form& form : result.forms) {
        DataType with_absence = form;
        with_absence.may_be_absent = true;
        form = Form(std::move(with_absence));
      }
    }
    if (!any && !object.forms.empty()) {
      const std::string near = did_you_mean(wanted, known);
      std::string all;
      if (near.empty() && !known.empty() && known.size() <= 8) {
        for (const std::string& one : known) all += (all.empty() ? "; there are " : ", ") + one;
      }
      error("check.unknown-member", fmt::format("{}.{}: {} has no member {}{}", path, wanted, owner, quoted(wanted),
                                                near.empty() ? all : near));
      return {};
    }
    return any ? result : ExpressionType();
  }

  ExpressionType call(std::uint32_t id) {
    const ScriptNode& n = at(id);
    const ScriptNode& called = at(n.operands[0]);
    std::vector<ExpressionType> arguments;
    for (std::size_t i = 1; i < n.operands.size(); ++i) arguments.push_back(visit(n.operands[i]));
    if (called.kind != Node::kMember) {
      visit(n.operands[0]);
      return called.kind == Node::kName ? chosen(called.text, arguments) : ExpressionType();
    }
    const ScriptNode& object = at(called.operands[0]);
    if (object.kind == Node::kName && object.text == "Math" && !scope_.names->contains("Math"))
      return math(called.text);
    const ExpressionType owner = visit(called.operands[0]);
    // ['A', 'B'].indexOf(x): each of them is compared with x.
    if (object.kind == Node::kList && (called.text == "indexOf" || called.text == "includes") &&
        n.operands.size() == 2) {
      for (const std::uint32_t item : object.operands) compare("===", item, visit(item), n.operands[1], arguments[0]);
      return called.text == "indexOf" ? number() : truth();
    }
    if (object.kind == Node::kList) function_of_list(called.text);
    member_of(owner, called.text, name_of(called.operands[0]));
    // Nothing else has these.
    static const std::vector<std::string> kGiveLists{"filter", "map", "reverse", "sort", "splice"};
    return std::find(kGiveLists.begin(), kGiveLists.end(), called.text) != kGiveLists.end() ? list() : ExpressionType();
  }

  static ExpressionType list() { return of(DataType{.kind = TypeKind::kOther, .name = "list"}); }
  static bool is_list(const DataType& type) {
    const bool is_array = type.name.ends_with(']') && !type.items.empty();  // of ROS
    return type.kind == TypeKind::kOther &&
           (type.name == "list" || type.name.starts_with("list<") || type.name.starts_with("set<") || is_array);
  }

  // ECMAScript 5.1, 15.4.4, and what the engine has of later editions.
  static const std::vector<std::string>& functions_of_lists() {
    static const std::vector<std::string> kFunctions{
        "concat",      "every", "filter", "forEach", "includes", "indexOf",     "join",
        "lastIndexOf", "map",   "pop",    "push",    "reduce",   "reverse",     "shift",
        "slice",       "some",  "sort",   "splice",  "toString", "reduceRight", "unshift"};
    return kFunctions;
  }

  void function_of_list(const std::string& name) {
    const auto& functions = functions_of_lists();
    if (std::find(functions.begin(), functions.end(), name) != functions.end()) return;
    error("check.unknown-member",
          fmt::format("a list has no function {}{}", quoted(name), did_you_mean(name, functions)));
  }

  // What models choose.
  [[nodiscard]] ExpressionType chosen(const std::string& function, const std::vector<ExpressionType>& arguments) const {
    if (scope_.functions == nullptr || !scope_.functions->contains(function)) return {};
    if (function == "between" || function == "fresh") return number();
    if (function == "chance") return truth();
    const std::size_t first = function == "pick" ? 1 : 0;
    if ((function != "choose" && function != "pick") || arguments.size() <= first) return {};
    ExpressionType result = arguments[first];
    for (std::size_t i = first + 1; i < arguments.size(); ++i) join(result, arguments[i]);
    return result;
  }

  ExpressionType math(const std::string& function) {
    static const std::vector<std::string> kFunctions{
        "abs",  "acos", "acosh",  "asin",  "asinh",  "atan",  "atan2", "atanh", "cbrt",  "ceil",  "clz32", "cos",
        "cosh", "exp",  "expm1",  "floor", "fround", "hypot", "imul",  "log",   "log10", "log1p", "log2",  "max",
        "min",  "pow",  "random", "round", "sign",   "sin",   "sinh",  "sqrt",  "tan",   "tanh",  "trunc"};
    if (std::find(kFunctions.begin(), kFunctions.end(), function) == kFunctions.end())
      error("check.unknown-member",
            fmt::format("Math has no function {}{}", quoted(function), did_you_mean(function, kFunctions)));
    return number();
  }

  // Several texts are one of them; other mixtures can be anything.
  static DataType as_one(const ExpressionType& type) {
    if (type.open || type.forms.empty()) return {};
    DataType one = type.forms[0];
    for (std::size_t i = 1; i < type.forms.size(); ++i) {
      const DataType& other = type.forms[i];
      const bool are_texts = one.kind == TypeKind::kText && other.kind == TypeKind::kText && one.samples_are_all &&
                             other.samples_are_all && one.words.empty() && other.words.empty();
      if (!are_texts) return {};
      one.samples.insert(one.samples.end(), other.samples.begin(), other.samples.end());
    }
    return one;
  }

  ExpressionType record(const ScriptNode& n) {
    DataType type{.kind = TypeKind::kRecord, .may_be_absent = false};
    for (std::size_t i = 0; i < n.operands.size(); ++i) {
      type.members.push_back({n.names[i], as_one(visit(n.operands[i]))});
    }
    return of(std::move(type));
  }

  ExpressionType unary(const ScriptNode& n) {
    if (n.text == "typeof") {
      // The one place in which a name need not exist.
      if (at(n.operands[0]).kind != Node::kName) visit(n.operands[0]);
      return {};
    }
    const ExpressionType inner = visit(n.operands[0]);
    if (n.text == "!") {
      check_condition(n.operands[0], inner);
      return truth();
    }
    if (n.text == "void" || n.text == "delete") return {};
    DataType type{.kind = TypeKind::kNumber, .name = "number"};
    if ((n.text == "-" || n.text == "+") && all_of_kind(inner, TypeKind::kNumber)) type.unit = unit_of(inner);
    return of(std::move(type));
  }

  ExpressionType binary(std::uint32_t id) {
    const ScriptNode& n = at(id);
    const std::uint32_t left_id = n.operands[0];
    const std::uint32_t right_id = n.operands[1];
    if (n.text == "&&" || n.text == "||") {
      ExpressionType left = visit(left_id);
      const ExpressionType right = visit(right_id);
      join(left, right);
      return left;
    }
    const ExpressionType left = visit(left_id);
    ExpressionType right = visit(right_id);
    if (n.text == ",") return right;
    if (is_equality(n.text)) {
      compare(n.text, left_id, left, right_id, right);
      return truth();
    }
    if (is_order(n.text)) {
      order(n.text, left_id, left, right_id, right);
      return truth();
    }
    if (n.text == "+") {
      if (all_of_kind(left, TypeKind::kNumber) && all_of_kind(right, TypeKind::kNumber)) {
        DataType sum{.kind = TypeKind::kNumber, .name = "number"};
        if (unit_of(left) == unit_of(right)) sum.unit = unit_of(left);
        return of(std::move(sum));
      }
      return {};
    }
    if (n.text == "-" || n.text == "*" || n.text == "/" || n.text == "%") {
      for (const auto& [operand, type] : {std::pair{left_id, &left}, {right_id, &right}}) {
        const bool is_word = all_of_kind(*type, TypeKind::kText) && !type->forms[0]->words.empty();
        if (is_word || all_of_kind(*type, TypeKind::kRecord))
          error("check.never-equal", fmt::format("{} is {} ({}), and cannot be calculated with", name_of(operand),
                                                 shown(type->forms[0]->kind), type->forms[0]->name));
      }
      DataType result{.kind = TypeKind::kNumber, .name = "number"};
      result.unit = scaled(n.text, left_id, left, right_id, right);
      return of(std::move(result));
    }
    if (n.text == "in" || n.text == "instanceof") return truth();
    return number();
  }

  // The unit that all its forms have; empty: none that is known.
  static std::string unit_of(const ExpressionType& type) {
    if (type.open || type.forms.empty()) return {};
    for (const DataType& form : type.forms) {
      if (form.unit != type.forms[0]->unit) return {};
    }
    return type.forms[0]->unit;
  }

  std::string scaled(const std::string& sign, std::uint32_t left_id, const ExpressionType& left, std::uint32_t right_id,
                     const ExpressionType& right) const {
    std::string unit = unit_of(left);
    std::optional<double> by = literal(right_id);
    if (unit.empty() && sign == "*") {
      unit = unit_of(right);
      by = literal(left_id);
    }
    if (sign == "-") return unit == unit_of(right) || right.open ? unit : std::string();
    if (unit.empty() || !by) return {};
    const double factor = sign == "*" ? *by : sign == "/" ? 1 / *by : 0;
    if (factor == 1) return unit;
    if (unit == "ratio" && factor == 100) return "%";
    if (unit == "%" && std::abs(factor - 0.01) < 1e-12) return "ratio";
    return {};
  }

  [[nodiscard]] std::optional<double> literal(std::uint32_t id) const {
    const ScriptNode& n = at(id);
    if (n.kind == Node::kNumber) return n.number;
    if (n.kind == Node::kUnary && n.text == "-" && at(n.operands[0]).kind == Node::kNumber)
      return -at(n.operands[0]).number;
    return std::nullopt;
  }

  void compare(const std::string& sign, std::uint32_t left_id, const ExpressionType& left, std::uint32_t right_id,
               const ExpressionType& right) {
    if (at(left_id).kind == Node::kText && at(right_id).kind == Node::kText) return;
    if (at(right_id).kind == Node::kText && check_word(sign, right_id, left_id, left)) return;
    if (at(left_id).kind == Node::kText && check_word(sign, left_id, right_id, right)) return;
    if (left.open || right.open || left.forms.empty() || right.forms.empty()) return;
    const bool is_strict = sign.size() == 3;
    const auto overlap = [&](const DataType& a, const DataType& b) {
      const auto unsure = [](const DataType& form) {
        return form.kind == TypeKind::kUnknown || form.kind == TypeKind::kOther || form.kind == TypeKind::kRecord;
      };
      if (a.kind == b.kind || unsure(a) || unsure(b) || is_wide_decimal(a, b) || is_wide_decimal(b, a)) return true;
      // == tries to make them alike; a word never is a number.
      const bool is_word = !a.words.empty() || !b.words.empty();
      return !is_strict && !is_word;
    };
    for (const DataType& a : left.forms) {
      for (const DataType& b : right.forms) {
        if (overlap(a, b)) return check_bounds(sign, left_id, left, right_id, right);
      }
    }
    error("check.never-equal",
          fmt::format("{} is {}, {} is {}; they are never equal", name_or_value(left_id), shown(left.forms[0]->kind),
                      name_or_value(right_id), shown(right.forms[0]->kind)));
  }

  [[nodiscard]] std::string name_or_value(std::uint32_t id) const {
    const ScriptNode& n = at(id);
    if (n.kind == Node::kText) return fmt::format("'{}'", n.text);
    if (n.kind == Node::kNumber || n.kind == Node::kTruth) return n.text;
    const std::string path = tree_.path(id);
    return path.empty() ? "one side" : path;
  }

  // A text in quotes compared with something. True: nothing more need be said.
  bool check_word(const std::string& sign, std::uint32_t text_id, std::uint32_t other_id, const ExpressionType& other) {
    const std::string& text = at(text_id).text;
    std::vector<std::string> known;
    std::string what;
    bool closed = !other.open;
    bool is_text = other.open;
    for (const DataType& form : other.forms) {
      if (form.kind == TypeKind::kUnknown) return true;
      if (form.kind != TypeKind::kText) {
        // '5' == 5
        if (sign.size() == 2 && form.kind != TypeKind::kRecord) return true;
        continue;
      }
      is_text = true;
      known.insert(known.end(), form.words.begin(), form.words.end());
      known.insert(known.end(), form.samples.begin(), form.samples.end());
      closed = closed && (!form.words.empty() || form.samples_are_all);
      if (!form.words.empty() && what.empty()) what = form.name;
    }
    if (!is_text) return false;
    // Nothing is always a thing to ask for, but of an enumeration.
    if ((text.empty() && (what.empty() || !closed)) || std::find(known.begin(), known.end(), text) != known.end())
      return true;
    const std::string near = did_you_mean(text, known);
    if (what.empty() || !closed) {
      // Names of the mission and its world: a scenario may have others.
      if (near.empty() && !closed) return true;
      add(closed && !near.empty() ? Severity::kError : Severity::kWarning, "check.unknown-word",
          fmt::format("nothing in this project makes {} '{}'{}", name_of(other_id), text, near));
      return true;
    }
    std::string all;
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    if (near.empty() && known.size() <= 8) {
      for (const std::string& one : known) {
        if (!one.empty()) all += (all.empty() ? "; there are " : ", ") + one;
      }
    }
    error("check.unknown-word", fmt::format("'{}' is no {}{}", text, what, near.empty() ? all : near));
    return true;
  }

  void order(const std::string& sign, std::uint32_t left_id, const ExpressionType& left, std::uint32_t right_id,
             const ExpressionType& right) {
    for (const auto& [id, type, other] : {std::tuple{left_id, &left, &right}, {right_id, &right, &left}}) {
      if (!all_of_kind(*other, TypeKind::kNumber)) continue;
      const bool is_word = all_of_kind(*type, TypeKind::kText) && !type->forms[0]->words.empty();
      if (is_word || all_of_kind(*type, TypeKind::kRecord)) {
        error("check.never-equal", fmt::format("{} is {} ({}), and is neither more nor less than a number", name_of(id),
                                               shown(type->forms[0]->kind), type->forms[0]->name));
        return;
      }
    }
    check_bounds(sign, left_id, left, right_id, right);
  }

  void check_bounds(const std::string& sign, std::uint32_t left_id, const ExpressionType& left, std::uint32_t right_id,
                    const ExpressionType& right) {
    if (!all_of_kind(left, TypeKind::kNumber) || !all_of_kind(right, TypeKind::kNumber)) return;
    const std::string a = unit_of(left);
    const std::string b = unit_of(right);
    if (!a.empty() && !b.empty() && a != b) {
      error("check.unit", fmt::format("{} is in {}, {} in {}", name_or_value(left_id), a, name_or_value(right_id), b));
      return;
    }
    check_share(sign, left_id, a, right_id, false);
    check_share(sign, right_id, b, left_id, true);
  }

  // A share compared with what it never reaches.
  void check_share(const std::string& sign, std::uint32_t id, const std::string& unit, std::uint32_t other,
                   bool mirrored) {
    const std::optional<double> constant = literal(other);
    const double most = unit == "%" ? 100 : unit == "ratio" ? 1 : 0;
    if (!constant || most == 0) return;
    const std::string shown_id = tree_.path(id).empty() ? "the value" : tree_.path(id);
    if (*constant >= 0 && *constant <= most) {
      if (unit == "%" && *constant > 0 && *constant < 1)
        add(Severity::kWarning, "check.out-of-range",
            fmt::format("{} is in percent, so {} is less than one percent; write {}", shown_id,
                        plain_decimal(*constant), plain_decimal(*constant * 100)));
      return;
    }
    if (unit == "ratio" && *constant > 1) {
      error("check.unit",
            fmt::format("{} is a ratio from 0 to 1, and {} is beyond; write {}, or multiply the value by 100", shown_id,
                        plain_decimal(*constant), plain_decimal(*constant / 100)));
      return;
    }
    const bool is_above = mirrored ? sign[0] == '<' : sign[0] == '>';
    const bool holds = sign[0] == '!' || (!is_equality(sign) && (*constant < 0 ? is_above : !is_above));
    add(Severity::kWarning, "check.out-of-range",
        fmt::format("{} is from 0 to {} %, so this is {} true", shown_id, plain_decimal(most),
                    holds ? "always" : "never"));
  }

  // Where true or false is wanted.
  void check_condition(std::uint32_t id, const ExpressionType& type) {
    const ScriptNode& n = at(id);
    if (n.kind == Node::kAssignment) {
      error("check.always-true", "\"=\" assigns; compare with \"===\"");
      return;
    }
    if (n.kind == Node::kBinary && (n.text == "&&" || n.text == "||")) {
      // On the left it may guard what is on the right.
      check_condition(n.operands[1], visit_silently(n.operands[1]));
      return;
    }
    if (n.kind != Node::kMember || type.open || type.forms.empty()) return;
    const bool is_object = std::all_of(type.forms.begin(), type.forms.end(), [](const DataType& form) {
      const bool is_word = form.kind == TypeKind::kText && !form.words.empty();
      return !form.may_be_absent && (form.kind == TypeKind::kRecord || is_word);
    });
    if (!is_object) return;
    add(Severity::kWarning, "check.always-true",
        fmt::format("{} is always true: it is {}{}; compare it, or name a member", name_of(id),
                    shown(type.forms[0]->kind),
                    type.forms[0]->name.empty() ? "" : fmt::format(" ({})", type.forms[0]->name)));
  }

  ExpressionType visit_silently(std::uint32_t id) {
    Diagnostics* const out = std::exchange(out_, nullptr);
    ExpressionType type = visit(id);
    out_ = out;
    return type;
  }

  const ScriptTree& tree_;
  const ExpressionScope& scope_;
  const SourceSpan& span_;
  Diagnostics* out_;
};

}  // namespace

ExpressionType of(Form form) {
  if (form->kind == TypeKind::kUnknown) return {};
  return {.open = false, .forms = {std::move(form)}};
}
ExpressionType of(DataType type) { return of(Form(std::move(type))); }

void join(ExpressionType& into, const ExpressionType& other) {
  into.open = into.open || other.open;
  if (into.forms.size() + other.forms.size() > kFormsMax) {
    into = {};
    return;
  }
  into.forms.insert(into.forms.end(), other.forms.begin(), other.forms.end());
}

ExpressionType items_of(const ExpressionType& collection) {
  ExpressionType result{.open = collection.open || collection.forms.empty(), .forms = {}};
  for (const Form& form : collection.forms) {
    if (form->items.empty()) return {};
    join(result, of(Form(form, form->items.begin()->type)));
  }
  return result;
}

ExpressionType read_expression(const ScriptTree& tree, const ExpressionScope& scope, const SourceSpan& span,
                               Diagnostics* diagnostics, bool is_condition) {
  return Reader(tree, scope, span, diagnostics).whole(is_condition);
}

}  // namespace sentree::project
