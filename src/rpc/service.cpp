#include "sentree/rpc/service.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/idl/conform.h"
#include "sentree/rpc/detail/connection.h"

namespace sentree::rpc {

Reply::Owed::~Owed() {
  give(tl::unexpected(CallError{CallErrorKind::kProtocol, "the service gave no answer", {}, {}}), false);
}

void Reply::Owed::give(Outcome outcome, bool is_last) {
  if (!given_.exchange(true)) send_(std::move(outcome), is_last);
}

const idl::Field* declared_exception(const idl::Method& method, std::string_view type) {
  const auto found = std::find_if(method.exceptions.begin(), method.exceptions.end(),
                                  [&](const idl::Field& f) { return f.type->structure->name == type; });
  return found == method.exceptions.end() ? nullptr : &*found;
}

Outcome checked(const idl::Method& method, Outcome outcome) {
  const std::string call = fmt::format("{}.{}", method.service, method.name);
  if (outcome) {
    if (method.oneway) return Value();
    if (idl::conforms(*method.result, *outcome)) return outcome;
    auto result = idl::conform(*method.result, std::move(*outcome), "result of " + call);
    if (result) return std::move(*result);
    return tl::unexpected(CallError{CallErrorKind::kProtocol, std::move(result.error().message), {}, {}});
  }
  CallError& error = outcome.error();
  if (error.kind != CallErrorKind::kException) {
    error.kind = CallErrorKind::kProtocol;
    return outcome;
  }
  const idl::Field* declared = declared_exception(method, error.exception);
  if (declared == nullptr) {
    return tl::unexpected(CallError{
        CallErrorKind::kProtocol,
        fmt::format("{} failed with \"{}\", which it does not declare: {}", call, error.exception, error.message),
        {},
        {}});
  }
  if (error.data.is_null()) error.data = Value(Map());
  auto fields = idl::conform(*declared->type, std::move(error.data), "exception of " + call);
  if (!fields) return tl::unexpected(CallError{CallErrorKind::kProtocol, std::move(fields.error().message), {}, {}});
  error.data = std::move(*fields);
  return outcome;
}

}  // namespace sentree::rpc
