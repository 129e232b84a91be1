#include "sentree/scxml/detail/null_model.h"

#include <fmt/format.h>

#include "sentree/scxml/detail/interpreter.h"

namespace sentree::scxml {

tl::unexpected<Diagnostic> NullModel::no_expressions(ExpressionId id) const {
  return fail("scxml.no-data",
              fmt::format("the null data model cannot evaluate \"{}\"; write datamodel=\"ecmascript\" at <scxml>",
                          interpreter_.chart().model().expressions[id].text));
}

Result<bool> NullModel::condition(ExpressionId id) {
  const NativeCode& code = interpreter_.chart().model().expressions[id].native;
  if (code.empty()) return no_expressions(id);
  const auto state = interpreter_.chart().find(code.strings.front());
  return state && interpreter_.is_active(*state);
}

Result<std::optional<Value>> NullModel::evaluate(ExpressionId id) { return no_expressions(id); }

Result<std::optional<Value>> NullModel::evaluate(std::string_view expression) {
  const NativeCode code = compile_null(expression);
  if (code.empty()) return fail("scxml.no-data", "the null data model can evaluate nothing but In('state')");
  const auto state = interpreter_.chart().find(code.strings.front());
  return Value(state && interpreter_.is_active(*state));
}

Result<std::string> NullModel::text(ExpressionId id) { return no_expressions(id); }
Result<void> NullModel::assign(ExpressionId location, ExpressionId) { return no_expressions(location); }
Result<void> NullModel::assign_value(ExpressionId location, const std::optional<Value>&) {
  return no_expressions(location);
}
Result<void> NullModel::bind(std::uint32_t, ExpressionId expr) { return no_expressions(expr); }
Result<void> NullModel::run(ExpressionId script) { return no_expressions(script); }
Result<void> NullModel::for_each(const Foreach& loop, const std::function<bool()>&) {
  return no_expressions(loop.array);
}

}  // namespace sentree::scxml
