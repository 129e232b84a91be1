#include "sentree/http/http.h"

#include <algorithm>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <charconv>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "sentree/http/websocket.h"

namespace sentree::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
namespace websocket = boost::beast::websocket;
using tcp = asio::ip::tcp;

bool same_name(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

struct Url {
  std::string authority;  // host and port, as they are written
  std::string host;       // without the brackets of an IPv6 address
  std::string port = "80";
  std::string target = "/";
};

std::optional<Url> parse_url(std::string_view text) {
  constexpr std::string_view kScheme = "http://";
  if (!text.starts_with(kScheme)) return std::nullopt;
  text.remove_prefix(kScheme.size());
  Url url;
  const std::size_t slash = std::min(text.find('/'), text.size());
  if (slash < text.size()) url.target = text.substr(slash);
  std::string_view authority = text.substr(0, slash);
  url.authority = authority;
  const std::size_t bracket = authority.starts_with('[') ? authority.find(']') : 0;
  if (bracket == std::string_view::npos) return std::nullopt;
  if (const std::size_t colon = authority.rfind(':'); colon != std::string_view::npos && colon >= bracket) {
    url.port = authority.substr(colon + 1);
    authority = authority.substr(0, colon);
    std::uint16_t number = 0;
    const auto [end, failure] = std::from_chars(url.port.data(), url.port.data() + url.port.size(), number);
    if (failure != std::errc() || end != url.port.data() + url.port.size()) return std::nullopt;
  }
  if (bracket > 0 && authority.size() != bracket + 1) return std::nullopt;
  url.host = bracket > 0 ? authority.substr(1, bracket - 1) : authority;
  // White space and control characters would let a target write header lines.
  const auto bad = [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '\x7f'; };
  if (url.host.empty() || std::any_of(url.host.begin(), url.host.end(), bad) ||
      std::any_of(url.target.begin(), url.target.end(), bad)) {
    return std::nullopt;
  }
  return url;
}

}  // namespace

std::string_view Request::header(std::string_view name) const {
  for (const auto& [key, value] : headers) {
    if (same_name(key, name)) return value;
  }
  return {};
}

std::string Request::text() const {
  std::string text = method + " " + target + " HTTP/1.1\r\n";
  for (const auto& [key, value] : headers) text += key + ": " + value + "\r\n";
  return text + "\r\n" + body;
}

bool is_loopback(std::string_view address) {
  beast::error_code error;
  const auto ip = asio::ip::make_address(std::string(address), error);
  return !error && ip.is_loopback();
}

// ---- Sockets ----

// What the handles of a socket share with the connection, which comes and goes in the server's thread.
struct Socket::Core {
  struct Queued {
    std::shared_ptr<const std::string> message;
    Form form = Form::kText;
  };
  std::mutex mutex;
  std::deque<Queued> queue;
  std::size_t bytes = 0;
  std::size_t bytes_max = 0;
  std::size_t messages_max = 0;
  std::optional<websocket::close_reason> closing;
  // Makes the server's thread look at the queue; called with the lock held, and empty once the connection is gone.
  std::function<void()> wake;
};

bool Socket::send(std::shared_ptr<const std::string> message, Form form) const {
  const std::lock_guard lock(core_->mutex);
  if (!core_->wake || core_->closing) return false;
  const bool is_full = core_->bytes + message->size() > core_->bytes_max || core_->queue.size() >= core_->messages_max;
  if (!core_->queue.empty() && is_full) return false;
  core_->bytes += message->size();
  core_->queue.push_back({std::move(message), form});
  if (core_->queue.size() == 1) core_->wake();
  return true;
}

std::size_t Socket::queued() const {
  const std::lock_guard lock(core_->mutex);
  return core_->bytes;
}

void Socket::close(std::uint16_t code, std::string reason) const {
  const std::lock_guard lock(core_->mutex);
  if (!core_->wake || core_->closing) return;
  constexpr std::size_t kReasonMax = 123;  // RFC 6455, 5.5: what fits a control frame beside the code
  reason.resize(std::min(reason.size(), kReasonMax));
  core_->closing = websocket::close_reason(static_cast<websocket::close_code>(code), reason);
  if (core_->queue.empty()) core_->wake();
}

// ---- Server ----

struct Server::Impl {
  Handler handler;
  SocketService sockets;
  Limits limits;
  std::string address;
  std::size_t connections = 0;                    // of the thread
  std::set<std::shared_ptr<Socket::Core>> cores;  // of the thread
  // After what connections use: those that are still open go with the context.
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::steady_timer until_next{context};  // where no descriptor is left for who comes
  std::thread thread;

  class Connection;
  class SocketConnection;

  void accept();

  ~Impl() {
    context.stop();
    if (thread.joinable()) thread.join();
    // From here on no handle wakes a context that is being destroyed.
    for (const auto& core : cores) {
      const std::lock_guard lock(core->mutex);
      core->wake = nullptr;
    }
  }
};

class Server::Impl::SocketConnection : public std::enable_shared_from_this<SocketConnection> {
 public:
  SocketConnection(beast::tcp_stream stream, Impl& server)
      : stream_(std::move(stream)), server_(server), core_(std::make_shared<Socket::Core>()) {
    ++server_.connections;
    core_->bytes_max = server_.sockets.limits.queue_bytes_max;
    core_->messages_max = server_.sockets.limits.queue_messages_max;
  }
  ~SocketConnection() {
    --server_.connections;
    detach();
  }
  SocketConnection(const SocketConnection&) = delete;
  SocketConnection& operator=(const SocketConnection&) = delete;

  void accept(const bhttp::request<bhttp::string_body>& upgrade, const Request& request) {
    beast::get_lowest_layer(stream_).expires_never();
    // Small messages follow each other, and would wait for what the peer acknowledges of the one before.
    beast::error_code unchanged;
    beast::get_lowest_layer(stream_).socket().set_option(tcp::no_delay(true), unchanged);
    stream_.set_option(websocket::stream_base::timeout{.handshake_timeout = server_.limits.timeout,
                                                       .idle_timeout = server_.sockets.limits.idle,
                                                       .keep_alive_pings = true});
    stream_.read_message_max(server_.sockets.limits.message_bytes_max);
    stream_.auto_fragment(false);
    if (server_.sockets.subprotocol) {
      if (std::string chosen = server_.sockets.subprotocol(request); !chosen.empty())
        stream_.set_option(websocket::stream_base::decorator(
            [chosen](websocket::response_type& answer) { answer.set(bhttp::field::sec_websocket_protocol, chosen); }));
    }
    core_->wake = [weak = weak_from_this(), &context = server_.context] {
      asio::post(context, [weak] {
        if (const auto self = weak.lock()) self->write();
      });
    };
    server_.cores.insert(core_);
    handler_ = server_.sockets.open(request, Socket(core_));
    stream_.async_accept(upgrade, [self = shared_from_this()](beast::error_code error) {
      if (error || !self->handler_) return self->end();
      self->is_open_ = true;
      self->read();
      self->write();
    });
  }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error || !self->handler_) return self->end();
      if (!self->stream_.got_text())
        Socket(self->core_).close(websocket::close_code::unknown_data, "messages are text");
      else
        self->handler_->received(beast::buffers_to_string(self->buffer_.data()));
      self->buffer_.clear();
      self->read();
    });
  }

  void write() {
    if (!is_open_ || writing_ || !handler_) return;
    {
      const std::lock_guard lock(core_->mutex);
      if (core_->queue.empty()) {
        if (core_->closing && !std::exchange(closed_, true))
          stream_.async_close(*core_->closing, [self = shared_from_this()](beast::error_code) { self->end(); });
        return;
      }
      sending_ = core_->queue.front();
    }
    writing_ = true;
    stream_.binary(sending_.form == Socket::Form::kBinary);
    stream_.async_write(asio::buffer(*sending_.message),
                        [self = shared_from_this()](beast::error_code error, std::size_t) { self->written(error); });
  }

  void written(beast::error_code error) {
    writing_ = false;
    if (error) return end();
    if (!handler_) return;  // it was closed meanwhile
    bool empty = false;
    {
      const std::lock_guard lock(core_->mutex);
      core_->bytes -= sending_.message->size();
      core_->queue.pop_front();
      empty = core_->queue.empty();
    }
    if (empty && handler_) handler_->drained();
    write();
  }

  void end() {
    detach();
    beast::get_lowest_layer(stream_).close();
  }

  // From here on nobody sends or receives.
  void detach() {
    {
      const std::lock_guard lock(core_->mutex);
      core_->wake = nullptr;
      core_->queue.clear();
      core_->bytes = 0;
    }
    server_.cores.erase(core_);
    handler_.reset();
  }

  websocket::stream<beast::tcp_stream> stream_;
  Impl& server_;
  std::shared_ptr<Socket::Core> core_;
  std::unique_ptr<SocketHandler> handler_;
  beast::flat_buffer buffer_;
  Socket::Core::Queued sending_;
  bool is_open_ = false;  // the handshake is done
  bool writing_ = false;
  bool closed_ = false;
};

class Server::Impl::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Impl& server) : stream_(std::move(socket)), server_(server) { ++server_.connections; }
  ~Connection() { --server_.connections; }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void read() {
    parser_.emplace();
    parser_->header_limit(server_.limits.head_bytes_max);
    parser_->body_limit(server_.limits.body_bytes_max);
    stream_.expires_after(server_.limits.timeout);
    bhttp::async_read(stream_, buffer_, *parser_,
                      [self = shared_from_this()](beast::error_code error, std::size_t) { self->answer(error); });
  }

 private:
  void answer(beast::error_code error) {
    Response response;
    bool keep = false;
    const bool gone = error && (error == bhttp::error::end_of_stream || error == beast::error::timeout ||
                                error.category() == asio::error::get_system_category());
    if (gone) return;
    if (error == bhttp::error::body_limit)
      response = {413, "text/plain", "the body is too large\n"};
    else if (error == bhttp::error::header_limit)
      response = {431, "text/plain", "the head is too large\n"};
    else if (error)
      response = {400, "text/plain", "this is no HTTP request\n"};
    else {
      const auto& message = parser_->get();
      keep = message.keep_alive();
      Request request;
      request.method = std::string(message.method_string());
      request.target = std::string(message.target());
      for (const auto& field : message)
        request.headers.emplace_back(std::string(field.name_string()), std::string(field.value()));
      request.body = message.body();
      if (websocket::is_upgrade(message)) {
        std::optional<Response> refusal = Response{404, "text/plain", "there is no WebSocket here\n"};
        if (server_.sockets.refuse) refusal = server_.sockets.refuse(request);
        if (!refusal) {
          std::make_shared<SocketConnection>(std::move(stream_), server_)->accept(message, request);
          return;
        }
        response = std::move(*refusal);
        keep = false;
      } else {
        response = server_.handler(request);
      }
    }
    answer_.emplace();
    answer_->version(11);
    answer_->result(static_cast<unsigned>(response.status));
    answer_->set(bhttp::field::content_type, response.content_type);
    for (const auto& [name, value] : response.headers) answer_->set(name, value);
    answer_->body() = std::move(response.body);
    answer_->keep_alive(keep);
    answer_->prepare_payload();
    stream_.expires_after(server_.limits.timeout);
    bhttp::async_write(stream_, *answer_, [self = shared_from_this(), keep](beast::error_code failed, std::size_t) {
      if (!failed && keep)
        self->read();
      else
        self->stream_.socket().shutdown(tcp::socket::shutdown_both, failed);
    });
  }

  beast::tcp_stream stream_;
  Impl& server_;
  beast::flat_buffer buffer_;
  std::optional<bhttp::request_parser<bhttp::string_body>> parser_;
  std::optional<bhttp::response<bhttp::string_body>> answer_;
};

void Server::Impl::accept() {
  acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error && connections < limits.connections_max) std::make_shared<Connection>(std::move(socket), *this)->read();
    if (!error) return accept();
    // Who waits at the door is still there: at once, the answer would be the same.
    until_next.expires_after(std::chrono::milliseconds(100));
    until_next.async_wait([this](beast::error_code cancelled) {
      if (!cancelled) accept();
    });
  });
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

Result<Server> Server::listen(std::string_view address, std::uint16_t port, Handler handler, Limits limits,
                              bool allow_remote, SocketService sockets) {
  beast::error_code error;
  const auto ip = asio::ip::make_address(std::string(address), error);
  if (error) return fail("http.bad-address", "\"" + std::string(address) + "\" is no IP address");
  if (!ip.is_loopback() && !allow_remote) {
    return fail("http.not-loopback", "address " + std::string(address) +
                                         " can be reached by others; use 127.0.0.1, or allow it with --insecure");
  }
  std::unique_ptr<Impl> impl;
  try {
    impl = std::make_unique<Impl>();
  } catch (const boost::system::system_error& exhausted) {  // a context has descriptors of its own
    return fail("http.exhausted", "cannot serve: " + exhausted.code().message());
  }
  impl->handler = std::move(handler);
  impl->sockets = std::move(sockets);
  impl->limits = limits;
  impl->address = ip.is_v6() ? "[" + std::string(address) + "]" : std::string(address);
  const tcp::endpoint endpoint(ip, port);
  impl->acceptor.open(endpoint.protocol(), error);
  if (!error) impl->acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) impl->acceptor.bind(endpoint, error);
  if (!error) impl->acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    const std::string at = impl->address + ":" + std::to_string(port);
    if (error != asio::error::address_in_use)
      return fail("http.bad-address", "cannot listen on " + at + ": " + error.message());
    return fail("http.port-taken",
                at + " is taken: another process listens there; stop it or choose another port (0 takes a free one)");
  }
  impl->accept();
  impl->thread = std::thread([raw = impl.get()] { raw->context.run(); });
  return Server(std::move(impl));
}

std::uint16_t Server::port() const {
  beast::error_code error;
  return impl_->acceptor.local_endpoint(error).port();
}

std::string Server::url() const { return "http://" + impl_->address + ":" + std::to_string(port()); }

// ---- Client ----

Result<Response> send(std::string_view url_text, Request request, const Limits& limits) {
  const auto url = parse_url(url_text);
  if (!url)
    return fail("http.bad-url", "\"" + std::string(url_text) + "\" is no address of the form http://host:port/path");
  struct Asker {
    asio::io_context context{1};
    tcp::resolver resolver{context};
    beast::tcp_stream stream{context};
  };
  std::optional<Asker> asker;
  try {
    asker.emplace();
  } catch (const boost::system::system_error& exhausted) {
    return fail("http.unreachable", std::string(url_text) + ": cannot connect: " + exhausted.code().message());
  }
  asio::io_context& context = asker->context;
  tcp::resolver& resolver = asker->resolver;
  beast::tcp_stream& stream = asker->stream;
  beast::error_code error;
  const auto run = [&] {
    context.run();
    context.restart();
  };
  const auto failed = [&](const char* what) {
    const bool late = error == beast::error::timeout;
    return fail(late ? "http.timeout" : "http.unreachable",
                std::string(url_text) + ": " + what + ": " + error.message());
  };
  const auto endpoints = resolver.resolve(url->host, url->port, error);
  if (error) return failed("no such host");
  stream.expires_after(limits.timeout);
  stream.async_connect(endpoints, [&](beast::error_code e, const tcp::endpoint&) { error = e; });
  run();
  if (error) return failed("cannot connect");

  bhttp::request<bhttp::string_body> message;
  message.version(11);
  message.method_string(request.method);
  message.target(url->target);
  message.set(bhttp::field::host, url->authority);
  for (const auto& [key, value] : request.headers) message.set(key, value);
  message.body() = std::move(request.body);
  message.keep_alive(false);
  message.prepare_payload();
  stream.expires_after(limits.timeout);
  bhttp::async_write(stream, message, [&](beast::error_code e, std::size_t) { error = e; });
  run();
  if (error) return failed("cannot send");

  beast::flat_buffer buffer;
  bhttp::response_parser<bhttp::string_body> parser;
  parser.header_limit(limits.head_bytes_max);
  parser.body_limit(limits.body_bytes_max);
  stream.expires_after(limits.timeout);
  bhttp::async_read(stream, buffer, parser, [&](beast::error_code e, std::size_t) { error = e; });
  run();
  if (error == bhttp::error::body_limit || error == bhttp::error::header_limit) {
    return fail("http.too-large", std::string(url_text) + ": the answer is too large");
  }
  if (error == beast::error::timeout) return failed("no answer in time");
  if (error) return fail("http.bad-answer", std::string(url_text) + ": no answer: " + error.message());
  Response response;
  response.status = static_cast<int>(parser.get().result_int());
  response.content_type = std::string(parser.get()[bhttp::field::content_type]);
  response.body = std::move(parser.get().body());
  return response;
}

}  // namespace sentree::http
