#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "sentree/rpc/client.h"
#include "sentree/rpc/detail/connection.h"

/// The client's side of a socket. Private to the library.
namespace sentree::rpc {

class Remote {
 public:
  Remote(const Address& address, std::string target, const ClientOptions& options,
         std::shared_ptr<const TlsContext> tls);
  ~Remote();
  Remote(const Remote&) = delete;
  Remote& operator=(const Remote&) = delete;

  /// Sends and waits for the reply; `arguments` conform.
  [[nodiscard]] Outcome exchange(const idl::Method& method, const Value& arguments, const CallContext& context);
  void interrupt(bool for_good);

  struct Counts {
    std::uint64_t late_replies = 0;
    std::uint64_t connections = 0;
  };
  [[nodiscard]] Counts counts() const;

 private:
  // A call whose deadline passed before its reply.
  struct Owed {
    std::int32_t sequence = 0;
    const idl::Method* method = nullptr;
    Value arguments;
    std::string source;
    std::uint64_t call = 0;
    Deadline given_up;
  };

  // Being the one who may use the connection; others wait, but not beyond their deadline.
  [[nodiscard]] bool acquire(Deadline deadline);
  void release();

  // The following need the connection.
  [[nodiscard]] Outcome talk(const idl::Method& method, const Value& arguments, const CallContext& context);
  [[nodiscard]] Outcome await_reply(const idl::Method& method, const Value& arguments, const CallContext& context,
                                    std::int32_t sequence);
  [[nodiscard]] tl::expected<void, CallError> connected(Deadline deadline);
  void drop();
  void report_late(MessageHead& head);
  void take_late_replies();
  [[nodiscard]] Outcome outcome_of(const idl::Method& method, ReplyBody body);

  void start_collector();
  void collect();

  [[nodiscard]] CallError unreachable(const std::string& why) const;
  [[nodiscard]] CallError late(const std::string& what) const;
  [[nodiscard]] std::string where() const;

  const Address address_;
  const std::string target_;
  const ClientOptions options_;
  const std::shared_ptr<const TlsContext> tls_;
  Resolver resolver_;

  mutable std::mutex mutex_;
  std::condition_variable freed_;      // waited for by callers
  std::condition_variable collector_;  // waited for by the collector
  bool busy_ = false;
  int waiting_ = 0;
  bool closed_ = false;
  bool interrupted_ = false;
  std::shared_ptr<Connection> connection_;
  Counts counts_;
  std::size_t owed_count_ = 0;
  bool collecting_ = false;

  // Only of the one who has the connection.
  std::deque<Owed> owed_;
  std::int32_t sequence_ = 0;
  Deadline idle_since_{};
  int failures_ = 0;
  Deadline next_attempt_{};
  std::string last_failure_;

  std::thread collector_thread_;
};

}  // namespace sentree::rpc
