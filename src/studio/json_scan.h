#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace sentree::studio {

// A look into JSON text that makes no values of it: for the many messages of a recording of which little is wanted.
// Texts are views into the source, as written. Of text that is no JSON, something is found or nothing; nothing bad
// happens.

/// Walks over the members of an object or the items of an array, in order.
class JsonWalk {
 public:
  explicit JsonWalk(std::string_view container);
  /// Goes to the next one; false: there is none.
  bool next();
  /// Of a member: what stands between its quotes.
  [[nodiscard]] std::string_view name() const { return name_; }
  [[nodiscard]] std::string_view value() const { return value_; }

 private:
  std::string_view rest_;
  std::string_view name_;
  std::string_view value_;
  bool is_object_ = false;
  bool first_ = true;
};

/// The member of that name; empty if there is none. Cost: O(what comes before it).
[[nodiscard]] std::string_view member(std::string_view object, std::string_view name);

/// What a string stands for; other values as written.
[[nodiscard]] std::string unquoted(std::string_view value);
/// What stands between the quotes of a string, else the text as written: for comparing names.
[[nodiscard]] std::string_view inside(std::string_view value);
[[nodiscard]] std::optional<double> as_number(std::string_view value);
[[nodiscard]] std::optional<std::int64_t> as_integer(std::string_view value);

}  // namespace sentree::studio
