#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace sentree::http {

/// A WebSocket (RFC 6455) of a server, for who sends on it. Messages that it receives are text. A handle: copies mean
/// the same socket, which it may outlive. From any thread.
class Socket {
 public:
  enum class Form : std::uint8_t { kText, kBinary };

  /// Puts a message into the queue. False, and nothing is sent: the socket is closed, or the queue is full
  /// (`SocketLimits`). A first message always has room.
  bool send(std::shared_ptr<const std::string> message, Form form = Form::kText) const;
  bool send(std::string text) const { return send(std::make_shared<const std::string>(std::move(text))); }
  /// Bytes in the queue that the peer has not taken yet.
  [[nodiscard]] std::size_t queued() const;
  /// Ends it with a code of RFC 6455, section 7.4, once what is queued has been sent.
  void close(std::uint16_t code, std::string reason) const;

  struct Core;  ///< For the files of this library.
  explicit Socket(std::shared_ptr<Core> core) : core_(std::move(core)) {}

 private:
  std::shared_ptr<Core> core_;
};

/// Who receives on it. Called in the server's thread; destroyed there when the socket is closed.
class SocketHandler {
 public:
  virtual ~SocketHandler() = default;
  virtual void received(std::string text) = 0;
  /// The peer has taken everything that was queued.
  virtual void drained() {}
};

}  // namespace sentree::http
