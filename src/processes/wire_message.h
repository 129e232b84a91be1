#pragma once

#include "sentree/base/message.h"
#include "sentree/base/value.h"

namespace sentree::processes {

/// The struct Message of interfaces/observer.thrift, and back. What is missing or of another type is left out.
[[nodiscard]] Value to_wire(const Message& message);
[[nodiscard]] Message from_wire(const Value& wire);

/// What `to_json(Message)` says, once parsed.
[[nodiscard]] Message message_from_json(const Value& json);

/// The JSON object in a string member, as ports and observations cross between processes; empty if it is none.
[[nodiscard]] Map json_object(const Value* text);
/// A member's text or number; empty or 0 if it is missing.
[[nodiscard]] std::string text_of(const Value& map, std::string_view key);
[[nodiscard]] std::uint64_t number_of(const Value& map, std::string_view key);

/// Octets on the wire, and back; what is none is empty.
[[nodiscard]] Value octets_of(std::string_view text);
[[nodiscard]] std::string_view text_in(const Value* octets);

}  // namespace sentree::processes
