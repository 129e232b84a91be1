// How a session's data get into its heap and out of it.

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/scxml/detail/duktape.h"
#include "sentree/scxml/detail/script_protect.h"
#include "sentree/scxml/script_heap.h"
#include "sentree/scxml/script_values.h"

namespace sentree::scxml {

Result<void> ScriptHeap::write(std::uint32_t slot, const std::optional<Value>& value) {
  return protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, global_);
    push_text(ctx, model_.variables[slot].id);
    if (value)
      push_value(ctx, *value, make_dom_);
    else
      duk_push_undefined(ctx);
    duk_put_prop(ctx, -3);
  });
}

bool ScriptHeap::read_primitive(std::uint32_t slot, ScriptValue& value) {
  bool primitive = true;
  const auto done = protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, global_);
    push_text(ctx, model_.variables[slot].id);
    duk_get_prop(ctx, -2);
    switch (duk_get_type(ctx, -1)) {
      case DUK_TYPE_UNDEFINED: value = {}; break;
      case DUK_TYPE_NULL: value = ScriptValue::null(); break;
      case DUK_TYPE_BOOLEAN: value = ScriptValue::of(duk_get_boolean(ctx, -1) != 0); break;
      case DUK_TYPE_NUMBER: value = ScriptValue::of(static_cast<double>(duk_get_number(ctx, -1))); break;
      default: primitive = false;
    }
  });
  return done.has_value() && primitive;
}

Result<void> ScriptHeap::write_globals(const Map& globals) {
  return protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, global_);
    for (const auto& [name, value] : globals) {
      push_text(ctx, name);
      push_value(ctx, value, make_dom_);
      duk_put_prop(ctx, -3);
    }
  });
}

Result<void> ScriptHeap::keep_functions() {
  functions_.clear();
  return protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, global_);
    duk_enum(ctx, -1, DUK_ENUM_OWN_PROPERTIES_ONLY);
    while (duk_next(ctx, -1, 1)) {
      if (duk_is_function(ctx, -1)) {
        functions_.emplace_back(std::string(), duk_get_heapptr(ctx, -1));
        append_text(ctx, -2, functions_.back().first);
      }
      duk_pop_2(ctx);
    }
  });
}

Result<void> ScriptHeap::read_all(std::vector<std::optional<Value>>& variables, Map& globals) {
  ValueReader reader;
  reader.mode = ValueReader::Mode::kState;
  std::string name;
  std::string culprit;
  const auto read = [&](duk_context* ctx, Value& out) {
    const bool known = std::any_of(functions_.begin(), functions_.end(), [&](const auto& f) {
      return f.second == duk_get_heapptr(ctx, -1) && f.first == name;
    });
    if (known) return false;
    const bool defined = reader.read(ctx, -1, out);
    if (!reader.failure.empty() && culprit.empty()) culprit = name;
    return defined;
  };
  globals = Map();
  Value value;
  auto done = protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, global_);
    for (std::uint32_t slot = 0; slot < model_.variables.size(); ++slot) {
      name = model_.variables[slot].id;
      push_text(ctx, name);
      duk_get_prop(ctx, -2);
      if (read(ctx, value))
        variables[slot] = std::move(value);
      else
        variables[slot].reset();
      duk_pop(ctx);
    }
    duk_enum(ctx, -1, DUK_ENUM_OWN_PROPERTIES_ONLY);
    while (duk_next(ctx, -1, 1)) {
      name.clear();
      append_text(ctx, -2, name);
      if (!model_.slots.contains(name)) {
        const bool function = duk_is_function(ctx, -1) != 0;
        if (read(ctx, value))
          globals[name] = std::move(value);
        else if (!function)
          globals[name] = Map{{"$undefined", true}};
      }
      duk_pop_2(ctx);
    }
  });
  if (!done) return done;
  if (!reader.failure.empty())
    return fail("scxml.no-value-form", fmt::format("\"{}\" holds {}, which cannot be saved", culprit, reader.failure));
  return {};
}

}  // namespace sentree::scxml
