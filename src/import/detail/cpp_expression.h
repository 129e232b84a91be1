#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/idl/schema.h"
#include "sentree/import/detail/cpp_lexer.h"

namespace sentree::import {

/// What names in C++ snippets and conditions mean.
struct Names {
  struct Remote {
    std::string service;     ///< Its name in sentree.yaml.
    idl::ServicePtr schema;  ///< Null: no interface file defines it.
  };
  std::map<std::string, Remote> remotes;  ///< By the variable through which a snippet calls.
  std::set<std::string> data;
  std::set<std::string> integers;     ///< Those data that are of an integer type.
  std::set<std::string> enumerators;  ///< Of all interface files.
};

/// A call of a service as an expression has it.
struct RemoteCall {
  std::string variable;  ///< Through which the snippet calls.
  std::string service;
  std::string method;
  std::vector<std::pair<std::string, std::string>> arguments;  ///< Name and ECMAScript expression.
  bool has_result = true;
};

/// The ECMAScript of a C++ expression.
struct Expression {
  std::string text;
  bool divides_integers = false;  ///< '/' between integers: C++ drops the rest, ECMAScript does not.
};

/// Enumerators become their names as text, casts and `std::string(…)` fall away, `->` is `.`; names must be known.
/// An error says what has no counterpart; its code is import.cpp.
[[nodiscard]] Result<Expression> translate_expression(Tokens tokens, const Names& names);
/// As above, for source text (a condition, an initial value).
[[nodiscard]] Result<Expression> translate_expression(std::string_view source, const Names& names);

/// `variable.method(a, b)` as the whole of `tokens`, or nothing if it is something else. Error: no such method, or
/// other arguments than the interface has.
[[nodiscard]] Result<std::optional<RemoteCall>> translate_call(Tokens tokens, const Names& names);

/// The text in single quotes, as ECMAScript reads it.
[[nodiscard]] std::string script_text(std::string_view text);

}  // namespace sentree::import
