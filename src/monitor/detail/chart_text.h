#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/monitor/detail/requirement_script.h"
#include "sentree/monitor/synthesis.h"

namespace sentree::monitor {

/// `<assign location="…" expr="…"/>`.
[[nodiscard]] std::string assign(const std::string& location, const std::string& expression);
/// An XML comment that says `text`.
[[nodiscard]] std::string comment(std::string text);
/// As the `delay` of a `<send>`, exact to the nanosecond.
[[nodiscard]] std::string delay(Duration time);

/// A condition as an attribute, with a space before it; nothing if it is true.
[[nodiscard]] std::string condition_attribute(const Js& condition);

/// A transition of a chart that is written from a requirement.
struct Edge {
  std::string event;
  Js condition;
  std::string target;  ///< Empty: it stays.
  std::vector<std::string> actions;
};

/// Its `<transition>`, behind `indent`.
[[nodiscard]] std::string edge_text(const Edge& edge, std::string_view indent);

/// A state of one.
struct ChartState {
  std::string id;
  Situation::Role role = Situation::Role::kWatching;
  std::string says;
  bool bounded = false;  ///< The requirement's bound runs while it is active.
  std::vector<std::string> on_exit;
  std::vector<Edge> edges;
  std::vector<std::string> on_entry;
  bool begins_anew = true;  ///< The bound, whenever it is entered.
};

/// Its `<state>`.
/// @param deadline  After which "deadline" comes.
/// @param counted   The datum that counts while it is active; may be empty.
[[nodiscard]] std::string state_text(const ChartState& state, std::optional<Duration> deadline,
                                     const std::string& counted);

}  // namespace sentree::monitor
