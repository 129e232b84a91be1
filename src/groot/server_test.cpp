#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <thread>

#include "sentree/base/json.h"
#include "sentree/bt/load.h"
#include "sentree/groot/client.h"
#include "sentree/groot/message_pack.h"
#include "sentree/groot/publisher.h"

namespace sentree::groot {
namespace {

using ::testing::HasSubstr;

bt::Tree served_tree(std::string xml, const bt::Registry* registry = nullptr) {
  auto loaded = bt::load(std::move(xml), {.registry = registry});
  EXPECT_TRUE(loaded.ok()) << (loaded.diagnostics.empty() ? "" : to_string(loaded.diagnostics[0]));
  return std::move(*loaded.value);
}

std::string at(std::uint16_t port) { return "zmq://127.0.0.1:" + std::to_string(port); }

class ServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!is_built()) GTEST_SKIP() << "built without ZeroMQ";
    const bt::Tree tree = served_tree(
        R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Sequence><AlwaysSuccess/></Sequence></BehaviorTree></root>)");
    scene.begin(*describe(tree), TreeId{7});
    auto started = Server::start(scene, nullptr,
                                 {.port = 0, .on_problem = [](const std::string& what) { ADD_FAILURE() << what; }});
    ASSERT_TRUE(started.has_value()) << to_string(started.error());
    server = std::move(*started);
  }
  Scene scene;
  std::unique_ptr<Server> server;
};

// A TCP connection that says what it likes.
class Peer {
 public:
  explicit Peer(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~Peer() { ::close(socket_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  bool connected() const { return connected_; }
  // As ZeroMQ wants it, the greeting is answered before more is said.
  void greet() const {
    std::string greeting("\xFF\0\0\0\0\0\0\0\0\x7F\x03\0NULL", 16);
    greeting.resize(64, '\0');
    say(greeting);
    char answer[64];
    (void)::recv(socket_, answer, sizeof answer, MSG_WAITALL);
  }
  void say(std::string_view bytes) const {
    (void)::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }

 private:
  int socket_;
  bool connected_ = false;
};

std::string ready(std::string_view type) {
  std::string body("\x05READY\x0BSocket-Type\0\0\0", 21);
  body += static_cast<char>(type.size());
  body += type;
  return std::string("\x04") + static_cast<char>(body.size()) + body;
}

TEST_F(ServerTest, AnswersWhateverOthersDoToItsPorts) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::minstd_rand random(seed);
  const Server::Ports ports = server->ports();
  std::vector<std::unique_ptr<Peer>> open;
  for (const std::uint16_t port :
       {ports.groot2, static_cast<std::uint16_t>(ports.groot2 + 1), ports.groot1_publisher, ports.groot1_server}) {
    const bool is_publisher = port == ports.groot1_publisher || port == ports.groot2 + 1;
    const auto peer = [&](std::string_view bytes, bool greets) {
      open.push_back(std::make_unique<Peer>(port));
      EXPECT_TRUE(open.back()->connected());
      if (greets) open.back()->greet();
      open.back()->say(bytes);
    };
    std::string garbage(10'000, '\0');
    for (int i = 0; i < 5; ++i) {
      for (char& byte : garbage) byte = static_cast<char>(random());
      peer(garbage, false);
      peer(garbage, true);
    }
    peer("GET / HTTP/1.1\r\n\r\n", false);
    peer("\xFF", false);
    peer("", true);
    const std::string known = ready(is_publisher ? "SUB" : "REQ");
    peer(known, true);
    peer(known + std::string("\x01\0\x01\x06\x02S", 6), true);                   // half of a message in two parts
    peer(known + std::string("\x02\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 9), true);  // a frame of 2^64 - 1 octets
    peer(known + std::string("\x01\0\0\0", 4), true);                            // empty request
    peer(known + std::string("\0\x01\x01", 3), true);                            // no request, or a subscription
    peer(ready("DEALER") + std::string("\x01\x01x\0\x01y", 6), true);            // no way back
    std::string flood = known;
    for (int i = 0; i < 5'000; ++i) flood += std::string("\x01\0\0\x06\x02S1234", 10);
    peer(flood, true);
  }
  for (int i = 0; i < 3'000; ++i)
    scene.changed({i, 1, i % 2 == 0 ? bt::Status::kIdle : bt::Status::kRunning,
                   i % 2 == 0 ? bt::Status::kRunning : bt::Status::kIdle});
  open.resize(open.size() / 2);  // some vanish
  const auto client = Client::connect(at(ports.groot2));
  ASSERT_TRUE(client.has_value());
  const auto tree = (*client)->ask(Ask::kTree);
  ASSERT_TRUE(tree.has_value()) << to_string(tree.error());
  EXPECT_EQ(tree->tree, TreeId{7});
  open.clear();
  EXPECT_TRUE((*client)->ask(Ask::kStatus).has_value());
}

TEST_F(ServerTest, RefusesHooksWhereNobodyTakesThem) {
  const auto client = Client::connect(at(server->ports().groot2));
  ASSERT_TRUE(client.has_value());
  EXPECT_EQ((*client)->ask(Ask::kInsertHook, "[]").error().code, "groot.refused");
  EXPECT_TRUE((*client)->ask(Ask::kDumpHooks).has_value());
}

TEST_F(ServerTest, AnswersARequestThatIsTooLarge) {
  const auto client = Client::connect(at(server->ports().groot2));
  ASSERT_TRUE(client.has_value());
  const auto large = (*client)->ask(Ask::kBlackboard, std::string(Server::kPartBytesMax + 1, 'x'));
  ASSERT_FALSE(large.has_value());
  EXPECT_EQ(large.error().message, "the publisher refuses: a request has at most 65536 octets");
  EXPECT_TRUE((*client)->ask(Ask::kStatus).has_value());
}

TEST_F(ServerTest, SaysWhichPortIsTakenAndWhoMayReachIt) {
  const auto second = Server::start(scene, nullptr, {.port = server->ports().groot2});
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code, "groot.port-taken");
  EXPECT_THAT(second.error().message,
              ::testing::StartsWith("Groot: 127.0.0.1:" + std::to_string(server->ports().groot2) +
                                    " (Groot 2's server) is taken: another process listens"));
  EXPECT_THAT(second.error().message, HasSubstr("(0 takes free ones)"));
  EXPECT_EQ(Server::start(scene, nullptr, {.address = "0.0.0.0"}).error().code, "groot.not-loopback");
  EXPECT_THAT(server->told(), HasSubstr("nobody is authenticated"));
  EXPECT_THAT(server->told(), HasSubstr("takes no breakpoints")) << "there are no hooks";
}

TEST(ServerAddress, IsAPortOrAHostWithOne) {
  EXPECT_EQ(parse_server_address("true")->port, kGroot2Port);
  EXPECT_EQ(parse_server_address("0.0.0.0:1700")->address, "0.0.0.0");
  for (const char* wrong : {"", "x", "1", "65534", "70000", ":1667", "a:"})
    EXPECT_EQ(parse_server_address(wrong).error().code, "groot.bad-address") << wrong;
}

TEST(ClientAddress, IsAHostAndPerhapsAPort) {
  if (!is_built()) GTEST_SKIP() << "built without ZeroMQ";
  for (const char* wrong :
       {"", "zmq://", "zmq://host:", "zmq://host:0", "zmq://host:99999", "zmq://host/x", "zmq://:1667"})
    EXPECT_EQ(Client::connect(wrong).error().code, "groot.bad-address") << wrong;
  // Nobody is there, which only shows when something is asked.
  const auto client = Client::connect("127.0.0.1:9");
  ASSERT_TRUE(client.has_value());
  EXPECT_EQ((*client)->ask(Ask::kTree).error().code, "groot.silent");
}

struct Waiting {
  static bt::Status on_start(bt::Context&) { return bt::Status::kRunning; }
  static bt::Status on_running(bt::Context&) { return bt::Status::kRunning; }
};

// A program of its own that embeds the tree, and a Groot.
class PublisherTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!is_built()) GTEST_SKIP() << "built without ZeroMQ";
    registry.action("Count", [this](bt::Context&) {
      ++counted;
      return bt::Status::kSuccess;
    });
    registry.add<Waiting>("Wait");
    executor = std::make_unique<exec::Executor>(
        served_tree(R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><ReactiveSequence>
              <Script code="n := 7"/><Count/><Wait/></ReactiveSequence></BehaviorTree></root>)",
                    &registry),
        exec::ExecutorOptions{.period = std::chrono::milliseconds(1)});
    auto started = Publisher::start(*executor, {.port = 0});
    ASSERT_TRUE(started.has_value()) << to_string(started.error());
    publisher = std::move(*started);
    auto connected = Client::connect(at(publisher->server().ports().groot2));
    ASSERT_TRUE(connected.has_value());
    client = std::move(*connected);
    thread = std::thread([this] { result = executor->run(); });
  }
  void TearDown() override {
    if (!thread.joinable()) return;
    publisher->let_go();
    executor->halt();
    thread.join();
  }
  std::string ask(Ask type, std::optional<std::string> body = {}) {
    const auto reply = client->ask(type, std::move(body));
    return reply ? reply->body : to_string(reply.error());
  }
  // Asks until the answer is right; each question takes a while, and there is an end to it.
  bool comes(const std::function<bool()>& is_so) {
    for (int i = 0; i < 20'000; ++i) {
      if (is_so()) return true;
      ask(Ask::kStatus);
    }
    return false;
  }
  static constexpr const char* kAtCount = R"(, "uid": 3, "position": 0})";
  std::atomic<int> counted = 0;
  bt::Registry registry;
  std::unique_ptr<exec::Executor> executor;
  std::unique_ptr<Publisher> publisher;
  std::unique_ptr<Client> client;
  bt::Status result = bt::Status::kIdle;
  std::thread thread;
};

TEST_F(PublisherTest, ShowsStatusesAndBlackboard) {
  // Between two ticks the children before the one that runs are idle again.
  EXPECT_TRUE(comes([&] { return ask(Ask::kStatus) == std::string("\1\0\1\2\0\x0C\3\0\x0C\4\0\1", 12); }));
  EXPECT_TRUE(
      comes([&] { return to_json(*parse_message_pack(ask(Ask::kBlackboard, "Main"))) == R"({"Main":{"n":7}})"; }));
  EXPECT_THAT(ask(Ask::kTree), HasSubstr("<Count name=\"Count\" _uid=\"3\"/>"));
}

TEST_F(PublisherTest, StopsAtABreakpointUntilItIsUnlocked) {
  const std::string hook =
      std::string(R"({"enabled": true, "mode": 0, "once": false, "desired_status": "SKIPPED")") + kAtCount;
  EXPECT_EQ(ask(Ask::kInsertHook, hook), "");
  // Listening begins some time after connecting: the breakpoint is reached again and again until it is heard.
  std::optional<std::uint16_t> reached;
  EXPECT_TRUE(comes([&] {
    ask(Ask::kUnlock, std::string(R"({"desired_status": "SKIPPED", "remove_when_done": false)") + kAtCount);
    reached = client->next_reached();
    return reached.has_value();
  }));
  EXPECT_EQ(reached, 3);
  const auto failed = [&] {
    ask(Ask::kUnlock, std::string(R"({"desired_status": "FAILURE", "remove_when_done": false)") + kAtCount);
    return ask(Ask::kStatus).substr(0, 3) == std::string("\1\0\x0D", 3);
  };
  EXPECT_TRUE(comes(failed));
  thread.join();
  EXPECT_EQ(result, bt::Status::kFailure);
}

TEST_F(PublisherTest, ReplacesAResultOnce) {
  EXPECT_EQ(ask(Ask::kInsertHook,
                std::string(R"({"enabled": true, "mode": 1, "once": true, "desired_status": "FAILURE")") + kAtCount),
            "");
  thread.join();
  EXPECT_EQ(result, bt::Status::kFailure);
  EXPECT_TRUE(comes([&] { return ask(Ask::kDumpHooks) == "[]"; }));
}

TEST_F(PublisherTest, LetsGoWhenTheProgramEnds) {
  EXPECT_TRUE(comes([&] { return ask(Ask::kStatus).substr(9) == std::string("\4\0\1", 3); }));
  EXPECT_EQ(ask(Ask::kInsertHook,
                std::string(R"({"enabled": true, "mode": 0, "once": false, "desired_status": "SKIPPED")") + kAtCount),
            "");
  const auto stands = [&] {
    const int before = counted;
    for (int i = 0; i < 20; ++i) ask(Ask::kStatus);
    return counted == before;
  };
  EXPECT_TRUE(comes(stands));
  TearDown();
  EXPECT_EQ(result, bt::Status::kIdle);
}

}  // namespace
}  // namespace sentree::groot
