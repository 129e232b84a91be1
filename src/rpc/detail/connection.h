#pragma once

#include <memory>
#include <string>
#include <utility>

#include "sentree/rpc/detail/wire.h"
#include "sentree/rpc/line.h"

namespace sentree::rpc {

/// A stream with the messages on it.
struct Connection final : Link {
  Connection(std::unique_ptr<Stream> s, const Limits& limits) : Link(std::move(s)), in(stream.get(), limits) {}

  [[nodiscard]] std::pair<const std::uint8_t*, std::size_t> message() override { return out.finish(); }

  Inbox in;
  Outbox out;
  std::unique_ptr<Wire> wire;
};

/// The declared exception of that type name, or null.
[[nodiscard]] const idl::Field* declared_exception(const idl::Method& method, std::string_view type);

}  // namespace sentree::rpc
