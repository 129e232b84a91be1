#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sentree::idl {

/// Why a call has no result. One vocabulary, in charts, recordings and on the wire.
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

}  // namespace sentree::idl
