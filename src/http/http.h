#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
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
};

/// Bounds of a client or server.
struct Limits {
  std::uint32_t head_bytes_max = 64U << 10U;
  std::uint64_t body_bytes_max = 8U << 20U;
  std::size_t connections_max = 64;           ///< Of a server at once; more are closed unanswered.
  std::chrono::milliseconds timeout{10'000};  ///< To connect, and for each read or write.
};

/// An HTTP/1.1 server in one thread of its own. Answers are made by a function, called in that thread.
class Server {
 public:
  using Handler = std::function<Response(const Request&)>;

  /// Listens on an IP address, at any free port for 0. Errors: http.bad-address, http.not-loopback (an address that
  /// others can reach is refused unless `allow_remote`), http.port-taken.
  [[nodiscard]] static Result<Server> listen(std::string_view address, std::uint16_t port, Handler handler,
                                             Limits limits = {}, bool allow_remote = false);
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
