#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "sentree/rpc/client.h"
#include "sentree/rpc/detail/connection.h"

/// The client's side of a socket. Private to the library.
namespace sentree::rpc {

/// A connection to one service, made when it is needed and made anew, with backoff, after it broke; and the replies
/// that it still owes. Whoever uses it sees to it that it is the only one, but for `interrupt` and `counts`.
class Line {
 public:
  Line(const Address& address, const ClientOptions& options, std::shared_ptr<const TlsContext> tls);
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  /// Sends and waits for the reply; `arguments` conform.
  [[nodiscard]] Outcome exchange(const idl::Method& method, const Value& arguments, Deadline deadline);

  /// In two steps: connects if need be and sends. An outcome: there is nothing to wait for.
  [[nodiscard]] std::optional<Outcome> send(const idl::Method& method, const Value& arguments, Deadline deadline);
  /// Waits for the reply to what was sent last.
  [[nodiscard]] Outcome receive(const idl::Method& method, Deadline deadline);

  /// In steps that do not wait: what `send_now` sends of. Null: all is left to `send`.
  [[nodiscard]] std::shared_ptr<Connection> prepare(const idl::Method& method, const Value& arguments);
  /// The bytes of what was prepared that go at once. Meanwhile another thread may `receive`.
  [[nodiscard]] static std::size_t send_now(Connection& connection);
  /// Sends what comes behind those. An outcome as of `send`.
  [[nodiscard]] std::optional<Outcome> send_rest(std::size_t sent, Deadline deadline);

  /// Everything that has come already; notices a peer that has gone.
  void take_late_replies();
  [[nodiscard]] bool owes() const { return !owed_.empty(); }
  /// When the oldest reply that is owed is given up, and the connection with it; `kNoDeadline` without one.
  [[nodiscard]] Deadline gives_up() const { return owed_.empty() ? kNoDeadline : owed_.front().given_up; }
  void drop();
  /// Null: there is none.
  [[nodiscard]] std::shared_ptr<Connection> connection() const;

  /// From now on `interrupt` concerns the next call.
  void begin();
  /// Ends what waits, from any thread; for good, or until `begin`.
  void interrupt(bool for_good);

  struct Counts {
    std::uint64_t late_replies = 0;
    std::uint64_t connections = 0;
  };
  [[nodiscard]] Counts counts() const;

  [[nodiscard]] CallError unreachable(const std::string& why) const;
  [[nodiscard]] CallError late(const std::string& what) const;

 private:
  // A call whose deadline passed before its reply.
  struct Owed {
    std::int32_t sequence = 0;
    const idl::Method* method = nullptr;
    Deadline given_up;
  };

  [[nodiscard]] tl::expected<void, CallError> connected(Deadline deadline);
  void write(const idl::Method& method, const Value& arguments);
  [[nodiscard]] std::optional<Outcome> transmit(std::size_t from, Deadline deadline);
  [[nodiscard]] CallError broken(const WireError& error);
  void take_late(const MessageHead& head);
  [[nodiscard]] Outcome outcome_of(const idl::Method& method, ReplyBody body);
  [[nodiscard]] std::string where() const;

  const Address address_;
  const ClientOptions options_;
  const std::shared_ptr<const TlsContext> tls_;
  Resolver resolver_;

  mutable std::mutex mutex_;  // of what `interrupt` and `counts` look at
  bool closed_ = false;
  bool interrupted_ = false;
  std::shared_ptr<Connection> connection_;
  Counts counts_;

  std::deque<Owed> owed_;
  std::int32_t sequence_ = 0;
  bool oneway_ = false;  // what was sent last
  Deadline idle_since_{};
  int failures_ = 0;
  Deadline next_attempt_{};
  std::string last_failure_;
};

}  // namespace sentree::rpc
