#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/idl/call_error.h"
#include "sentree/idl/schema.h"

namespace sentree::rpc {

using idl::call_error_kinds;
using idl::CallErrorKind;
using idl::parse_call_error_kind;
using idl::to_string;

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
