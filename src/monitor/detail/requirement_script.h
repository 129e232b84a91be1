#pragma once

#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/monitor/requirement.h"
#include "sentree/monitor/requirement_types.h"

namespace sentree::monitor {

/// An ECMAScript expression and how tightly it binds.
struct Js {
  std::string text;
  int binding = 0;
};

[[nodiscard]] Js js_and(const Js& a, const Js& b);
[[nodiscard]] Js js_or(const Js& a, const Js& b);
[[nodiscard]] Js js_not(const Js& a);
[[nodiscard]] inline Js js_true() { return {"true", 9}; }
[[nodiscard]] inline Js js_false() { return {"false", 9}; }
[[nodiscard]] bool is_true(const Js& js);
[[nodiscard]] bool is_false(const Js& js);

/// Whether it reads the datum of that name. (Or a text has that word.)
[[nodiscard]] bool reads(const Js& js, std::string_view name);

/// Words of a condition as a name: "level < 30" is level_below_30.
[[nodiscard]] std::string slug(const Condition& condition, std::size_t length_max = 40);

/// Translates the conditions of one requirement to expressions over the data of its chart, and collects those data.
///
/// Of each condition there are two expressions, since it has three values: one that is true where it is known to hold,
/// one where it is known not to. Data that are not set yet are undefined and make both false.
class Script {
 public:
  /// A <data> that observations set.
  struct Variable {
    std::string name;
    std::string shown;            ///< What it is in the requirement's words.
    std::string assigned;         ///< Expression over _event.data; empty: a flag.
    int binding = 9;              ///< Of that expression.
    std::vector<Source> sources;  ///< Which set it; of a flag: which raise it.
    [[nodiscard]] bool is_flag() const { return assigned.empty(); }
  };
  /// A <data> that remembers a condition from before the present observation.
  struct Before {
    std::string name;
    std::string expression;
    std::string shown;
  };

  /// @param present  The name of an observation. If any, expressions are over that itself: of an observation of that
  ///                 name that is one of the requirement's (`present`), values and events are looked at in its data.
  Script(const Requirement& requirement, const Typing& typing, std::string_view present = {});

  [[nodiscard]] Js holds(const ConditionPtr& condition) { return truth(*condition, true); }
  [[nodiscard]] Js fails(const ConditionPtr& condition) { return truth(*condition, false); }
  /// As `holds`, of the values before the present observation.
  [[nodiscard]] Js held_before(const ConditionPtr& condition);
  /// Which observations of its name the source means.
  [[nodiscard]] Js filter(const Source& source);
  /// Whether an observation of that name is one of the requirement's.
  [[nodiscard]] Js is_meant(const std::string& observation);
  /// Whether the variable's sources are among the observations of that name, of which it is known that they are meant.
  [[nodiscard]] Js is_set(const Variable& variable, const std::string& observation);
  /// A name that nothing else in the chart has.
  [[nodiscard]] std::string unique(std::string name);

  [[nodiscard]] const std::deque<Variable>& variables() const { return variables_; }
  [[nodiscard]] const std::vector<Before>& before() const { return before_; }

 private:
  void name_values(const Condition& condition);
  [[nodiscard]] Js truth(const Condition& condition, bool wanted);
  [[nodiscard]] Js compare(const Condition& condition, bool wanted);
  [[nodiscard]] Js equal(const Condition& condition, bool wanted);
  [[nodiscard]] Js value(const Condition& condition);
  [[nodiscard]] const Variable& variable(const Condition& value, std::string_view name);
  [[nodiscard]] const Variable* merged(const Condition& defined);
  [[nodiscard]] const Variable& flag(const Condition& event, std::string_view name);
  [[nodiscard]] Js before(const Condition& condition, bool wanted);
  [[nodiscard]] DataType type_of(const Condition& condition) const;
  [[nodiscard]] static std::string raw(const Condition& value);
  [[nodiscard]] Js guard(const Condition& value) const;
  [[nodiscard]] static Js holders(const Condition& value);
  [[nodiscard]] Js at_present(const Variable& variable, const Js& expression);
  [[nodiscard]] Js is_there(const Condition& c) const;

  const Requirement& requirement_;
  const Typing& typing_;
  const std::string present_;
  std::deque<Variable> variables_;  // others are added while one is used
  std::vector<Before> before_;
  std::map<std::string, std::size_t> known_;  // variable by what it stands for
  std::map<std::string, std::string> before_known_;
  std::vector<std::string> taken_;
  std::string where_key_;
};

}  // namespace sentree::monitor
