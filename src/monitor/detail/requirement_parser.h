#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/monitor/requirement.h"
#include "sentree/monitor/requirement_lexer.h"
#include "sentree/monitor/requirement_parts.h"

namespace sentree::monitor {

/// Reads tokens into definitions and requirements whose names are not resolved yet. Recursive descent; the work behind
/// `parse_requirements`, together with `resolve_names`.
class RequirementParser {
 public:
  RequirementParser(std::vector<RequirementToken> tokens, Diagnostics& diagnostics)
      : tokens_(std::move(tokens)), diagnostics_(diagnostics) {}

  void run(RequirementFile& file);
  /// By requirement.
  [[nodiscard]] std::vector<RequirementParts>& parts() { return parts_; }

 private:
  using Token = RequirementToken;

  // Statements.
  void definition(RequirementFile& file);
  void requirement(RequirementFile& file);
  void attributes(Requirement& requirement);
  void scope(Requirement& requirement);
  void body(Requirement& requirement);
  void whenever(Requirement& requirement);
  void after_condition(Requirement& requirement);
  Bound bound();
  void recover();
  /// Keeps where the words since `from` stand.
  void mark(RequirementPart::Role role, std::size_t from);
  ConditionPtr part(RequirementPart::Role role, int precedence = 1);
  Bound bound_part();

  // Conditions.
  ConditionPtr condition() { return binary(1); }
  ConditionPtr binary(int precedence);
  ConditionPtr unary();
  ConditionPtr postfix();
  ConditionPtr primary();
  ConditionPtr number();
  std::string unit();
  ConditionPtr event();
  ConditionPtr named(const Token& name);
  Source source();
  [[nodiscard]] bool at_source() const;
  ConditionPtr make(Condition::Kind kind, const SourceSpan& span, std::vector<ConditionPtr> operands = {});

  // Tokens.
  [[nodiscard]] const Token& peek(std::size_t ahead = 0) const;
  const Token& take();
  [[nodiscard]] bool is_word(std::string_view word) const;
  [[nodiscard]] bool is_symbol(std::string_view symbol) const;
  bool accept_word(std::string_view word);
  bool accept_symbol(std::string_view symbol);
  [[nodiscard]] std::string word_hint() const;
  void expect_word(std::string_view word);
  void expect_symbol(std::string_view symbol, std::string_view what);
  std::string expect_name(std::string_view what);
  /// One error a statement; what follows is skipped.
  void error(std::string message);
  void error_at(const SourceSpan& span, std::string code, std::string message);

  std::vector<Token> tokens_;
  std::map<std::pair<bool, std::string>, int> defined_;  // events and values, with their lines
  Diagnostics& diagnostics_;
  RequirementParts marked_;  // of the requirement that is being read
  std::vector<RequirementParts> parts_;
  std::size_t at_ = 0;
  bool failed_ = false;
  int depth_ = 0;
};

/// Puts definitions in where their names stand and turns the other names into words; reports names that are nothing.
void resolve_names(RequirementFile& file, Diagnostics& diagnostics);

}  // namespace sentree::monitor
