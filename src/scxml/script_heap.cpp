#include "sentree/scxml/detail/script_heap.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <unordered_set>
#include <utility>
#include <vector>

#include "sentree/base/assert.h"
#include "sentree/scxml/detail/duktape.h"
#include "sentree/scxml/detail/script_protect.h"
#include "sentree/scxml/detail/script_values.h"

namespace sentree::scxml {

// ---- Memory ----

// Counts what a heap takes and refuses beyond its bound; the interpreter makes a RangeError of that.
struct ScriptHeap::Allocator {
  static constexpr std::size_t kHeader = 16;
  std::size_t used = 0;
  std::size_t max = 0;

  static void* allocate(void* self, duk_size_t size) { return static_cast<Allocator*>(self)->resize(nullptr, size); }
  static void* reallocate(void* self, void* block, duk_size_t size) {
    return static_cast<Allocator*>(self)->resize(block, size);
  }
  static void release(void* self, void* block) { static_cast<Allocator*>(self)->resize(block, 0); }

  void* resize(void* block, std::size_t size) {
    char* const old = block ? static_cast<char*>(block) - kHeader : nullptr;
    const std::size_t old_size = old ? *reinterpret_cast<std::size_t*>(old) : 0;
    if (size == 0) {
      used -= old_size;
      std::free(old);
      return nullptr;
    }
    if (size > max || used - old_size > max - size) return nullptr;
    char* const fresh = static_cast<char*>(std::realloc(old, size + kHeader));
    if (!fresh) return nullptr;
    used = used - old_size + size;
    *reinterpret_cast<std::size_t*>(fresh) = size;
    return fresh + kHeader;
  }
};

namespace {

// Every call is protected, so the interpreter gives up here only when it is broken itself.
[[noreturn]] void fatal(void*, const char* message) { assertion_failed(message, "duktape", 0); }

ScriptHeap& heap_of(duk_context* ctx) {
  duk_push_heap_stash(ctx);
  duk_get_prop_string(ctx, -1, "heap");
  auto* heap = static_cast<ScriptHeap*>(duk_get_pointer(ctx, -1));
  duk_pop_2(ctx);
  return *heap;
}

duk_ret_t script_now(duk_context* ctx) {
  ScriptWorld* world = heap_of(ctx).world();
  duk_push_number(ctx, world ? world->script_now_ms() : 0);
  return 1;
}

duk_ret_t script_random(duk_context* ctx) {
  ScriptWorld* world = heap_of(ctx).world();
  duk_push_number(ctx, world ? world->script_random() : 0);
  return 1;
}

duk_ret_t script_in(duk_context* ctx) {
  duk_size_t size = 0;
  const char* id = duk_require_lstring(ctx, 0, &size);
  ScriptWorld* world = heap_of(ctx).world();
  duk_push_boolean(ctx, world && world->script_in({id, size}));
  return 1;
}

// A call of a function of the embedding program. What it needs lives outside the stack that an error unwinds.
struct NativeCall {
  List arguments;
  Value result;
  std::string failure;
};

duk_ret_t call_native(duk_context* ctx) {
  ScriptWorld* world = heap_of(ctx).world();
  const auto index = static_cast<std::size_t>(duk_get_current_magic(ctx));
  const int count = duk_get_top(ctx);
  if (!world || index >= world->script_functions().size())
    return duk_type_error(ctx, "this function is not there any more");
  thread_local NativeCall call;
  call.arguments.clear();
  call.failure.clear();
  thread_local ValueReader reader;
  reader.tags_undefined = true;
  for (int i = 0; i < count; ++i) {
    call.arguments.emplace_back();
    reader.failure.clear();
    reader.path.clear();
    if (!reader.read(ctx, i, call.arguments.back())) call.arguments.back() = Map{{"$undefined", true}};
    if (!reader.failure.empty()) return duk_type_error(ctx, "argument %d holds %s", i + 1, reader.failure.c_str());
  }
  {
    auto result = world->script_call(index, call.arguments);
    if (result)
      call.result = *std::move(result);
    else
      call.failure = std::move(result.error().message);
  }
  if (!call.failure.empty()) return duk_error(ctx, DUK_ERR_ERROR, "%s", call.failure.c_str());
  push_value(ctx, call.result, nullptr);
  return 1;
}

// Freezes built-in objects. Lives outside the stack that an error unwinds.
class Freezing {
 public:
  // Everything that leads from the members of the global object and from `make_dom`, but for the global object.
  void freeze(duk_context* ctx, void* global, void* make_dom) {
    frozen_ = {global};
    open_ = {global};
    duk_push_heapptr(ctx, make_dom);
    add(ctx);
    while (!open_.empty()) {
      duk_push_heapptr(ctx, open_.back());
      open_.pop_back();
      duk_get_prototype(ctx, -1);
      add(ctx);
      duk_enum(ctx, -1, DUK_ENUM_OWN_PROPERTIES_ONLY | DUK_ENUM_INCLUDE_NONENUMERABLE | DUK_ENUM_INCLUDE_SYMBOLS);
      while (duk_next(ctx, -1, 0) != 0) {
        duk_get_prop_desc(ctx, -3, 0);
        for (const char* const member : {"value", "get", "set"}) {
          duk_get_prop_string(ctx, -1, member);
          add(ctx);
        }
        duk_pop(ctx);
      }
      duk_pop_2(ctx);
    }
  }

 private:
  // Takes what is on top of the stack.
  void add(duk_context* ctx) {
    if (duk_is_object(ctx, -1) && frozen_.insert(duk_get_heapptr(ctx, -1)).second) {
      duk_freeze(ctx, -1);
      open_.push_back(duk_get_heapptr(ctx, -1));
    }
    duk_pop(ctx);
  }

  std::unordered_set<void*> frozen_;
  std::vector<void*> open_;  // whose members are still to be looked at
};

}  // namespace

Result<void> ScriptHeap::error_at_top(ExpressionId id) {
  std::string message;
  int line = 0;
  // Reading the error runs scripts (toString), so it is protected too.
  auto body = [&](duk_context* ctx) {
    duk_dup(ctx, 0);
    if (duk_is_error(ctx, -1)) {
      duk_get_prop_string(ctx, -1, "lineNumber");
      line = duk_get_int_default(ctx, -1, 0);
      duk_pop(ctx);
    }
    duk_to_string(ctx, -1);
    append_text(ctx, -1, message);
  };
  struct Context {
    decltype(body)& read;
  } context{body};
  const auto thunk = [](duk_context* ctx, void* data) -> duk_ret_t {
    static_cast<Context*>(data)->read(ctx);
    return 0;
  };
  duk_dup(context_, -1);
  if (duk_safe_call(context_, thunk, &context, 1, 1) != DUK_EXEC_SUCCESS) message = "a script failed";
  duk_pop(context_);
  SourceSpan span;
  if (id != kNoExpression) {
    const Place& place = model_.expressions[id].place;
    span = {model_.file, place.line + std::max(0, line - 1), line > 1 ? 1 : place.column, 0};
  }
  // Duktape counts from the beginning of what it was given.
  if (const std::size_t own = message.rfind(" (line "); own != std::string::npos && message.starts_with("SyntaxError"))
    message.resize(own);
  return fail("scxml.script", std::move(message), std::move(span));
}

// ---- Life ----

ScriptHeap::ScriptHeap(const Model& model)
    : model_(model), allocator_(std::make_unique<Allocator>()), compiled_(model.expressions.size()) {}

ScriptHeap::~ScriptHeap() {
  if (context_) duk_destroy_heap(context_);
}

Result<std::shared_ptr<ScriptHeap>> ScriptHeap::create(const Model& model, std::size_t memory_max) {
  return create(model, memory_max, true);
}

Result<std::shared_ptr<ScriptHeap>> ScriptHeap::create_for_syntax(const Model& model, std::size_t memory_max) {
  return create(model, memory_max, false);
}

Result<std::shared_ptr<ScriptHeap>> ScriptHeap::create(const Model& model, std::size_t memory_max, bool whole) {
  std::shared_ptr<ScriptHeap> heap(new ScriptHeap(model));
  heap->allocator_->max = memory_max;
  heap->context_ =
      duk_create_heap(Allocator::allocate, Allocator::reallocate, Allocator::release, heap->allocator_.get(), fatal);
  if (!heap->context_ || !heap->keep_compiled() || (whole && !heap->build())) {
    return fail("scxml.script-memory", fmt::format("a JavaScript heap needs more than {} bytes", memory_max));
  }
  return heap;
}

bool ScriptHeap::keep_compiled() {
  return protect(kNoExpression,
                 [this](duk_context* ctx) {
                   duk_push_heap_stash(ctx);
                   duk_push_pointer(ctx, this);
                   duk_put_prop_string(ctx, -2, "heap");
                   duk_push_array(ctx);
                   duk_put_prop_string(ctx, -2, "kept");
                   duk_pop(ctx);
                 })
      .has_value();
}

bool ScriptHeap::build() {
  Freezing freezing;
  return protect(kNoExpression,
                 [&](duk_context* ctx) {
                   duk_push_string(ctx, kBootstrap);
                   duk_push_string(ctx, "bootstrap");
                   duk_compile(ctx, DUK_COMPILE_EVAL);
                   duk_call(ctx, 0);
                   duk_push_global_object(ctx);
                   base_ = duk_get_heapptr(ctx, -1);
                   duk_push_c_function(ctx, script_now, 0);
                   duk_push_c_function(ctx, script_random, 0);
                   duk_push_c_function(ctx, script_in, 1);
                   duk_call(ctx, 4);
                   make_dom_ = duk_get_heapptr(ctx, -1);
                   freezing.freeze(ctx, base_, make_dom_);
                   duk_push_heap_stash(ctx);
                   duk_dup(ctx, -2);
                   duk_put_prop_string(ctx, -2, "makeDom");
                   duk_push_heapptr(ctx, base_);
                   duk_put_prop_string(ctx, -2, "base");
                   duk_pop_2(ctx);

                   // Scripts' global object: it holds nothing but the session's data, and inherits everything else.
                   duk_push_object(ctx);
                   global_ = duk_get_heapptr(ctx, -1);
                   duk_push_heapptr(ctx, base_);
                   duk_set_prototype(ctx, -2);
                   for (const Variable& variable : model_.variables) {
                     push_text(ctx, variable.id);
                     duk_push_undefined(ctx);
                     duk_def_prop(ctx, -3,
                                  DUK_DEFPROP_HAVE_VALUE | DUK_DEFPROP_SET_WRITABLE | DUK_DEFPROP_SET_ENUMERABLE |
                                      DUK_DEFPROP_CLEAR_CONFIGURABLE);
                   }
                   duk_push_heapptr(ctx, base_);
                   duk_push_string(ctx, "globalThis");
                   duk_dup(ctx, -3);
                   duk_def_prop(ctx, -3, DUK_DEFPROP_HAVE_VALUE | DUK_DEFPROP_FORCE | DUK_DEFPROP_CLEAR_WEC);
                   for (const char* name : {"_sessionid", "_name", "_ioprocessors", "_x", "_event"}) {
                     duk_push_string(ctx, name);
                     if (std::string_view(name) == "_name")
                       push_text(ctx, model_.name);
                     else
                       duk_push_undefined(ctx);
                     duk_def_prop(ctx, -3, DUK_DEFPROP_HAVE_VALUE | DUK_DEFPROP_FORCE | DUK_DEFPROP_CLEAR_WEC);
                   }
                   duk_freeze(ctx, -1);
                   duk_pop(ctx);
                   duk_set_global_object(ctx);
                 })
      .has_value();
}

bool ScriptHeap::reset() {
  tag = 0;
  functions_.clear();
  lost_function_.reset();
  kept_members_ = {};
  bool clean = true;
  const auto done = protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, global_);
    for (const Variable& variable : model_.variables) {
      push_text(ctx, variable.id);
      duk_push_undefined(ctx);
      duk_def_prop(ctx, -3, DUK_DEFPROP_HAVE_VALUE | DUK_DEFPROP_SET_WRITABLE | DUK_DEFPROP_SET_ENUMERABLE);
    }
    duk_enum(ctx, -1, DUK_ENUM_OWN_PROPERTIES_ONLY | DUK_ENUM_INCLUDE_NONENUMERABLE | DUK_ENUM_INCLUDE_SYMBOLS);
    while (duk_next(ctx, -1, 0)) {
      if (duk_is_symbol(ctx, -1)) {
        clean = false;
        duk_pop(ctx);
        continue;
      }
      duk_size_t size = 0;
      const char* name = duk_get_lstring(ctx, -1, &size);
      const bool variable = std::any_of(model_.variables.begin(), model_.variables.end(),
                                        [&](const Variable& v) { return v.id == std::string_view(name, size); });
      if (variable) {
        duk_pop(ctx);
        continue;
      }
      clean = duk_del_prop(ctx, -3) && clean;
    }
    duk_pop(ctx);
    duk_get_prototype(ctx, -1);
    clean = clean && duk_get_heapptr(ctx, -1) == base_;
  });
  return done.has_value() && clean;
}

// ---- System variables ----

namespace {

// Lists and maps with all that is in them read-only.
void push_frozen(duk_context* ctx, const Value& value) {
  duk_require_stack(ctx, 8);
  if (const List* list = value.as_list()) {
    duk_push_array(ctx);
    for (duk_uarridx_t i = 0; i < list->size(); ++i) {
      push_frozen(ctx, (*list)[i]);
      duk_put_prop_index(ctx, -2, i);
    }
    duk_freeze(ctx, -1);
  } else if (const Map* map = value.as_map()) {
    duk_push_object(ctx);
    for (const auto& [key, item] : *map) {
      push_text(ctx, key);
      push_frozen(ctx, item);
      duk_def_prop(ctx, -3, DUK_DEFPROP_HAVE_VALUE | DUK_DEFPROP_SET_ENUMERABLE);
    }
    duk_freeze(ctx, -1);
  } else {
    push_value(ctx, value, nullptr);
  }
}

}  // namespace

Result<void> ScriptHeap::set_system(std::string_view id, std::span<const Processor> processors) {
  session_id.clear();
  known_.clear();
  auto done = protect(kNoExpression, [&](duk_context* ctx) {
    constexpr duk_uint_t kFlags = DUK_DEFPROP_HAVE_VALUE | DUK_DEFPROP_FORCE | DUK_DEFPROP_CLEAR_WEC;
    duk_push_heapptr(ctx, base_);
    duk_push_string(ctx, "_sessionid");
    push_text(ctx, id);
    duk_def_prop(ctx, -3, kFlags);
    duk_push_string(ctx, "_x");
    duk_push_object(ctx);
    duk_freeze(ctx, -1);
    duk_def_prop(ctx, -3, kFlags);

    duk_push_string(ctx, "_ioprocessors");
    duk_push_object(ctx);
    const auto add = [ctx](std::string_view type, std::string_view location, std::string_view suffix) {
      push_text(ctx, type);
      duk_push_object(ctx);
      push_text(ctx, location);
      push_text(ctx, suffix);
      duk_concat(ctx, 2);
      duk_put_prop_string(ctx, -2, "location");
      duk_freeze(ctx, -1);
      duk_put_prop(ctx, -3);
    };
    add(kScxmlProcessor, "#_scxml_", id);
    add(kScxmlProcessorShort, "#_scxml_", id);
    for (const Processor& processor : processors) {
      add(processor.type, processor.location, {});
      if (processor.type == kBasicHttpProcessor) add(kBasicHttpProcessorShort, processor.location, {});
      if (processor.type == kBasicHttpProcessorShort) add(kBasicHttpProcessor, processor.location, {});
    }
    duk_freeze(ctx, -1);
    duk_def_prop(ctx, -3, kFlags);

    if (world_) {
      duk_int_t magic = 0;
      for (const NativeFunction& function : world_->script_functions()) {
        push_text(ctx, function.name);
        duk_push_c_function(ctx, call_native, DUK_VARARGS);
        duk_set_magic(ctx, -1, magic++);
        duk_freeze(ctx, -1);
        duk_def_prop(ctx, -3, kFlags);
      }
      for (const NativeValue& value : world_->script_values()) {
        push_text(ctx, value.name);
        push_frozen(ctx, value.value);
        duk_def_prop(ctx, -3, kFlags);
      }
    }
  });
  if (!done) return done;
  session_id = id;
  if (world_ != nullptr) {
    for (const NativeFunction& function : world_->script_functions()) known_.push_back(function.name);
  }
  return done;
}

Result<void> ScriptHeap::set_event(const Event* event) {
  return protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, base_);
    duk_push_string(ctx, "_event");
    if (!event) {
      duk_push_undefined(ctx);
    } else {
      duk_push_object(ctx);
      const auto add = [ctx](const char* name, std::string_view value, bool always) {
        if (always || !value.empty())
          push_text(ctx, value);
        else
          duk_push_undefined(ctx);
        duk_put_prop_string(ctx, -2, name);
      };
      add("name", event->name, true);
      add("type", to_string(event->type), true);
      add("sendid", event->sendid, false);
      add("origin", event->origin, false);
      add("origintype", event->origintype, false);
      add("invokeid", event->invokeid, false);
      if (!event->raw.empty()) add("raw", event->raw, true);
      if (event->data)
        push_value(ctx, *event->data, make_dom_);
      else
        duk_push_undefined(ctx);
      duk_put_prop_string(ctx, -2, "data");
      duk_freeze(ctx, -1);
    }
    duk_def_prop(ctx, -3, DUK_DEFPROP_HAVE_VALUE | DUK_DEFPROP_FORCE | DUK_DEFPROP_CLEAR_WEC);
  });
}

// ---- Expressions ----

namespace {

// ")" before its "(": text that would close the parenthesis we put it into.
bool closes_early(std::string_view text) {
  int depth = 0;
  for (const char c : text) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (depth < 0) return true;
  }
  return false;
}

// The suite has expressions that end like statements ("new Thing();"); so do charts written for engines that use eval.
std::string_view without_semicolon(std::string_view text) {
  const std::size_t end = text.find_last_not_of("; \t\r\n");
  return end == std::string_view::npos ? text : text.substr(0, end + 1);
}

// What closes an expression is not to stand in a comment at its end; else it stands in the expression's last line,
// which is that of an error in a bare name.
const char* line_end(std::string_view text) { return text.find("//") == std::string_view::npos ? "" : "\n"; }

void push_source(duk_context* ctx, const Expression& expression) {
  switch (expression.use) {
    case ExpressionUse::kScript: push_text(ctx, expression.text); return;
    case ExpressionUse::kLocation:
    case ExpressionUse::kItem:
      // Strict, so that an undeclared or read-only location is an error (SCXML 5.4, 5.10); <foreach> may declare (4.6).
      duk_push_string(
          ctx, expression.use == ExpressionUse::kItem ? "(function($value){" : "(function($value){'use strict';");
      push_text(ctx, expression.text);
      duk_push_string(ctx, fmt::format("{}=$value}})", line_end(expression.text)).c_str());
      break;
    default:
      duk_push_string(ctx, "(function(){return (");
      push_text(ctx, without_semicolon(expression.text));
      duk_push_string(ctx, fmt::format("{})}})", line_end(expression.text)).c_str());
  }
  duk_concat(ctx, 3);
}

}  // namespace

// Pushes the function of an expression, compiling it the first time.
void ScriptHeap::push_compiled(ExpressionId id) {
  duk_context* ctx = context_;
  if (compiled_[id]) {
    duk_push_heapptr(ctx, compiled_[id]);
    return;
  }
  const Expression& expression = model_.expressions[id];
  if (expression.use != ExpressionUse::kScript && closes_early(expression.text)) {
    duk_push_string(ctx, "[");
    push_text(ctx, expression.text);
    duk_push_string(ctx, "\n]");
    duk_concat(ctx, 3);
    duk_push_string(ctx, "expression");
    duk_compile(ctx, DUK_COMPILE_EVAL);
    duk_pop(ctx);
  }
  push_source(ctx, expression);
  duk_push_string(ctx, "script");
  duk_compile(ctx, DUK_COMPILE_EVAL);
  if (expression.use != ExpressionUse::kScript) duk_call(ctx, 0);
  duk_push_heap_stash(ctx);
  duk_get_prop_string(ctx, -1, "kept");
  duk_dup(ctx, -3);
  duk_put_prop_index(ctx, -2, static_cast<duk_uarridx_t>(id));
  duk_pop_2(ctx);
  compiled_[id] = duk_get_heapptr(ctx, -1);
}

std::optional<std::string> ScriptHeap::syntax_error(ExpressionId id, int& line) {
  auto done = protect(id, [&](duk_context*) { push_compiled(id); });
  if (done) return std::nullopt;
  line = done.error().span.line;
  return std::move(done.error().message);
}

void ScriptHeap::push_call(ExpressionId id) {
  push_compiled(id);
  duk_push_global_object(context_);
  duk_call_method(context_, 0);
}

Result<bool> ScriptHeap::condition(ExpressionId id) {
  bool result = false;
  auto done = protect(id, [&](duk_context* ctx) {
    push_call(id);
    result = duk_to_boolean(ctx, -1) != 0;
  });
  if (!done) return tl::unexpected(std::move(done.error()));
  return result;
}

Result<std::optional<Value>> ScriptHeap::evaluate(ExpressionId id) {
  ValueReader reader;
  Value value;
  bool defined = false;
  auto done = protect(id, [&](duk_context* ctx) {
    push_call(id);
    defined = reader.read(ctx, -1, value);
  });
  if (!done) return tl::unexpected(std::move(done.error()));
  if (!reader.failure.empty())
    return fail("scxml.no-value-form", fmt::format("\"{}\" holds {}", model_.expressions[id].text, reader.failure));
  return defined ? std::optional(std::move(value)) : std::nullopt;
}

Result<std::optional<Value>> ScriptHeap::evaluate(std::string_view expression) {
  ValueReader reader;
  Value value;
  bool defined = false;
  auto done = protect(kNoExpression, [&](duk_context* ctx) {
    // As a program of its own: its value is the one of its last statement.
    push_text(ctx, without_semicolon(expression));
    duk_push_string(ctx, "expression");
    duk_compile(ctx, DUK_COMPILE_EVAL);
    duk_call(ctx, 0);
    defined = reader.read(ctx, -1, value);
  });
  if (!done) return tl::unexpected(std::move(done.error()));
  if (!reader.failure.empty())
    return fail("scxml.no-value-form", fmt::format("\"{}\" holds {}", expression, reader.failure));
  return defined ? std::optional(std::move(value)) : std::nullopt;
}

Result<std::string> ScriptHeap::text(ExpressionId id) {
  std::string result;
  auto done = protect(id, [&](duk_context* ctx) {
    push_call(id);
    if (duk_is_object(ctx, -1) && !duk_is_function(ctx, -1) && !duk_is_error(ctx, -1) &&
        !duk_has_prop_string(ctx, -1, "nodeType")) {
      duk_json_encode(ctx, -1);
    }
    duk_safe_to_string(ctx, -1);
    append_text(ctx, -1, result);
  });
  if (!done) return tl::unexpected(std::move(done.error()));
  return result;
}

Result<void> ScriptHeap::assign(ExpressionId location, ExpressionId expr) {
  return protect(expr, [&](duk_context* ctx) {
    push_compiled(location);
    duk_push_global_object(ctx);
    push_call(expr);
    duk_call_method(ctx, 1);
  });
}

Result<void> ScriptHeap::assign_value(ExpressionId location, const std::optional<Value>& value) {
  return protect(location, [&](duk_context* ctx) {
    push_compiled(location);
    duk_push_global_object(ctx);
    if (value)
      push_value(ctx, *value, make_dom_);
    else
      duk_push_undefined(ctx);
    duk_call_method(ctx, 1);
  });
}

Result<void> ScriptHeap::bind(std::uint32_t slot, ExpressionId expr) {
  return protect(expr, [&](duk_context* ctx) {
    duk_push_heapptr(ctx, global_);
    push_text(ctx, model_.variables[slot].id);
    push_call(expr);
    duk_put_prop(ctx, -3);
  });
}

Result<void> ScriptHeap::run(ExpressionId script) {
  return protect(script, [&](duk_context*) { push_call(script); });
}

Result<void> ScriptHeap::for_each(const Foreach& loop, const std::function<bool()>& body) {
  std::size_t length = 0;
  bool is_array = false;
  // The copy is kept among the compiled expressions' neighbours, under a key of its own, as loops can be nested.
  std::string key = fmt::format("loop{}", loop.array);
  auto begun = protect(loop.array, [&](duk_context* ctx) {
    push_compiled(loop.item);
    if (loop.index != kNoExpression) push_compiled(loop.index);
    duk_push_heap_stash(ctx);
    push_call(loop.array);
    is_array = duk_is_array(ctx, -1) != 0;
    if (!is_array) return;
    length = duk_get_length(ctx, -1);
    if (length > foreach_max) return;
    duk_push_string(ctx, "slice");
    duk_call_prop(ctx, -2, 0);
    duk_put_prop_lstring(ctx, -3, key.data(), key.size());
  });
  if (!begun) return begun;
  const Expression& array = model_.expressions[loop.array];
  if (!is_array) return fail("scxml.no-array", fmt::format("\"{}\" is no array", array.text));
  if (length > foreach_max) {
    return fail("scxml.too-long", fmt::format("\"{}\" has more than {} items", array.text, foreach_max));
  }
  for (std::size_t i = 0; i < length; ++i) {
    auto set = protect(loop.item, [&](duk_context* ctx) {
      push_compiled(loop.item);
      duk_push_global_object(ctx);
      duk_push_heap_stash(ctx);
      duk_get_prop_lstring(ctx, -1, key.data(), key.size());
      duk_remove(ctx, -2);
      duk_get_prop_index(ctx, -1, static_cast<duk_uarridx_t>(i));
      duk_remove(ctx, -2);
      duk_call_method(ctx, 1);
      if (loop.index == kNoExpression) return;
      push_compiled(loop.index);
      duk_push_global_object(ctx);
      duk_push_number(ctx, static_cast<double>(i));
      duk_call_method(ctx, 1);
    });
    if (!set) return set;
    if (!body()) break;
  }
  return protect(kNoExpression, [&](duk_context* ctx) {
    duk_push_heap_stash(ctx);
    duk_del_prop_lstring(ctx, -1, key.data(), key.size());
  });
}

}  // namespace sentree::scxml
