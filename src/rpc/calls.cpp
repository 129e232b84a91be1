#include "sentree/rpc/detail/calls.h"

#include <fmt/format.h>

#include <utility>

namespace sentree::rpc {
namespace {

// Why the arguments do not fit.
std::optional<std::string> bring_into_form(const idl::Method& method, Value& arguments) {
  if (arguments.is_null()) arguments = Value(Map());
  if (idl::conforms_arguments(method, arguments)) return std::nullopt;
  auto conformed = idl::conform_arguments(method, std::move(arguments));
  if (!conformed) return std::move(conformed.error().message);
  arguments = std::move(*conformed);
  return std::nullopt;
}

}  // namespace

std::optional<Outcome> Calls::admit(const idl::Method& method, Value& arguments) {
  if (auto wrong = bring_into_form(method, arguments)) return refused(CallErrorKind::kArguments, std::move(*wrong));
  calls_.fetch_add(1, std::memory_order_relaxed);
  return std::nullopt;
}

void Calls::ended(const Outcome& outcome) {
  if (outcome || outcome.error().kind == CallErrorKind::kException) return;
  errors_.fetch_add(1, std::memory_order_relaxed);
  if (outcome.error().kind == CallErrorKind::kLate) late_.fetch_add(1, std::memory_order_relaxed);
}

ClientCounters Calls::counters() const {
  ClientCounters out;
  out.calls = calls_.load(std::memory_order_relaxed);
  out.errors = errors_.load(std::memory_order_relaxed);
  out.late = late_.load(std::memory_order_relaxed);
  return out;
}

Result<std::shared_ptr<const TlsContext>> prepare_remote(const Address& address, const TlsFiles& files) {
  if (address.kind == Address::Kind::kLocal) {
    return fail("rpc.address",
                fmt::format("address \"{}\" is in this process, so nothing can connect to it", to_string(address)));
  }
  if (address.kind == Address::Kind::kOther) {
    return fail("rpc.address",
                fmt::format("address \"{}\" is none of Thrift, which is needed here", to_string(address)));
  }
  if (address.kind != Address::Kind::kTls) return std::shared_ptr<const TlsContext>();
  return tls_context(files, false);
}

}  // namespace sentree::rpc
