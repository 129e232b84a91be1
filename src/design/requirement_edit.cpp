#include "sentree/design/requirement_edit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "sentree/design/findings.h"
#include "sentree/monitor/requirement_parts.h"

namespace sentree::design {

namespace {

using monitor::Requirement;
using Role = monitor::RequirementPart::Role;
using monitor::Pattern;
using monitor::Scope;

constexpr std::string_view kPlaceholder = "true";

std::string_view name_of(Role role) {
  switch (role) {
    case Role::kScope: return "scope";
    case Role::kOpen: return "open";
    case Role::kClose: return "close";
    case Role::kBody: return "body";
    case Role::kP: return "p";
    case Role::kQ: return "q";
    case Role::kR: return "r";
    case Role::kBound: return "bound";
    case Role::kTimes: return "times";
    case Role::kAssuming: return "assuming";
  }
  return "";
}

std::string_view name_of(Scope::Kind kind) {
  switch (kind) {
    case Scope::Kind::kGlobally: return "globally";
    case Scope::Kind::kBefore: return "before";
    case Scope::Kind::kAfter: return "after";
    case Scope::Kind::kBetween: return "between";
    case Scope::Kind::kAfterUntil: return "after-until";
    case Scope::Kind::kWhile: return "while";
  }
  return "";
}

std::string_view pattern_of(const Requirement& requirement) {
  const bool bounded = requirement.bound.has_value();
  switch (requirement.pattern) {
    case Pattern::kAlways: return "always";
    case Pattern::kNever: return "never";
    case Pattern::kEventually: return bounded ? "eventually-within" : "eventually";
    case Pattern::kRespond: return bounded ? "respond" : "respond-eventually";
    case Pattern::kImmediately: return "immediately";
    case Pattern::kKeepFor: return "keep-for";
    case Pattern::kKeepUntil: return "keep-until";
    case Pattern::kNotFor: return "not-for";
    case Pattern::kPrecedes: return bounded ? "precedes-within" : "precedes";
    case Pattern::kAtLeastEvery: return "at-least-every";
    case Pattern::kAtMost: return bounded ? "at-most-per" : "at-most";
    case Pattern::kHoldsFor: return "holds-for";
  }
  return "";
}

bool begins_with_whenever(std::string_view pattern) {
  static constexpr std::array kPatterns{"respond",  "respond-eventually", "immediately",
                                        "keep-for", "keep-until",         "not-for"};
  return std::find(kPatterns.begin(), kPatterns.end(), pattern) != kPatterns.end();
}

struct Range {
  std::size_t from = 0;
  std::size_t to = 0;
};

// A requirement, and where its parts stand.
class Parts {
 public:
  Parts(std::string_view text, const monitor::RequirementParts& parts) : text_(text) {
    for (const monitor::RequirementPart& part : parts) {
      const std::size_t last = offset_of(text, part.last);
      ranges_.emplace_back(part.role,
                           Range{offset_of(text, part.first), last + static_cast<std::size_t>(part.last.length)});
    }
  }
  [[nodiscard]] const Range* find(Role role) const {
    const auto found = std::find_if(ranges_.begin(), ranges_.end(), [&](const auto& one) { return one.first == role; });
    return found != ranges_.end() ? &found->second : nullptr;
  }
  [[nodiscard]] std::string text(Role role, std::string_view otherwise = kPlaceholder) const {
    const Range* range = find(role);
    return range != nullptr ? std::string(text_.substr(range->from, range->to - range->from)) : std::string(otherwise);
  }
  [[nodiscard]] const std::vector<std::pair<Role, Range>>& all() const { return ranges_; }

 private:
  std::string_view text_;
  std::vector<std::pair<Role, Range>> ranges_;
};

struct Parsed {
  monitor::RequirementFile file;
  std::vector<monitor::RequirementParts> parts;  // by requirement
};

Result<Parsed> parsed(std::string_view text, const std::string& file) {
  Parsed result;
  auto read = monitor::parse_requirements(text, file, result.parts);
  const auto error = std::find_if(read.diagnostics.begin(), read.diagnostics.end(),
                                  [](const Diagnostic& d) { return d.severity == Severity::kError; });
  if (error != read.diagnostics.end()) return tl::unexpected(*error);
  if (!read.value) return fail("design.bad-edit", "the requirements cannot be read");
  result.file = std::move(*read.value);
  return result;
}

// What is written between the trigger and the response: ", robot shall ".
std::string between(std::string_view text, const Parts& parts, std::string_view pattern) {
  if (!begins_with_whenever(pattern)) return ", ";
  const Range* p = parts.find(Role::kP);
  const Range* q = parts.find(Role::kQ);
  std::string words(text.substr(p->to, q->from - p->to));
  for (const std::string_view own : {"keep", "not"}) {
    const std::size_t at = words.rfind(own);
    if (at != std::string::npos && words.find_first_not_of(" \t\r\n", at + own.size()) == std::string::npos)
      return words.substr(0, at);
  }
  return words;
}

// Whether it needs no parentheses behind "not".
bool is_one(std::string_view condition) {
  if (condition.find_first_of(" \t\r\n") == std::string_view::npos) return true;
  int open = 0;
  for (std::size_t i = 0; i < condition.size(); ++i) {
    if (condition[i] == '(') ++open;
    if (condition[i] == ')') --open;
    if (open == 0) return i > 0 && i + 1 == condition.size();
  }
  return false;
}

std::string negated(const std::string& condition) {
  return "not " + (is_one(condition) ? condition : fmt::format("({})", condition));
}

std::string body(std::string_view pattern, std::string_view text, const Parts& parts, std::string_view before) {
  const std::string p = parts.text(Role::kP);
  const std::string q = parts.text(Role::kQ);
  const std::string within = parts.text(Role::kBound, "1 s");
  if (begins_with_whenever(pattern)) {
    const std::string head = fmt::format("whenever {}{}", p, between(text, parts, before));
    if (pattern == "respond") return fmt::format("{}{} within {}", head, q, within);
    if (pattern == "respond-eventually") return fmt::format("{}{} eventually", head, q);
    if (pattern == "immediately") return fmt::format("{}{} immediately", head, q);
    if (pattern == "keep-for") return fmt::format("{}keep {} for {}", head, q, within);
    if (pattern == "keep-until") return fmt::format("{}keep {} until {}", head, q, parts.text(Role::kR));
    return fmt::format("{}{} for {}", head, negated(q), within);
  }
  if (pattern == "always" || pattern == "never" || pattern == "eventually") return fmt::format("{} {}", pattern, p);
  if (pattern == "eventually-within") return fmt::format("eventually {} within {}", p, within);
  if (pattern == "precedes") return fmt::format("{} precedes {}", p, q);
  if (pattern == "precedes-within") return fmt::format("{} precedes {} by at most {}", p, q, within);
  if (pattern == "at-least-every") return fmt::format("{} at least every {}", p, within);
  const std::string times = parts.text(Role::kTimes, "1");
  if (pattern == "at-most") return fmt::format("{} at most {} times", p, times);
  if (pattern == "at-most-per") return fmt::format("{} at most {} times per {}", p, times, within);
  return fmt::format("{} holds for at least {}", p, within);
}

std::string scope_text(std::string_view scope, const Parts& parts) {
  const std::string open = parts.text(Role::kOpen);
  const std::string close = parts.text(Role::kClose);
  if (scope == "before") return "before " + close;
  if (scope == "after") return "after " + open;
  if (scope == "between") return fmt::format("between {} and {}", open, close);
  if (scope == "after-until") return fmt::format("after {} until {}", open, close);
  return scope == "while" ? "while " + open : "";
}

struct Edited {
  Range range;
  std::string text;
  std::string name;
};

class Editor {
 public:
  Editor(std::string_view text, const Parsed& read) : text_(text), read_(read) {}

  Result<Edited> operator()(const SetPart& set) const {
    const auto at = find(set.requirement);
    if (!at) return tl::unexpected(at.error());
    const Parts parts(text_, read_.parts[*at]);
    const std::string name = fmt::format("write {} of {}", set.part, set.requirement);
    const auto found = std::find_if(parts.all().begin(), parts.all().end(),
                                    [&](const auto& one) { return name_of(one.first) == set.part; });
    if (set.part == name_of(Role::kAssuming)) {
      const std::size_t end = parts.find(Role::kBody)->to;
      const Range all{end, found != parts.all().end() ? found->second.to : end};
      return Edited{all, set.text.empty() ? "" : " assuming " + set.text, name};
    }
    if (found == parts.all().end() || found->first == Role::kScope || found->first == Role::kBody)
      return fail("design.no-such-node", fmt::format("{} has no part \"{}\"", set.requirement, set.part));
    if (set.text.find_first_not_of(" \t\r\n") == std::string::npos)
      return fail("design.bad-name", "something has to be said here");
    return Edited{found->second, set.text, name};
  }

  Result<Edited> operator()(const SetScope& set) const {
    const auto at = find(set.requirement);
    if (!at) return tl::unexpected(at.error());
    const Parts parts(text_, read_.parts[*at]);
    const std::string written = scope_text(set.scope, parts);
    if (written.empty() && set.scope != "globally")
      return fail("design.no-such-node", fmt::format("there is no scope \"{}\"", set.scope));
    const std::string name = "scope of " + set.requirement;
    const Range* scope = parts.find(Role::kScope);
    const std::size_t body = parts.find(Role::kBody)->from;
    if (scope == nullptr) return Edited{{body, body}, written.empty() ? "" : written + ", ", name};
    if (written.empty()) return Edited{{scope->from, body}, "", name};
    // "globally" needs no comma behind it.
    const bool has_comma = text_.substr(scope->to, body - scope->to).find(',') != std::string_view::npos;
    return Edited{*scope, written + (has_comma ? "" : ","), name};
  }

  Result<Edited> operator()(const SetPattern& set) const {
    const auto at = find(set.requirement);
    if (!at) return tl::unexpected(at.error());
    if (std::find(patterns().begin(), patterns().end(), set.pattern) == patterns().end())
      return fail("design.no-such-node", fmt::format("there is no pattern \"{}\"", set.pattern));
    const Parts parts(text_, read_.parts[*at]);
    return Edited{*parts.find(Role::kBody), body(set.pattern, text_, parts, pattern_of(read_.file.requirements[*at])),
                  "pattern of " + set.requirement};
  }

 private:
  [[nodiscard]] Result<std::size_t> find(const std::string& name) const {
    const auto& all = read_.file.requirements;
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.name == name; });
    if (found != all.end()) return static_cast<std::size_t>(found - all.begin());
    return fail("design.no-such-node", fmt::format("there is no requirement \"{}\"", name));
  }

  std::string_view text_;
  const Parsed& read_;
};

}  // namespace

const std::vector<std::string>& patterns() {
  static const std::vector<std::string> kPatterns{
      "always",         "never",    "eventually",  "eventually-within", "respond",  "respond-eventually",
      "immediately",    "keep-for", "keep-until",  "not-for",           "precedes", "precedes-within",
      "at-least-every", "at-most",  "at-most-per", "holds-for"};
  return kPatterns;
}

Result<std::vector<Sentence>> sentences_of(std::string_view text, const std::string& file) {
  const auto read = parsed(text, file);
  if (!read) return tl::unexpected(read.error());
  std::vector<Sentence> sentences;
  for (std::size_t i = 0; i < read->file.requirements.size(); ++i) {
    const Requirement& requirement = read->file.requirements[i];
    Sentence sentence{.name = requirement.name,
                      .prose = requirement.prose,
                      .scope = std::string(name_of(requirement.scope.kind)),
                      .pattern = std::string(pattern_of(requirement)),
                      .from = offset_of(text, requirement.span),
                      .to = 0,
                      .parts = {}};
    const Parts parts(text, read->parts[i]);
    for (const auto& [role, range] : parts.all()) {
      sentence.to = std::max(sentence.to, range.to);
      if (role != Role::kScope && role != Role::kBody)
        sentence.parts.push_back({std::string(name_of(role)), range.from, range.to, parts.text(role)});
    }
    sentences.push_back(std::move(sentence));
  }
  return sentences;
}

Result<GestureResult> edit_requirement(std::string_view text, const RequirementGesture& gesture,
                                       const std::string& file) {
  const auto read = parsed(text, file);
  if (!read) return tl::unexpected(read.error());
  auto edited = std::visit(Editor(text, *read), gesture);
  if (!edited) return tl::unexpected(edited.error());
  std::string after(text);
  after.replace(edited->range.from, edited->range.to - edited->range.from, edited->text);
  const auto again = parsed(after, file);
  if (!again) return tl::unexpected(again.error());
  if (again->file.requirements.size() != read->file.requirements.size() ||
      again->file.definitions.size() != read->file.definitions.size())
    return fail("design.bad-edit", "that would be more than a part of one requirement; write it in the text");
  GestureResult result{edits_between(text, after), std::move(edited->name)};
  if (result.edits.empty()) return fail("design.nothing-to-do", "it is so already");
  end_lines_alike(text, result.edits);
  return result;
}

}  // namespace sentree::design
