#include "sentree/monitor/requirement_types.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sentree/base/numbered.h"
#include "sentree/base/value.h"
#include "sentree/monitor/observed.h"

namespace sentree::monitor {

namespace {

using Kind = Condition::Kind;
using Type = DataType::Kind;

std::string_view word_for(Type type) {
  switch (type) {
    case Type::kNumber: return "a number";
    case Type::kTruth: return "true or false";
    case Type::kText: return "a text";
    case Type::kRecord: return "a record";
    default: return "nothing that can be compared";
  }
}

struct Scale {
  std::string_view unit;
  std::string_view of;
  double factor;  // 1 `unit` is `factor` `of`
};
constexpr std::array<Scale, 25> kScales{
    {{"ratio", "ratio", 1}, {"%", "ratio", 0.01},  {"m", "m", 1},     {"mm", "m", 0.001},
     {"cm", "m", 0.01},     {"km", "m", 1000},     {"rad", "rad", 1}, {"deg", "rad", 0.017453292519943295},
     {"s", "s", 1},         {"ms", "s", 0.001},    {"us", "s", 1e-6}, {"min", "s", 60},
     {"m/s", "m/s", 1},     {"rad/s", "rad/s", 1}, {"V", "V", 1},     {"mV", "V", 0.001},
     {"A", "A", 1},         {"degC", "degC", 1},   {"W", "W", 1},     {"Hz", "Hz", 1},
     {"kg", "kg", 1},       {"g", "kg", 0.001},    {"N", "N", 1},     {"Nm", "Nm", 1},
     {"Pa", "Pa", 1}}};

const Scale* scale_of(std::string_view unit) {
  const auto found = std::find_if(kScales.begin(), kScales.end(), [&](const Scale& s) { return s.unit == unit; });
  return found == kScales.end() ? nullptr : &*found;
}

// A number in another unit: x [m] * 1000 is in mm. Empty: the product has no unit that is known.
std::string scaled_unit(const std::string& unit, double by) {
  if (unit.empty()) return {};
  const Scale* from = scale_of(unit);
  for (const Scale& to : kScales) {
    if (from == nullptr || to.of != from->of || to.unit == unit) continue;
    const double factor = from->factor / to.factor;
    if (factor > by * (1 - 1e-12) && factor < by * (1 + 1e-12)) return std::string(to.unit);
  }
  return unit;
}

std::string advice(const std::string& from, const std::string& to) {
  const Scale* a = scale_of(from);
  const Scale* b = scale_of(to);
  if (a == nullptr || b == nullptr || a->of != b->of) return "";
  const double factor = a->factor / b->factor;
  return factor >= 1 ? "; multiply the first by " + plain_decimal(factor)
                     : "; divide the first by " + plain_decimal(b->factor / a->factor);
}

std::vector<std::string> names(const DataMembers& members) {
  std::vector<std::string> result;
  for (const DataMember& member : members) result.push_back(member.name);
  return result;
}

template <class Map>
std::vector<std::string> keys(const Map& map) {
  std::vector<std::string> names;
  for (const auto& [name, value] : map) names.push_back(name);
  return names;
}

Kind mirrored(Kind kind) {
  switch (kind) {
    case Kind::kLess: return Kind::kGreater;
    case Kind::kLessEqual: return Kind::kGreaterEqual;
    case Kind::kGreater: return Kind::kLess;
    case Kind::kGreaterEqual: return Kind::kLessEqual;
    default: return kind;
  }
}

// Whether it is one observed value, as it is or in another unit: then a share is within its bounds.
bool is_one_value(const Condition& condition) {
  const Condition& c = inside(condition);
  if (c.kind == Kind::kValue || c.kind == Kind::kMember) return true;
  if (c.kind != Kind::kMultiply && c.kind != Kind::kDivide) return false;
  return (is_one_value(*c.operands[0]) && inside(*c.operands[1]).kind == Kind::kNumber) ||
         (c.kind == Kind::kMultiply && inside(*c.operands[0]).kind == Kind::kNumber && is_one_value(*c.operands[1]));
}

std::optional<double> constant_of(const Condition& condition) {
  const Condition& c = inside(condition);
  if (c.kind == Kind::kNumber) return c.number;
  if (c.kind == Kind::kNegate && inside(*c.operands[0]).kind == Kind::kNumber) return -inside(*c.operands[0]).number;
  return std::nullopt;
}

struct Found {
  Type type = Type::kUnknown;
  std::string unit;
  const Condition* literal = nullptr;  // a number written without unit
  const DataType* data = nullptr;
};

class Checker {
 public:
  Checker(const Vocabulary* vocabulary, Diagnostics& diagnostics) : vocabulary_(vocabulary), out_(diagnostics) {}

  void condition(const ConditionPtr& condition) {
    if (condition) visit(*condition, Type::kTruth);
  }
  // A condition or a value.
  void content(const Condition& content) { visit(content, Type::kUnknown); }

  Typing typing;
  bool last_pass = false;

 private:
  void add(Severity severity, const SourceSpan& span, std::string code, std::string message) {
    if (!last_pass) return;
    Diagnostic diagnostic{severity, std::move(code), std::move(message), span};
    if (std::find(out_.begin(), out_.end(), diagnostic) == out_.end()) out_.push_back(std::move(diagnostic));
  }
  void error(const SourceSpan& span, std::string code, std::string message) {
    add(Severity::kError, span, std::move(code), std::move(message));
  }

  Found visit(const Condition& c, Type expected) {
    switch (c.kind) {
      case Kind::kNumber: return want({Type::kNumber, c.unit, c.unit.empty() ? &c : nullptr, nullptr}, expected, c);
      case Kind::kText: return want({Type::kText, "", nullptr, nullptr}, expected, c);
      case Kind::kTruth: return want({Type::kTruth, "", nullptr, nullptr}, expected, c);
      case Kind::kDefined: return defined(c, expected);
      case Kind::kValue: return value(c, expected);
      case Kind::kMember: return member(c, expected);
      case Kind::kEvent: source(*c.source); return want({Type::kTruth, "", nullptr, nullptr}, expected, c);
      case Kind::kUpdated: {
        visit(*c.operands[0], Type::kUnknown);
        std::vector<Source> sources;
        collect_sources(*c.operands[0], sources);
        if (sources.empty()) error(c.span, "requirement.type", "\"updated\" follows a value that observations set");
        return want({Type::kTruth, "", nullptr, nullptr}, expected, c);
      }
      case Kind::kNot:
      case Kind::kAnd:
      case Kind::kOr:
      case Kind::kImplies:
      case Kind::kRises:
      case Kind::kFalls:
        for (const ConditionPtr& operand : c.operands) visit(*operand, Type::kTruth);
        return want({Type::kTruth, "", nullptr, nullptr}, expected, c);
      case Kind::kLess:
      case Kind::kLessEqual:
      case Kind::kGreater:
      case Kind::kGreaterEqual: {
        const Found left = visit(*c.operands[0], Type::kNumber);
        const Found right = visit(*c.operands[1], Type::kNumber);
        compare(c, left, right);
        return want({Type::kTruth, "", nullptr, nullptr}, expected, c);
      }
      case Kind::kEqual:
      case Kind::kNotEqual: equality(c); return want({Type::kTruth, "", nullptr, nullptr}, expected, c);
      default: return want(arithmetic(c), expected, c);
    }
  }

  Found want(Found found, Type expected, const Condition& c) {
    if (expected != Type::kUnknown && found.type != Type::kUnknown && found.type != expected) {
      error(c.span, "requirement.type",
            fmt::format("expected {}, but {} is {}", word_for(expected), to_text(c), word_for(found.type)));
    }
    return found;
  }

  Type known_type(const Condition& c) {
    switch (c.kind) {
      case Kind::kValue: return value(c, Type::kUnknown).type;
      case Kind::kMember: return member(c, Type::kUnknown).type;
      case Kind::kNumber:
      case Kind::kNegate:
      case Kind::kAdd:
      case Kind::kSubtract:
      case Kind::kMultiply:
      case Kind::kDivide: return Type::kNumber;
      case Kind::kText: return Type::kText;
      case Kind::kName:
      case Kind::kDefined: return Type::kUnknown;
      default: return Type::kTruth;
    }
  }

  Found defined(const Condition& c, Type expected) {
    // What it is known to be is told where it is used; else it is what it is used as.
    const Type is = known_type(inside(c));
    const bool differs = expected != Type::kUnknown && is != Type::kUnknown && is != expected;
    Found found = visit(*c.operands[0], differs ? Type::kUnknown : expected);
    if (differs) return want(std::move(found), expected, c);
    if (c.unit.empty()) return found;
    if (!found.unit.empty() && found.unit != c.unit) {
      error(c.span, "requirement.unit",
            fmt::format("\"{}\" is defined in {}, but its value is in {}{}", c.text, c.unit, found.unit,
                        advice(found.unit, c.unit)));
    }
    found.unit = c.unit;
    found.literal = nullptr;
    return found;
  }

  // What the type is known to be, or was inferred from another use; a use that expects more tells.
  Found typed(const std::string& key, const Condition& c, Type expected) {
    DataType& type = typing[key];
    if (type.kind == Type::kUnknown) type.kind = expected;
    if (type.kind == Type::kRecord || type.kind == Type::kOther) {
      std::string members;
      for (const auto& [name, inner] : type.members) members += (members.empty() ? "" : ", ") + name;
      const std::string text = to_text(c);
      const bool is_request = text.ends_with(")") && (text.starts_with("request(") || text.starts_with("reply(") ||
                                                      text.starts_with("late(") || text.starts_with("error("));
      error(c.span, "requirement.type",
            fmt::format("{} is {}{}{}", text, type.name.empty() ? "a record" : "of type " + type.name,
                        members.empty() ? ", which cannot be compared" : "; name one of its members: " + members,
                        is_request ? fmt::format("; event({}) says that it comes", text) : ""));
      return {Type::kUnknown, "", nullptr, nullptr};
    }
    return want({type.kind, type.unit, nullptr, &type}, expected, c);
  }

  Found value(const Condition& c, Type expected) {
    const std::string key = to_text(c);
    const DataType* root = source(*c.source);
    if (root != nullptr) know(key, *root, c.path, c);
    return typed(key, c, expected);
  }

  Found member(const Condition& c, Type expected) {
    const std::string key = to_text(c);
    if (where_ != nullptr) {
      if (is_of_message(c)) return {};
      know(where_key_ + key, data_of(*where_), c.path, c);
    }
    return typed(where_key_ + key, c, expected);
  }

  // target.x where args.target.x is meant.
  bool is_of_message(const Condition& c) {
    const DataType& data = data_of(*where_);
    const auto find = [](const DataType& record, const std::string& name) {
      return std::find_if(record.members.begin(), record.members.end(), [&](const auto& m) { return m.name == name; });
    };
    const auto* const first = find(data, c.path[0]);
    if (first == data.members.end() || c.path.size() < 2 || !first->type.members.empty()) return false;
    for (const char* const part : {"args", "result", "inputs", "outputs"}) {
      const auto* const record = find(data, part);
      if (record == data.members.end() || find(record->type, c.path[0]) == record->type.members.end()) continue;
      error(c.span, "requirement.unknown-member",
            fmt::format("\"{}\" is that of the message; did you mean \"{}.{}\"?", c.path[0], part, to_text(c)));
      return true;
    }
    return false;
  }

  void know(const std::string& key, const DataType& root, const std::vector<std::string>& path, const Condition& c) {
    DataType type = follow(root, path, c);
    typing.try_emplace(key, std::move(type));
  }

  DataType follow(const DataType& root, const std::vector<std::string>& path, const Condition& c) {
    const DataType* type = &root;
    bool absent = root.may_be_absent;
    for (const std::string& name : path) {
      if (type->kind == Type::kUnknown) return {};
      const auto member = std::find_if(type->members.begin(), type->members.end(),
                                       [&](const auto& entry) { return entry.name == name; });
      if (member == type->members.end()) {
        const std::vector<std::string> known = names(type->members);
        const std::string near = did_you_mean(name, known);
        error(c.span, "requirement.unknown-member",
              fmt::format("{}: {} has no member \"{}\"{}", to_text(c), type->name.empty() ? "it" : type->name, name,
                          near.empty() && !known.empty() ? fmt::format("; it has {}", fmt::join(known, ", ")) : near));
        return {};
      }
      type = &member->type;
      absent = absent || type->may_be_absent;
    }
    DataType result = *type;
    result.may_be_absent = absent;
    return result;
  }

  // Null: nothing is known of its data.
  const DataType* source(const Source& source) {
    const Vocabulary::Method* method = nullptr;
    if (vocabulary_ != nullptr) {
      if (!source.service.empty()) method = find_method(source);
      if (source.kind == Source::Kind::kNode) known(source.from, vocabulary_->nodes, "node", source.from_span);
      if (source.kind != Source::Kind::kNode && !source.from.empty()) {
        const auto& models = vocabulary_->models;
        if (std::find(models.begin(), models.end(), source.from) == models.end())
          known(source.from, vocabulary_->leaves, "leaf", source.from_span);
      }
      if (source.kind == Source::Kind::kObservation) observation(source);
    }
    if (source.where) {
      where_ = &source;
      where_key_ = source.observation + " ";
      visit(*source.where, Type::kTruth);
      where_ = nullptr;
      where_key_.clear();
      // It is looked at when an observation arrives, and by itself.
      if (std::vector<Source> others; collect_sources(*source.where, others), !others.empty()) {
        error(source.where->span, "requirement.where",
              fmt::format("where looks at members of {} alone, not at what other observations have set, as \"{}\" is; "
                          "compare outside: event(…) and … = …",
                          source.observation, to_text(*source.where)));
      } else if (is_momentary(*source.where)) {
        error(source.where->span, "requirement.where",
              fmt::format("\"{}\" is an event, and where wants what the members of one {} are", to_text(*source.where),
                          source.observation));
      }
    }
    if (source.kind == Source::Kind::kRequest) return method == nullptr ? nullptr : &method->arguments;
    if (source.kind == Source::Kind::kReply) return method == nullptr ? nullptr : &method->result;
    return &data_of(source);
  }

  const DataType& data_of(const Source& source) {
    const auto [data, is_new] = observed_.try_emplace(source.observation);
    if (is_new)
      data->second =
          vocabulary_ != nullptr ? observations().data_of(source.observation) : data_of_any(source.observation);
    return data->second;
  }

  const Observations& observations() {
    if (!observations_) observations_.emplace(*vocabulary_);
    return *observations_;
  }

  const Vocabulary::Method* find_method(const Source& source) {
    const auto service = vocabulary_->services.find(source.service);
    if (service == vocabulary_->services.end()) {
      error(source.span, "requirement.unknown-service",
            fmt::format("the project has no service \"{}\"{}", source.service,
                        did_you_mean(source.service, keys(vocabulary_->services))));
      return nullptr;
    }
    const auto method = service->second.find(source.method);
    if (method == service->second.end()) {
      error(source.span, "requirement.unknown-method",
            fmt::format("service \"{}\" has no method \"{}\"{}", source.service, source.method,
                        did_you_mean(source.method, keys(service->second))));
      return nullptr;
    }
    const bool is_outcome = source.kind == Source::Kind::kReply || source.kind == Source::Kind::kLate;
    if (method->second.oneway && is_outcome) {
      error(source.span, "requirement.unknown-method",
            fmt::format("{}.{} is one-way: nobody answers it; what is published is request({}.{})", source.service,
                        source.method, source.service, source.method));
    }
    return &method->second;
  }

  void known(const std::string& name, const std::vector<std::string>& names, const std::string& what,
             const SourceSpan& span) {
    if (std::find(names.begin(), names.end(), name) != names.end()) return;
    const std::vector<std::string> alike = numbered(name, names);
    error(span, "requirement.unknown-leaf",
          alike.empty() ? fmt::format("the mission has no {} \"{}\"{}", what, name, did_you_mean(name, names))
                        : fmt::format("several leaves are called \"{}\"; say {}", name, fmt::join(alike, " or ")));
  }

  // A full name: of the mission, of a call or of a leaf.
  void observation(const Source& source) {
    const std::vector<std::string>& names = observations().names();
    if (std::find(names.begin(), names.end(), source.observation) != names.end()) return;
    const std::string::size_type dot = source.observation.rfind('.');
    const std::string leaf = source.observation.substr(0, dot);
    if (std::vector<std::string> alike = numbered(leaf, vocabulary_->leaves); !alike.empty()) {
      if (dot != std::string::npos) {
        for (std::string& name : alike) name += source.observation.substr(dot);
      }
      error(source.span, "requirement.unknown-leaf",
            fmt::format("several leaves are called \"{}\"; say {}", leaf, fmt::join(alike, " or ")));
      return;
    }
    error(source.span, "requirement.unknown-leaf",
          fmt::format("nothing in this project is observed as \"{}\"{}", source.observation,
                      did_you_mean(source.observation, names)));
  }

  void equality(const Condition& c) {
    for (const ConditionPtr& operand : c.operands) {
      const Condition& inner = inside(*operand);
      const bool is_value = inner.kind == Kind::kNumber || inner.kind == Kind::kText || inner.kind == Kind::kTruth ||
                            inner.kind == Kind::kValue || inner.kind == Kind::kMember || inner.kind >= Kind::kNegate;
      if (!is_value) {
        error(inner.span, "requirement.type", "= and != compare values; join conditions with and, or, implies");
        return;
      }
    }
    Found left = visit(*c.operands[0], Type::kUnknown);
    Found right = visit(*c.operands[1], Type::kUnknown);
    if (left.type == Type::kUnknown && right.type != Type::kUnknown) left = visit(*c.operands[0], right.type);
    if (right.type == Type::kUnknown && left.type != Type::kUnknown) right = visit(*c.operands[1], left.type);
    if (left.type == Type::kUnknown) return;
    if (left.type != right.type) {
      std::string hint;
      if (inside(*c.operands[1]).is_word) hint = fmt::format(" (\"{}\" is not defined)", inside(*c.operands[1]).text);
      error(c.span, "requirement.type",
            fmt::format("{} is {}, {} is {}; they are never equal{}", to_text(*c.operands[0]), word_for(left.type),
                        to_text(*c.operands[1]), word_for(right.type), hint));
      return;
    }
    if (left.type == Type::kNumber) compare(c, left, right);
    if (left.type == Type::kText) {
      check_word(left, *c.operands[0], *c.operands[1]);
      check_word(right, *c.operands[1], *c.operands[0]);
    }
  }

  void check_word(const Found& of, const Condition& value, const Condition& word) {
    const Condition& text = inside(word);
    if (of.data == nullptr || text.kind != Kind::kText) return;
    const bool is_enumeration = !of.data->words.empty();
    const std::vector<std::string>& words = is_enumeration ? of.data->words : of.data->samples;
    if (words.empty() || std::find(words.begin(), words.end(), text.text) != words.end()) return;
    std::string all;
    if (words.size() <= 6) {
      for (const std::string& w : words) all += (all.empty() ? "; it has " : ", ") + w;
    }
    const std::string hint = did_you_mean(text.text, words);
    if (is_enumeration) {
      error(text.span, "requirement.unknown-word",
            fmt::format("\"{}\" is no {}{}", text.text, of.data->name, hint.empty() ? all : hint));
      return;
    }
    // A text in quotes is meant as it is written; where others are possible, only what is nearly a known one is told.
    if (!text.is_word) return;
    const bool is_all = of.data->samples_are_all;
    if (!is_all && hint.empty()) return;
    add(is_all && !hint.empty() ? Severity::kError : Severity::kWarning, text.span, "requirement.unknown-word",
        fmt::format("\"{}\" is no name in the mission, its world or its models, so nothing makes {} that{}", text.text,
                    to_text(value), hint));
  }

  void compare(const Condition& c, const Found& left, const Found& right) {
    if (!compare_units(c, left, right)) return;
    compare_with_bounds(c, c.kind, *c.operands[0], left, *c.operands[1]);
    compare_with_bounds(c, mirrored(c.kind), *c.operands[1], right, *c.operands[0]);
  }

  // A share compared with what it never reaches. With its very bounds it may be compared, to watch who measures it.
  void compare_with_bounds(const Condition& c, Kind kind, const Condition& share, const Found& found,
                           const Condition& other) {
    const auto constant = constant_of(other);
    const double most = found.unit == "%" ? 100 : found.unit == "ratio" ? 1 : 0;
    if (most == 0 || !constant || !is_one_value(share)) return;
    if (*constant >= 0 && *constant <= most) return;
    const bool is_above = kind == Kind::kGreater || kind == Kind::kGreaterEqual;
    const bool is_below = kind == Kind::kLess || kind == Kind::kLessEqual;
    const bool holds = kind == Kind::kNotEqual || (*constant < 0 ? is_above : is_below);
    add(Severity::kWarning, c.span, "requirement.out-of-range",
        fmt::format("{} is from 0 to {}{}, so {}{}", to_text(share), plain_decimal(most), found.unit == "%" ? " %" : "",
                    to_text(c), holds ? " is always true" : " is never true"));
  }

  // False: they do not fit.
  bool compare_units(const Condition& c, const Found& left, const Found& right) {
    bool fits = true;
    const auto one_bare = [&](const Found& with, const Found& bare, const Condition& other) {
      if (bare.literal == nullptr) return;
      if (with.unit == "ratio" && bare.literal->number > 1) {
        fits = false;
        error(bare.literal->span, "requirement.unit",
              fmt::format("{} is a ratio from 0 to 1, and {} is beyond; write {}, or multiply the value by 100",
                          to_text(other), plain_decimal(bare.literal->number),
                          plain_decimal(bare.literal->number / 100)));
      } else if (with.unit == "%" && bare.literal->number > 0 && bare.literal->number < 1) {
        add(Severity::kWarning, bare.literal->span, "requirement.unit",
            fmt::format("{} is in percent, so {} is less than one percent; write {}, or say so with {} %",
                        to_text(other), plain_decimal(bare.literal->number), plain_decimal(bare.literal->number * 100),
                        plain_decimal(bare.literal->number)));
      }
    };
    if (!left.unit.empty() && !right.unit.empty() && left.unit != right.unit) {
      error(c.span, "requirement.unit",
            fmt::format("{} is in {}, {} in {}{}", to_text(*c.operands[0]), left.unit, to_text(*c.operands[1]),
                        right.unit, advice(left.unit, right.unit)));
      return false;
    }
    one_bare(left, right, *c.operands[0]);
    one_bare(right, left, *c.operands[1]);
    return fits;
  }

  Found arithmetic(const Condition& c) {
    const Found left = visit(*c.operands[0], Type::kNumber);
    if (c.kind == Kind::kNegate) return {Type::kNumber, left.unit, nullptr, nullptr};
    const Found right = visit(*c.operands[1], Type::kNumber);
    Found result{Type::kNumber, "", nullptr, nullptr};
    if (c.kind == Kind::kAdd || c.kind == Kind::kSubtract) {
      compare_units(c, left, right);
      result.unit = left.unit.empty() ? right.unit : left.unit;
    } else if (right.literal != nullptr) {
      result.unit =
          scaled_unit(left.unit, c.kind == Kind::kMultiply ? right.literal->number : 1 / right.literal->number);
    } else if (left.literal != nullptr && c.kind == Kind::kMultiply) {
      result.unit = scaled_unit(right.unit, left.literal->number);
    }
    return result;
  }

  const Vocabulary* vocabulary_;
  Diagnostics& out_;
  std::optional<Observations> observations_;
  const Source* where_ = nullptr;  // that whose where is being visited
  std::string where_key_;
  std::map<std::string, DataType> observed_;  // data of observations by their full name
};

// ---- What can never be ----

// Bounds that a conjunction sets to the values in it.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;
  bool high_open = false;
  std::vector<std::string> words;

  [[nodiscard]] bool empty() const {
    return low > high || (low == high && (low_open || high_open)) ||
           (words.size() > 1 && words.front() != words.back());
  }
  void at_least(double bound, bool open) {
    if (bound > low || (bound == low && open)) {
      low = bound;
      low_open = open;
    }
  }
  void at_most(double bound, bool open) {
    if (bound < high || (bound == high && open)) {
      high = bound;
      high_open = open;
    }
  }
};

// True if the conjunction contradicts itself. Looks at comparisons of one value with constants only.
bool contradicts(const Condition& c, std::map<std::string, Range>& ranges) {
  const Condition& inner = inside(c);
  if (inner.kind == Kind::kTruth) return inner.number == 0;
  if (inner.kind == Kind::kAnd)
    return contradicts(*inner.operands[0], ranges) || contradicts(*inner.operands[1], ranges);
  if (inner.kind < Kind::kEqual || inner.kind > Kind::kGreaterEqual || inner.kind == Kind::kNotEqual) return false;
  const Condition* left = inner.operands[0].get();
  const Condition* right = inner.operands[1].get();
  Kind kind = inner.kind;
  if (inside(*left).kind == Kind::kNumber || inside(*left).kind == Kind::kText) {
    std::swap(left, right);
    kind = mirrored(kind);
  }
  const Condition& constant = inside(*right);
  Range& range = ranges[to_text(inside(*left))];
  if (constant.kind == Kind::kText && kind == Kind::kEqual) {
    range.words.push_back(constant.text);
    if (range.words.size() > 1 && range.words.front() != constant.text) return true;
  } else if (constant.kind == Kind::kNumber) {
    const double n = constant.number;
    if (kind == Kind::kEqual || kind == Kind::kGreater || kind == Kind::kGreaterEqual)
      range.at_least(n, kind == Kind::kGreater);
    if (kind == Kind::kEqual || kind == Kind::kLess || kind == Kind::kLessEqual) range.at_most(n, kind == Kind::kLess);
  }
  return range.empty();
}

bool is_never(const Condition& condition) {
  std::map<std::string, Range> ranges;
  return contradicts(condition, ranges);
}

bool is_always_true(const Condition& condition) {
  const Condition& inner = inside(condition);
  return inner.kind == Kind::kTruth && inner.number != 0;
}

// Whose they are, as "source = LEAF" among what a where demands.
std::string source_in(const Condition& where) {
  const Condition& inner = inside(where);
  if (inner.kind == Kind::kAnd) {
    std::string left = source_in(*inner.operands[0]);
    return left.empty() ? source_in(*inner.operands[1]) : left;
  }
  if (inner.kind != Kind::kEqual) return {};
  const Condition* member = &inside(*inner.operands[0]);
  const Condition* word = &inside(*inner.operands[1]);
  if (member->kind != Kind::kMember) std::swap(member, word);
  const bool is_source = member->kind == Kind::kMember && member->path == std::vector<std::string>{"source"};
  return is_source && word->kind == Kind::kText ? word->text : "";
}
// A word there that is no leaf is told as such.
std::string whose(const Source& source, const Vocabulary& vocabulary) {
  if (!source.from.empty() || !source.where) return source.from;
  std::string leaf = source_in(*source.where);
  const bool is_leaf = std::find(vocabulary.leaves.begin(), vocabulary.leaves.end(), leaf) != vocabulary.leaves.end();
  return is_leaf ? leaf : "";
}

// Why nothing is ever observed of it; empty: it may be, or that is not known.
std::string never_comes(const Source& source, const Vocabulary& vocabulary) {
  const std::string from = whose(source, vocabulary);
  if (source.service.empty() || !vocabulary.calls) return {};
  // On topics others publish too, and what is overheard others call.
  const auto service = vocabulary.services.find(source.service);
  if (service != vocabulary.services.end()) {
    const auto method = service->second.find(source.method);
    if (method != service->second.end() && (method->second.oneway || (method->second.overheard && from.empty())))
      return {};
  }
  const bool called =
      std::any_of(vocabulary.calls->begin(), vocabulary.calls->end(), [&](const Vocabulary::Call& call) {
        return call.service == source.service && call.method == source.method && (from.empty() || from == call.leaf);
      });
  if (called) return {};
  return fmt::format("{} calls {}.{}", from.empty() ? std::string("no skill") : fmt::format("\"{}\" never", from),
                     source.service, source.method);
}

// Values that leaves never bring: who calls besides skills has no name of a leaf.
void find_unseen(const Requirement& r, const Vocabulary& vocabulary, Diagnostics& diagnostics) {
  for (const Source& source : sources_of(r)) {
    const auto& leaves = vocabulary.leaves;
    if (std::find(leaves.begin(), leaves.end(), whose(source, vocabulary)) == leaves.end()) continue;
    const std::string why = never_comes(source, vocabulary);
    if (why.empty()) continue;
    Diagnostic found{Severity::kWarning, "requirement.never-seen",
                     fmt::format("{} is never observed: {}", source.text(), why), source.span};
    if (std::find(diagnostics.begin(), diagnostics.end(), found) == diagnostics.end())
      diagnostics.push_back(std::move(found));
  }
}

// Why the condition can never hold in this project; empty: it can.
std::string never_holds(const Condition& condition, const Vocabulary* vocabulary) {
  if (is_never(condition)) return "it contradicts itself";
  const Condition& inner = inside(condition);
  if (inner.kind == Kind::kAnd) {
    const std::string left = never_holds(*inner.operands[0], vocabulary);
    return left.empty() ? never_holds(*inner.operands[1], vocabulary) : left;
  }
  if (inner.kind == Kind::kOr) {
    const std::string left = never_holds(*inner.operands[0], vocabulary);
    return left.empty() ? left : never_holds(*inner.operands[1], vocabulary);
  }
  if (vocabulary == nullptr || !vocabulary->calls || inner.kind == Kind::kNot || inner.kind == Kind::kImplies)
    return {};
  // Whatever is left needs every one of its observations.
  std::vector<Source> sources;
  collect_sources(inner, sources);
  for (const Source& source : sources) {
    if (std::string why = never_comes(source, *vocabulary); !why.empty()) return why;
  }
  return {};
}

void find_vacuous(const Requirement& r, const Vocabulary* vocabulary, Diagnostics& diagnostics) {
  const auto warn = [&](std::string code, std::string message) {
    diagnostics.push_back({Severity::kWarning, std::move(code), std::move(message), r.span});
  };
  if (!can_be_violated(r)) {
    warn("requirement.never-violated",
         fmt::format("requirement {} can never be violated while the mission runs: it owes something without saying "
                     "when; add \"within\" and a bound, or leave it to the verifier",
                     r.name));
    return;
  }
  if (r.scope.open) {
    const std::string why = never_holds(*r.scope.open, vocabulary);
    if (!why.empty()) {
      warn("requirement.never-triggered", fmt::format("the scope of requirement {} never begins: {}", r.name, why));
      return;
    }
  }
  // What has to happen for a violation.
  ConditionPtr trigger;
  switch (r.pattern) {
    case Pattern::kRespond:
    case Pattern::kImmediately:
    case Pattern::kKeepFor:
    case Pattern::kKeepUntil:
    case Pattern::kNotFor:
    case Pattern::kNever:
    case Pattern::kAtMost:
    case Pattern::kHoldsFor: trigger = r.p; break;
    case Pattern::kPrecedes: trigger = r.q; break;
    default: break;
  }
  if (trigger) {
    const std::string why = never_holds(*trigger, vocabulary);
    if (!why.empty()) {
      warn("requirement.never-triggered",
           fmt::format("requirement {} never says anything: {} can never hold, because {}", r.name, to_text(*trigger),
                       why));
      return;
    }
  }
  if (r.pattern == Pattern::kAlways && is_always_true(*r.p))
    warn("requirement.never-violated",
         fmt::format("requirement {} can never be violated: true is always true", r.name));
}

}  // namespace

bool can_be_violated(const Requirement& requirement) {
  if (requirement.pattern == Pattern::kRespond) return requirement.bound.has_value();
  if (requirement.pattern != Pattern::kEventually || requirement.bound) return true;
  // Without a bound it is due when its scope ends.
  return requirement.scope.kind == Scope::Kind::kBefore || requirement.scope.can_reopen();
}

DataMembers::DataMembers(std::initializer_list<DataMember> members)
    : list_(std::make_shared<std::vector<DataMember>>(members)) {}

const DataMember* DataMembers::begin() const { return list_ ? list_->data() : nullptr; }

const DataMember* DataMembers::end() const { return list_ ? list_->data() + list_->size() : nullptr; }

std::size_t DataMembers::size() const { return list_ ? list_->size() : 0; }

void DataMembers::push_back(DataMember member) {
  if (!list_)
    list_ = std::make_shared<std::vector<DataMember>>();
  else if (list_.use_count() > 1)
    list_ = std::make_shared<std::vector<DataMember>>(*list_);
  list_->push_back(std::move(member));
}

bool operator==(const DataMembers& a, const DataMembers& b) {
  if (a.list_ == b.list_) return true;
  if (a.size() != b.size()) return false;
  // Of the comparison that goes on: the first pair that differs ends all of it, so one that was met before is alike.
  thread_local std::set<std::pair<const void*, const void*>> met;
  const bool is_outermost = met.empty();
  if (!met.emplace(a.list_.get(), b.list_.get()).second) return true;
  const bool alike = std::equal(a.begin(), a.end(), b.begin());
  if (is_outermost) met.clear();
  return alike;
}

Typing check_requirement(const Requirement& requirement, const Vocabulary* vocabulary, Diagnostics& diagnostics) {
  Checker checker(vocabulary, diagnostics);
  // A value compared with another one gets its type from there, so the first passes only infer.
  for (const bool last : {false, false, true}) {
    checker.last_pass = last;
    for (const ConditionPtr* condition : {&requirement.scope.open, &requirement.scope.close, &requirement.p,
                                          &requirement.q, &requirement.r, &requirement.assuming}) {
      checker.condition(*condition);
    }
  }
  const std::size_t before = diagnostics.size();
  find_vacuous(requirement, vocabulary, diagnostics);
  if (vocabulary != nullptr && diagnostics.size() == before) find_unseen(requirement, *vocabulary, diagnostics);
  return checker.typing;
}

std::vector<std::string_view> units() {
  std::vector<std::string_view> all;
  for (const Scale& scale : kScales) all.push_back(scale.unit);
  return all;
}

bool is_unit(std::string_view text) { return scale_of(text) != nullptr; }

void check_definitions(const RequirementFile& file, const Vocabulary* vocabulary, Diagnostics& diagnostics) {
  if (file.requirements.empty()) return;
  for (const Definition& definition : file.definitions) {
    if (definition.is_used) continue;
    diagnostics.push_back(
        {Severity::kWarning, "requirement.unused",
         fmt::format("no requirement of this file uses {}\"{}\"", definition.is_event ? "event " : "", definition.name),
         definition.span});
    if (!definition.parameters.empty()) continue;
    Checker checker(vocabulary, diagnostics);
    for (const bool last : {false, false, true}) {
      checker.last_pass = last;
      checker.content(*definition.content);
    }
  }
}

}  // namespace sentree::monitor
