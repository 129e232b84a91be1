#include "sentree/rpc/client.h"

#include <atomic>
#include <optional>
#include <utility>

#include "sentree/rpc/detail/connection.h"
#include "sentree/rpc/detail/remote.h"
#include "sentree/rpc/detail/seam.h"

namespace sentree::rpc {

class Client::Impl {
 public:
  Impl(std::shared_ptr<Service> service, ClientOptions options)
      : service_(std::move(service)),
        interface_(service_, &service_->interface()),
        seam_(named(std::move(options), *interface_)) {}
  Impl(const Address& address, idl::ServicePtr interface, ClientOptions options, std::shared_ptr<const TlsContext> tls)
      : interface_(std::move(interface)),
        seam_(named(std::move(options), *interface_)),
        remote_(std::make_unique<Remote>(address, seam_.options().target, seam_.options(), std::move(tls))) {}

  const idl::Service& interface() const { return *interface_; }

  Outcome call(const idl::Method& method, Value arguments, const CallContext& context) {
    if (auto over = seam_.admit(method, arguments, context)) return std::move(*over);
    std::optional<Outcome> late;
    Outcome out = seam_.finish(method, arguments, context, deliver(method, arguments, context, late));
    if (late) seam_.late(method, arguments, context, *late);
    return out;
  }

  void interrupt(bool for_good) {
    if (for_good) closed_.store(true, std::memory_order_release);
    if (remote_ != nullptr) remote_->interrupt(for_good);
  }

  ClientCounters counters() const {
    ClientCounters out = seam_.counters();
    if (remote_ != nullptr) {
      out.late_replies += remote_->counts().late_replies;
      out.connections = remote_->counts().connections;
    }
    return out;
  }

 private:
  // `late` is set to a result that came after the deadline.
  Outcome deliver(const idl::Method& method, const Value& arguments, const CallContext& context,
                  std::optional<Outcome>& late) {
    if (remote_ != nullptr) return remote_->exchange(method, arguments, context);
    const std::string& target = seam_.options().target;
    if (closed_.load(std::memory_order_acquire))
      return refused(CallErrorKind::kUnreachable, "\"" + target + "\" is unreachable: the client has been closed");
    Outcome out = checked(method, invoke(method, arguments, context));
    if (context.deadline == kNoDeadline || std::chrono::steady_clock::now() <= context.deadline) return out;
    late = std::move(out);
    return refused(CallErrorKind::kLate,
                   "\"" + target + "\" did not answer in time: the reply to " + method.name + " was late");
  }

  Outcome invoke(const idl::Method& method, const Value& arguments, const CallContext& context) {
    try {
      return service_->call(method, arguments, context);
    } catch (const std::exception& e) {
      return refused(CallErrorKind::kProtocol,
                     "\"" + seam_.options().target + "\" failed in " + method.name + ": " + e.what());
    }
  }

  std::shared_ptr<Service> service_;  // Null: remote.
  idl::ServicePtr interface_;
  Seam seam_;
  std::unique_ptr<Remote> remote_;
  std::atomic<bool> closed_{false};
};

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

std::unique_ptr<Client> Client::local(std::shared_ptr<Service> service, ClientOptions options) {
  return std::unique_ptr<Client>(new Client(std::make_unique<Impl>(std::move(service), std::move(options))));
}

Result<std::unique_ptr<Client>> Client::remote(const Address& address, idl::ServicePtr interface,
                                               ClientOptions options) {
  auto tls = prepare_remote(address, options.tls);
  if (!tls) return tl::unexpected(tls.error());
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Impl>(address, std::move(interface), std::move(options), std::move(*tls))));
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
