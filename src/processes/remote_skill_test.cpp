// The server of a skill in a process of its own.
#include "sentree/processes/remote_skill.h"

#include <gtest/gtest.h>

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <future>
#include <string>
#include <thread>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/rpc/server.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/text/file.h"

namespace sentree::processes {
namespace {

// Listens, and answers nobody.
int listener(const std::string& path) {
  const int made = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  EXPECT_EQ(::bind(made, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(::listen(made, 8), 0);
  return made;
}

class SkillServer : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const char* name) const { return (folder_.path() / name).string(); }
  void put(const char* name, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(at(name)).parent_path());
    ASSERT_TRUE(text::write_file(at(name), text));
  }
  /// Of the project that has been put there; what is wrong with it is a failure.
  [[nodiscard]] project::SkillPlan plan_of(const std::string& leaf) const {
    const auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok());
    auto plan = project::prepare_skill(*project.value, leaf);
    EXPECT_TRUE(plan.ok());
    return std::move(*plan.value);
  }

 private:
  const TemporaryFolder folder_{"skill"};
};

TEST_F(SkillServer, ConnectsToComponentsBeforeItsFirstTick) {
  const std::string socket = at("door.sock");
  put("interfaces/door.thrift", "service Door { bool open() }\n");
  put("skills/Open.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="asking">
  <state id="asking"><onentry><send type="thrift" target="door" event="open"/></onentry>
    <transition event="door.open.reply" target="success"/><transition event="error halt" target="failure"/></state>
  <final id="success"/><final id="failure"/></scxml>)");
  put("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Action ID="Open"/></BehaviorTree></root>)");
  put("sentree.yaml",
      "mission: {file: mission.xml}\nservices: {door: {interface: door.thrift/Door, at: \"unix:" + socket + "\"}}\n");
  const int listening = listener(socket);
  const project::SkillPlan plan = plan_of("Open");
  const auto publisher = make_silent_publisher();
  const auto scheduler = runtime::make_real_scheduler();
  const auto service = make_skill_service(plan, *served_skill_interface(), *publisher, *scheduler, {});
  pollfd somebody{listening, POLLIN, 0};
  EXPECT_EQ(::poll(&somebody, 1, 10'000), 1) << "nobody has connected";
  ::close(listening);
}

// Who knows neither leaves nor ports ticks it with what the tree says of the leaf.
TEST_F(SkillServer, GivesTheConstantsOfItsLeafToWhoGivesNone) {
  put("skills/Above.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
  <datamodel><data id="limit"/><data id="unit"/></datamodel>
  <state id="asked"><transition event="tick" cond="limit === 30" target="success"/>
    <transition event="tick" target="failure"/></state>
  <final id="success"/><final id="failure"/></scxml>)");
  put("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Sequence>
  <Condition ID="Above" name="Here" limit="30" unit="m"/><Condition ID="Above" name="There" limit="30" unit="{u}"/>
  <Condition ID="Above" name="Far" limit="40" unit="m"/></Sequence></BehaviorTree>
  <TreeNodesModel><Condition ID="Above"><input_port name="limit" type="double"/><input_port name="unit"/></Condition>
  </TreeNodesModel></root>)");
  put("sentree.yaml", "mission: {file: mission.xml}\n");
  const auto tick = [&](const std::string& leaf, std::vector<std::string>& told) {
    const project::SkillPlan plan = plan_of(leaf);
    const auto publisher = make_silent_publisher();
    const auto scheduler = runtime::make_real_scheduler();
    SkillServerOptions options;
    options.problem = [&](const std::string& what) { told.push_back(what); };
    const auto service = make_skill_service(plan, *served_skill_interface(), *publisher, *scheduler, options);
    std::thread actors([&] { static_cast<void>(scheduler->run()); });
    std::promise<rpc::Outcome> answered;
    service->serve(*service->interface().find("request_tick"), Value(Map{}),
                   rpc::Reply([&](rpc::Outcome outcome, bool) { answered.set_value(std::move(outcome)); }));
    const rpc::Outcome outcome = answered.get_future().get();
    scheduler->stop();
    actors.join();
    return outcome ? std::string(outcome->text()) : outcome.error().message;
  };
  std::vector<std::string> told;
  EXPECT_EQ(tick("Here", told), "SKILL_SUCCESS");
  EXPECT_EQ(tick("Far", told), "SKILL_FAILURE");
  EXPECT_TRUE(told.empty());
  EXPECT_EQ(tick("There", told), "SKILL_SUCCESS");
  ASSERT_EQ(told.size(), 1U);
  EXPECT_NE(told[0].find("no constant for unit"), std::string::npos) << told[0];
  EXPECT_EQ(tick("Above", told), "SKILL_FAILURE") << "its leaves have several limits";
  ASSERT_EQ(told.size(), 2U);
  EXPECT_NE(told[1].find("no constant for unit, limit"), std::string::npos) << told[1];
}

// A skill's process outlives missions, each of which counts the runs of its leaf for itself.
TEST_F(SkillServer, BeginsAnewInEachMission) {
  put("skills/Once.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">
  <state id="asked"><transition event="tick" target="success"/></state>
  <final id="success"/></scxml>)");
  put("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Action ID="Once"/></BehaviorTree></root>)");
  put("sentree.yaml", "mission: {file: mission.xml}\n");
  const project::SkillPlan plan = plan_of("Once");
  const auto publisher = make_silent_publisher();
  const auto scheduler = runtime::make_real_scheduler();
  const auto service = make_skill_service(plan, *served_skill_interface(), *publisher, *scheduler, {});
  const rpc::Address address = *rpc::Address::parse("unix:" + at("once.sock"));
  const auto server = rpc::Server::start(address, {{"skill", service}});
  ASSERT_TRUE(server) << server.error().message;
  std::thread actors([&] { static_cast<void>(scheduler->run()); });
  for (int mission = 1; mission <= 3; ++mission) {
    std::promise<bt::Status> answered;
    runtime::LeafReplies replies;
    replies.answered = [&](std::uint64_t, bt::Status status, const Map& /*outputs*/) { answered.set_value(status); };
    replies.unreachable = [&](std::uint64_t, const std::string& why) {
      ADD_FAILURE() << why;
      answered.set_value(bt::Status::kIdle);
    };
    replies.halted = [] {};
    replies.problem = [](const std::string& what) { ADD_FAILURE() << what; };
    auto driver = make_remote_skill({.leaf = "Once",
                                     .address = address,
                                     .interface = *skill_interface(),
                                     .tick_deadline = std::chrono::minutes(1),
                                     .halt_deadline = std::chrono::minutes(1)},
                                    std::move(replies));
    ASSERT_TRUE(driver) << driver.error().message;
    (*driver)->tick({.tick = 1, .started = true, .inputs = {}}, {});
    EXPECT_EQ(answered.get_future().get(), bt::Status::kSuccess) << "mission " << mission;
    (*driver)->close();
  }
  scheduler->stop();
  actors.join();
}

}  // namespace
}  // namespace sentree::processes
