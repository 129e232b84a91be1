#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/monitor/detail/model.h"
#include "sentree/processes/remote_observer.h"
#include "sentree/processes/remote_skill.h"
#include "sentree/rpc/client.h"
#include "sentree/rpc/server.h"
#include "sentree/scxml/chart.h"

namespace sentree::processes {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Violated by the fifth "beat", or by 100 ms without one.
monitor::Model beats() {
  auto chart = scxml::load(R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
  <datamodel><data id="n" expr="0"/></datamodel>
  <state id="counts">
    <onentry><send event="silence" id="silence" delay="100ms"/></onentry>
    <onexit><cancel sendid="silence"/></onexit>
    <transition event="beat" cond="n &lt; 4" target="counts"><assign location="n" expr="n + 1"/></transition>
    <transition event="beat" target="enough"/>
    <transition event="silence" target="silent"/>
  </state>
  <state id="enough"/><state id="silent"/>
</scxml>)",
                           "beats.scxml");
  EXPECT_TRUE(chart.ok());
  return *monitor::Model::make(
              {.name = "beats", .chart = *chart.value, .violated = {"enough", "silent"}, .renames = {}, .span = {}})
              .value;
}

Message beat(std::uint64_t number, milliseconds at, const std::string& name = "beat") {
  Message message;
  message.sequence = number;
  message.time = TimePoint(at);
  message.name = name;
  message.source = "heart";
  return message;
}

class KeptObserver : public testing::Test {
 protected:
  KeptObserver() : interface_(*kept_observer_interface()) { begin(); }
  // Another process has the address from now on.
  void begin() {
    server_.reset();
    auto server =
        rpc::Server::start(address_, {{"observer", make_monitor_service(interface_, beats(), {}, [](auto&) {})}});
    ASSERT_TRUE(server) << to_string(server.error());
    server_ = std::move(*server);
  }
  void die() { server_.reset(); }

  std::unique_ptr<RemoteObserver> connect(const Value& memory = {}) {
    auto observer = RemoteObserver::connect("beats", address_, interface_,
                                            {.problem = [](const std::string& what) { ADD_FAILURE() << what; },
                                             .decision =
                                                 [this](const monitor::Decision& decision) {
                                                   const std::lock_guard lock(mutex_);
                                                   decisions_.push_back(decision);
                                                 }},
                                            true);
    EXPECT_TRUE(observer) << to_string(observer.error());
    EXPECT_TRUE((*observer)->recall(memory));
    return std::move(*observer);
  }
  std::vector<monitor::Decision> decisions() {
    const std::lock_guard lock(mutex_);
    return decisions_;
  }
  std::vector<std::uint64_t> deciding() {
    std::vector<std::uint64_t> all;
    for (const monitor::Decision& decision : decisions())
      all.push_back(decision.deciding ? decision.deciding->sequence : 0);
    return all;
  }

  const TemporaryFolder folder_{"kept"};
  const rpc::Address address_ = *rpc::Address::parse("unix:" + (folder_.path() / "observer.sock").string());
  const idl::ServicePtr interface_;
  std::unique_ptr<rpc::Server> server_;
  std::mutex mutex_;
  std::vector<monitor::Decision> decisions_;
};

TEST_F(KeptObserver, IsTakenBackToWhereItWas) {
  Value memory;
  {
    const auto observer = connect();
    for (std::uint64_t i = 1; i <= 3; ++i) observer->observe(beat(i, milliseconds(10 * i)));
    const auto said = observer->remember(seconds(30));
    ASSERT_TRUE(said);
    memory = *said;
    // What follows the run has forgotten when it goes on.
    observer->observe(beat(4, milliseconds(40)));
    ASSERT_TRUE(observer->remember(seconds(30)));
  }
  begin();
  const auto observer = connect(memory);
  observer->observe(beat(4, milliseconds(40)));
  observer->observe(beat(5, milliseconds(50)));
  observer->observe(beat(6, milliseconds(60)));
  observer->finish(TimePoint(milliseconds(70)));
  ASSERT_THAT(deciding(), testing::ElementsAre(5U));
  EXPECT_EQ(decisions()[0].state, "enough");
  // What led there lies before what it was taken back to as well.
  EXPECT_EQ(decisions()[0].witness.front().sequence, 1U);
  EXPECT_EQ(decisions()[0].witness.size(), 5U);
}

TEST_F(KeptObserver, HasItsOpenDeadlinesStill) {
  Value memory;
  {
    const auto observer = connect();
    observer->observe(beat(1, milliseconds(10)));
    memory = *observer->remember(seconds(30));
  }
  begin();
  const auto observer = connect(memory);
  observer->finish(TimePoint(milliseconds(500)));
  ASSERT_EQ(decisions().size(), 1U);
  EXPECT_EQ(decisions()[0].state, "silent");
  EXPECT_EQ(decisions()[0].at, TimePoint(milliseconds(110)));
}

TEST_F(KeptObserver, SurvivesEveryDeathOfItsProcessAndDecidesOnce) {
  const std::uint64_t seed = 20'261'124;
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  for (int round = 0; round < 12; ++round) {
    decisions_.clear();
    begin();
    const auto observer = connect();
    for (std::uint64_t i = 1; i <= 8; ++i) {
      const std::uint64_t what = rng.below(6);
      if (what == 0) begin();
      if (what == 1) die();
      // Another thing is observed while nobody is there.
      observer->observe(beat(2 * i - 1, milliseconds(20 * i - 10), "other"));
      if (what == 1) begin();
      if (what == 2) {
        ASSERT_TRUE(observer->remember(seconds(30)));
      }
      observer->observe(beat(2 * i, milliseconds(20 * i)));
    }
    if (rng.below(2) == 0) begin();
    observer->finish(TimePoint(milliseconds(170)));
    ASSERT_THAT(deciding(), testing::ElementsAre(10U)) << "round " << round;
  }
}

TEST_F(KeptObserver, ThatWasStartedAnewSeesNothingBeforeItIsToldWhatItWas) {
  auto client = rpc::Client::remote(address_, interface_, {});
  ASSERT_TRUE(client);
  const auto in_time = [] { return std::chrono::steady_clock::now() + seconds(30); };
  EXPECT_FALSE((*client)->call("remember", Map(), in_time()));
  EXPECT_FALSE((*client)->call("finish", Map{{"time_ns", 1}}, in_time()));
  const Value nothing = Bytes();
  EXPECT_TRUE((*client)->call("recall", Map{{"memory", nothing}}, in_time()));
  EXPECT_TRUE((*client)->call("remember", Map(), in_time()));
  const Value nonsense = Bytes{{std::byte{7}}};
  EXPECT_FALSE((*client)->call("recall", Map{{"memory", nonsense}}, in_time()));
}

}  // namespace
}  // namespace sentree::processes
