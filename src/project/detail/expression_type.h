#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/monitor/requirement_types.h"
#include "sentree/scxml/script_syntax.h"

// What the expressions of charts can be, and what in them cannot be meant.

namespace sentree::project {

/// A type that many expressions share: those of interfaces are large.
class Form {
 public:
  explicit Form(monitor::DataType type) : type_(std::make_shared<const monitor::DataType>(std::move(type))) {}
  /// A part of another, which lives on with it.
  Form(const Form& whole, const monitor::DataType& part) : type_(whole.type_, &part) {}
  operator const monitor::DataType&() const { return *type_; }  // NOLINT(google-explicit-constructor)
  const monitor::DataType* operator->() const { return type_.get(); }

 private:
  std::shared_ptr<const monitor::DataType> type_;
};

/// What an expression can be, as far as it can be told.
struct ExpressionType {
  bool open = true;         ///< Or anything else.
  std::vector<Form> forms;  ///< One of these.
};

[[nodiscard]] ExpressionType of(Form form);
[[nodiscard]] ExpressionType of(monitor::DataType type);
/// Or what `other` is.
void join(ExpressionType& into, const ExpressionType& other);

/// What a list holds, or a map under any name: nothing of it need be there.
[[nodiscard]] ExpressionType items_of(const ExpressionType& collection);

/// What the names of an expression mean.
struct ExpressionScope {
  const std::map<std::string, ExpressionType, std::less<>>* names = nullptr;  ///< Declared.
  bool open = false;                                                          ///< There may be others.
  const std::set<std::string>* functions = nullptr;                           ///< That a run offers; null: none.
  std::optional<ExpressionType> event;                                        ///< `_event.data`.
};

/// What an expression is, with what in it cannot be meant, as `check_expressions` says.
/// @param span         Where it is.
/// @param diagnostics  Null: nothing is told.
[[nodiscard]] ExpressionType read_expression(const scxml::ScriptTree& tree, const ExpressionScope& scope,
                                             const SourceSpan& span, Diagnostics* diagnostics, bool is_condition);

}  // namespace sentree::project
