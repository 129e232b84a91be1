#include "sentree/rpc/detail/seam.h"

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

std::optional<Outcome> Seam::admit(const idl::Method& method, Value& arguments, const CallContext& context) {
  if (auto wrong = bring_into_form(method, arguments)) return refused(CallErrorKind::kArguments, std::move(*wrong));
  calls_.fetch_add(1, std::memory_order_relaxed);
  if (options_.hook == nullptr) return std::nullopt;
  Hook::Verdict verdict = options_.hook->before({context.source, options_.target, method, arguments, context.call});
  std::string veto;
  if (verdict.veto) {
    veto = std::move(*verdict.veto);
  } else if (verdict.arguments) {
    const auto wrong = bring_into_form(method, *verdict.arguments);
    if (!wrong) {
      arguments = std::move(*verdict.arguments);
      return std::nullopt;
    }
    veto = "the arguments were changed to ones that do not fit: " + *wrong;
  } else {
    return std::nullopt;
  }
  return finish(method, arguments, context, refused(CallErrorKind::kVetoed, std::move(veto)));
}

Outcome Seam::finish(const idl::Method& method, const Value& arguments, const CallContext& context, Outcome out) {
  if (options_.hook != nullptr) {
    const Call seen{context.source, options_.target, method, arguments, context.call};
    if (out)
      options_.hook->replied(seen, *out);
    else
      options_.hook->failed(seen, out.error());
  }
  if (!out && out.error().kind != CallErrorKind::kException) {
    errors_.fetch_add(1, std::memory_order_relaxed);
    if (out.error().kind == CallErrorKind::kLate) late_.fetch_add(1, std::memory_order_relaxed);
  }
  return out;
}

void Seam::late(const idl::Method& method, const Value& arguments, const CallContext& context, const Outcome& out) {
  late_replies_.fetch_add(1, std::memory_order_relaxed);
  if (options_.hook != nullptr)
    options_.hook->late({context.source, options_.target, method, arguments, context.call}, out);
}

ClientCounters Seam::counters() const {
  ClientCounters out;
  out.calls = calls_.load(std::memory_order_relaxed);
  out.errors = errors_.load(std::memory_order_relaxed);
  out.late = late_.load(std::memory_order_relaxed);
  out.late_replies = late_replies_.load(std::memory_order_relaxed);
  return out;
}

Result<std::shared_ptr<const TlsContext>> prepare_remote(const Address& address, const TlsFiles& files) {
  if (address.kind == Address::Kind::kLocal) {
    return fail("rpc.address",
                "address \"" + to_string(address) + "\" is in this process, so nothing can connect to it");
  }
  if (address.kind != Address::Kind::kTls) return std::shared_ptr<const TlsContext>();
  return tls_context(files, false);
}

}  // namespace sentree::rpc
