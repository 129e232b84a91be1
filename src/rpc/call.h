#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/idl/schema.h"

namespace sentree::rpc {

enum class CallErrorKind : std::uint8_t {
  kException,    ///< The service threw an exception that its IDL declares; `exception` and `data` say which.
  kVetoed,       ///< A monitor or an observer refused the request; nothing was sent.
  kUnreachable,  ///< No connection, or it broke before the reply; the service may or may not have acted.
  kLate,         ///< The deadline passed; a reply that still comes reaches nobody.
  kProtocol,     ///< The peer broke the protocol, knows no such method, or failed without a declared exception.
  kArguments,    ///< The arguments do not fit the IDL; nothing was sent.
  kInterrupted,  ///< Who has called was gone when the outcome came; the service may or may not have acted.
};

/// "exception", "vetoed", "unreachable", "late", "protocol", "arguments", "interrupted".
[[nodiscard]] std::string_view to_string(CallErrorKind kind);
[[nodiscard]] std::optional<CallErrorKind> parse_call_error_kind(std::string_view word);
/// All of these words.
[[nodiscard]] std::vector<std::string> call_error_kinds();

struct CallError {
  CallErrorKind kind = CallErrorKind::kUnreachable;
  std::string message;    ///< For people; names the service or address and the way out.
  std::string exception;  ///< kException: the name of its type, without the file it comes from.
  Value data;             ///< kException: its fields.

  friend bool operator==(const CallError&, const CallError&) = default;
};

/// The result of a call (null for void and oneway), or why there is none.
using Outcome = tl::expected<Value, CallError>;

/// Calls wait on the wall clock that never jumps.
using Deadline = std::chrono::steady_clock::time_point;
inline constexpr Deadline kNoDeadline = Deadline::max();

}  // namespace sentree::rpc
