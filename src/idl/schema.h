#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"

namespace sentree::idl {

/// Files that one schema may be made of, and `include`s inside `include`s.
inline constexpr std::size_t kFilesMax = 256;
inline constexpr int kIncludeNestingMax = 32;
/// Types inside types and constants inside constants, as written in a file.
inline constexpr int kSyntaxNestingMax = 64;
/// Bytes of one file.
inline constexpr std::size_t kFileSizeMax = 4U << 20U;

enum class Kind : std::uint8_t {
  kVoid,
  kBool,
  kI8,
  kI16,
  kI32,
  kI64,
  kDouble,
  kString,
  kBinary,
  kEnum,
  kStruct,
  kList,
  kSet,
  kMap
};

struct Enum;
struct Struct;

/// A type with its typedefs followed. Lives in its `Schema`.
struct Type {
  Kind kind = Kind::kVoid;
  std::string name;                   ///< As messages show it: "i64", "list<Pose2D>", "geometry.Pose2D".
  const Enum* enumeration = nullptr;  ///< kEnum.
  const Struct* structure = nullptr;  ///< kStruct: struct, union or exception.
  const Type* key = nullptr;          ///< kMap.
  const Type* element = nullptr;      ///< kList, kSet; of kMap the value.
};

struct Enumerator {
  std::string name;
  std::int32_t number = 0;
  SourceSpan span;
};

struct Enum {
  std::string name;
  std::vector<Enumerator> enumerators;  ///< In the order written.
  SourceSpan span;

  [[nodiscard]] const Enumerator* find(std::string_view enumerator) const;  ///< Null: no such name.
  [[nodiscard]] const Enumerator* find(std::int64_t number) const;          ///< The first of that number, or null.
};

enum class Requiredness : std::uint8_t { kDefault, kRequired, kOptional };

struct Field {
  std::int16_t id = 0;
  std::string name;
  Requiredness requiredness = Requiredness::kDefault;
  const Type* type = nullptr;
  std::optional<Value> default_value;  ///< As written in the IDL, normalised to the type.
  /// What a reader of the wire takes for an absent field, as generated code does: the default, else the type's zero.
  /// Nothing for an optional field without default, and for a type that contains itself.
  std::optional<Value> when_absent;
  std::string unit;  ///< As the annotation (unit = "%") says; empty: none.
  /// A number's bounds, inclusive: annotations (min = "0", max = "1"), else those of a share: % from 0 to 100, ratio
  /// from 0 to 1. What crosses the wire is not held to them; constants in files and commands are, see `check_ranges`.
  std::optional<double> min;
  std::optional<double> max;
  SourceSpan span;
};

enum class StructKind : std::uint8_t { kStruct, kUnion, kException };

struct Struct {
  std::string name;
  StructKind kind = StructKind::kStruct;
  std::vector<Field> fields;  ///< In the order written.
  SourceSpan span;

  [[nodiscard]] const Field* find(std::string_view field) const;
  [[nodiscard]] std::vector<std::string> field_names() const;
};

struct Method {
  std::string name;
  std::string service;  ///< The service that declares it: the base's name where it is inherited.
  Struct arguments;
  const Type* result = nullptr;   ///< Kind::kVoid if there is none.
  std::vector<Field> exceptions;  ///< The `throws` clause; each of type kStruct.
  bool oneway = false;
  std::string unit;         ///< Of the result, as the annotation (unit = "%") says; empty: none.
  bool idempotent = false;  ///< Asked twice it does what it does asked once: annotation (idempotent = "true").
  SourceSpan span;
};

/// A service with what it inherits.
struct Service {
  std::string name;
  const Service* base = nullptr;
  std::vector<const Method*> methods;  ///< Own ones first, then the base's.
  SourceSpan span;
  std::deque<Method> own_methods;

  [[nodiscard]] const Method* find(std::string_view method) const;  ///< Own before inherited; null: none.
  [[nodiscard]] std::vector<std::string> method_names() const;
};

/// A service that keeps its schema alive, so that clients and servers can outlive whoever loaded it.
using ServicePtr = std::shared_ptr<const Service>;

struct Constant {
  std::string name;
  const Type* type = nullptr;
  Value value;  ///< Normalised to the type.
  SourceSpan span;
};

struct Typedef {
  std::string name;
  const Type* type = nullptr;
  SourceSpan span;
};

/// What an include line names, found and read.
struct IncludedFile {
  std::string file;  ///< As messages show it; the same file must get the same name each time.
  std::string source;
};

/// Finds the file that `include "path"` in `from` means. An error's message is shown at the include line.
using IncludeReader = std::function<Result<IncludedFile>(std::string_view path, std::string_view from)>;

/// A Thrift IDL file with everything that it includes, checked. Immutable; a copy shares it. Thread-safe.
///
/// Names of the file itself are plain ("Battery"); those of an included file `geometry.thrift` carry its name
/// ("geometry.Pose2D"), as they do in the IDL. What pointers point to lives as long as any copy of the schema or any
/// `ServicePtr` of it.
class Schema {
 public:
  /// Reads the grammar of the Thrift compiler 0.17: what it accepts is accepted (its warnings are ours), what it
  /// refuses is refused, each with line and column. Bounds: `kFilesMax` and its neighbours.
  ///
  /// Codes: idl.syntax, idl.unknown-type, idl.unknown-service, idl.unknown-constant, idl.duplicate, idl.constant-type,
  /// idl.number-range, idl.not-an-exception, idl.include, idl.include-cycle, idl.too-deep, idl.too-large,
  /// idl.unsupported; warnings idl.field-id, idl.deprecated.
  /// Cost: O(size), about 20 ms a megabyte.
  [[nodiscard]] static Loaded<Schema> load(std::string_view source, const std::string& file,
                                           const IncludeReader& include = {});

  /// Null if there is none of that name.
  [[nodiscard]] ServicePtr service(std::string_view name) const;
  [[nodiscard]] const Struct* structure(std::string_view name) const;  ///< Struct, union or exception.
  [[nodiscard]] const Enum* enumeration(std::string_view name) const;
  [[nodiscard]] const Constant* constant(std::string_view name) const;
  [[nodiscard]] const Type* type(std::string_view name) const;  ///< Any named type, typedefs followed.

  [[nodiscard]] const std::deque<Service>& services() const;  ///< Of the file, not of its includes.
  [[nodiscard]] const std::deque<Struct>& structures() const;
  [[nodiscard]] const std::deque<Enum>& enumerations() const;
  [[nodiscard]] const std::deque<Typedef>& typedefs() const;
  [[nodiscard]] std::vector<std::string> service_names() const;
  [[nodiscard]] const std::string& file() const;
  /// The file and all it includes, as named by the reader.
  [[nodiscard]] std::vector<std::string> files() const;

  struct Program;  ///< One file, resolved; private to the library.

 private:
  explicit Schema(std::shared_ptr<const Program> program) : program_(std::move(program)) {}
  std::shared_ptr<const Program> program_;
};

}  // namespace sentree::idl
