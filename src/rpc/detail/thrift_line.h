#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "sentree/rpc/client.h"
#include "sentree/rpc/detail/connection.h"
#include "sentree/rpc/line.h"

/// The client's side of a socket that speaks Thrift. Private to the library.
namespace sentree::rpc {

/// Thrift's messages, whose numbers tell a late reply from the one that is waited for.
class ThriftLine final : public Line {
 public:
  ThriftLine(const Address& address, const ClientOptions& options, std::shared_ptr<const TlsContext> tls);
  ThriftLine(const ThriftLine&) = delete;
  ThriftLine& operator=(const ThriftLine&) = delete;

  /// Sends and waits for the reply; `arguments` conform.
  [[nodiscard]] Outcome exchange(const idl::Method& method, const Value& arguments, Deadline deadline);

  [[nodiscard]] tl::expected<void, CallError> open(Deadline deadline) override { return connected(deadline); }
  [[nodiscard]] std::optional<Outcome> send(const idl::Method& method, const Value& arguments,
                                            Deadline deadline) override;
  [[nodiscard]] Outcome receive(const idl::Method& method, Deadline deadline) override;
  [[nodiscard]] std::shared_ptr<Link> prepare(const idl::Method& method, const Value& arguments) override;
  [[nodiscard]] std::optional<Outcome> send_rest(std::size_t sent, Deadline deadline) override;
  void take_late_replies() override;
  [[nodiscard]] bool owes() const override { return !owed_.empty(); }
  [[nodiscard]] Deadline gives_up() const override { return owed_.empty() ? kNoDeadline : owed_.front().given_up; }
  void drop() override;
  [[nodiscard]] std::shared_ptr<Link> connection() const override;
  void begin() override;
  void interrupt(bool for_good) override;
  [[nodiscard]] Counts counts() const override;
  [[nodiscard]] CallError unreachable(const std::string& why) const override;
  [[nodiscard]] CallError late(const std::string& what) const override;

 private:
  // A call whose deadline passed before its reply.
  struct Owed {
    std::int32_t sequence = 0;
    const idl::Method* method = nullptr;
    Deadline given_up;
  };

  [[nodiscard]] tl::expected<void, CallError> connected(Deadline deadline);
  [[nodiscard]] tl::expected<void, CallError> connect_anew(Deadline deadline);
  [[nodiscard]] tl::expected<void, CallError> settle(Deadline deadline);
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

  std::string service_;     // named before each method; empty: none is
  bool is_settled_ = true;  // whether it is
  std::deque<Owed> owed_;
  std::int32_t sequence_ = 0;
  bool oneway_ = false;  // what was sent last
  Deadline idle_since_{};
  int failures_ = 0;
  Deadline next_attempt_{};
  std::string last_failure_;
};

}  // namespace sentree::rpc
