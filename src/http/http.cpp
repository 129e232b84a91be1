#include "sentree/http/http.h"

#include <algorithm>
#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <charconv>
#include <optional>
#include <set>
#include <thread>

namespace sentree::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
using tcp = asio::ip::tcp;

bool same_name(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](char x, char y) { return lower(x) == lower(y); });
}

struct Url {
  std::string host;
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
  if (const std::size_t colon = authority.rfind(':'); colon != std::string_view::npos) {
    url.port = authority.substr(colon + 1);
    authority = authority.substr(0, colon);
    std::uint16_t number = 0;
    const auto [end, failure] = std::from_chars(url.port.data(), url.port.data() + url.port.size(), number);
    if (failure != std::errc() || end != url.port.data() + url.port.size()) return std::nullopt;
  }
  url.host = authority;
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

// ---- Server ----

struct Server::Impl {
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  Handler handler;
  Limits limits;
  std::string address;
  std::size_t connections = 0;  // of the thread
  std::thread thread;

  class Connection;

  void accept();

  ~Impl() {
    context.stop();
    if (thread.joinable()) thread.join();
  }
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
      response = server_.handler(request);
    }
    answer_.emplace();
    answer_->version(11);
    answer_->result(static_cast<unsigned>(response.status));
    answer_->set(bhttp::field::content_type, response.content_type);
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
    accept();
  });
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

Result<Server> Server::listen(std::string_view address, std::uint16_t port, Handler handler, Limits limits,
                              bool allow_remote) {
  beast::error_code error;
  const auto ip = asio::ip::make_address(std::string(address), error);
  if (error) return fail("http.bad-address", "\"" + std::string(address) + "\" is no IP address");
  if (!ip.is_loopback() && !allow_remote) {
    return fail("http.not-loopback",
                "address " + std::string(address) + " can be reached by others; use 127.0.0.1, or allow it explicitly");
  }
  auto impl = std::make_unique<Impl>();
  impl->handler = std::move(handler);
  impl->limits = limits;
  impl->address = ip.is_v6() ? "[" + std::string(address) + "]" : std::string(address);
  const tcp::endpoint endpoint(ip, port);
  impl->acceptor.open(endpoint.protocol(), error);
  if (!error) impl->acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) impl->acceptor.bind(endpoint, error);
  if (!error) impl->acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error)
    return fail("http.port-taken",
                "cannot listen on " + std::string(address) + ":" + std::to_string(port) + ": " + error.message());
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
  asio::io_context context{1};
  tcp::resolver resolver(context);
  beast::tcp_stream stream(context);
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
  message.set(bhttp::field::host, url->host);
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
