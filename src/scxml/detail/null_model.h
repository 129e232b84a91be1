#pragma once

#include "sentree/scxml/detail/data_model.h"

namespace sentree::scxml {

class Interpreter;

/// SCXML B.1: conditions are In(id), and there are no data.
class NullModel final : public DataModel {
 public:
  explicit NullModel(const Interpreter& interpreter) : interpreter_(interpreter) {}

  void set_event(const Event*) override {}
  Result<bool> condition(ExpressionId id) override;
  Result<std::optional<Value>> evaluate(ExpressionId id) override;
  Result<std::optional<Value>> evaluate(std::string_view expression) override;
  Result<std::string> text(ExpressionId id) override;
  Result<void> assign(ExpressionId location, ExpressionId expr) override;
  Result<void> assign_value(ExpressionId location, const std::optional<Value>& value) override;
  Result<void> bind(std::uint32_t slot, ExpressionId expr) override;
  void bind_value(std::uint32_t, const std::optional<Value>&) override {}
  Result<void> run(ExpressionId script) override;
  Result<void> for_each(const Foreach& loop, const std::function<bool()>& body) override;
  void finish() override {}

 private:
  [[nodiscard]] tl::unexpected<Diagnostic> no_expressions(ExpressionId id) const;

  const Interpreter& interpreter_;
};

}  // namespace sentree::scxml
