#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sentree/base/result.h"
#include "sentree/groot/groot2.h"

namespace sentree::groot {

/// Asks the Groot 2 publisher of a program that executes a tree. For one thread.
class Client {
 public:
  static constexpr std::chrono::milliseconds kPatience{1000};
  /// Larger answers are not taken.
  static constexpr std::int64_t kReplyBytesMax = 64 << 20;

  /// @param address  "zmq://HOST:PORT", "HOST:PORT" or "HOST"; the port is 1667 unless given. Nobody need be there yet.
  /// Errors: groot.not-built, groot.bad-address.
  [[nodiscard]] static Result<std::unique_ptr<Client>> connect(const std::string& address);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Waits for the answer, at most `kPatience`. Errors: groot.silent (nobody answers), groot.refused, groot.reply.
  [[nodiscard]] Result<Reply> ask(Ask type, std::optional<std::string> body = {});
  /// A node whose hook was reached meanwhile; nothing: none.
  [[nodiscard]] std::optional<std::uint16_t> next_reached();

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::groot
