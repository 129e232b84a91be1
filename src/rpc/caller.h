#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

#include "sentree/base/value.h"
#include "sentree/idl/schema.h"
#include "sentree/rpc/call.h"

namespace sentree::rpc {

struct ClientCounters {
  std::uint64_t calls = 0;
  std::uint64_t errors = 0;        ///< All kinds but kException.
  std::uint64_t late = 0;          ///< Calls whose deadline passed.
  std::uint64_t late_replies = 0;  ///< Of those, replies that still came; the rest was never answered.
  std::uint64_t connections = 0;   ///< Made so far.
};

/// The caller's side of a service elsewhere, over whatever middleware: nobody waits for a call. Calls are made one
/// after the other, in the order given. Thread-safe.
class Caller {
 public:
  /// Called once for each call: before `call` returns (a veto, wrong arguments, too many calls, a closed client), or
  /// from a thread of the middleware, which does nothing else meanwhile. It may call the client, but not destroy it.
  using Done = std::function<void(Outcome)>;

  virtual ~Caller() = default;

  [[nodiscard]] virtual const idl::Service& interface() const = 0;

  /// `method` is of `interface()`; `arguments` is a map of names, or null for none; missing ones take their default.
  virtual void call(const idl::Method& method, Value arguments, Deadline deadline, Done done) = 0;
  /// By name; an unknown one is kArguments with the nearest name.
  void call(std::string_view method, Value arguments, Deadline deadline, Done done);

  /// Connects now instead of with the first call; `done` as of `call`, with null once calls can be made, else why not
  /// (kUnreachable, kLate). Calls that are made meanwhile wait behind it, until `deadline` at most. Not counted.
  virtual void open(Deadline /*deadline*/, const Done& done) { done(Value()); }

  /// Fails all calls, now and later, as kUnreachable. Idempotent.
  virtual void close() = 0;
  /// The same, and waits: once it returns, no `done` is in progress, and none is called for what was asked before.
  /// Not from a `done`.
  virtual void end() = 0;

  [[nodiscard]] virtual ClientCounters counters() const = 0;
};

/// An interface with one method, `sentree_ping`, which nobody serves: what a server says of it shows that it lives, and
/// under which names it serves.
[[nodiscard]] const idl::ServicePtr& nobodys_service();

/// One call whose outcome is waited for.
[[nodiscard]] Outcome call_and_wait(Caller& caller, std::string_view method, Value arguments, Deadline deadline);

}  // namespace sentree::rpc
