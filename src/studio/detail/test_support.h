#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <deque>
#include <filesystem>
#include <optional>
#include <string>

#include "sentree/base/value.h"
#include "sentree/runtime/plan.h"
#include "sentree/text/json.h"

namespace sentree::studio {

/// A scenario of the recharge example in virtual time, limited to a duration.
inline runtime::Plan recharge_plan(const std::string& scenario, Duration duration) {
  auto loaded = runtime::load_scenario(std::filesystem::path(SENTREE_SOURCE_DIR) / "examples/recharge/scenarios" /
                                       (scenario + ".yaml"));
  EXPECT_TRUE(loaded.ok());
  loaded.value->duration = duration;
  loaded.value->virtual_time = true;
  auto plan = runtime::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok());
  return std::move(*plan.value);
}

/// A browser's side of a WebSocket, with nothing but sockets.
class TestClient {
 public:
  struct Options {
    std::string host;    // header; default: the server's own
    std::string origin;  // header; empty: none
    std::string path = "/api/ws";
    std::string version = "13";  // of WebSockets
  };
  explicit TestClient(std::uint16_t port) : TestClient(port, Options()) {}
  TestClient(std::uint16_t port, const Options& options) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    timeval patience{.tv_sec = 60, .tv_usec = 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) return;
    const std::string host = options.host.empty() ? "127.0.0.1:" + std::to_string(port) : options.host;
    write("GET " + options.path + " HTTP/1.1\r\nHost: " + host +
          "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: " + options.version +
          "\r\n"
          "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n" +
          (options.origin.empty() ? "" : "Origin: " + options.origin + "\r\n") + "\r\n");
    while (buffer_.find("\r\n\r\n") == std::string::npos && fill()) {
    }
    const std::size_t end = buffer_.find("\r\n\r\n");
    if (buffer_.size() > 12) status_ = std::atoi(buffer_.c_str() + 9);
    buffer_.erase(0, end == std::string::npos ? buffer_.size() : end + 4);
  }
  ~TestClient() { ::close(socket_); }
  TestClient(const TestClient&) = delete;
  TestClient& operator=(const TestClient&) = delete;

  /// Of the answer to the request: 101 if the socket is open.
  [[nodiscard]] int status() const { return status_; }

  void send(const std::string& text) {
    std::string frame{'\x81'};
    if (text.size() < 126) {
      frame += static_cast<char>(0x80U | text.size());
    } else {
      frame += static_cast<char>(0xFF);
      for (int shift = 56; shift >= 0; shift -= 8)
        frame += static_cast<char>((static_cast<std::uint64_t>(text.size()) >> static_cast<unsigned>(shift)) & 0xFFU);
    }
    frame += std::string(4, '\0');  // a mask that changes nothing
    write(frame + text);
  }

  /// The next message; nothing once the socket is closed.
  std::optional<std::string> receive() {
    for (std::string message;;) {
      if (!need(2)) return std::nullopt;
      const auto at = [&](std::size_t i) { return static_cast<std::uint8_t>(buffer_[i]); };
      const bool is_last = (at(0) & 0x80U) != 0;
      const unsigned op = at(0) & 0x0FU;
      std::uint64_t size = at(1) & 0x7FU;
      std::size_t head = 2;
      if (size >= 126) {
        const std::size_t bytes = size == 126 ? 2 : 8;
        if (!need(2 + bytes)) return std::nullopt;
        size = 0;
        for (std::size_t i = 0; i < bytes; ++i) size = size << 8U | at(2 + i);
        head += bytes;
      }
      if (!need(head + size)) return std::nullopt;
      const std::string text = buffer_.substr(head, size);
      buffer_.erase(0, head + size);
      constexpr unsigned kText = 1;
      constexpr unsigned kClose = 8;
      if (op == kClose) return std::nullopt;
      if (op > kText) continue;
      message += text;
      if (is_last) return message;
    }
  }

  /// The next message as data; null at the end.
  Value next() {
    const auto text = receive();
    if (!text) return {};
    auto value = text::parse_json(*text);
    EXPECT_TRUE(value.has_value()) << text->substr(0, 200);
    return value ? std::move(*value) : Value();
  }

  /// The next message of that type; null at the end. Others are passed over.
  Value next(std::string_view type) {
    for (;;) {
      Value message = next();
      if (message.is_null() || message.find("type")->text() == type) return message;
    }
  }

 private:
  void write(const std::string& bytes) {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const auto count = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;
      sent += static_cast<std::size_t>(count);
    }
  }
  bool fill() {
    char bytes[65536];
    const auto count = ::recv(socket_, bytes, sizeof bytes, 0);
    if (count <= 0) return false;
    buffer_.append(bytes, static_cast<std::size_t>(count));
    return true;
  }
  bool need(std::size_t bytes) {
    while (buffer_.size() < bytes) {
      if (!fill()) return false;
    }
    return true;
  }

  int socket_;
  int status_ = 0;
  std::string buffer_;
};

}  // namespace sentree::studio
