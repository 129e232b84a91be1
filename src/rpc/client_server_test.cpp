#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "sentree/rpc/detail/test_peers.h"

namespace sentree::rpc {
namespace {

using namespace std::chrono_literals;
using test::connect;
using test::Folder;
using test::in;
using test::Robot;
using test::serve;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The same expectations for every way a call can go.
class EveryTransport : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    std::string text = GetParam();
    if (const auto at = text.find("PATH"); at != std::string::npos) text.replace(at, 4, folder_.file("socket"));
    Address address = *Address::parse(text);
    server_ = serve(address, robot_);
    ASSERT_NE(server_, nullptr);
    address.port = server_->address().port;
    client_ = connect(address, {.target = "robot"});
  }

  Folder folder_;
  std::shared_ptr<Robot> robot_ = std::make_shared<Robot>();
  std::unique_ptr<Server> server_;
  std::unique_ptr<Client> client_;
};

TEST_P(EveryTransport, CarriesArgumentsResultsAndDefaults) {
  const Outcome out = client_->call("go", Map{{"target", Map{{"x", 1}, {"y", 2}}}});
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(to_json(*out), R"({"x":1.0,"y":2.0,"theta":0.0})");
  EXPECT_EQ(client_->call("ping", {}), Outcome(Value()));
}

TEST_P(EveryTransport, CarriesDeclaredExceptions) {
  const Outcome out = client_->call("go", Map{{"target", Map{{"x", -1}, {"y", 2}}}});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kException);
  EXPECT_EQ(out.error().exception, "Refused");
  EXPECT_EQ(to_json(out.error().data), R"({"status":"MOVING","why":"behind"})");
}

TEST_P(EveryTransport, RefusesWrongArgumentsBeforeAnybodySeesThem) {
  const Outcome out = client_->call("echo", Map{{"text", 5}});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kArguments);
  EXPECT_EQ(out.error().message, R"(argument "text" of Robot.echo: expected string, got int 5)");
  EXPECT_EQ(client_->counters().calls, 0U);
  EXPECT_THAT(client_->call("ehco", {}).error().message, HasSubstr("did you mean \"echo\"?"));
}

TEST_P(EveryTransport, CallsFromManyThreadsAllGetTheirOwnReply) {
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 200; ++i) {
        const std::string text = std::to_string(t) + ":" + std::to_string(i);
        if (client_->call("echo", Map{{"text", text}}) != Outcome(Value(text))) ++wrong;
      }
    });
  }
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(client_->counters().calls, 800U);
}

TEST_P(EveryTransport, OnewayCallsArriveInOrder) {
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(client_->call("note", Map{{"text", std::to_string(i)}}));
  const auto notes = robot_->await_notes(50);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(notes[static_cast<std::size_t>(i)], std::to_string(i));
}

TEST_P(EveryTransport, AClosedClientCallsNobody) {
  client_->close();
  EXPECT_EQ(client_->call("ping", {}).error().kind, CallErrorKind::kUnreachable);
}

INSTANTIATE_TEST_SUITE_P(Rpc, EveryTransport,
                         ::testing::Values("unix:PATH", "unix:PATH#robot", "tcp://127.0.0.1:0",
                                           "tcp://localhost:0/robot", "tcp://[::1]:0?protocol=compact",
                                           "unix:PATH?transport=framed",
                                           "unix:PATH#robot?protocol=compact&transport=framed"));

class OverASocket : public ::testing::Test {
 protected:
  Folder folder_;
  std::shared_ptr<Robot> robot_ = std::make_shared<Robot>();
};

TEST_F(OverASocket, ALateReplyIsCountedAndReachesNobody) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket(), {.target = "robot"});
  const Outcome out = client->call("wait", {}, in(30ms));
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kLate);
  EXPECT_THAT(out.error().message, HasSubstr("\"robot\" at unix:"));
  robot_->release();
  EXPECT_EQ(client->call("echo", Map{{"text", "x"}}), Outcome(Value("x")));
  EXPECT_EQ(client->counters().late, 1U);
  EXPECT_EQ(client->counters().late_replies, 1U);
  EXPECT_EQ(client->counters().connections, 1U) << "the connection is kept";
}

TEST_F(OverASocket, ALateReplyDoesNotConfuseTheNextCall) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket(), {.target = "robot"});
  ASSERT_EQ(client->call("wait", {}, in(30ms)).error().kind, CallErrorKind::kLate);
  std::thread releases([&] { robot_->release(); });
  EXPECT_EQ(client->call("echo", Map{{"text", "mine"}}, in(5s)), Outcome(Value("mine")));
  releases.join();
  EXPECT_EQ(client->counters().late_replies, 1U);
}

TEST_F(OverASocket, APeerThatOwesTooManyRepliesLosesTheConnection) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket());
  for (std::size_t i = 0; i < kLateRepliesMax; ++i) {
    ASSERT_EQ(client->call("wait", {}, in(1ms)).error().kind, CallErrorKind::kLate);
  }
  EXPECT_TRUE(client->call("ping", {}, in(5s))) << "on a connection of its own";
  EXPECT_EQ(client->counters().connections, 2U);
  robot_->release();
}

TEST_F(OverASocket, ADeadlineHoldsWhileAnotherCallHasTheConnection) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket());
  std::thread other([&] { (void)client->call("wait", {}); });
  robot_->await_waiting(1);
  const Outcome out = client->call("ping", {}, in(20ms));
  EXPECT_EQ(out.error().kind, CallErrorKind::kLate);
  robot_->release();
  other.join();
}

TEST_F(OverASocket, InterruptEndsTheCallInProgress) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket());
  Outcome out;
  std::thread caller([&] { out = client->call("wait", {}); });
  robot_->await_waiting(1);
  client->interrupt();
  caller.join();
  EXPECT_EQ(out.error().kind, CallErrorKind::kUnreachable);
  robot_->release();
  EXPECT_TRUE(client->call("ping", {})) << "connects anew";
}

TEST_F(OverASocket, CloseEndsTheCallInProgressForGood) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket());
  std::thread caller([&] { (void)client->call("wait", {}); });
  robot_->await_waiting(1);
  client->close();
  caller.join();
  robot_->release();
  EXPECT_EQ(client->call("ping", {}).error().kind, CallErrorKind::kUnreachable);
}

TEST_F(OverASocket, ARestartedServerIsUsedAgain) {
  auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket(), {.target = "robot"});
  ASSERT_TRUE(client->call("ping", {}));
  server->stop();
  const Outcome gone = client->call("ping", {});
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().kind, CallErrorKind::kUnreachable);
  server = serve(folder_.socket(), robot_);
  Outcome out;
  do {
    out = client->call("ping", {});
  } while (!out);
  EXPECT_EQ(client->counters().connections, 2U);
}

TEST_F(OverASocket, AttemptsToConnectBackOff) {
  const auto client = connect(folder_.socket());
  EXPECT_THAT(client->call("ping", {}).error().message, HasSubstr("No such file"));
  bool said_when = false;
  for (int i = 0; i < 1000 && !said_when; ++i) {
    said_when = client->call("ping", {}).error().message.find("tried again in") != std::string::npos;
  }
  EXPECT_TRUE(said_when);
}

TEST_F(OverASocket, StoppingAServerEndsItsConnectionsAndRemovesItsFile) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket());
  ASSERT_TRUE(client->call("ping", {}));
  server->stop();
  EXPECT_FALSE(std::filesystem::exists(folder_.file("socket")));
  server->stop();
}

TEST_F(OverASocket, AUsedAddressIsNotTakenOverAndAStaleFileIs) {
  { const test::RawServer crashed(folder_.socket()); }
  EXPECT_TRUE(std::filesystem::exists(folder_.file("socket")));
  const auto server = serve(folder_.socket(), robot_);
  const auto second = Server::start(folder_.socket(), {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, "rpc.port-taken");
  EXPECT_TRUE(std::filesystem::exists(folder_.file("socket")));

  const auto tcp = serve(*Address::parse("tcp://127.0.0.1:0"), robot_);
  EXPECT_NE(tcp->address().port, 0);
  const auto taken = Server::start(tcp->address(), {});
  ASSERT_FALSE(taken);
  EXPECT_THAT(taken.error().message, HasSubstr(to_string(tcp->address()) + " is taken"));

  std::ofstream(folder_.file("notes")) << "mine";
  const auto file = Server::start(*Address::parse("unix:" + folder_.file("notes")), {});
  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, HasSubstr("a file that is no socket is there"));
  EXPECT_TRUE(std::filesystem::exists(folder_.file("notes")));
}

TEST_F(OverASocket, OtherMachinesNeedTlsOrTheirPermission) {
  const Address everywhere = *Address::parse("tcp://0.0.0.0:0");
  const auto refused = Server::start(everywhere, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "rpc.not-loopback");
  EXPECT_TRUE(Server::start(everywhere, {}, {.insecure = true}));
  EXPECT_FALSE(Server::start(*Address::parse("tcp://[::]:0"), {}));
}

TEST_F(OverASocket, UnknownMethodsAndServicesAreNamed) {
  const auto server = serve(folder_.socket(), robot_);
  const auto other = test::schema("service Robot { void fly() }").service("Robot");
  const auto client = *Client::remote(folder_.socket(), other);
  const Outcome out = client->call("fly", {});
  EXPECT_EQ(out.error().kind, CallErrorKind::kProtocol);
  EXPECT_THAT(out.error().message, HasSubstr("Robot has no method \"fly\""));

  Address wrong = folder_.socket();
  wrong.service = "battery";
  EXPECT_THAT(connect(wrong)->call("ping", {}).error().message, HasSubstr("there is \"robot\""));

  const Address both = *Address::parse("unix:" + folder_.file("both"));
  const auto two = Server::start(both, {{"robot", robot_}, {"arm", robot_}});
  ASSERT_TRUE(two);
  EXPECT_THAT((*Client::remote(both, other))->call("fly", {}).error().message,
              HasSubstr("names no service is for the first of \"robot\", \"arm\""));
}

TEST_F(OverASocket, AnAnswerThatBreaksTheIdlIsAnErrorThatNamesTheField) {
  const auto liar = std::make_shared<FunctionService>(
      test::schema().service("Robot"), [](const idl::Method& method, const Value&) -> Outcome {
        if (method.name == "ping") throw std::runtime_error("it broke");
        if (method.name == "echo") return tl::unexpected(CallError{CallErrorKind::kException, "why", "Unheard", {}});
        return Value(Map{{"x", "far"}, {"y", 1}});
      });
  const auto server = serve(folder_.socket(), liar);
  const auto client = connect(folder_.socket());
  EXPECT_THAT(client->call("go", Map{{"target", Map{{"x", 1}, {"y", 2}}}}).error().message,
              HasSubstr("result of Robot.go.x: expected double, got string \"far\""));
  EXPECT_THAT(client->call("ping", {}).error().message, HasSubstr("it broke"));
  EXPECT_THAT(client->call("echo", Map{{"text", ""}}).error().message,
              HasSubstr("\"Unheard\", which it does not declare"));
}

}  // namespace
}  // namespace sentree::rpc
