#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "sentree/idl/schema.h"
#include "sentree/rpc/call.h"
#include "sentree/rpc/stream.h"

namespace sentree::rpc {

/// A connection of a line, kept by whoever sends on it.
struct Link {
  explicit Link(std::unique_ptr<Stream> s) : stream(std::move(s)) {}
  virtual ~Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// What was prepared to be sent.
  [[nodiscard]] virtual std::pair<const std::uint8_t*, std::size_t> message() = 0;

  std::unique_ptr<Stream> stream;
};

/// The client's side of one service on a stream, in the words of one middleware: a connection, made when it is needed
/// and made anew, with backoff, after it broke, and the replies that it still owes. Whoever uses it sees to it that
/// it is the only one, but for `interrupt` and `counts`.
class Line {
 public:
  virtual ~Line() = default;

  /// Connects if need be, and sends nothing. No value: why it cannot.
  [[nodiscard]] virtual tl::expected<void, CallError> open(Deadline deadline) = 0;
  /// Connects if need be and sends; `arguments` conform. An outcome: there is nothing to wait for.
  [[nodiscard]] virtual std::optional<Outcome> send(const idl::Method& method, const Value& arguments,
                                                    Deadline deadline) = 0;
  /// Waits for the reply to what was sent last.
  [[nodiscard]] virtual Outcome receive(const idl::Method& method, Deadline deadline) = 0;

  /// In steps that do not wait: what to `Stream::send_now` of, while another thread may `receive`. Null: all is left
  /// to `send`.
  [[nodiscard]] virtual std::shared_ptr<Link> prepare(const idl::Method& method, const Value& arguments) = 0;
  /// Sends what comes behind those bytes. An outcome as of `send`.
  [[nodiscard]] virtual std::optional<Outcome> send_rest(std::size_t sent, Deadline deadline) = 0;

  /// Takes everything that has come already; notices a peer that has gone.
  virtual void take_late_replies() = 0;
  /// Whether what comes next may belong to an earlier call.
  [[nodiscard]] virtual bool owes() const = 0;
  /// When the oldest reply that is owed is given up, and the connection with it; `kNoDeadline` without one.
  [[nodiscard]] virtual Deadline gives_up() const = 0;
  virtual void drop() = 0;
  /// Null: there is none.
  [[nodiscard]] virtual std::shared_ptr<Link> connection() const = 0;

  /// From now on `interrupt` concerns the next call.
  virtual void begin() = 0;
  /// Ends what waits, from any thread; for good, or until `begin`.
  virtual void interrupt(bool for_good) = 0;

  struct Counts {
    std::uint64_t late_replies = 0;
    std::uint64_t connections = 0;
  };
  [[nodiscard]] virtual Counts counts() const = 0;

  [[nodiscard]] virtual CallError unreachable(const std::string& why) const = 0;
  [[nodiscard]] virtual CallError late(const std::string& what) const = 0;
};

}  // namespace sentree::rpc
