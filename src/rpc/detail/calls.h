#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include "sentree/idl/conform.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/stream.h"

/// What clients of both kinds do around a call. Private to the library.
namespace sentree::rpc {

/// Checks and counts the calls of a client.
class Calls {
 public:
  /// Brings the arguments into form. An outcome: that is all, nothing is sent.
  [[nodiscard]] std::optional<Outcome> admit(const idl::Method& method, Value& arguments);
  void ended(const Outcome& outcome);
  [[nodiscard]] ClientCounters counters() const;

 private:
  std::atomic<std::uint64_t> calls_{0};
  std::atomic<std::uint64_t> errors_{0};
  std::atomic<std::uint64_t> late_{0};
};

/// The options with a target: by default the interface's name.
[[nodiscard]] inline ClientOptions named(ClientOptions options, const idl::Service& interface) {
  if (options.target.empty()) options.target = interface.name;
  return options;
}

[[nodiscard]] inline tl::unexpected<CallError> refused(CallErrorKind kind, std::string message) {
  return tl::unexpected(CallError{kind, std::move(message), {}, {}});
}

/// What a client to another process needs before it can be made: an address that can be connected to, the certificates.
/// Null without TLS.
[[nodiscard]] Result<std::shared_ptr<const TlsContext>> prepare_remote(const Address& address, const TlsFiles& files);

}  // namespace sentree::rpc
