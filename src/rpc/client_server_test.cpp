#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "sentree/rpc/detail/test_peers.h"

namespace sentree::rpc {
namespace {

using namespace std::chrono_literals;
using test::connect;
using test::Diary;
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
    const std::string form = GetParam();
    if (form == "local") {
      client_ = Client::local(robot_, {.target = "robot", .hook = &diary_});
      return;
    }
    std::string text = form;
    if (const auto at = text.find("PATH"); at != std::string::npos) text.replace(at, 4, folder_.file("socket"));
    Address address = *Address::parse(text);
    server_ = serve(address, robot_, {.clock = &server_clock_});
    ASSERT_NE(server_, nullptr);
    address.port = server_->address().port;
    client_ = connect(address, {.target = "robot", .hook = &diary_, .clock = &client_clock_});
  }

  Folder folder_;
  std::shared_ptr<Robot> robot_ = std::make_shared<Robot>();
  Diary diary_;
  LogicalClock server_clock_;
  LogicalClock client_clock_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<Client> client_;
};

TEST_P(EveryTransport, CarriesArgumentsResultsAndDefaults) {
  const Outcome out = client_->call("go", Map{{"target", Map{{"x", 1}, {"y", 2}}}});
  ASSERT_TRUE(out) << out.error().message;
  EXPECT_EQ(to_json(*out), R"({"x":1.0,"y":2.0,"theta":0.0})");
  EXPECT_EQ(client_->call("ping", {}), Outcome(Value()));
  EXPECT_THAT(diary_.lines(),
              ElementsAre(R"(request go {"target":{"x":1.0,"y":2.0,"theta":0.0},"fast":true})",
                          R"(reply go {"x":1.0,"y":2.0,"theta":0.0})", "request ping {}", "reply ping null"));
}

TEST_P(EveryTransport, CarriesDeclaredExceptions) {
  const Outcome out = client_->call("go", Map{{"target", Map{{"x", -1}, {"y", 2}}}});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kException);
  EXPECT_EQ(out.error().exception, "Refused");
  EXPECT_EQ(to_json(out.error().data), R"({"status":"MOVING","why":"behind"})");
  EXPECT_EQ(diary_.lines().back(), "error go exception");
}

TEST_P(EveryTransport, RefusesWrongArgumentsBeforeAnybodySeesThem) {
  const Outcome out = client_->call("echo", Map{{"text", 5}});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kArguments);
  EXPECT_EQ(out.error().message, R"(argument "text" of Robot.echo: expected string, got int 5)");
  EXPECT_THAT(diary_.lines(), ElementsAre());
  EXPECT_THAT(client_->call("ehco", {}).error().message, HasSubstr("did you mean \"echo\"?"));
}

TEST_P(EveryTransport, AVetoKeepsTheRequestFromBeingSent) {
  diary_.verdict.veto = "below 30 %";
  const Outcome out = client_->call("note", Map{{"text", "x"}});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kVetoed);
  EXPECT_EQ(out.error().message, "below 30 %");
  EXPECT_EQ(diary_.lines().back(), "error note vetoed");
  diary_.verdict.veto.reset();
  ASSERT_TRUE(client_->call("note", Map{{"text", "y"}}));
  EXPECT_THAT(robot_->await_notes(1), ElementsAre("y"));
}

TEST_P(EveryTransport, AHookMayChangeTheArguments) {
  diary_.verdict.arguments = Map{{"text", "changed"}};
  EXPECT_EQ(client_->call("echo", Map{{"text", "x"}}), Outcome(Value("changed")));
  diary_.verdict.arguments = Map{{"text", 1}};
  EXPECT_EQ(client_->call("echo", Map{{"text", "x"}}).error().kind, CallErrorKind::kVetoed);
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
                         ::testing::Values("local", "unix:PATH", "unix:PATH#robot", "tcp://127.0.0.1:0",
                                           "tcp://localhost:0/robot", "tcp://[::1]:0?protocol=compact",
                                           "unix:PATH?transport=framed",
                                           "unix:PATH#robot?protocol=compact&transport=framed"));

class OverASocket : public ::testing::Test {
 protected:
  Folder folder_;
  std::shared_ptr<Robot> robot_ = std::make_shared<Robot>();
  Diary diary_;
};

TEST_F(OverASocket, ALateReplyIsReportedAndReachesNobodyElse) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket(), {.target = "robot", .hook = &diary_});
  const Outcome out = client->call("wait", {}, {.call = 7, .deadline = in(30ms)});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kLate);
  EXPECT_THAT(out.error().message, HasSubstr("\"robot\" at unix:"));
  robot_->release();
  diary_.await("late wait 7 result");
  EXPECT_THAT(diary_.lines(), ElementsAre("request wait {}", "error wait late", "late wait 7 result"));
  EXPECT_EQ(client->call("echo", Map{{"text", "x"}}), Outcome(Value("x")));
  EXPECT_EQ(client->counters().late, 1U);
  EXPECT_EQ(client->counters().late_replies, 1U);
  EXPECT_EQ(client->counters().connections, 1U) << "the connection is kept";
}

TEST_F(OverASocket, ALateReplyDoesNotConfuseTheNextCall) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket(), {.target = "robot", .hook = &diary_});
  ASSERT_EQ(client->call("wait", {}, {.deadline = in(30ms)}).error().kind, CallErrorKind::kLate);
  std::thread releases([&] { robot_->release(); });
  EXPECT_EQ(client->call("echo", Map{{"text", "mine"}}, {.deadline = in(5s)}), Outcome(Value("mine")));
  releases.join();
  EXPECT_EQ(client->counters().late_replies, 1U);
}

TEST_F(OverASocket, APeerThatOwesTooManyRepliesLosesTheConnection) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket());
  for (std::size_t i = 0; i < kLateRepliesMax; ++i) {
    ASSERT_EQ(client->call("wait", {}, {.deadline = in(1ms)}).error().kind, CallErrorKind::kLate);
  }
  EXPECT_TRUE(client->call("ping", {}, {.deadline = in(5s)})) << "on a connection of its own";
  EXPECT_EQ(client->counters().connections, 2U);
  robot_->release();
}

TEST_F(OverASocket, ADeadlineHoldsWhileAnotherCallHasTheConnection) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = connect(folder_.socket());
  std::thread other([&] { (void)client->call("wait", {}); });
  robot_->await_waiting(1);
  const Outcome out = client->call("ping", {}, {.deadline = in(20ms)});
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
      test::schema().service("Robot"), [](const idl::Method& method, const Value&, const CallContext&) -> Outcome {
        if (method.name == "ping") throw std::runtime_error("it broke");
        if (method.name == "echo") return tl::unexpected(CallError{CallErrorKind::kException, "why", "Unheard", {}});
        return Value(Map{{"x", "far"}, {"y", 1}});
      });
  const auto server = serve(folder_.socket(), liar);
  const auto local = Client::local(liar);
  const auto remote = connect(folder_.socket());
  for (Client* client : {local.get(), remote.get()}) {
    EXPECT_THAT(client->call("go", Map{{"target", Map{{"x", 1}, {"y", 2}}}}).error().message,
                HasSubstr("result of Robot.go.x: expected double, got string \"far\""));
    EXPECT_THAT(client->call("ping", {}).error().message, HasSubstr("it broke"));
    EXPECT_THAT(client->call("echo", Map{{"text", ""}}).error().message,
                HasSubstr("\"Unheard\", which it does not declare"));
  }
}

TEST_F(OverASocket, AnEffectHasAGreaterStampThanItsCause) {
  LogicalClock ahead;
  LogicalClock behind;
  ahead.receive(1000);
  const auto server = serve(folder_.socket(), robot_, {.clock = &behind});
  const auto client = connect(folder_.socket(), {.clock = &ahead});
  const CausalStamp cause = ahead.now();
  ASSERT_TRUE(client->call("ping", {}));
  EXPECT_GT(behind.now(), cause);
  EXPECT_GT(ahead.now(), behind.now()) << "the reply carried the server's stamp back";
  ASSERT_TRUE(connect(folder_.socket())->call("ping", {})) << "without stamps";
}

TEST_F(OverASocket, AHostileStampCannotExhaustTheClock) {
  LogicalClock clock;
  clock.receive(~CausalStamp{0});
  EXPECT_EQ(clock.now(), kStampMax + 1);
  EXPECT_GT(clock.advance(), kStampMax);
}

TEST_F(OverASocket, LocalCallsAreLateToo) {
  const auto client = Client::local(robot_, {.target = "robot", .hook = &diary_});
  robot_->release();
  const Outcome out = client->call("wait", {}, {.call = 3, .deadline = Deadline{}});
  EXPECT_EQ(out.error().kind, CallErrorKind::kLate);
  EXPECT_THAT(diary_.lines(), ElementsAre("request wait {}", "error wait late", "late wait 3 result"));
}

}  // namespace
}  // namespace sentree::rpc
