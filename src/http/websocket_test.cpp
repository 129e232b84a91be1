#include "sentree/http/websocket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <random>
#include <string>

#include "sentree/http/detail/test_peer.h"
#include "sentree/http/http.h"

namespace sentree::http {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

// A server whose sockets tell a test what happens to them.
class SocketServer {
 public:
  explicit SocketServer(SocketLimits limits = {}, Limits http_limits = {}) {
    SocketService service;
    service.refuse = [this](const Request& request) -> std::optional<Response> {
      if (refuses(request)) return Response{403, "text/plain", "not you\n"};
      return std::nullopt;
    };
    service.open = [this](const Request&, Socket socket) -> std::unique_ptr<SocketHandler> {
      const std::lock_guard lock(mutex_);
      if (takes_none) return nullptr;
      sockets_.push_back(socket);
      ++open_;
      changed_.notify_all();
      return std::make_unique<Handler>(*this, std::move(socket));
    };
    service.limits = limits;
    auto listening = Server::listen(
        "127.0.0.1", 0,
        [](const Request&) {
          return Response{200, "text/plain", "well\n"};
        },
        http_limits, false, std::move(service));
    EXPECT_TRUE(listening.has_value());
    server_.emplace(std::move(*listening));
  }

  [[nodiscard]] std::uint16_t port() const { return server_->port(); }
  [[nodiscard]] std::string url() const { return server_->url(); }
  void end() { server_.reset(); }

  // Each waits until it is so.
  std::string received() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !received_.empty(); });
    std::string text = std::move(received_.front());
    received_.pop_front();
    return text;
  }
  Socket opened(std::size_t index = 0) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return sockets_.size() > index; });
    return sockets_[index];
  }
  void all_closed() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return open_ == 0; });
  }

  std::function<bool(const Request&)> refuses = [](const Request&) { return false; };
  std::function<void(const Socket&, const std::string&)> on_received = [](const Socket&, const std::string&) {};
  bool takes_none = false;

 private:
  class Handler final : public SocketHandler {
   public:
    Handler(SocketServer& test, Socket socket) : test_(test), socket_(std::move(socket)) {}
    ~Handler() override {
      const std::lock_guard lock(test_.mutex_);
      --test_.open_;
      test_.changed_.notify_all();
    }
    void received(std::string text) override {
      test_.on_received(socket_, text);
      const std::lock_guard lock(test_.mutex_);
      test_.received_.push_back(std::move(text));
      test_.changed_.notify_all();
    }

   private:
    SocketServer& test_;
    Socket socket_;
  };

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> received_;
  std::vector<Socket> sockets_;
  std::size_t open_ = 0;
  std::optional<Server> server_;
};

// ---- Opening ----

TEST(WebSocket, OpensAsTheStandardSays) {
  SocketServer server;
  Peer peer(server.port());
  const std::string head = peer.upgrade();
  EXPECT_THAT(head, StartsWith("HTTP/1.1 101 "));
  // The example of RFC 6455, 1.3.
  EXPECT_THAT(head, HasSubstr("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo="));
}

TEST(WebSocket, IsRefusedWithTheAnswerOfTheService) {
  SocketServer server;
  server.refuses = [](const Request& request) { return request.header("origin") == "http://elsewhere"; };
  Peer other(server.port());
  EXPECT_THAT(other.upgrade("Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                            "Origin: http://elsewhere\r\n"),
              StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(Peer(server.port()).upgrade(), StartsWith("HTTP/1.1 101 "));
}

TEST(WebSocket, IsRefusedWhereThereIsNone) {
  auto server = Server::listen("127.0.0.1", 0, [](const Request&) { return Response(); });
  ASSERT_TRUE(server);
  EXPECT_THAT(Peer(server->port()).upgrade(), StartsWith("HTTP/1.1 404 "));
}

TEST(WebSocket, WhoseHandshakeIsIncompleteIsForgotten) {
  SocketServer server;
  for (const char* headers : {"", "Sec-WebSocket-Version: 13\r\n",
                              "Sec-WebSocket-Version: 8\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"}) {
    Peer peer(server.port());
    EXPECT_THAT(peer.upgrade(headers), StartsWith("HTTP/1.1 4")) << headers;
    EXPECT_FALSE(peer.next()) << headers;
  }
  server.all_closed();
}

TEST(WebSocket, ThatNobodyTakesIsEnded) {
  SocketServer server;
  server.takes_none = true;
  Peer peer(server.port());
  peer.upgrade();
  EXPECT_EQ(peer.end_code(), 0U);
}

TEST(WebSocket, CountsAsAConnection) {
  SocketServer server({}, {.connections_max = 1});
  Peer first(server.port());
  EXPECT_THAT(first.upgrade(), StartsWith("HTTP/1.1 101 "));
  EXPECT_EQ(Peer(server.port()).upgrade(), "");
}

// ---- Messages ----

TEST(WebSocket, PassesMessagesBothWays) {
  SocketServer server;
  server.on_received = [](const Socket& socket, const std::string& text) { socket.send("got " + text); };
  Peer peer(server.port());
  peer.upgrade();
  for (const std::size_t size : {0U, 1U, 125U, 126U, 127U, 65'000U}) {
    const std::string text(size, 'x');
    peer.frame(kLast | kText, text, 0xA1B2C3D4);
    EXPECT_EQ(server.received(), text);
    const auto answer = peer.next();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->first, kLast | kText);
    EXPECT_EQ(answer->text, "got " + text);
  }
}

TEST(WebSocket, SendsOctetsBetweenTexts) {
  SocketServer server;
  Peer peer(server.port());
  peer.upgrade();
  const Socket socket = server.opened();
  const std::string octets("\x01\x00\xff", 3);
  socket.send("before");
  socket.send(std::make_shared<const std::string>(octets), Socket::Form::kBinary);
  socket.send("after");
  EXPECT_EQ(peer.next()->first, kLast | kText);
  const auto binary = peer.next();
  ASSERT_TRUE(binary);
  EXPECT_EQ(binary->first, kLast | kBinary);
  EXPECT_EQ(binary->text, octets);
  EXPECT_EQ(peer.next()->first, kLast | kText);
}

TEST(WebSocket, PutsFragmentsTogether) {
  SocketServer server;
  Peer peer(server.port());
  peer.upgrade();
  peer.frame(kText, "one ");
  peer.frame(kContinuation, "");
  peer.frame(kLast | kPing, "between");
  peer.frame(kContinuation, "two ");
  peer.frame(kLast | kContinuation, "three");
  EXPECT_EQ(server.received(), "one two three");
  const auto pong = peer.next();
  ASSERT_TRUE(pong);
  EXPECT_EQ(pong->op(), kPong);
  EXPECT_EQ(pong->text, "between");
}

TEST(WebSocket, TakesAMessageOctetByOctet) {
  SocketServer server;
  Peer peer(server.port());
  peer.upgrade();
  for (const char octet : Peer::framed(kLast | kText, std::string(200, 'y'))) peer.write(std::string(1, octet));
  EXPECT_EQ(server.received(), std::string(200, 'y'));
}

TEST(WebSocket, EndsForTooLongAMessage) {
  constexpr std::size_t kMax = 1000;
  SocketServer server({.message_bytes_max = kMax});
  Peer peer(server.port());
  peer.upgrade();
  peer.frame(kLast | kText, std::string(kMax, 'x'));
  EXPECT_EQ(server.received().size(), kMax);
  peer.frame(kLast | kText, std::string(kMax + 1, 'x'));
  EXPECT_EQ(peer.end_code(), 1009U);

  Peer in_parts(server.port());
  in_parts.upgrade();
  in_parts.frame(kText, std::string(kMax, 'x'));
  in_parts.frame(kLast | kContinuation, "x");
  EXPECT_EQ(in_parts.end_code(), 1009U);

  // It is not waited for: what it announces is enough.
  Peer announced(server.port());
  announced.upgrade();
  announced.write(std::string("\x81\xFF\x7F\xFF\xFF\xFF\xFF\xFF\xFF\xFF\0\0\0\0", 14));
  EXPECT_EQ(announced.end_code(), 1009U);
  server.all_closed();
}

TEST(WebSocket, EndsForWhatIsNoMessage) {
  SocketServer server;
  const struct {
    const char* what;
    std::string octets;
    unsigned code;
  } cases[] = {
      {"not masked", std::string("\x81\x01x"), 1002},
      {"a reserved bit", Peer::framed(kLast | 0x40U | kText, "x"), 1002},
      {"a reserved kind", Peer::framed(kLast | 3U, "x"), 1002},
      {"a ping in fragments", Peer::framed(kPing, "x"), 1002},
      {"a long ping", Peer::framed(kLast | kPing, std::string(126, 'x')), 1002},
      {"a continuation of nothing", Peer::framed(kLast | kContinuation, "x"), 1002},
      {"a message within another", Peer::framed(kText, "x") + Peer::framed(kLast | kText, "x"), 1002},
      {"a length that is not the shortest", std::string("\x81\xFE\0\x01\0\0\0\0x", 9), 1002},
      {"text that is not UTF-8", Peer::framed(kLast | kText, "\xC3\x28"), 1007},
      {"octets", Peer::framed(kLast | kBinary, "x"), 1003},
      {"a close of one octet", Peer::framed(kLast | kClose, "x"), 1002},
  };
  for (const auto& one : cases) {
    Peer peer(server.port());
    peer.upgrade();
    peer.write(one.octets);
    EXPECT_EQ(peer.end_code(), one.code) << one.what;
  }
  server.all_closed();
}

TEST(WebSocket, OutlivesGarbage) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  SocketServer server;
  for (int i = 0; i < 50; ++i) {
    Peer peer(server.port());
    if (i % 2 == 0) peer.upgrade();
    std::string octets(1 + random() % 300, '\0');
    for (char& octet : octets) octet = static_cast<char>(random());
    peer.write(octets);
    if (i % 3 == 0) peer.reset();
  }
  server.all_closed();
  Peer peer(server.port());
  EXPECT_THAT(peer.upgrade(), StartsWith("HTTP/1.1 101 "));
}

// ---- The queue ----

TEST(WebSocket, QueuesNoMoreBytesThanItsBound) {
  constexpr std::size_t kMax = 1000;
  SocketServer server({.queue_bytes_max = kMax});
  std::vector<bool> sent;
  std::size_t queued = 0;
  // Nothing leaves the queue meanwhile: that happens in this thread too.
  server.on_received = [&](const Socket& socket, const std::string&) {
    for (const std::size_t size : {600U, 400U, 1U}) sent.push_back(socket.send(std::string(size, 'x')));
    queued = socket.queued();
  };
  Peer peer(server.port());
  peer.upgrade();
  peer.frame(kLast | kText, "go");
  server.received();
  EXPECT_EQ(sent, (std::vector<bool>{true, true, false}));
  EXPECT_EQ(queued, kMax);
}

TEST(WebSocket, QueuesNoMoreMessagesThanItsBound) {
  constexpr std::size_t kMax = 100;
  SocketServer server({.queue_messages_max = kMax});
  std::size_t taken = 0;
  server.on_received = [&](const Socket& socket, const std::string&) {
    while (taken <= kMax && socket.send("")) ++taken;
  };
  Peer peer(server.port());
  peer.upgrade();
  peer.frame(kLast | kText, "go");
  server.received();
  EXPECT_EQ(taken, kMax);
  for (std::size_t i = 0; i < kMax; ++i) ASSERT_TRUE(peer.next()) << i;
}

TEST(WebSocket, AFirstMessageAlwaysHasRoom) {
  SocketServer server({.queue_bytes_max = 10});
  Peer peer(server.port());
  peer.upgrade();
  EXPECT_TRUE(server.opened().send(std::string(5000, 'x')));
  const auto frame = peer.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->text.size(), 5000U);
}

TEST(WebSocket, APeerThatReadsLateGetsAllThatWasTakenAndNoMoreIsHeldThanTheBound) {
  constexpr std::size_t kMax = 64U << 10U;
  constexpr std::size_t kSize = 1000;
  SocketServer server({.queue_bytes_max = kMax});
  Peer peer(server.port(), 4096);
  peer.upgrade();
  const Socket socket = server.opened();
  // The system takes some for the peer; then the queue is what is left.
  constexpr std::size_t kTries = 100'000;
  std::size_t taken = 0;
  for (; taken < kTries; ++taken) {
    std::string text = std::to_string(taken);
    text.resize(kSize, ' ');
    if (!socket.send(std::move(text))) break;
    EXPECT_LE(socket.queued(), kMax);
  }
  ASSERT_LT(taken, kTries);
  EXPECT_GT(socket.queued(), kMax - kSize * 2);
  for (std::size_t i = 0; i < taken; ++i) {
    const auto frame = peer.next();
    ASSERT_TRUE(frame);
    ASSERT_THAT(frame->text, StartsWith(std::to_string(i) + " "));
  }
}

TEST(WebSocket, APeerThatNeverReadsIsGivenUp) {
  SocketServer server({.queue_bytes_max = 64U << 10U, .idle = std::chrono::milliseconds(200)});
  Peer peer(server.port(), 4096);
  peer.upgrade();
  const Socket socket = server.opened();
  while (socket.send(std::string(10'000, 'x'))) {
  }
  server.all_closed();
  EXPECT_EQ(socket.queued(), 0U);
  EXPECT_FALSE(socket.send("late"));
}

// ---- Ending ----

TEST(WebSocket, AsksASilentPeerThenGivesItUp) {
  SocketServer server({.idle = std::chrono::milliseconds(200)});
  Peer peer(server.port());
  peer.upgrade();
  const auto ping = peer.next();
  ASSERT_TRUE(ping);
  EXPECT_EQ(ping->op(), kPing);
  EXPECT_EQ(peer.end_code(), 0U);
  server.all_closed();
}

TEST(WebSocket, AnswersPingAndClose) {
  SocketServer server;
  Peer peer(server.port());
  peer.upgrade();
  peer.frame(kLast | kPing, std::string(125, 'p'));
  const auto pong = peer.next();
  ASSERT_TRUE(pong);
  EXPECT_EQ(pong->first, kLast | kPong);
  EXPECT_EQ(pong->text, std::string(125, 'p'));
  peer.frame(kLast | kPong, "not asked for");
  peer.frame(kLast | kClose, std::string("\x03\xE8", 2));
  const auto close = peer.next();
  ASSERT_TRUE(close);
  EXPECT_EQ(close->op(), kClose);
  EXPECT_EQ(close->code(), 1000U);
  EXPECT_FALSE(peer.next());
  peer.end();
  server.all_closed();
}

TEST(WebSocket, IsClosedOnceWhatIsQueuedIsSent) {
  SocketServer server;
  server.on_received = [](const Socket& socket, const std::string&) {
    socket.send("first");
    socket.close(1008, std::string(200, 'r'));
    EXPECT_FALSE(socket.send("late"));
    socket.close(1001, "late too");
  };
  Peer peer(server.port());
  peer.upgrade();
  peer.frame(kLast | kText, "go");
  const auto first = peer.next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->text, "first");
  const auto close = peer.next();
  ASSERT_TRUE(close);
  EXPECT_EQ(close->code(), 1008U);
  // What a control frame holds (RFC 6455, 5.5).
  EXPECT_EQ(close->text.substr(2), std::string(123, 'r'));
  peer.frame(kLast | kClose, close->text.substr(0, 2));
  EXPECT_FALSE(peer.next());
  peer.end();
  server.all_closed();
}

TEST(WebSocket, AHandleOutlivesPeerAndServer) {
  SocketServer server;
  {
    Peer peer(server.port());
    peer.upgrade();
    server.opened();
    peer.reset();
  }
  server.all_closed();
  EXPECT_FALSE(server.opened().send("x"));
  Peer peer(server.port());
  peer.upgrade();
  const Socket socket = server.opened(1);
  server.end();
  EXPECT_EQ(peer.end_code(), 0U);
  server.all_closed();
  EXPECT_FALSE(socket.send("x"));
  EXPECT_EQ(socket.queued(), 0U);
  socket.close(1000, "over");
}

// ---- Requests, octet by octet ----

TEST(HttpServer, AHeadBeyondTheBoundIsRefused) {
  SocketServer server({}, {.head_bytes_max = 1000});
  Peer peer(server.port());
  peer.write("GET / HTTP/1.1\r\nHost: here\r\nX: " + std::string(1000, 'x') + "\r\n\r\n");
  EXPECT_THAT(peer.head(), StartsWith("HTTP/1.1 431 "));
}

TEST(HttpServer, SaysThatGarbageIsNoRequest) {
  SocketServer server;
  Peer peer(server.port());
  peer.write("\x01\x02 nonsense\r\n\r\n");
  EXPECT_THAT(peer.head(), StartsWith("HTTP/1.1 400 "));
  EXPECT_TRUE(send(server.url(), {}));
}

TEST(HttpServer, AConnectionThatSaysNothingIsEnded) {
  SocketServer server({}, {.timeout = std::chrono::milliseconds(50)});
  Peer silent(server.port());
  EXPECT_EQ(silent.head(), "");
  Peer half(server.port());
  half.write("GET / HT");
  EXPECT_EQ(half.head(), "");
}

TEST(HttpServer, AClientWaitsNoLongerThanItsBound) {
  std::mutex mutex;
  std::condition_variable changed;
  bool late = false;
  auto server = Server::listen("127.0.0.1", 0, [&](const Request&) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return late; });
    return Response();
  });
  ASSERT_TRUE(server);
  const auto answer = send(server->url(), {}, {.timeout = std::chrono::milliseconds(50)});
  {
    const std::lock_guard lock(mutex);
    late = true;
    changed.notify_all();
  }
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, "http.timeout");
}

}  // namespace
}  // namespace sentree::http
