// Puts definitions in where their names stand.
#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/told_once.h"
#include "sentree/monitor/detail/requirement_parser.h"
#include "sentree/monitor/observed.h"
#include "sentree/text/xml.h"

namespace sentree::monitor {

namespace {

using Kind = Condition::Kind;

std::vector<std::string> split(std::string_view dotted) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= dotted.size();) {
    const std::size_t dot = std::min(dotted.find('.', begin), dotted.size());
    parts.emplace_back(dotted.substr(begin, dot - begin));
    begin = dot + 1;
  }
  return parts;
}

bool is_constant_case(std::string_view name) {
  return std::none_of(name.begin(), name.end(), [](unsigned char c) { return std::islower(c) != 0; });
}

bool is_equality(Kind kind) { return kind == Kind::kEqual || kind == Kind::kNotEqual; }
bool is_comparison(Kind kind) { return kind >= Kind::kEqual && kind <= Kind::kGreaterEqual; }

// Whether no observation has a part in it.
bool is_constant(const Condition& condition) {
  if (condition.kind == Kind::kValue || condition.kind == Kind::kMember || condition.kind == Kind::kEvent) return false;
  return std::all_of(condition.operands.begin(), condition.operands.end(),
                     [](const ConditionPtr& operand) { return is_constant(*operand); });
}

class Resolver {
 public:
  Resolver(const RequirementFile& file, Diagnostics& diagnostics) : diagnostics_(diagnostics) {
    for (const Definition& definition : file.definitions) {
      definitions_.try_emplace({definition.is_event, definition.name}, &definition);
      names_[definition.is_event ? 1 : 0].push_back(definition.name);
    }
  }

  void resolve(ConditionPtr& condition) {
    if (!condition) return;
    parts_ = 0;
    condition = visit(condition, {});
  }
  // Those that were put in.
  [[nodiscard]] std::set<const Definition*>& used() { return used_; }

 private:
  using Arguments = std::map<std::string, ConditionPtr>;
  struct Place {
    bool compared = false;           // an operand of = or !=: a word stands for itself
    bool is_left = false;            // of a comparison
    const Source* where = nullptr;   // whose observations it looks at
    const DataType* data = nullptr;  // of these, as far as their name tells
  };

  void error(const SourceSpan& span, std::string code, std::string message) {
    diagnostics_.push_back({Severity::kError, std::move(code), std::move(message), span});
  }

  ConditionPtr visit(const ConditionPtr& condition, const Arguments& arguments) {
    return visit(condition, arguments, Place());
  }

  ConditionPtr visit(const ConditionPtr& condition, const Arguments& arguments, Place place) {
    if (++parts_ > kConditionPartsMax) {
      if (parts_ == kConditionPartsMax + 1)
        error(condition->span, "requirement.too-large", "the condition is too large once its definitions are put in");
      return condition;
    }
    if (condition->kind == Kind::kName) return name(*condition, arguments, place);
    auto copy = std::make_shared<Condition>(*condition);
    const std::size_t mistakes = diagnostics_.size();
    for (ConditionPtr& operand : copy->operands) {
      Place below = place;
      below.compared = is_equality(condition->kind);
      below.is_left = is_comparison(condition->kind) && &operand == copy->operands.data();
      operand = visit(operand, arguments, below);
    }
    if (is_comparison(copy->kind) && diagnostics_.size() == mistakes) check_compared(*copy, place);
    if (copy->source && copy->source->where) {
      const DataType data = data_of_any(copy->source->observation);
      copy->source->where = visit(copy->source->where, arguments, {.where = &*copy->source, .data = &data});
    }
    if ((copy->kind == Kind::kRises || copy->kind == Kind::kFalls) && is_momentary(*copy->operands[0])) {
      error(copy->span, "requirement.momentary",
            "rises and falls take a condition that lasts; an event is over at once, so use it as it is");
    }
    return copy;
  }

  // Of two constants it is known before anything is observed.
  void check_compared(const Condition& comparison, const Place& place) {
    if (!is_constant(comparison)) return;
    const Condition& left = *comparison.operands[0];
    const Condition& right = *comparison.operands[1];
    if (place.where != nullptr && (left.is_word || right.is_word)) {
      no_member(left.is_word ? left : right, place);
    } else if (left.is_word && right.is_word) {
      error(comparison.span, "requirement.unknown-name",
            fmt::format("\"{}\" and \"{}\" are words that stand for themselves; one of them should be defined by let",
                        left.text, right.text));
    } else {
      error(comparison.span, "requirement.constant",
            fmt::format("{} compares what never changes; compare with {}", to_text(comparison),
                        place.where != nullptr ? "a member of " + place.where->observation
                                               : "what observations set: let NAME = reply(…)"));
    }
  }

  void no_member(const Condition& name, const Place& place) {
    std::vector<std::string> known;
    std::string all;
    for (const DataMember& member : place.data->members) {
      known.push_back(member.name);
      all += (all.empty() ? "; it has " : ", ") + member.name;
    }
    const std::string near = did_you_mean(split(name.text)[0], known);
    error(name.span, "requirement.unknown-member",
          fmt::format("{} has no member \"{}\"{}", place.where->observation, name.text, near.empty() ? all : near));
  }

  ConditionPtr name(const Condition& name, const Arguments& arguments, Place place) {
    const bool is_event = name.unit == "event";
    if (const auto argument = arguments.find(name.text); argument != arguments.end() && !is_event)
      return argument->second;
    const auto definition = definitions_.find({is_event, name.text});
    if (place.where != nullptr && !is_event && name.operands.empty()) {
      const auto parts = split(name.text);
      const DataMembers& known = place.data->members;
      const bool is_open = place.data->kind == DataType::Kind::kUnknown && definition == definitions_.end();
      if ((is_open && (place.is_left || parts.size() > 1)) ||
          std::any_of(known.begin(), known.end(), [&](const DataMember& member) { return member.name == parts[0]; })) {
        auto member = std::make_shared<Condition>();
        member->kind = Kind::kMember;
        member->path = parts;
        member->span = name.span;
        return member;
      }
    }
    if (definition != definitions_.end()) return defined(name, *definition->second, arguments, place);
    if (is_event) {
      if (name.text.find('.') != std::string::npos && name.operands.empty()) return observation(name);
      return unknown(name, true);
    }
    if (!place.compared || !name.operands.empty() || name.text.find('.') != std::string::npos) {
      if (place.where == nullptr || !name.operands.empty()) return unknown(name, false);
      no_member(name, place);
      return unknown_truth(name.span);
    }
    // A word that stands for itself; not one that is a slip of a definition's name.
    const std::string near = did_you_mean(name.text, names(false));
    if (!near.empty() && !is_constant_case(name.text)) {
      error(name.span, "requirement.unknown-name",
            fmt::format("\"{}\" is not defined{} (a text that looks like it goes in quotes)", name.text, near));
    }
    auto word = std::make_shared<Condition>();
    word->kind = Kind::kText;
    word->text = name.text;
    word->is_word = true;
    word->span = name.span;
    return word;
  }

  ConditionPtr observation(const Condition& name) {
    auto event = std::make_shared<Condition>();
    event->kind = Kind::kEvent;
    event->span = name.span;
    event->source.emplace();
    event->source->observation = name.text;
    event->source->span = name.span;
    return event;
  }

  ConditionPtr unknown(const Condition& name, bool is_event) {
    const std::string what = is_event ? "event \"" : "\"";
    std::string hint = did_you_mean(name.text, names(is_event));
    if (!is_event && definitions_.contains({true, name.text}))
      hint = fmt::format(", but an event of that name is: write event({})", to_text(name));
    error(name.span, "requirement.unknown-name",
          fmt::format(
              "{}{}\" is not defined{}", what, name.text,
              hint.empty() ? fmt::format("; define it with {}{} = …", is_event ? "event " : "let ", name.text) : hint));
    auto truth = std::make_shared<Condition>();
    truth->span = name.span;
    truth->number = 1;
    return truth;
  }

  ConditionPtr defined(const Condition& name, const Definition& definition, const Arguments& outer, Place place) {
    if (name.operands.size() != definition.parameters.size()) {
      error(name.span, "requirement.unknown-name",
            fmt::format("\"{}\" takes {} argument{}, got {}", name.text, definition.parameters.size(),
                        definition.parameters.size() == 1 ? "" : "s", name.operands.size()));
      return unknown_truth(name.span);
    }
    if (std::find(open_.begin(), open_.end(), &definition) != open_.end()) {
      error(definition.span, "requirement.unknown-name", fmt::format("\"{}\" is defined by itself", definition.name));
      return unknown_truth(name.span);
    }
    if (open_.size() >= static_cast<std::size_t>(kConditionNestingMax)) {
      error(name.span, "requirement.too-deep", "definitions are nested too deeply");
      return unknown_truth(name.span);
    }
    Arguments inner;
    std::string written = name.text;
    for (std::size_t i = 0; i < name.operands.size(); ++i) {
      ConditionPtr argument =
          visit(name.operands[i], outer, {.compared = true, .where = place.where, .data = place.data});
      written += (i == 0 ? "(" : ", ") + to_text(*argument);
      inner[definition.parameters[i]] = std::move(argument);
    }
    if (!name.operands.empty()) written += ")";
    used_.insert(&definition);
    open_.push_back(&definition);
    ConditionPtr content = visit(definition.content, inner, Place());
    open_.pop_back();
    if (place.where != nullptr) return content;
    auto result = std::make_shared<Condition>();
    result->kind = Kind::kDefined;
    result->text = definition.is_event ? fmt::format("event({})", written) : written;
    result->unit = definition.unit;
    result->operands = {std::move(content)};
    result->span = name.span;
    return result;
  }

  static ConditionPtr unknown_truth(const SourceSpan& span) {
    auto truth = std::make_shared<Condition>();
    truth->span = span;
    truth->number = 1;
    return truth;
  }

  [[nodiscard]] const std::vector<std::string>& names(bool events) const { return names_[events ? 1 : 0]; }

  std::map<std::pair<bool, std::string_view>, const Definition*> definitions_;  // the first of a name
  std::array<std::vector<std::string>, 2> names_;                               // of values, of events
  Diagnostics& diagnostics_;
  std::vector<const Definition*> open_;
  std::set<const Definition*> used_;
  std::size_t parts_ = 0;
};

// What a pattern cannot be asked of.
void check_momentary(const Requirement& requirement, Diagnostics& diagnostics) {
  const auto error = [&](const ConditionPtr& condition, const std::string& message) {
    diagnostics.push_back({Severity::kError, "requirement.momentary", message, condition->span});
  };
  const auto is_event_alone = [](const ConditionPtr& condition) {
    const Condition* inner = condition.get();
    while (inner->kind == Kind::kDefined) inner = inner->operands[0].get();
    return inner->kind == Kind::kEvent || inner->kind == Kind::kUpdated || inner->kind == Kind::kRises ||
           inner->kind == Kind::kFalls;
  };
  if (requirement.pattern == Pattern::kAlways && is_event_alone(requirement.p))
    error(requirement.p, "an event is over at once and cannot hold always; ask for it with \"at least every\"");
  if (requirement.pattern == Pattern::kHoldsFor && is_momentary(*requirement.p))
    error(requirement.p, "an event is over at once and cannot hold for a while");
  if (requirement.scope.kind == Scope::Kind::kWhile && is_momentary(*requirement.scope.open))
    error(requirement.scope.open, "while takes a condition that lasts; after an event, use after … until …");
  if (requirement.assuming && is_momentary(*requirement.assuming))
    error(requirement.assuming, "assuming takes a condition that lasts");
  if ((requirement.pattern == Pattern::kKeepFor || requirement.pattern == Pattern::kKeepUntil) &&
      is_event_alone(requirement.q))
    error(requirement.q, "an event is over at once and cannot be kept");
}

// Names as they are written, before anything is put in for them.
void collect_names(const Condition& condition, std::vector<const Condition*>& names) {
  if (condition.kind == Kind::kName && condition.unit != "event") names.push_back(&condition);
  for (const ConditionPtr& operand : condition.operands) collect_names(*operand, names);
  if (condition.source && condition.source->where) collect_names(*condition.source->where, names);
}

// A parameter that nothing uses is a slip, and a word that is nearly it would stand for itself.
void check_parameters(const RequirementFile& file, Diagnostics& diagnostics) {
  for (const Definition& definition : file.definitions) {
    if (definition.parameters.empty()) continue;
    std::vector<const Condition*> names;
    collect_names(*definition.content, names);
    const auto is_name = [&](const std::string& text) {
      return std::any_of(names.begin(), names.end(), [&](const Condition* name) { return name->text == text; });
    };
    // Words that nobody has given a meaning.
    std::vector<std::string> words;
    for (const Condition* name : names) {
      const bool is_known = std::any_of(file.definitions.begin(), file.definitions.end(),
                                        [&](const Definition& other) { return other.name == name->text; });
      const auto& parameters = definition.parameters;
      if (!is_known && std::find(parameters.begin(), parameters.end(), name->text) == parameters.end())
        words.push_back(name->text);
    }
    for (const std::string& parameter : definition.parameters) {
      if (is_name(parameter)) continue;
      const std::string near(closest(parameter, words));
      const auto slip =
          std::find_if(names.begin(), names.end(), [&](const Condition* name) { return name->text == near; });
      diagnostics.push_back(
          {Severity::kError, "requirement.unused",
           fmt::format("the definition of {}\"{}\" does not use its parameter \"{}\"{}",
                       definition.is_event ? "event " : "", definition.name, parameter,
                       near.empty() ? std::string() : fmt::format("; did you mean it by \"{}\"?", near)),
           slip == names.end() ? definition.span : (*slip)->span});
    }
  }
}

}  // namespace

void resolve_names(RequirementFile& file, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.size();
  check_parameters(file, diagnostics);
  Resolver resolver(file, diagnostics);
  // Each definition by itself, so that a mistake is told where it is written, used or not. Those with parameters are
  // complete only where they are used.
  std::vector<ConditionPtr> contents;
  for (const Definition& definition : file.definitions) {
    contents.push_back(definition.content);
    if (definition.parameters.empty()) resolver.resolve(contents.back());
  }
  resolver.used().clear();
  for (Requirement& requirement : file.requirements) {
    for (ConditionPtr* condition : {&requirement.scope.open, &requirement.scope.close, &requirement.p, &requirement.q,
                                    &requirement.r, &requirement.assuming}) {
      resolver.resolve(*condition);
    }
    check_momentary(requirement, diagnostics);
    if (requirement.pattern == Pattern::kAtMost && requirement.bound && requirement.bound->unit != Bound::Unit::kTime &&
        requirement.times > kCountedTimesMax) {
      diagnostics.push_back(
          {Severity::kError, "requirement.bound",
           fmt::format("at most {} times can be counted per ticks or events, which are kept one by one; use a time",
                       kCountedTimesMax),
           requirement.bound->span});
    }
  }
  for (std::size_t i = 0; i < contents.size(); ++i) {
    Definition& definition = file.definitions[i];
    definition.is_used = resolver.used().contains(&definition);
    definition.content = std::move(contents[i]);
  }
  // The same mistake, reached through every use of its definition, is told once.
  const Diagnostics found(diagnostics.begin() + static_cast<std::ptrdiff_t>(before), diagnostics.end());
  diagnostics.resize(before);
  ToldOnce().append(found, diagnostics);
}

Loaded<RequirementFile> parse_requirements(std::string_view source, const std::string& file) {
  std::vector<RequirementParts> parts;
  return parse_requirements(source, file, parts);
}

Loaded<RequirementFile> parse_requirements(std::string_view source, const std::string& file,
                                           std::vector<RequirementParts>& parts) {
  Loaded<RequirementFile> loaded;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (source.starts_with(kByteOrderMark)) source.remove_prefix(kByteOrderMark.size());
  if (source.size() > kRequirementBytesMax) {
    loaded.diagnostics.push_back({Severity::kError, "requirement.too-large",
                                  fmt::format("a requirement file has at most {} bytes", kRequirementBytesMax),
                                  SourceSpan{file, 0, 0, 0}});
    return loaded;
  }
  // It goes into a chart, which is XML.
  if (const auto unreadable = text::first_unreadable(source)) {
    const LineIndex::Position place = LineIndex(source).position(unreadable->first);
    loaded.diagnostics.push_back(
        {Severity::kError, "requirement.encoding", unreadable->second, SourceSpan{file, place.line, place.column, 1}});
    return loaded;
  }
  RequirementFile result;
  result.file = file;
  auto tokens = lex_requirements(source, result.file, loaded.diagnostics);
  if (has_errors(loaded.diagnostics)) return loaded;
  RequirementParser parser(std::move(tokens), loaded.diagnostics);
  parser.run(result);
  parts = std::move(parser.parts());
  if (!has_errors(loaded.diagnostics)) resolve_names(result, loaded.diagnostics);
  sort_by_place(loaded.diagnostics);
  if (!has_errors(loaded.diagnostics)) loaded.value = std::move(result);
  return loaded;
}

}  // namespace sentree::monitor
