#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/model.h"

namespace sentree::scxml {

/// How expressions of a chart are evaluated, for one session during one step (SCXML 5). A failure is what raises
/// error.execution; its message goes into `_event.data.message`.
class DataModel {
 public:
  virtual ~DataModel() = default;

  /// What `_event` is from now on; borrowed until the next call. Null: undefined.
  virtual void set_event(const Event* event) = 0;

  virtual Result<bool> condition(ExpressionId id) = 0;
  /// As messages hold it: functions and undefined members are left out. Nothing: undefined.
  virtual Result<std::optional<Value>> evaluate(ExpressionId id) = 0;
  /// One that is not part of the chart.
  virtual Result<std::optional<Value>> evaluate(std::string_view expression) = 0;
  /// The value as a script would print it.
  virtual Result<std::string> text(ExpressionId id) = 0;
  virtual Result<void> assign(ExpressionId location, ExpressionId expr) = 0;
  virtual Result<void> assign_value(ExpressionId location, const std::optional<Value>& value) = 0;
  /// Binds a variable of <data>; on failure it is undefined.
  virtual Result<void> bind(std::uint32_t slot, ExpressionId expr) = 0;
  virtual void bind_value(std::uint32_t slot, const std::optional<Value>& value) = 0;
  virtual Result<void> run(ExpressionId script) = 0;
  /// Calls `body` for each item of a shallow copy of the array, until it returns false.
  virtual Result<void> for_each(const Foreach& loop, const std::function<bool()>& body) = 0;
  /// The end of the step: the session holds all data again.
  virtual void finish() = 0;
};

}  // namespace sentree::scxml
