#include "sentree/rpc/middleware.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/rpc/async_client.h"

namespace sentree::rpc {
namespace {

class Thrift final : public Middleware {
 public:
  std::vector<std::string> schemes() const override { return {"unix", "tcp", "tls"}; }
  std::vector<std::string> forms() const override { return {"unix:/path", "tcp://host:port", "tls://host:port"}; }
  std::string about() const override { return "Apache Thrift over sockets, with certificates by tls:"; }
  // `Address::parse` has done it.
  Result<void> check(const Address&) const override { return {}; }

  Result<std::unique_ptr<Caller>> connect(const Address& address, idl::ServicePtr interface,
                                          ClientOptions options) override {
    auto client = AsyncClient::remote(address, std::move(interface), std::move(options));
    if (!client) return tl::unexpected(std::move(client.error()));
    return std::unique_ptr<Caller>(std::move(*client));
  }

  Result<std::unique_ptr<Opened>> serve(const Address& address, std::vector<NamedService> services,
                                        ServerOptions options) override {
    auto server = Server::start(address, std::move(services), std::move(options));
    if (!server) return tl::unexpected(std::move(server.error()));
    return std::unique_ptr<Opened>(std::make_unique<Served>(std::move(*server)));
  }

 private:
  class Served final : public Opened {
   public:
    explicit Served(std::unique_ptr<Server> server) : server_(std::move(server)) {}
    std::string address() const override { return to_string(server_->address()); }
    void stop() override { server_->stop(); }

   private:
    std::unique_ptr<Server> server_;
  };
};

std::vector<std::unique_ptr<Middleware>>& registered() {
  static std::vector<std::unique_ptr<Middleware>> all = [] {
    std::vector<std::unique_ptr<Middleware>> first;
    first.push_back(std::make_unique<Thrift>());
    return first;
  }();
  return all;
}

}  // namespace

// NOLINTNEXTLINE(performance-unnecessary-value-param): who overrides it keeps what it takes
Result<std::unique_ptr<Opened>> Middleware::subscribe(const Address& address, idl::ServicePtr, Take, SubscribeOptions) {
  return fail("rpc.address", fmt::format("nothing can be read from {}: it has no topics", to_string(address)));
}

Result<void> Middleware::check_overheard(const Address& address, const idl::Service& interface) const {
  if (is_source(address, &interface)) return {};
  return fail("rpc.address", fmt::format("what is said at \"{}\" passes between its two ends, and reaches nobody else; "
                                         "observed can be what is published, and all of a graph of ROS 2",
                                         to_string(address)));
}

Result<std::unique_ptr<Opened>> Middleware::overhear(const Address& address, idl::ServicePtr interface, Hearing hearing,
                                                     SubscribeOptions options) {
  return subscribe(
      address, std::move(interface),
      [request = std::move(hearing.request)](const idl::Method& method, Value arguments) {
        static_cast<void>(request(method, std::move(arguments)));
      },
      std::move(options));
}

// NOLINTNEXTLINE(performance-unnecessary-value-param): as above
Result<std::unique_ptr<Opened>> Middleware::watch(const Address& address, std::function<void(const std::string&)>,
                                                  SubscribeOptions options) {
  return subscribe(address, nullptr, {}, std::move(options));
}

Result<std::vector<NetworkEntry>> Middleware::list(const Address& address, std::chrono::milliseconds) {
  return fail("rpc.address", fmt::format("\"{}\" is no network that could tell what it offers", to_string(address)));
}

Address Middleware::beside(const Address& address, const std::string&, const std::string& other) const {
  Address out = address;
  out.service = other;
  return out;
}

Middleware& thrift() { return *registered().front(); }

void register_middleware(std::unique_ptr<Middleware> middleware) {
  for (const std::string& scheme : middleware->schemes()) {
    if (find_middleware(scheme) != nullptr) return;
  }
  registered().push_back(std::move(middleware));
}

Middleware* find_middleware(std::string_view scheme) {
  for (const auto& each : registered()) {
    const auto schemes = each->schemes();
    if (std::find(schemes.begin(), schemes.end(), scheme) != schemes.end()) return each.get();
  }
  return nullptr;
}

std::vector<Middleware*> middlewares() {
  std::vector<Middleware*> out;
  for (const auto& each : registered()) out.push_back(each.get());
  return out;
}

std::string address_forms() {
  std::vector<std::string> forms;
  for (const auto& each : registered()) {
    for (std::string& form : each->forms()) forms.push_back(std::move(form));
  }
  std::string out;
  for (std::size_t i = 0; i < forms.size(); ++i)
    out += (i == 0 ? "" : i + 1 == forms.size() ? " or " : ", ") + forms[i];
  return out;
}

Middleware& middleware_of(const Address& address) {
  if (address.kind != Address::Kind::kOther) return thrift();
  Middleware* found = find_middleware(address.scheme);
  SENTREE_ASSERT(found != nullptr);  // there is no such address otherwise
  return *found;
}

Result<std::unique_ptr<Caller>> connect(const Address& address, idl::ServicePtr interface, ClientOptions options) {
  return middleware_of(address).connect(address, std::move(interface), std::move(options));
}

Result<std::unique_ptr<Opened>> serve(const Address& address, std::vector<NamedService> services,
                                      ServerOptions options) {
  return middleware_of(address).serve(address, std::move(services), std::move(options));
}

}  // namespace sentree::rpc
