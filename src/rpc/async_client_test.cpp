#include "sentree/rpc/async_client.h"

#include <gmock/gmock.h>

#include <atomic>
#include <random>
#include <thread>

#include "sentree/base/rng.h"
#include "sentree/rpc/detail/answers.h"
#include "sentree/rpc/detail/test_peers.h"

namespace sentree::rpc {
namespace {

using namespace std::chrono_literals;
using test::begin;
using test::call;
using test::Folder;
using test::in;
using test::LaterRobot;
using test::make_client;
using test::RawPeer;
using test::RawServer;
using test::Robot;
using test::serve;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Large enough to fill a socket many times over.
constexpr std::size_t kLarge = std::size_t{4} << 20U;

class Async : public ::testing::Test {
 protected:
  Folder folder_;
  std::shared_ptr<Robot> robot_ = std::make_shared<Robot>();
  std::shared_ptr<LaterRobot> later_ = std::make_shared<LaterRobot>();
};

class AsyncTransports : public ::testing::TestWithParam<const char*> {};

TEST_P(AsyncTransports, CarryResultsExceptionsAndLargeMessages) {
  const Folder folder;
  std::string text = GetParam();
  if (const auto at = text.find("PATH"); at != std::string::npos) text.replace(at, 4, folder.file("socket"));
  Address address = *Address::parse(text);
  const auto server = serve(address, std::make_shared<Robot>());
  address.port = server->address().port;
  const auto client = make_client(address, {.target = "robot"});
  EXPECT_EQ(call(*client, "ping", {}), Outcome(Value()));
  const Outcome out = call(*client, "go", Map{{"target", Map{{"x", -1}, {"y", 2}}}});
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().exception, "Refused");
  // Neither side's socket takes it at once.
  const std::string large(kLarge, 'x');
  EXPECT_EQ(call(*client, "echo", Map{{"text", large}}), Outcome(Value(large)));
  EXPECT_EQ(call(*client, "echo", Map{{"text", "small"}}), Outcome(Value("small")));
  EXPECT_EQ(client->counters().connections, 1U);
}
INSTANTIATE_TEST_SUITE_P(Rpc, AsyncTransports,
                         ::testing::Values("unix:PATH", "tcp://127.0.0.1:0", "unix:PATH?transport=framed",
                                           "unix:PATH#robot?protocol=compact"));

TEST_F(Async, CallsAreMadeInTheOrderGiven) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = make_client(folder_.socket());
  std::vector<std::future<Outcome>> outcomes;
  for (int i = 0; i < 50; ++i) outcomes.push_back(begin(*client, "note", Map{{"text", std::to_string(i)}}));
  for (auto& outcome : outcomes) EXPECT_TRUE(outcome.get());
  const auto notes = robot_->await_notes(50);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(notes[static_cast<std::size_t>(i)], std::to_string(i));
}

TEST_F(Async, OpensBeforeTheFirstCall) {
  const auto client = make_client(folder_.socket(), {.target = "robot"});
  const auto open = [&] {
    std::promise<Outcome> opened;
    client->open(in(10s), [&](Outcome outcome) { opened.set_value(std::move(outcome)); });
    return opened.get_future().get();
  };
  EXPECT_EQ(open().error().kind, CallErrorKind::kUnreachable);
  const auto server = serve(folder_.socket(), robot_);
  Outcome opened = open();
  // What has failed is not tried again at once.
  for (const auto until = in(10s); !opened && std::chrono::steady_clock::now() < until;) opened = open();
  EXPECT_EQ(opened, Outcome(Value()));
  EXPECT_EQ(client->counters().connections, 1U);
  EXPECT_EQ(client->counters().calls, 0U);
  EXPECT_EQ(call(*client, "ping", {}), Outcome(Value()));
  EXPECT_EQ(client->counters().connections, 1U);
  client->close();
  EXPECT_EQ(open().error().kind, CallErrorKind::kUnreachable);
}

TEST_F(Async, ADoneMayCallAgain) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = make_client(folder_.socket());
  std::promise<int> over;
  int count = 0;
  std::function<void(Outcome)> again = [&](const Outcome& out) {
    if (!out || ++count == 100)
      over.set_value(count);
    else
      client->call("ping", {}, kNoDeadline, again);
  };
  client->call("ping", {}, kNoDeadline, again);
  EXPECT_EQ(over.get_future().get(), 100);
  EXPECT_EQ(client->counters().connections, 1U);
}

TEST_F(Async, WhatDoesNotFitIsNotSent) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = make_client(folder_.socket(), {.target = "robot"});
  EXPECT_THAT(call(*client, "ehco", {}).error().message, HasSubstr("did you mean \"echo\"?"));
  EXPECT_EQ(call(*client, "echo", Map{{"text", 5}}).error().kind, CallErrorKind::kArguments);
  EXPECT_EQ(client->counters().calls, 0U);
}

TEST_F(Async, ALateReplyIsCountedAndReachesNobody) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = make_client(folder_.socket(), {.target = "robot"});
  ASSERT_TRUE(call(*client, "ping", {}));
  const Outcome out = call(*client, "wait", {}, in(30ms));
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kLate);
  robot_->release();
  EXPECT_EQ(call(*client, "echo", Map{{"text", "mine"}}), Outcome(Value("mine")));
  EXPECT_EQ(client->counters().late, 1U);
  EXPECT_EQ(client->counters().late_replies, 1U);
  EXPECT_EQ(client->counters().connections, 1U);
}

TEST_F(Async, ALateReplyDoesNotConfuseTheNextCall) {
  const auto server = serve(folder_.socket(), later_);
  const auto client = make_client(folder_.socket());
  auto connected = begin(*client, "ping", {});
  later_->take(1).reply.give(Value());
  ASSERT_TRUE(connected.get());
  auto first = begin(*client, "echo", Map{{"text", "first"}}, in(30ms));
  EXPECT_EQ(first.get().error().kind, CallErrorKind::kLate);
  auto second = begin(*client, "echo", Map{{"text", "second"}});
  const auto late = later_->take(3);
  const auto mine = later_->take(3);
  late.reply.give(late.answer);
  mine.reply.give(mine.answer);
  EXPECT_EQ(second.get(), Outcome(Value("second")));
  EXPECT_EQ(client->counters().late_replies, 1U);
}

TEST_F(Async, APeerThatOwesTooManyRepliesLosesTheConnection) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = make_client(folder_.socket());
  ASSERT_TRUE(call(*client, "ping", {}));
  for (std::size_t i = 0; i < kLateRepliesMax; ++i)
    ASSERT_EQ(call(*client, "wait", {}, in(1ms)).error().kind, CallErrorKind::kLate);
  EXPECT_TRUE(call(*client, "ping", {}, in(5s))) << "on a connection of its own";
  EXPECT_EQ(client->counters().connections, 2U);
  robot_->release();
}

TEST_F(Async, ACallThatWaitsForOthersHasItsDeadlineToo) {
  const auto server = serve(folder_.socket(), later_);
  const auto client = make_client(folder_.socket());
  auto first = begin(*client, "echo", Map{{"text", "first"}}, in(60ms));
  auto second = begin(*client, "echo", Map{{"text", "second"}}, in(20ms));
  EXPECT_EQ(first.get().error().kind, CallErrorKind::kLate);
  EXPECT_THAT(second.get().error().message, HasSubstr("other calls kept the connection busy"));
}

TEST_F(Async, TheCallsThatWaitHaveABound) {
  const auto server = serve(folder_.socket(), later_);
  const auto client = make_client(folder_.socket());
  auto first = begin(*client, "ping", {});
  const auto held = later_->take(1);
  std::vector<std::future<Outcome>> waiting;
  for (std::size_t i = 0; i < kAsyncCallsMax; ++i) waiting.push_back(begin(*client, "ping", {}));
  auto refused = begin(*client, "ping", {});
  ASSERT_EQ(refused.wait_for(0s), std::future_status::ready) << "told at once";
  const Outcome out = refused.get();
  EXPECT_EQ(out.error().kind, CallErrorKind::kUnreachable);
  EXPECT_THAT(out.error().message, HasSubstr("256 calls are waiting already"));
  held.reply.give(Value());
  EXPECT_TRUE(first.get());
  client->close();
  for (auto& outcome : waiting) (void)outcome.get();
}

TEST_F(Async, ClosingFailsAllCalls) {
  const auto server = serve(folder_.socket(), later_);
  const auto client = make_client(folder_.socket());
  auto flying = begin(*client, "ping", {});
  const auto held = later_->take(1);
  auto waiting = begin(*client, "ping", {});
  client->close();
  EXPECT_EQ(flying.get().error().kind, CallErrorKind::kUnreachable);
  EXPECT_EQ(waiting.get().error().kind, CallErrorKind::kUnreachable);
  EXPECT_THAT(call(*client, "ping", {}).error().message, HasSubstr("the client has been closed"));
}

TEST_F(Async, ARestartedServerIsUsedAgain) {
  auto server = serve(folder_.socket(), robot_);
  const auto client = make_client(folder_.socket());
  ASSERT_TRUE(call(*client, "ping", {}));
  server->stop();
  EXPECT_EQ(call(*client, "ping", {}).error().kind, CallErrorKind::kUnreachable);
  server = serve(folder_.socket(), robot_);
  Outcome out;
  do {
    out = call(*client, "ping", {});
  } while (!out);
  EXPECT_EQ(client->counters().connections, 2U);
}

TEST_F(Async, APeerThatTakesNothingCostsTheDeadlineAndTheConnection) {
  const RawServer server(folder_.socket());
  const auto client = make_client(folder_.socket());
  auto small = begin(*client, "ping", {});
  const RawPeer peer(server.accept());
  EXPECT_THAT(peer.receive(), HasSubstr("ping"));
  peer.send(std::string("\x80\x01\x00\x02\x00\x00\x00\x04ping\x00\x00\x00\x01\x00", 17));
  EXPECT_TRUE(small.get());
  const Value large = Map{{"text", std::string(kLarge, 'x')}};
  // Its first bytes go in this thread, the others wait for the peer; then on a connection that is made for it.
  for (int i = 0; i < 2; ++i) EXPECT_EQ(call(*client, "echo", large, in(50ms)).error().kind, CallErrorKind::kLate);
  EXPECT_TRUE(peer.await_end());
}

TEST_F(Async, AServerThatHangsUpWhileNobodyCallsIsNoticed) {
  const RawServer server(folder_.socket());
  const auto client = make_client(folder_.socket());
  auto first = begin(*client, "ping", {});
  {
    const RawPeer peer(server.accept());
    EXPECT_THAT(peer.receive(), HasSubstr("ping"));
    peer.send(std::string("\x80\x01\x00\x02\x00\x00\x00\x04ping\x00\x00\x00\x01\x00", 17));
    EXPECT_TRUE(first.get());
  }
  auto second = begin(*client, "ping", {});
  // Perhaps noticed by the call itself; the next one in any case connects anew.
  while (client->counters().connections < 2) {
    if (second.wait_for(1ms) == std::future_status::ready) second = begin(*client, "ping", {});
  }
  client->close();
}

TEST_F(Async, CallsFromManyThreadsAllGetTheirOwnReply) {
  const auto server = serve(folder_.socket(), robot_);
  const auto client = make_client(folder_.socket());
  const std::uint64_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      Rng rng = Rng::of(seed, std::to_string(t));
      for (int i = 0; i < 100; ++i) {
        // Now and then one that goes in pieces.
        const std::size_t size = rng.below(20) == 0 ? std::size_t{1} << 19U : 10;
        const std::string text = std::to_string(t) + ":" + std::to_string(i) + std::string(size, '.');
        if (call(*client, "echo", Map{{"text", text}}) != Outcome(Value(text))) ++wrong;
      }
    });
  }
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(client->counters().connections, 1U);
}

TEST_F(Async, AServiceMayAnswerLaterAndFromAnyThread) {
  const auto server = serve(folder_.socket(), later_);
  const auto client = make_client(folder_.socket());
  auto outcome = begin(*client, "echo", Map{{"text", std::string(kLarge, 'y')}});
  std::thread([held = later_->take(1)] { held.reply.give(held.answer); }).join();
  EXPECT_EQ(outcome.get(), Outcome(Value(std::string(kLarge, 'y'))));
  // An answer counts once.
  outcome = begin(*client, "echo", Map{{"text", "once"}});
  auto held = later_->take(2);
  held.reply.give(Value("once"));
  held.reply.give(Value("twice"));
  EXPECT_EQ(outcome.get(), Outcome(Value("once")));
  // What breaks the IDL is an error of the call here, too.
  outcome = begin(*client, "echo", Map{{"text", "x"}});
  later_->take(3).reply.give(Value(5));
  EXPECT_THAT(outcome.get().error().message, HasSubstr("result of Robot.echo: expected string"));
}

TEST_F(Async, AnAnswerThatNobodyGivesIsAnError) {
  const auto server = serve(folder_.socket(), later_);
  const auto client = make_client(folder_.socket());
  auto outcome = begin(*client, "ping", {});
  (void)later_->take(1);
  EXPECT_THAT(outcome.get().error().message, HasSubstr("the service gave no answer"));
}

TEST_F(Async, ALastAnswerClosesTheConnection) {
  const auto server = serve(folder_.socket(), later_);
  const RawPeer peer(folder_.socket());
  peer.send(std::string("\x80\x01\x00\x01\x00\x00\x00\x04ping\x00\x00\x00\x01\x00", 17));
  later_->take(1).reply.give_last(Value());
  EXPECT_THAT(peer.receive(), HasSubstr("ping"));
  EXPECT_TRUE(peer.await_end());
}

TEST_F(Async, AnAnswerMayComeWhenItsServerIsGone) {
  auto server = serve(folder_.socket(), later_);
  const auto client = make_client(folder_.socket());
  auto outcome = begin(*client, "ping", {});
  const auto held = later_->take(1);
  server.reset();
  held.reply.give(Value());
  EXPECT_EQ(outcome.get().error().kind, CallErrorKind::kUnreachable);
}

TEST_F(Async, TheAnswersThatAConnectionIsOwedHaveABound) {
  const auto server = serve(folder_.socket(), later_);
  const RawPeer peer(folder_.socket());
  constexpr std::size_t kAsked = kAnswersOwedMax + 4;
  std::string asked;
  for (std::size_t i = 1; i <= kAsked; ++i) {
    asked += std::string("\x80\x01\x00\x01\x00\x00\x00\x04ping\x00\x00\x00", 15);
    asked += static_cast<char>(i);
    asked += '\0';
  }
  peer.send(asked);
  for (std::size_t i = 0; i < kAsked; ++i) later_->take(std::min(kAnswersOwedMax + i, kAsked)).reply.give(Value());
  EXPECT_EQ(later_->most(), kAnswersOwedMax);
  std::string answered;
  while (answered.size() < kAsked * 17) answered += peer.receive();
}

}  // namespace
}  // namespace sentree::rpc
