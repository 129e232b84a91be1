#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::http {

/// A request as it was received, or is to be sent. Header names keep their case; look them up with `header`.
struct Request {
  std::string method = "GET";
  std::string target = "/";  ///< Path and query.
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;

  /// The first header of that name, in any case; empty if there is none.
  [[nodiscard]] std::string_view header(std::string_view name) const;
  /// The request line, the headers and the body as HTTP/1.1 writes them.
  [[nodiscard]] std::string text() const;
};

struct Response {
  int status = 200;
  std::string content_type = "text/plain";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};  ///< Further ones.
};

class Socket;
class SocketHandler;

/// Bounds of one WebSocket.
struct SocketLimits {
  std::size_t message_bytes_max = 64U << 10U;   ///< Received; a longer one ends the socket (1009).
  std::size_t queue_bytes_max = 16U << 20U;     ///< Waiting to be sent; see `Socket::send`.
  std::size_t queue_messages_max = 64U << 10U;  ///< The same, in messages: empty ones take memory too.
  std::chrono::milliseconds idle{30'000};       ///< A peer that does not even answer a ping for so long is gone.
};

/// How a server answers who wants to open a WebSocket. Its functions are called in the server's thread.
struct SocketService {
  /// Why not, or nothing. Not set: every request is refused.
  std::function<std::optional<Response>(const Request&)> refuse;
  /// Whoever is not refused gets a handler before the answer to the handshake is sent; if that fails, it is destroyed
  /// like that of a socket that was closed. None: the socket is closed.
  std::function<std::unique_ptr<SocketHandler>(const Request&, Socket)> open;
  SocketLimits limits = {};
  /// The one that is spoken of those that the request offers (`Sec-WebSocket-Protocol`); empty, or not set: none.
  std::function<std::string(const Request&)> subprotocol = {};
};

/// Bounds of a client or server.
struct Limits {
  std::uint32_t head_bytes_max = 64U << 10U;
  std::uint64_t body_bytes_max = 8U << 20U;
  std::size_t connections_max = 64;           ///< Of a server at once; more are closed unanswered.
  std::chrono::milliseconds timeout{10'000};  ///< To connect, and for each read or write.
};

/// Whether the address that a server is asked to listen on can be reached from this machine only.
[[nodiscard]] bool is_loopback(std::string_view address);

/// An HTTP/1.1 server in one thread of its own. Answers are made by a function, called in that thread.
class Server {
 public:
  using Handler = std::function<Response(const Request&)>;

  /// Listens on an IP address, at any free port for 0. Errors: http.bad-address, http.not-loopback (an address that
  /// others can reach is refused unless `allow_remote`), http.port-taken.
  /// @param sockets  What requests to open a WebSocket are answered with (see websocket.h).
  [[nodiscard]] static Result<Server> listen(std::string_view address, std::uint16_t port, Handler handler,
                                             Limits limits = {}, bool allow_remote = false, SocketService sockets = {});
  Server(Server&&) noexcept;
  Server& operator=(Server&&) noexcept;
  /// Closes all connections and waits for the thread.
  ~Server();

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::string url() const;  ///< "http://127.0.0.1:4711"

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Sends one request to "http://host[:port]/path" and waits for the answer; `request.target` is replaced by the URL's.
/// Errors: http.bad-url, http.unreachable, http.timeout, http.too-large, http.bad-answer.
[[nodiscard]] Result<Response> send(std::string_view url, Request request, const Limits& limits = {});

}  // namespace sentree::http
