#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"

namespace sentree::idl {

/// Lists, maps and structs inside each other that a value may have.
inline constexpr int kValueNestingMax = 64;
/// Largest integer up to which every integer is a double, so a script's number.
inline constexpr std::int64_t kExactInDouble = std::int64_t{1} << 53;

/// Values and types, in both directions:
///   bool ↔ bool · i8…i64 ↔ int (an integral double or decimal text is accepted) · double ↔ double (an int or
///   "NaN", "Infinity", "-Infinity" is accepted) · string ↔ string · binary ↔ bytes (a string is accepted) · enum ↔ its
///   enumerator's name (a number is accepted; one without a name stays an int) · list, set ↔ list (a set's duplicates
///   are dropped) · map with string keys ↔ map · map with other keys ↔ list of [key, value] · struct, exception ↔ map
///   in the order of the fields, absent optional fields left out · union ↔ map with one entry.
///
/// Checks `value` and brings it into that form; fields with a default are filled in, an absent field without one
/// is an error unless it is optional (null counts as absent).
/// Errors: idl.wrong-type, idl.out-of-range, idl.missing, idl.unknown-name, idl.union, idl.too-deep; the message
/// begins with `what` and the path: `result.pose.x: expected double, got string "abc"`.
[[nodiscard]] Result<Value> conform(const Type& type, Value value, std::string_view what);

/// The same for the arguments of a call: a map of names (null counts as empty). Messages read
/// `argument "goal_id" of Navigation.stopNavigation: expected i64, got string "abc"`.
[[nodiscard]] Result<Value> conform_arguments(const Method& method, Value arguments);

/// The same for what a method throws: a map of one entry, the fields of an exception of its `throws` under the name of
/// its type. Errors also: idl.unknown-name.
[[nodiscard]] Result<Value> conform_exception(const Method& method, Value exception);

/// Whether the numbers in `value`, which conforms, are within the bounds that the IDL gives to the fields of `type`
/// (`Field::min`, `Field::max`). For constants of people: a robot may measure what it likes.
/// Errors: idl.out-of-range; the message begins with `what` and the path.
[[nodiscard]] Result<void> check_ranges(const Type& type, const Value& value, std::string_view what);
/// The same of one field, or argument, itself.
[[nodiscard]] Result<void> check_ranges(const Field& field, const Value& value, std::string_view what);
/// The same of the arguments of a call.
[[nodiscard]] Result<void> check_ranges(const Method& method, const Value& arguments);

/// True if `value` is in the form that `conform` makes, so that it need not be copied. No messages, no allocation.
[[nodiscard]] bool conforms(const Type& type, const Value& value);
[[nodiscard]] bool conforms_arguments(const Method& method, const Value& arguments);

/// An argument as a file gives it: its value only where it is constant.
struct WrittenArgument {
  std::string name;
  std::optional<Value> value;  ///< Nothing: known when the call is made.
  SourceSpan span;
};

/// Everything that is wrong with a call as far as it can be seen without running it: unknown and missing
/// arguments, constants of the wrong type or out of range. `at` is the place of the call. Codes as `conform`;
/// idl.duplicate.
[[nodiscard]] Diagnostics check_arguments(const Method& method, const std::vector<WrittenArgument>& arguments,
                                          const SourceSpan& at);

/// The method, or idl.unknown-method with the nearest name; `service_shown` is the name the user knows it by.
[[nodiscard]] Result<const Method*> find_method(const Service& service, std::string_view method,
                                                std::string_view service_shown, const SourceSpan& at = {});
/// The service, or idl.unknown-service with the nearest name.
[[nodiscard]] Result<ServicePtr> find_service(const Schema& schema, std::string_view service,
                                              const SourceSpan& at = {});

/// For scripts, whose numbers are doubles: integers beyond 2^53 become decimal text, everything else stays.
[[nodiscard]] Value for_script(Value value);

/// Keeps the first of equal items, as a set has it. O(items).
void drop_duplicates(List& items);
/// Keeps the last of the [key, value] pairs of equal key, as a map has it. O(pairs).
void drop_duplicate_keys(List& pairs);

/// "name(1: string name, 2: double tolerance): ReturnCode", for help and completion.
[[nodiscard]] std::string signature(const Method& method);

}  // namespace sentree::idl
