#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/caller.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/server.h"

namespace sentree::rpc {

/// Something that was opened and goes when it is destroyed.
class Opened {
 public:
  virtual ~Opened() = default;
  /// Where it is reached, chosen parts filled in; for people and for `Address::parse`.
  [[nodiscard]] virtual std::string address() const = 0;
  /// Ends it, and waits for what is in progress. Idempotent.
  virtual void stop() = 0;
};

/// A service, or a stream of data, that a network tells of.
struct NetworkEntry {
  std::string name;
  std::string at;    ///< An address of ours.
  std::string kind;  ///< "tcp", as the network says; may be empty.
};

/// A way to reach services, chosen by the scheme of their address. Runs, skills, components and commands know this
/// and nothing of what is behind it. Thread-safe once registered.
class Middleware {
 public:
  virtual ~Middleware() = default;

  /// Of its addresses, without the colon.
  [[nodiscard]] virtual std::vector<std::string> schemes() const = 0;
  /// How its addresses look, for messages: "yarp:/port".
  [[nodiscard]] virtual std::vector<std::string> forms() const = 0;
  /// One line for people: what it speaks, and who would answer.
  [[nodiscard]] virtual std::string about() const = 0;
  /// Why no address of its can be opened here, and how to get what is missing; empty: they can.
  [[nodiscard]] virtual std::string lacks() const { return {}; }
  /// Whether the address can be meant. Error: rpc.address.
  [[nodiscard]] virtual Result<void> check(const Address& address) const = 0;
  /// Whether both can be used in one process. Error: rpc.address.
  [[nodiscard]] virtual Result<void> check_beside(const Address& /*address*/, const Address& /*other*/) const {
    return {};
  }

  /// Whether what the address says can be meant of a service that is called, or published or read, there. Error:
  /// rpc.address.
  [[nodiscard]] virtual Result<void> check_service(const Address& /*address*/,
                                                   const idl::Service& /*interface*/) const {
    return {};
  }
  /// Whether that method can be called there, and is not only heard. Error: rpc.address, with what can be.
  [[nodiscard]] virtual Result<void> check_called(const Address& /*address*/, const idl::Service& /*interface*/,
                                                  const idl::Method& /*method*/) const {
    return {};
  }

  /// A service elsewhere. Nothing is asked of the network before the first call.
  [[nodiscard]] virtual Result<std::unique_ptr<Caller>> connect(const Address& address, idl::ServicePtr interface,
                                                                ClientOptions options) = 0;
  /// Serves until what is returned is stopped. Listens on loopback only, unless the address says otherwise and
  /// `ServerOptions::insecure`, or its own means, allow it.
  [[nodiscard]] virtual Result<std::unique_ptr<Opened>> serve(const Address& address,
                                                              std::vector<NamedService> services,
                                                              ServerOptions options) = 0;

  /// What is published elsewhere on one-way methods. From a thread of the middleware; the arguments conform.
  using Take = std::function<void(const idl::Method& method, Value arguments)>;
  struct SubscribeOptions {
    std::string target;  ///< The service's name in the project.
    std::function<void(const std::string&)> problem;
    bool optional = false;  ///< Nobody need publish: that nobody does is no problem.
  };
  /// Whether that address is one to read from. What is there may say the interface; null: it is not known.
  [[nodiscard]] virtual bool is_source(const Address& /*address*/, const idl::Service* /*interface*/) const {
    return false;
  }
  /// Only of an address that is a source.
  [[nodiscard]] virtual Result<std::unique_ptr<Opened>> subscribe(const Address& address, idl::ServicePtr interface,
                                                                  Take take, SubscribeOptions options);

  /// What may be the matter where nothing came of a source that is subscribed to; empty: that is not known.
  [[nodiscard]] virtual std::string why_silent(const Address& /*address*/, const idl::Service& /*interface*/,
                                               const std::string& /*target*/) {
    return {};
  }

  /// What others say to each other, without having been asked for it. From a thread of the middleware, one thing after
  /// the other; values conform.
  struct Hearing {
    /// Returns a number of its own, not 0, by which the outcome is told.
    std::function<std::uint64_t(const idl::Method& method, Value arguments)> request;
    /// By 0: what was asked has not been heard.
    std::function<void(std::uint64_t call, const idl::Method& method, Outcome outcome)> outcome;
  };
  /// Whether what others say at an address reaches anybody else. Error: rpc.address.
  [[nodiscard]] virtual Result<void> check_overheard(const Address& address, const idl::Service& interface) const;
  /// Only of an address that can be; nobody is answered, and nobody learns of it who does not ask who listens.
  [[nodiscard]] virtual Result<std::unique_ptr<Opened>> overhear(const Address& address, idl::ServicePtr interface,
                                                                 Hearing hearing, SubscribeOptions options);

  /// Only of a source: the same as text, whatever it is, without knowing its interface.
  [[nodiscard]] virtual Result<std::unique_ptr<Opened>> watch(const Address& address,
                                                              std::function<void(const std::string&)> take,
                                                              SubscribeOptions options);

  /// What the network offers. Error: rpc.address where there is nobody to ask, or who is to tell does not answer.
  [[nodiscard]] virtual Result<std::vector<NetworkEntry>> list(const Address& address,
                                                               std::chrono::milliseconds patience);

  /// The address of another service that whoever serves `address` serves beside it.
  [[nodiscard]] virtual Address beside(const Address& address, const std::string& service,
                                       const std::string& other) const;
};

/// Apache Thrift: unix:, tcp: and tls:. Always there.
[[nodiscard]] Middleware& thrift();

/// Makes a middleware known to this process, for good: by the program, before it starts threads. One of the same
/// schemes is there already: nothing happens.
void register_middleware(std::unique_ptr<Middleware> middleware);
/// Null: none of that scheme.
[[nodiscard]] Middleware* find_middleware(std::string_view scheme);
/// All, Thrift first.
[[nodiscard]] std::vector<Middleware*> middlewares();
/// "unix:/path, tcp://host:port or tls://host:port".
[[nodiscard]] std::string address_forms();

/// That of an address; Thrift's for local: too, which it refuses.
[[nodiscard]] Middleware& middleware_of(const Address& address);

/// By the middleware of the address.
[[nodiscard]] Result<std::unique_ptr<Caller>> connect(const Address& address, idl::ServicePtr interface,
                                                      ClientOptions options = {});
[[nodiscard]] Result<std::unique_ptr<Opened>> serve(const Address& address, std::vector<NamedService> services,
                                                    ServerOptions options = {});

}  // namespace sentree::rpc
