// How a session's data get into its heap and out of it.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "sentree/scxml/detail/duktape.h"
#include "sentree/scxml/detail/script_heap.h"
#include "sentree/scxml/detail/script_protect.h"
#include "sentree/scxml/detail/script_values.h"
#include "sentree/scxml/script_syntax.h"

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

namespace {

// Objects that functions lead to, beyond which it is not looked any further.
constexpr std::size_t kFunctionMembersMax = 1000;

}  // namespace

Result<void> ScriptHeap::keep_functions() {
  functions_.clear();
  lost_function_.reset();
  kept_members_ = {};
  auto done = protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, global_);
    duk_enum(ctx, -1, DUK_ENUM_OWN_PROPERTIES_ONLY);
    while (duk_next(ctx, -1, 1)) {
      if (duk_is_function(ctx, -1)) {
        functions_.push_back({std::string(), duk_get_heapptr(ctx, -1)});
        append_text(ctx, -2, functions_.back().name);
      }
      duk_pop_2(ctx);
    }
    look_at_members(ctx, kept_members_);
  });
  for (const Kept& function : functions_) {
    const auto known = model_.functions.by_name.find(function.name);
    const auto& reason =
        known == model_.functions.by_name.end() ? std::optional(model_.functions.others) : known->second;
    if (!reason || lost_function_) continue;
    const Place& place = model_.expressions[model_.scripts[reason->script]].place;
    lost_function_ = Diagnostic{
        Severity::kError,
        "scxml.no-value-form",
        fmt::format("\"{}\" {}, so that the session cannot be saved: keep it in a <data>", function.name, reason->what),
        {model_.file, place.line + reason->line, reason->line > 0 ? 1 : place.column, 0}};
  }
  return done;
}

// Members of functions, and what hangs on them, as a text in which objects are their addresses.
void ScriptHeap::look_at_members(duk_context* ctx, Members& members) {
  members.text.clear();
  members.objects.clear();
  const ScriptFunctions& all = model_.functions;
  for (const Kept& function : functions_) {
    if (all.all_given || all.given.count(function.name) != 0) members.objects.push_back(function.object);
  }
  const auto add = [&](duk_idx_t index) {
    if (duk_is_object(ctx, index)) {
      void* const object = duk_get_heapptr(ctx, index);
      fmt::format_to(std::back_inserter(members.text), "{};", fmt::ptr(object));
      if (object != global_ &&
          std::find(members.objects.begin(), members.objects.end(), object) == members.objects.end())
        members.objects.push_back(object);
      return;
    }
    fmt::format_to(std::back_inserter(members.text), "{}:", duk_get_type(ctx, index));
    duk_dup(ctx, index);
    if (duk_is_number(ctx, -1) && duk_get_number(ctx, -1) == 0 && std::signbit(duk_get_number(ctx, -1)))
      members.text += '-';
    if (duk_is_symbol(ctx, -1) == 0) duk_to_string(ctx, -1);
    if (duk_is_symbol(ctx, -1) == 0) append_text(ctx, -1, members.text);
    members.text += ';';
    duk_pop(ctx);
  };
  for (std::size_t next = 0; next < members.objects.size() && next < kFunctionMembersMax; ++next) {
    duk_push_heapptr(ctx, members.objects[next]);
    duk_get_prototype(ctx, -1);
    if (duk_is_object(ctx, -1)) {
      fmt::format_to(std::back_inserter(members.text), "{}|", fmt::ptr(duk_get_heapptr(ctx, -1)));
    }
    duk_pop(ctx);
    duk_enum(ctx, -1, DUK_ENUM_OWN_PROPERTIES_ONLY | DUK_ENUM_INCLUDE_NONENUMERABLE | DUK_ENUM_INCLUDE_SYMBOLS);
    while (duk_next(ctx, -1, 0)) {
      if (duk_is_symbol(ctx, -1) == 0) append_text(ctx, -1, members.text);
      duk_get_prop_desc(ctx, -3, 0);
      for (const char* const part : {"value", "get", "set", "writable", "enumerable", "configurable"}) {
        duk_get_prop_string(ctx, -1, part);
        add(-1);
        duk_pop(ctx);
      }
      duk_pop(ctx);
    }
    duk_pop_2(ctx);
  }
}

SourceSpan ScriptHeap::place_of(std::string_view name) const {
  if (const auto slot = model_.slots.find(name); slot != model_.slots.end()) {
    const Place& place = model_.variables[slot->second].place;
    return {model_.file, place.line, place.column, place.length};
  }
  for (const Expression& expression : model_.expressions) {
    if (expression.text.find(name) == std::string::npos ||
        !names_in_script(expression.text).contains(std::string(name)))
      continue;
    return {model_.file, expression.place.line, expression.place.column, expression.place.length};
  }
  return {model_.file, 1, 1, 0};
}

Result<void> ScriptHeap::read_all(std::vector<std::optional<Value>>& variables, Map& globals) {
  ValueReader reader;
  reader.mode = ValueReader::Mode::kState;
  reader.plain_objects = model_.plain_objects;
  std::string name;
  std::string culprit;
  const auto read = [&](duk_context* ctx, Value& out) {
    const bool known = std::any_of(functions_.begin(), functions_.end(), [&](const Kept& function) {
      return function.object == duk_get_heapptr(ctx, -1) && function.name == name;
    });
    if (known) return false;
    const bool defined = reader.read(ctx, -1, out);
    if (!reader.failure.empty() && culprit.empty()) culprit = name;
    return defined;
  };
  globals = Map();
  Value value;
  auto done = protect(kNoExpression, [&](duk_context* ctx) {
    // What functions lead to is no data: an object that is both would be two of them.
    look_at_members(ctx, members_);
    reader.seen.insert(members_.objects.begin(), members_.objects.end());
    duk_push_heapptr(ctx, global_);
    if (!reader.plain_objects) {
      reader.check_members(ctx, -1, true);
      if (!reader.failure.empty()) culprit = "globalThis";
    }
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
    return fail("scxml.no-value-form", fmt::format("\"{}\" holds {}, which cannot be saved", culprit, reader.failure),
                place_of(culprit));
  if (lost_function_) return tl::unexpected(*lost_function_);
  if (members_.text != kept_members_.text || members_.objects.size() > kFunctionMembersMax) {
    const std::string& function = functions_.front().name;
    return fail(
        "scxml.no-value-form",
        fmt::format("what belongs to functions of the chart's own <script>s has changed, as members of \"{}\" and "
                    "its prototype, which cannot be saved: keep it in a <data>",
                    function),
        place_of(function));
  }
  return {};
}

}  // namespace sentree::scxml
