#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/idl/schema.h"

/// The Thrift grammar as written, before names mean anything. Private to the library.
namespace sentree::idl::syntax {

struct TypeUse {
  enum class Form : std::uint8_t { kBase, kNamed, kList, kSet, kMap };
  Form form = Form::kBase;
  Kind base = Kind::kVoid;         ///< kBase.
  std::string name;                ///< kNamed, perhaps with dots.
  std::vector<TypeUse> arguments;  ///< One of kList and kSet, two of kMap.
  SourceSpan span;
};

struct Constant {
  enum class Form : std::uint8_t { kInt, kDouble, kText, kName, kList, kMap };
  Form form = Form::kInt;
  std::int64_t integer = 0;
  double real = 0;
  std::string text;             ///< kText; kName, perhaps with dots.
  std::vector<Constant> items;  ///< kList; kMap: key, value, key, value …
  SourceSpan span;
};

struct Field {
  std::int32_t id = 0;
  Requiredness requiredness = Requiredness::kDefault;
  TypeUse type;
  std::string name;
  std::vector<Constant> value;  ///< One, or none.
  std::string unit;             ///< Annotation (unit = "…").
  std::optional<double> min;    ///< Annotations (min = "…", max = "…").
  std::optional<double> max;
  SourceSpan span;
};

struct Method {
  bool oneway = false;
  TypeUse result;
  std::string name;
  std::vector<Field> arguments;
  std::vector<Field> exceptions;
  std::string unit;
  bool idempotent = false;
  SourceSpan span;
};

struct Definition {
  enum class Form : std::uint8_t { kConst, kTypedef, kEnum, kStruct, kService };
  Form form = Form::kConst;
  std::string name;
  SourceSpan span;
  TypeUse type;    ///< kConst, kTypedef.
  Constant value;  ///< kConst.
  std::vector<Enumerator> enumerators;
  StructKind struct_kind = StructKind::kStruct;
  std::vector<Field> fields;
  std::string base;  ///< kService; empty: none.
  SourceSpan base_span;
  std::vector<Method> methods;
};

struct Include {
  std::string path;
  SourceSpan span;
};

struct File {
  std::vector<Include> includes;
  std::vector<Definition> definitions;
};

/// Parses one file; stops at the first error. Warnings go to `diagnostics` as well.
/// @returns false if there was an error.
[[nodiscard]] bool parse(std::string_view source, const std::string& file, File& out, Diagnostics& diagnostics);

}  // namespace sentree::idl::syntax
