#pragma once

#include <fmt/format.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "sentree/base/value.h"
#include "sentree/http/detail/test_peer.h"
#include "sentree/project/plan.h"
#include "sentree/text/json.h"

namespace sentree::studio {

/// A scenario of the recharge example in virtual time, limited to a duration.
inline project::Plan recharge_plan(const std::string& scenario, Duration duration) {
  auto loaded = project::load_scenario(std::filesystem::path(SENTREE_SOURCE_DIR) / "examples/recharge/scenarios" /
                                       (scenario + ".yaml"));
  EXPECT_TRUE(loaded.ok());
  loaded.value->duration = duration;
  loaded.value->virtual_time = true;
  auto plan = project::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok());
  return std::move(*plan.value);
}

/// A browser's side of a WebSocket.
class TestClient {
 public:
  struct Options {
    std::string host;    // header; default: the server's own
    std::string origin;  // header; empty: none
    std::string path = "/api/ws";
    std::string version = "13";  // of WebSockets
  };
  explicit TestClient(std::uint16_t port) : TestClient(port, Options()) {}
  TestClient(std::uint16_t port, const Options& options) : peer_(port) {
    const std::string host = options.host.empty() ? fmt::format("127.0.0.1:{}", port) : options.host;
    peer_.write(
        fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\nUpgrade: websocket\r\nConnection: "
                    "Upgrade\r\nSec-WebSocket-Version: {}\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n{}\r\n",
                    options.path, host, options.version,
                    options.origin.empty() ? "" : fmt::format("Origin: {}\r\n", options.origin)));
    const std::string head = peer_.head();
    if (head.size() > 12) status_ = std::atoi(head.c_str() + 9);
  }

  /// Of the answer to the request: 101 if the socket is open.
  [[nodiscard]] int status() const { return status_; }

  void send(const std::string& text) { peer_.frame(http::kLast | http::kText, text); }

  /// The next message; nothing once the socket is closed.
  std::optional<std::string> receive() {
    for (std::string message;;) {
      const auto frame = peer_.next();
      if (!frame || frame->op() == http::kClose) return std::nullopt;
      if (frame->op() > http::kText) continue;
      message += frame->text;
      if ((frame->first & http::kLast) == 0) continue;
      // For web/e2e/protocol.mjs, which compares what is sent with its description.
      if (const char* file = std::getenv("SENTREE_MESSAGES")) std::ofstream(file, std::ios::app) << message << '\n';
      return message;
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
  http::Peer peer_;
  int status_ = 0;
};

}  // namespace sentree::studio
