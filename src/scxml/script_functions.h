#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace sentree::scxml {

/// What the functions that a chart's own scripts leave behind may keep from call to call. A session holds data, and no
/// functions: when it is restored the scripts are executed again, and what a closure kept is as in the beginning.
struct ScriptFunctions {
  /// Why a function need not be the same once the scripts have been executed again, and where that is written.
  struct Reason {
    std::string what;        ///< `keeps "n" between its calls`
    std::size_t script = 0;  ///< Which of the scripts.
    int line = 0;            ///< In it, from 0.
  };

  /// By global names that the scripts bind; nothing: the function is the same. It is written at the top level and
  /// outside of conditions, so that there is nothing beside it but global variables; or what it takes from functions
  /// around it never changes and comes from no data.
  std::map<std::string, std::optional<Reason>, std::less<>> by_name;
  /// Of functions with other names.
  Reason others;
  /// Those with which something else is done somewhere than calling them, so that they may be given properties.
  std::set<std::string, std::less<>> given;
  /// Any may be among these.
  bool all_given = false;
};

/// What cannot be told has a reason. `is_data(name)`: it is a variable of a <datamodel>. `others`: all expressions
/// elsewhere in the chart. Cost: O(size × nesting of functions).
[[nodiscard]] ScriptFunctions look_into_functions(const std::vector<std::string_view>& scripts,
                                                  const std::vector<std::string_view>& others,
                                                  const std::function<bool(std::string_view)>& is_data);

}  // namespace sentree::scxml
