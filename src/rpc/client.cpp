#include "sentree/rpc/client.h"

#include <utility>

#include "sentree/rpc/detail/calls.h"
#include "sentree/rpc/detail/remote.h"

namespace sentree::rpc {

class Client::Impl {
 public:
  Impl(const Address& address, idl::ServicePtr interface, ClientOptions options, std::shared_ptr<const TlsContext> tls)
      : interface_(std::move(interface)), remote_(address, named(std::move(options), *interface_), std::move(tls)) {}

  const idl::Service& interface() const { return *interface_; }

  Outcome call(const idl::Method& method, Value arguments, Deadline deadline) {
    if (auto over = calls_.admit(method, arguments)) return std::move(*over);
    Outcome out = remote_.exchange(method, arguments, deadline);
    calls_.ended(out);
    return out;
  }

  void interrupt(bool for_good) { remote_.interrupt(for_good); }

  ClientCounters counters() const {
    ClientCounters out = calls_.counters();
    out.late_replies = remote_.counts().late_replies;
    out.connections = remote_.counts().connections;
    return out;
  }

 private:
  idl::ServicePtr interface_;
  Calls calls_;
  Remote remote_;
};

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

Result<std::unique_ptr<Client>> Client::remote(const Address& address, idl::ServicePtr interface,
                                               ClientOptions options) {
  auto tls = prepare_remote(address, options.tls);
  if (!tls) return tl::unexpected(tls.error());
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Impl>(address, std::move(interface), std::move(options), std::move(*tls))));
}

const idl::Service& Client::interface() const { return impl_->interface(); }

Outcome Client::call(const idl::Method& method, Value arguments, Deadline deadline) {
  return impl_->call(method, std::move(arguments), deadline);
}

Outcome Client::call(std::string_view method, Value arguments, Deadline deadline) {
  const auto found = idl::find_method(interface(), method, interface().name);
  if (!found) return refused(CallErrorKind::kArguments, found.error().message);
  return impl_->call(**found, std::move(arguments), deadline);
}

void Client::interrupt() { impl_->interrupt(false); }
void Client::close() { impl_->interrupt(true); }
ClientCounters Client::counters() const { return impl_->counters(); }

}  // namespace sentree::rpc
