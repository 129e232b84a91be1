#include "sentree/rpc/client.h"

#include <atomic>
#include <optional>
#include <utility>

#include "sentree/idl/conform.h"
#include "sentree/rpc/detail/connection.h"
#include "sentree/rpc/detail/remote.h"

namespace sentree::rpc {
namespace {

tl::unexpected<CallError> refused(CallErrorKind kind, std::string message) {
  return tl::unexpected(CallError{kind, std::move(message), {}, {}});
}

}  // namespace

class Client::Impl {
 public:
  Impl(std::shared_ptr<Service> service, ClientOptions options)
      : service_(std::move(service)), interface_(service_, &service_->interface()), options_(std::move(options)) {
    name();
  }
  Impl(const Address& address, idl::ServicePtr interface, ClientOptions options, std::shared_ptr<const TlsContext> tls)
      : interface_(std::move(interface)), options_(std::move(options)) {
    name();
    remote_ = std::make_unique<Remote>(address, options_.target, options_, std::move(tls));
  }

  const idl::Service& interface() const { return *interface_; }

  Outcome call(const idl::Method& method, Value arguments, const CallContext& context) {
    if (arguments.is_null()) arguments = Value(Map());
    if (auto wrong = brought_into_form(method, arguments)) return refused(CallErrorKind::kArguments, std::move(*wrong));
    calls_.fetch_add(1, std::memory_order_relaxed);
    std::optional<Outcome> late;
    if (options_.hook == nullptr) return counted(deliver(method, arguments, context, late));

    const Call seen{context.source, options_.target, method, arguments, context.call};
    Hook::Verdict verdict = options_.hook->before(seen);
    Outcome out;
    if (verdict.veto) {
      out = refused(CallErrorKind::kVetoed, std::move(*verdict.veto));
    } else if (verdict.arguments) {
      Value changed = std::move(*verdict.arguments);
      if (auto wrong = brought_into_form(method, changed)) {
        out = refused(CallErrorKind::kVetoed, "the arguments were changed to ones that do not fit: " + *wrong);
      } else {
        arguments = std::move(changed);
        out = deliver(method, arguments, context, late);
      }
    } else {
      out = deliver(method, arguments, context, late);
    }
    if (out)
      options_.hook->replied(seen, *out);
    else
      options_.hook->failed(seen, out.error());
    if (late) options_.hook->late(seen, *late);
    return counted(std::move(out));
  }

  void interrupt(bool for_good) {
    if (for_good) closed_.store(true, std::memory_order_release);
    if (remote_ != nullptr) remote_->interrupt(for_good);
  }

  ClientCounters counters() const {
    ClientCounters out;
    out.calls = calls_.load(std::memory_order_relaxed);
    out.errors = errors_.load(std::memory_order_relaxed);
    out.late = late_.load(std::memory_order_relaxed);
    out.late_replies = late_replies_.load(std::memory_order_relaxed);
    if (remote_ != nullptr) {
      out.late_replies += remote_->counts().late_replies;
      out.connections = remote_->counts().connections;
    }
    return out;
  }

 private:
  void name() {
    if (options_.target.empty()) options_.target = interface_->name;
  }

  static std::optional<std::string> brought_into_form(const idl::Method& method, Value& arguments) {
    if (idl::conforms_arguments(method, arguments)) return std::nullopt;
    auto conformed = idl::conform_arguments(method, std::move(arguments));
    if (!conformed) return std::move(conformed.error().message);
    arguments = std::move(*conformed);
    return std::nullopt;
  }

  Outcome counted(Outcome out) {
    if (!out && out.error().kind != CallErrorKind::kException) {
      errors_.fetch_add(1, std::memory_order_relaxed);
      if (out.error().kind == CallErrorKind::kLate) late_.fetch_add(1, std::memory_order_relaxed);
    }
    return out;
  }

  // `late` is set to a result that came after the deadline.
  Outcome deliver(const idl::Method& method, const Value& arguments, const CallContext& context,
                  std::optional<Outcome>& late) {
    if (remote_ != nullptr) return remote_->exchange(method, arguments, context);
    if (closed_.load(std::memory_order_acquire)) {
      return refused(CallErrorKind::kUnreachable,
                     "\"" + options_.target + "\" is unreachable: the client has been closed");
    }
    Outcome out = checked(method, invoke(method, arguments, context));
    if (context.deadline == kNoDeadline || std::chrono::steady_clock::now() <= context.deadline) return out;
    late_replies_.fetch_add(1, std::memory_order_relaxed);
    late = std::move(out);
    return refused(CallErrorKind::kLate,
                   "\"" + options_.target + "\" did not answer in time: the reply to " + method.name + " was late");
  }

  Outcome invoke(const idl::Method& method, const Value& arguments, const CallContext& context) {
    try {
      return service_->call(method, arguments, context);
    } catch (const std::exception& e) {
      return refused(CallErrorKind::kProtocol,
                     "\"" + options_.target + "\" failed in " + method.name + ": " + e.what());
    }
  }

  std::shared_ptr<Service> service_;  // Null: remote.
  idl::ServicePtr interface_;
  ClientOptions options_;
  std::unique_ptr<Remote> remote_;
  std::atomic<bool> closed_{false};
  std::atomic<std::uint64_t> calls_{0};
  std::atomic<std::uint64_t> errors_{0};
  std::atomic<std::uint64_t> late_{0};
  std::atomic<std::uint64_t> late_replies_{0};
};

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

std::unique_ptr<Client> Client::local(std::shared_ptr<Service> service, ClientOptions options) {
  return std::unique_ptr<Client>(new Client(std::make_unique<Impl>(std::move(service), std::move(options))));
}

Result<std::unique_ptr<Client>> Client::remote(const Address& address, idl::ServicePtr interface,
                                               ClientOptions options) {
  if (address.kind == Address::Kind::kLocal) {
    return fail("rpc.address",
                "address \"" + to_string(address) + "\" is in this process, so nothing can connect to it");
  }
  std::shared_ptr<const TlsContext> tls;
  if (address.kind == Address::Kind::kTls) {
    auto made = tls_context(options.tls, false);
    if (!made) return tl::unexpected(made.error());
    tls = std::move(*made);
  }
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Impl>(address, std::move(interface), std::move(options), std::move(tls))));
}

const idl::Service& Client::interface() const { return impl_->interface(); }

Outcome Client::call(const idl::Method& method, Value arguments, const CallContext& context) {
  return impl_->call(method, std::move(arguments), context);
}

Outcome Client::call(std::string_view method, Value arguments, const CallContext& context) {
  const auto found = idl::find_method(interface(), method, interface().name);
  if (!found) return refused(CallErrorKind::kArguments, found.error().message);
  return impl_->call(**found, std::move(arguments), context);
}

void Client::interrupt() { impl_->interrupt(false); }
void Client::close() { impl_->interrupt(true); }
ClientCounters Client::counters() const { return impl_->counters(); }

}  // namespace sentree::rpc
