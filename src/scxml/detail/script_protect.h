#pragma once

#include <type_traits>

#include "sentree/scxml/detail/duktape.h"
#include "sentree/scxml/detail/script_heap.h"

namespace sentree::scxml {

struct Protected {
  void (*thunk)(duk_context*, void*);
  void* body;
};

inline duk_ret_t run_protected(duk_context* ctx, void* data) {
  const auto* call = static_cast<Protected*>(data);
  call->thunk(ctx, call->body);
  return 0;
}

/// Runs `body(context)`, which must keep nothing on its stack that owns memory while it calls the interpreter.
template <class Body>
Result<void> ScriptHeap::protect(ExpressionId id, Body&& body) {
  Protected call{[](duk_context* ctx, void* b) { (*static_cast<std::remove_reference_t<Body>*>(b))(ctx); }, &body};
  if (duk_safe_call(context_, run_protected, &call, 0, 1) == DUK_EXEC_SUCCESS) {
    duk_pop(context_);
    return {};
  }
  auto failure = error_at_top(id);
  duk_pop(context_);
  return failure;
}

}  // namespace sentree::scxml
