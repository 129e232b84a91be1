#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/rpc/call.h"
#include "sentree/rpc/detail/connection.h"

/// The way out of a server's connection. Private to the library.
namespace sentree::rpc {

/// Calls of one connection that may be without an answer; what comes after them is not read until one has it.
inline constexpr std::size_t kAnswersOwedMax = 16;

/// What an answer belongs to.
struct Question {
  const idl::Method* method = nullptr;
  std::int32_t sequence = 0;
};

/// Sends the answers of one connection from whichever thread gives them. None of those waits: what the socket does not
/// take at once is sent by the thread that reads the connection, between two messages. Outlives the connection.
class Answers {
 public:
  /// In the thread that reads.
  Answers(Connection& connection, std::chrono::milliseconds send_time_max);
  ~Answers();
  Answers(const Answers&) = delete;
  Answers& operator=(const Answers&) = delete;

  // Of the thread that reads.

  /// Waits for a message; meanwhile sends what is left over. Not kOk: the peer has gone. Throws WireError.
  [[nodiscard]] StreamStatus wait();
  /// One more answer is owed.
  void owe();
  /// In place of one: a failure that the server itself tells.
  void fail(const std::string& method, std::int32_t sequence, const std::string& why, std::int32_t type);
  /// The connection ends; answers that come later are dropped.
  void close();

  // Of any thread.

  void give(const Question& question, Outcome outcome, bool is_last);

 private:
  // With the lock held.
  void dispatch();
  void wake();

  std::mutex mutex_;
  Connection* connection_;  // null: closed
  const std::chrono::milliseconds send_time_max_;
  const std::thread::id reader_ = std::this_thread::get_id();
  std::size_t owed_ = 0;
  std::vector<std::uint8_t> rest_;  // of answers that the socket did not take
  bool sends_rest_ = false;         // the reader does
  std::string broken_;              // why an answer could not be written
  bool polling_ = false;            // the reader waits for `wake_` too
  const int wake_;                  // an eventfd; -1: no descriptor was left
};

}  // namespace sentree::rpc
