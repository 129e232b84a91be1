#include <gmock/gmock.h>

#include <algorithm>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/rpc/detail/test_peers.h"
#include "sentree/rpc/stream.h"

namespace sentree::rpc {
namespace {

using namespace std::chrono_literals;
using test::connect;
using test::Folder;
using test::in;
using test::RawPeer;
using test::RawServer;
using test::Robot;
using test::serve;
using ::testing::HasSubstr;

Value nested(int depth) {
  Value v{Map{}};
  for (int i = 0; i < depth; ++i) v = Map{{"nest", std::move(v)}};
  return v;
}

std::size_t open_descriptors() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

// What peers did wrong, and how often.
class Complaints {
 public:
  auto listener() {
    return [this](const std::string& message) {
      const std::lock_guard lock(mutex_);
      last_ = message;
      ++count_;
      changed_.notify_all();
    };
  }
  std::string await(int count = 1) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return count_ >= count; });
    return last_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string last_;
  int count_ = 0;
};

class Trust : public ::testing::TestWithParam<const char*> {
 protected:
  std::unique_ptr<Server> start(ServerOptions options = {}) {
    options.on_peer_error = complaints_.listener();
    return serve(folder_.socket(), robot_, std::move(options));
  }
  std::unique_ptr<Client> client(ClientOptions options = {}) {
    return connect(*Address::parse(to_string(folder_.socket()) + GetParam()), std::move(options));
  }
  void expect_still_serving() { EXPECT_TRUE(client()->call("ping", {}, in(10s))); }

  Folder folder_;
  std::shared_ptr<Robot> robot_ = std::make_shared<Robot>();
  Complaints complaints_;
};

TEST_P(Trust, AMessageHasABound) {
  const auto server = start({.limits = {.message_bytes = 10000}});
  const auto c = client();
  EXPECT_TRUE(c->call("echo", Map{{"text", std::string(9000, 'x')}}));
  EXPECT_FALSE(c->call("echo", Map{{"text", std::string(11000, 'x')}}, in(10s)));
  EXPECT_THAT(complaints_.await(), HasSubstr("was disconnected"));
  expect_still_serving();
}

TEST_P(Trust, AReplyHasABoundToo) {
  const auto server = start();
  const auto c = client({.limits = {.message_bytes = 10000}});
  const Outcome out = c->call("echo", Map{{"text", std::string(11000, 'x')}});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kProtocol);
  EXPECT_TRUE(c->call("ping", {}));
}

TEST_P(Trust, ManyMessagesOfOneConnectionMayTogetherBeLarger) {
  const auto server = start({.limits = {.message_bytes = 10000}});
  const auto c = client({.limits = {.message_bytes = 10000}});
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(c->call("echo", Map{{"text", std::string(5000, 'x')}}));
}

TEST_P(Trust, NestingHasABound) {
  const auto server = start({.limits = {.nesting = 10}});
  EXPECT_TRUE(client()->call("nest", Map{{"nest", nested(9)}}));
  EXPECT_FALSE(client()->call("nest", Map{{"nest", nested(10)}}));
  EXPECT_THAT(complaints_.await(), HasSubstr("nested more than 10 deep"));
  expect_still_serving();
}

TEST_P(Trust, NestingThatIsSkippedHasTheSameBound) {
  const auto server = start({.limits = {.nesting = 10}});
  // To the server's IDL, the argument is an unknown field.
  const auto schema = test::schema("struct Nest { 1: optional Nest nest } service Robot { void ping(77: Nest nest) }");
  const auto c = *Client::remote(*Address::parse(to_string(folder_.socket()) + GetParam()), schema.service("Robot"));
  EXPECT_TRUE(c->call("ping", Map{{"nest", nested(5)}}));
  EXPECT_FALSE(c->call("ping", Map{{"nest", nested(60)}}));
  expect_still_serving();
}

TEST_P(Trust, ContainersHaveABound) {
  const auto server = start({.limits = {.container_items = 100}});
  EXPECT_TRUE(client()->call("numbers", Map{{"numbers", List(100, Value(1))}}));
  EXPECT_FALSE(client()->call("numbers", Map{{"numbers", List(101, Value(1))}}));
  (void)complaints_.await();
  expect_still_serving();
}

TEST_P(Trust, ValuesOfAMessageHaveABound) {
  const auto server = start({.limits = {.values = 50}});
  EXPECT_TRUE(client()->call("numbers", Map{{"numbers", List(40, Value(1))}}));
  EXPECT_FALSE(client()->call("numbers", Map{{"numbers", List(60, Value(1))}}));
  EXPECT_THAT(complaints_.await(), HasSubstr("more than 50 values"));
}

INSTANTIATE_TEST_SUITE_P(Rpc, Trust,
                         ::testing::Values("", "?protocol=compact", "?transport=framed",
                                           "?protocol=compact&transport=framed"));

class BadPeers : public ::testing::Test {
 protected:
  Folder folder_;
  std::shared_ptr<Robot> robot_ = std::make_shared<Robot>();
  Complaints complaints_;
};

TEST_F(BadPeers, ConnectionsHaveABound) {
  const auto server = serve(folder_.socket(), robot_, {.connections_max = 2, .on_peer_error = complaints_.listener()});
  const auto first = connect(folder_.socket());
  const auto second = connect(folder_.socket());
  ASSERT_TRUE(first->call("ping", {}));
  ASSERT_TRUE(second->call("ping", {}));
  EXPECT_EQ(connect(folder_.socket())->call("ping", {}, in(10s)).error().kind, CallErrorKind::kUnreachable);
  EXPECT_EQ(server->counters().refused, 1U);
  EXPECT_THAT(complaints_.await(), ::testing::HasSubstr("has 2 connections, and takes no more"));
  EXPECT_TRUE(first->call("ping", {}));
}

TEST_F(BadPeers, SilentConnectionsMakeRoomForOthers) {
  const auto server = serve(folder_.socket(), robot_, {.connections_max = 2, .idle_before_eviction = 0ms});
  const RawPeer silent(folder_.socket());
  const RawPeer mute(folder_.socket());
  const auto first = connect(folder_.socket());
  const auto second = connect(folder_.socket());
  EXPECT_TRUE(first->call("ping", {}, in(10s)));
  EXPECT_TRUE(second->call("ping", {}, in(10s)));
  EXPECT_TRUE(silent.await_end());
  EXPECT_TRUE(mute.await_end());
}

TEST_F(BadPeers, NothingIsKeptOfConnectionsThatHaveEnded) {
  const auto server = serve(folder_.socket(), robot_);
  const std::size_t before = open_descriptors();
  {
    std::vector<std::unique_ptr<RawPeer>> peers;
    for (int i = 0; i < 20; ++i) peers.push_back(std::make_unique<RawPeer>(folder_.socket()));
    while (server->counters().connections < peers.size()) std::this_thread::yield();
  }
  // Nobody connects any more; the tests' time limit ends the wait.
  while (open_descriptors() > before) std::this_thread::yield();
}

TEST_F(BadPeers, GarbageCostsOneErrorAndNoMore) {
  const auto server =
      serve(folder_.socket(), robot_, {.message_time_max = 50ms, .on_peer_error = complaints_.listener()});
  const std::uint64_t seed = 5;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  const auto good = connect(folder_.socket());
  for (int round = 0; round < 100; ++round) {
    std::string bytes(1 + rng.below(200), '\0');
    for (char& c : bytes) c = static_cast<char>(rng.below(256));
    if (round % 4 == 1) bytes.replace(0, 4, std::string("\x80\x01\x00\x01", 4));
    if (round % 4 == 2) bytes.replace(0, 2, "\x82\x21");
    if (round % 4 == 3) bytes.replace(0, 5, std::string("\x00\x00\x00\x40\x80", 5));
    RawPeer peer(folder_.socket());
    peer.send(bytes);
    peer.finish();
    ASSERT_TRUE(peer.await_end()) << round;
    ASSERT_TRUE(good->call("ping", {}, in(10s)));
  }
  // A few rounds happen to be a call of a method that does not exist.
  EXPECT_GT(server->counters().peer_errors, 90U);
  EXPECT_LE(server->counters().peer_errors, 100U);
}

TEST_F(BadPeers, HalfAMessageIsGivenUp) {
  const auto server =
      serve(folder_.socket(), robot_, {.message_time_max = 20ms, .on_peer_error = complaints_.listener()});
  const RawPeer peer(folder_.socket());
  peer.send(std::string("\x80\x01\x00\x01\x00\x00\x00\x04pi", 10));
  EXPECT_TRUE(peer.await_end());
  EXPECT_THAT(complaints_.await(), HasSubstr("the time is up"));

  RawPeer gone(folder_.socket());
  gone.send(std::string("\x80\x01\x00\x01\x00\x00\x00\x04pi", 10));
  gone.close();
  EXPECT_THAT(complaints_.await(2), HasSubstr("ended within a message"));
}

TEST_F(BadPeers, ADeclaredLengthIsNotBelieved) {
  const auto server =
      serve(folder_.socket(), robot_, {.message_time_max = 20ms, .on_peer_error = complaints_.listener()});
  for (const std::string& bytes :
       {std::string("\x80\x01\x00\x01\x7f\xff\xff\xff", 8), std::string("\x80\x01\x00\x01\x80\x00\x00\x00", 8),
        std::string("\x00\xff\xff\xff\x80", 5), std::string("\x80\x01\x00\x01\x00\xff\xff\xff", 8)}) {
    const RawPeer peer(folder_.socket());
    peer.send(bytes);
    EXPECT_TRUE(peer.await_end());
  }
}

TEST_F(BadPeers, AServerThatSendsGarbageIsAProtocolError) {
  const RawServer server(folder_.socket());
  const auto client = connect(folder_.socket());
  for (const std::string& bytes : {std::string("HTTP/1.1 400 Bad Request\r\n\r\n"),
                                   std::string("\x80\x01\x00\x01\x00\x00\x00\x04ping\x00\x00\x00\x01\x00", 17),
                                   std::string("\x80\x01\x00\x02\xff\xff\xff\xff", 8)}) {
    std::thread peer([&] {
      RawPeer p(server.accept());
      (void)p.receive();
      p.send(bytes);
      (void)p.await_end();
    });
    const Outcome out = client->call("ping", {}, in(10s));
    ASSERT_FALSE(out);
    EXPECT_EQ(out.error().kind, CallErrorKind::kProtocol) << out.error().message;
    peer.join();
  }
}

TEST_F(BadPeers, AServerThatHangsUpIsUnreachable) {
  const RawServer server(folder_.socket());
  const auto client = connect(folder_.socket());
  std::thread peer([&] {
    RawPeer p(server.accept());
    (void)p.receive();
    p.send(std::string("\x80\x01\x00\x02\x00\x00", 6));
  });
  EXPECT_EQ(client->call("ping", {}, in(10s)).error().kind, CallErrorKind::kUnreachable);
  peer.join();
}

TEST_F(BadPeers, AReplyInTwoHalvesAroundTheDeadlineIsLateAndNotLost) {
  const RawServer server(folder_.socket());
  const auto client = connect(folder_.socket());
  const std::string reply("\x80\x01\x00\x02\x00\x00\x00\x04ping\x00\x00\x00\x01\x00", 17);
  std::string second = reply;
  second[15] = 2;  // answers the next call
  std::promise<void> late;
  // The first half is there before the deadline, the second comes after it.
  std::thread peer([&] {
    const RawPeer p(server.accept());
    (void)p.receive();
    p.send(reply.substr(0, 9));
    late.get_future().wait();
    (void)p.receive();
    p.send(reply.substr(9) + second);
  });
  EXPECT_EQ(client->call("ping", {}, in(40ms)).error().kind, CallErrorKind::kLate);
  late.set_value();
  EXPECT_TRUE(client->call("ping", {}, in(10s)));
  peer.join();
  EXPECT_EQ(client->counters().late_replies, 1U);
}

TEST_F(BadPeers, APeerThatAcceptsNobodyCostsTheDeadlineAndNoMore) {
  const RawServer server(folder_.socket());
  const auto client = connect(folder_.socket());
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(client->call("ping", {}, in(50ms)).error().kind, CallErrorKind::kLate);
  // A request larger than the socket's buffer, which nobody reads.
  const auto stuffed = connect(folder_.socket());
  EXPECT_EQ(stuffed->call("echo", Map{{"text", std::string(8U << 20U, 'x')}}, in(50ms)).error().kind,
            CallErrorKind::kLate);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);
}

TEST(Connection, IsGivenUpWhenALateReplyDoesNotCome) {
  const Folder folder;
  const RawServer server(folder.socket());
  const auto client = connect(folder.socket(), {.late_wait = 30ms});
  EXPECT_EQ(client->call("ping", {}, in(5ms)).error().kind, CallErrorKind::kLate);
  const int peer = server.accept();
  // Calls wait behind the reply until it has had its time. The next one closes the connection, which the peer sees
  // behind the requests.
  EXPECT_EQ(client->call("ping", {}, in(30ms)).error().kind, CallErrorKind::kLate);
  EXPECT_FALSE(client->call("ping", {}, in(5ms)));
  EXPECT_EQ(client->counters().connections, 2U);
  char request[256];
  while (::recv(peer, request, sizeof request, 0) > 0) {
  }
  ::close(peer);
}

TEST_F(BadPeers, LateRepliesTakeNoDescriptors) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket());
  ASSERT_TRUE(client->call("ping", {}));
  const std::size_t before = open_descriptors();
  EXPECT_EQ(client->call("wait", {}, in(5ms)).error().kind, CallErrorKind::kLate);
  EXPECT_EQ(open_descriptors(), before);
  robot_->release();
  EXPECT_TRUE(client->call("ping", {}));
  EXPECT_EQ(client->counters().late_replies, 1U);
  EXPECT_EQ(open_descriptors(), before);
}

TEST(Connection, IsTriedAgainAtALargestDistance) {
  const Folder folder;
  constexpr int kLastMs = 25;  // 10, 20, 25, 25, …
  const auto client = connect(folder.socket(), {.backoff_last = std::chrono::milliseconds(kLastMs)});
  int attempts = 0;
  int longest_ms = 0;
  while (attempts < 6 || longest_ms <= 20) {
    const Outcome out = client->call("ping", {}, in(10s));
    ASSERT_FALSE(out);
    const std::size_t at = out.error().message.find("tried again in ");
    if (at == std::string::npos)
      ++attempts;
    else
      longest_ms = std::max(longest_ms, std::atoi(out.error().message.c_str() + at + std::strlen("tried again in ")));
  }
  EXPECT_LE(longest_ms, kLastMs);
}

TEST(NameService, ThatHangsCostsADeadlineAndIsAskedOnce) {
  struct Service {
    std::mutex mutex;
    std::condition_variable changed;
    int asked = 0;
    bool answers = false;
  };
  const auto service = std::make_shared<Service>();  // its thread may outlive the test
  Resolver resolver([service](const std::string&, std::uint16_t, bool) {
    std::unique_lock lock(service->mutex);
    ++service->asked;
    service->changed.wait(lock, [&] { return service->answers; });
    return Resolver::Answer{StreamStatus::kOk, {}, "address", 2};
  });
  for (int i = 0; i < 3; ++i) EXPECT_EQ(resolver.resolve("robot", 9090, false, in(5ms)).status, StreamStatus::kLate);
  {
    const std::lock_guard lock(service->mutex);
    service->answers = true;
  }
  service->changed.notify_all();
  const Resolver::Answer answer = resolver.resolve("robot", 9090, false, kNoDeadline);
  EXPECT_EQ(answer.status, StreamStatus::kOk);
  EXPECT_EQ(answer.socket_address, "address");
  EXPECT_EQ(service->asked, 1);
}

}  // namespace
}  // namespace sentree::rpc
