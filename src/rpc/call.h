#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "sentree/base/message.h"
#include "sentree/base/value.h"
#include "sentree/idl/schema.h"

namespace sentree::rpc {

enum class CallErrorKind : std::uint8_t {
  kException,    ///< The service threw an exception that its IDL declares; `exception` and `data` say which.
  kVetoed,       ///< A hook refused the request; nothing was sent.
  kUnreachable,  ///< No connection, or it broke before the reply; the service may or may not have acted.
  kLate,         ///< The deadline passed; a reply that still comes goes to `Hook::late` and to nobody else.
  kProtocol,     ///< The peer broke the protocol, knows no such method, or failed without a declared exception.
  kArguments,    ///< The arguments do not fit the IDL; nothing was sent and no hook saw it.
};

/// "exception", "vetoed", "unreachable", "late", "protocol", "arguments".
[[nodiscard]] std::string_view to_string(CallErrorKind kind);

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

/// What a call carries beside method and arguments.
struct CallContext {
  std::string_view source;  ///< Who calls, as observations name it.
  std::uint64_t call = 0;   ///< The caller's number of the call, which joins request and outcome.
  Deadline deadline = kNoDeadline;
};

/// One call as hooks see it: the same for every transport. Borrowed for the hook's call.
struct Call {
  std::string_view source;
  std::string_view target;  ///< The service's name in the project.
  const idl::Method& method;
  const Value& arguments;  ///< In the form of `idl::conform`.
  std::uint64_t id = 0;
};

/// The one seam that every call passes through. Monitors, recorder and studio see what a `Hook` sees; no
/// code per service. The functions are called in the caller's thread, `late` in any; hooks must be thread-safe.
class Hook {
 public:
  struct Verdict {
    std::optional<std::string> veto;  ///< Why the request must not be sent.
    std::optional<Value> arguments;   ///< What to send instead; checked against the IDL again.
  };

  virtual ~Hook() = default;
  /// Before the request is sent.
  virtual Verdict before(const Call&) { return {}; }
  /// Before the caller gets the result; for oneway calls once the request is sent.
  virtual void replied(const Call&, const Value& /*result*/) {}
  /// Before the caller gets the error; also after a veto.
  virtual void failed(const Call&, const CallError&) {}
  /// A reply that came after `failed` had reported kLate. Dropped after this.
  virtual void late(const Call&, const Outcome&) {}
};

/// Lamport's clock of one process. Given to clients and servers, it stamps calls between processes so that
/// an effect never has a smaller stamp than its cause. Thread-safe, lock-free.
///
/// On the wire a stamp is an i64 field of id 32767 in the struct of arguments and of results; peers that do not know it
/// skip it, as Thrift demands of unknown fields.
class LogicalClock {
 public:
  [[nodiscard]] CausalStamp now() const { return stamp_.load(std::memory_order_acquire); }
  /// A new stamp, greater than all before: for an event of this process, such as sending.
  CausalStamp advance() { return stamp_.fetch_add(1, std::memory_order_acq_rel) + 1; }
  /// Afterwards `now()` is greater than `seen`: for receiving.
  void receive(CausalStamp seen);

 private:
  std::atomic<CausalStamp> stamp_{0};
};

/// Largest stamp accepted from a peer, so that a hostile one cannot exhaust the clock.
inline constexpr CausalStamp kStampMax = CausalStamp{1} << 62U;

}  // namespace sentree::rpc
