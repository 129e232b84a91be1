#pragma once

#include <memory>
#include <string>

#include "sentree/rpc/detail/stream.h"
#include "sentree/rpc/detail/wire.h"

namespace sentree::rpc {

/// A stream with the messages on it.
struct Connection {
  Connection(std::unique_ptr<Stream> s, const Limits& limits) : stream(std::move(s)), in(stream.get(), limits) {}

  std::unique_ptr<Stream> stream;
  Inbox in;
  Outbox out;
  std::unique_ptr<Wire> wire;
};

/// What a service's answer means for its caller, checked against the IDL: a result brought into form, a declared
/// exception with its fields; everything else becomes kProtocol with a message that names the method.
[[nodiscard]] Outcome checked(const idl::Method& method, Outcome outcome);

/// The declared exception of that type name, or null.
[[nodiscard]] const idl::Field* declared_exception(const idl::Method& method, std::string_view type);

}  // namespace sentree::rpc
