#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace sentree::http {

// Of the first octet of a frame: RFC 6455, 5.2.
inline constexpr unsigned kContinuation = 0;
inline constexpr unsigned kText = 1;
inline constexpr unsigned kBinary = 2;
inline constexpr unsigned kClose = 8;
inline constexpr unsigned kPing = 9;
inline constexpr unsigned kPong = 10;
inline constexpr unsigned kLast = 0x80;

/// The other side of a connection to a server of this machine: octets as they go over the wire.
class Peer {
 public:
  explicit Peer(std::uint16_t port, int receive_buffer = 0) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    timeval patience{.tv_sec = 60, .tv_usec = 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (receive_buffer > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Peer() {
    if (socket_ >= 0) end();
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  void write(const std::string& octets) {
    for (std::size_t sent = 0; sent < octets.size();) {
      const auto count = ::send(socket_, octets.data() + sent, octets.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;
      sent += static_cast<std::size_t>(count);
    }
  }

  // The head of the answer to a handshake.
  std::string upgrade(const std::string& more =
                          "Sec-WebSocket-Version: 13\r\n"
                          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n") {
    write("GET /socket HTTP/1.1\r\nHost: here\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n" + more +
          "\r\n");
    return head();
  }
  std::string head() {
    while (buffer_.find("\r\n\r\n") == std::string::npos && fill()) {
    }
    const std::size_t end = std::min(buffer_.find("\r\n\r\n"), buffer_.size());
    const std::string head = buffer_.substr(0, end);
    buffer_.erase(0, end + 4);
    return head;
  }

  void frame(unsigned first, const std::string& text, unsigned mask = 0x01020304) { write(framed(first, text, mask)); }
  static std::string framed(unsigned first, const std::string& text, unsigned mask = 0x01020304) {
    std::string octets{static_cast<char>(first)};
    const auto number = [&](std::size_t bytes) {
      for (std::size_t i = bytes; i > 0; --i) octets += static_cast<char>(text.size() >> (8 * (i - 1)) & 0xFFU);
    };
    if (text.size() < 126) {
      octets += static_cast<char>(0x80U | text.size());
    } else if (text.size() <= 0xFFFF) {
      octets += static_cast<char>(0xFE);
      number(2);
    } else {
      octets += static_cast<char>(0xFF);
      number(8);
    }
    std::string key;
    for (unsigned shift = 32; shift > 0; shift -= 8) key += static_cast<char>(mask >> (shift - 8) & 0xFFU);
    octets += key;
    for (std::size_t i = 0; i < text.size(); ++i) octets += static_cast<char>(text[i] ^ key[i % 4]);
    return octets;
  }

  struct Frame {
    unsigned first = 0;
    std::string text;
    unsigned op() const { return first & 0x0FU; }
    // Of a kClose.
    unsigned code() const {
      return text.size() < 2 ? 0
                             : static_cast<unsigned>(static_cast<unsigned char>(text[0])) << 8U |
                                   static_cast<unsigned char>(text[1]);
    }
  };
  // Nothing once the connection has ended.
  std::optional<Frame> next() {
    if (!need(2)) return std::nullopt;
    const auto octet = [&](std::size_t i) { return static_cast<unsigned char>(buffer_[i]); };
    Frame frame{.first = octet(0), .text = {}};
    std::size_t size = octet(1) & 0x7FU;
    std::size_t begin = 2;
    if (size >= 126) {
      begin += size == 126 ? 2 : 8;
      if (!need(begin)) return std::nullopt;
      size = 0;
      for (std::size_t i = 2; i < begin; ++i) size = size << 8U | octet(i);
    }
    if (!need(begin + size)) return std::nullopt;
    frame.text = buffer_.substr(begin, size);
    buffer_.erase(0, begin + size);
    return frame;
  }
  // With what code the server ended it; 0: without one. Messages before are passed over. Agrees, as a browser does.
  unsigned end_code() {
    unsigned code = 0;
    while (const auto ended = next()) {
      if (ended->op() != kClose) continue;
      code = ended->code();
      frame(kLast | kClose, ended->text.substr(0, 2));
    }
    end();
    return code;
  }
  void end() {
    ::close(socket_);
    socket_ = -1;
  }
  void reset() {
    const linger hard{.l_onoff = 1, .l_linger = 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    end();
  }

 private:
  bool fill() {
    char octets[65536];
    const auto count = ::recv(socket_, octets, sizeof octets, 0);
    if (count <= 0) return false;
    buffer_.append(octets, static_cast<std::size_t>(count));
    return true;
  }
  bool need(std::size_t octets) {
    while (buffer_.size() < octets) {
      if (!fill()) return false;
    }
    return true;
  }

  int socket_;
  std::string buffer_;
};

}  // namespace sentree::http
