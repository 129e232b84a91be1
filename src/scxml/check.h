#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/scxml/chart.h"

namespace sentree::scxml {

struct CheckOptions {
  /// Events that can come from outside, as full names; what is handled but neither here nor sent by the chart is
  /// reported. Not given: anything can come from outside.
  std::optional<std::vector<std::string>> external_events;
  /// Events that the chart sends to itself for its surroundings to see; no transition need handle them.
  std::vector<std::string> seen_outside = {};
};

/// What a loaded chart has that cannot work, or does nothing, by place.
///
/// Errors: scxml.expression-syntax (also of scripts and of charts inside <invoke>). Warnings: scxml.unreachable-state,
/// scxml.transition-never-taken, scxml.endless-transition, scxml.event-not-handled, scxml.event-not-sent,
/// scxml.unknown-target, scxml.unused-data, scxml.unreadable-data, scxml.unreadable-chart (of an <invoke>),
/// scxml.unknown-name (`console`, `Object.values`, …), scxml.unknown-data (parameters of an <invoke>),
/// scxml.unknown-state (In of a state that is not there). Cost: O(size) and, for charts with expressions that are not
/// simple, one JavaScript heap (about 2 ms).
[[nodiscard]] Diagnostics check(const Chart& chart, const CheckOptions& options = {});

}  // namespace sentree::scxml
