// What others say to each other, heard by who has no part in it.

#include <gmock/gmock.h>

#include "sentree/ros/detail/action.h"
#include "sentree/ros/detail/overhear.h"
#include "sentree/ros/detail/test_count_server.h"

namespace sentree::ros {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

// What passes between nodes that are none of ours.
class RosOverheard : public Graph {
 protected:
  [[nodiscard]] std::shared_ptr<Node> other_node() const {
    return std::make_shared<Node>(stranger(), Release::kHumble, static_cast<std::uint32_t>(std::stoi(domain_)));
  }
  [[nodiscard]] static ServiceName lamp() {
    return {"/lamp", "std_srvs::srv::dds_::SetBool_Request_", "std_srvs::srv::dds_::SetBool_Response_"};
  }
  // Says its name, "on" or "off".
  [[nodiscard]] std::unique_ptr<ServiceServer> serve_lamp(const std::shared_ptr<Node>& node, Worker& worker) {
    auto server =
        ServiceServer::open(node, lamp(), worker,
                            [](const std::vector<std::uint8_t>& request, const auto& answer) {
                              const bool on = request.at(4) != 0;
                              std::vector<std::uint8_t> reply{0, 1, 0, 0, 1, 0, 0, 0};
                              const std::string said = on ? "on" : "off";
                              reply.insert(reply.end(), {static_cast<std::uint8_t>(said.size() + 1), 0, 0, 0});
                              reply.insert(reply.end(), said.begin(), said.end());
                              reply.push_back(0);
                              answer(reply);
                            },
                            {});
    EXPECT_TRUE(server);
    return std::move(*server);
  }
  [[nodiscard]] static std::vector<std::uint8_t> ask(ServiceClient& client, bool on) {
    const auto never = [] { return false; };
    EXPECT_TRUE(client.wait_available(patience(), never));
    const auto key = client.send({0, 1, 0, 0, static_cast<std::uint8_t>(on), 0, 0, 0});
    EXPECT_TRUE(key);
    return client.wait(key.value_or(ServiceClient::Key{}), patience(), never).value_or(std::vector<std::uint8_t>());
  }
  struct Said {
    std::uint64_t call = 0;
    std::string what;  // "METHOD", "METHOD.reply"
    Value value;
  };
  [[nodiscard]] std::unique_ptr<rpc::Opened> hear(const std::string& name, const std::string& type,
                                                  const std::string& options = "&requests") {
    rpc::Middleware::Hearing hearing;
    hearing.request = [this](const idl::Method& method, Value arguments) {
      const std::uint64_t call = ++calls_;
      said_.add({call, method.name, std::move(arguments)});
      return call;
    };
    hearing.outcome = [this](std::uint64_t call, const idl::Method& method, rpc::Outcome outcome) {
      said_.add({call, method.name + ".reply", outcome ? std::move(*outcome) : Value(outcome.error().message)});
    };
    auto heard = rpc::middleware_of(at(name)).overhear(
        at(name, options), interface(type), std::move(hearing),
        {.target = "heard", .problem = [this](const std::string& what) { problems_.add(what); }});
    EXPECT_TRUE(heard) << heard.error().message;
    return std::move(*heard);
  }
  // Of one topic of DDS, as a participant that has nothing to do with it sees them.
  [[nodiscard]] static std::size_t count(const Node& node, const std::string& topic, bool writers, bool overhears) {
    const auto all = node.endpoints();
    return static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [&](const dds::Endpoint& each) {
      return each.topic == topic && each.is_writer == writers && (each.overhears || !overhears);
    }));
  }
  // An own pair of reader and writer: what is asked from then on is heard.
  [[nodiscard]] static bool listens(const Node& node, std::size_t listeners) {
    return eventually([&] {
      return count(node, "rq/lampRequest", false, true) == listeners &&
             count(node, "rr/lampReply", true, true) == listeners;
    });
  }

  std::atomic<std::uint64_t> calls_{0};
  Heard<Said> said_;
  Heard<std::string> problems_;
};

TEST_F(RosOverheard, AreRequestsAndTheirReplies) {
  const auto there = other_node();
  const auto elsewhere = other_node();
  Worker worker;
  const auto heard = hear("/lamp", "std_srvs/srv/SetBool");
  const auto server = serve_lamp(there, worker);
  const auto client = *ServiceClient::make(elsewhere, lamp());
  // What is asked before the listener has been discovered is not heard.
  ASSERT_TRUE(eventually([&] {
    EXPECT_EQ(ask(*client, true).at(13), 'n');
    return !said_.all().empty();
  }));
  EXPECT_EQ(ask(*client, false).at(13), 'f');
  const auto all = said_.wait([](const auto& now) {
    return std::any_of(now.begin(), now.end(), [](const Said& each) {
      return each.what == "call.reply" && *each.value.find("message") == Value("off");
    });
  });
  const std::uint64_t last = all.back().call;
  std::vector<std::string> lines;
  for (const Said& each : all) {
    if (each.call == last) lines.push_back(each.what + " " + to_json(each.value));
  }
  EXPECT_THAT(lines, ElementsAre(R"(call {"data":false})", R"(call.reply {"success":true,"message":"off"})"));
  worker.stop();
}

TEST_F(RosOverheard, AreRepliesAloneWithoutAnythingThatLooksLikeAServer) {
  const auto there = other_node();
  const auto elsewhere = other_node();
  Worker worker;
  const auto heard = hear("/lamp", "std_srvs/srv/SetBool", "");
  const auto server = serve_lamp(there, worker);
  const auto client = *ServiceClient::make(elsewhere, lamp());
  ASSERT_TRUE(eventually([&] {
    EXPECT_EQ(ask(*client, true).at(13), 'n');
    return !said_.all().empty();
  }));
  for (const Said& each : said_.all()) {
    EXPECT_EQ(each.call, 0U);
    EXPECT_EQ(each.what + " " + to_json(each.value), R"(call.reply {"success":true,"message":"on"})");
  }
  EXPECT_EQ(count(*elsewhere, "rq/lampRequest", false, false), 1U);
  EXPECT_EQ(count(*elsewhere, "rr/lampReply", true, false), 1U);
  worker.stop();
}

TEST_F(RosOverheard, ServersAreNotTakenForMoreOrLongerThanTheyAreThere) {
  const auto third = other_node();
  const auto heard = hear("/lamp", "std_srvs/srv/SetBool");
  const auto another = [&] {
    // Of another process, as far as others see.
    const auto node = other_node();
    rpc::Middleware::Hearing hearing;
    hearing.request = [](const idl::Method&, const Value&) { return std::uint64_t{1}; };
    hearing.outcome = [](std::uint64_t, const idl::Method&, const rpc::Outcome&) {};
    return *overhear(node, *GraphAddress::parse("/lamp?requests"), interface("std_srvs/srv/SetBool"), "/lamp",
                     "ros:/lamp", std::move(hearing), {});
  }();
  {
    const auto there = other_node();
    Worker worker;
    const auto server = serve_lamp(there, worker);
    ASSERT_TRUE(listens(*third, 2));
    // Clients of ROS want as many readers of requests as writers of replies.
    EXPECT_TRUE(eventually([&] {
      return count(*third, "rq/lampRequest", false, false) == 3 && count(*third, "rr/lampReply", true, false) == 3;
    }));
    worker.stop();
  }
  EXPECT_TRUE(listens(*third, 0)) << "who listens is a server to somebody";
  EXPECT_EQ(count(*third, "rq/lampRequest", false, false), 0U);
}

TEST_F(RosOverheard, ThatAreNotThereAreToldWithWhatIsNear) {
  const auto other = stranger();
  std::string error;
  const auto nothing = [](const std::string&) {};
  const auto published = other->write({"rt/scan", "std_msgs::msg::dds_::String_", {}}, nothing, error);
  const auto served = other->read(
      {"rq/lampRequest", "std_srvs::srv::dds_::SetBool_Request_", {}}, [](const dds::Sample&) {}, nothing, error);
  std::vector<std::unique_ptr<rpc::Opened>> heard;
  heard.push_back(hear("/scan", "std_msgs/msg/String", ""));
  heard.push_back(hear("/scann", "std_msgs/msg/String", ""));
  heard.push_back(hear("/lamp", "std_srvs/srv/SetBool", ""));
  heard.push_back(hear("/lampp", "std_srvs/srv/SetBool"));
  heard.push_back(hear("/count", "demo/action/Count", ""));
  const std::string where = " yet, in domain " + domain_;
  EXPECT_THAT(problems_.wait([](const auto& all) { return all.size() >= 3; }),
              UnorderedElementsAre("nobody publishes ros:/scann" + where + "; did you mean \"/scan\"?",
                                   "nobody serves the service ros:/lampp" + where + "; did you mean \"/lamp\"?",
                                   "nobody serves the action ros:/count" + where));
}

TEST_F(RosOverheard, ThatAreOfAnotherTypeAreToldOnce) {
  const auto there = other_node();
  Worker worker;
  const auto server = serve_lamp(there, worker);
  const auto heard = hear("/lamp", "std_srvs/srv/Trigger");
  EXPECT_THAT(problems_.wait_for(1).at(0),
              HasSubstr("/lamp is std_srvs/srv/SetBool_Request there, and std_srvs/srv/Trigger_Request here"));
  worker.stop();
}

TEST_F(RosOverheard, GoalsAreSeenFromTheirBeginningToTheirEnd) {
  const auto heard = hear("/count", "demo/action/Count");
  CountServer server(other_node(), "/count", true);
  const auto elsewhere = other_node();
  const auto client = *ActionClient::of(elsewhere, interface("demo/action/Count"), "/count");
  const idl::ServicePtr action = interface("demo/action/Count");
  const auto never = [] { return false; };
  Value id;
  const auto has = [&](const std::string& what) {
    const auto all = said_.all();
    return std::any_of(all.begin(), all.end(), [&](const Said& each) {
      const Value* const of = each.value.find("goal_id");
      return each.what == what && of != nullptr && *of == id;
    });
  };
  // What is said before the listener has been discovered is not heard.
  ASSERT_TRUE(eventually([&] {
    const auto sent = client->call(*action->find("send_goal"), Map{{"upto", 5}}, patience(), never);
    EXPECT_TRUE(sent) << sent.error().message;
    if (!sent) return true;
    id = *sent->find("goal_id");
    EXPECT_TRUE(eventually([&] { return !client->is_open(std::string(id.text())); })) << "it has ended";
    return has("result") && has("send_goal.reply") && has("feedback");
  }));
  const auto all = said_.all();
  std::map<std::string, Value> said;
  for (const Said& each : all) said[each.what] = each.value;
  EXPECT_EQ(said["send_goal"], Value(Map{{"upto", 5}}));
  EXPECT_EQ(said["send_goal.reply"], Value(Map{{"accepted", true}, {"goal_id", id}}));
  EXPECT_EQ(said["feedback"], Value(Map{{"goal_id", id}, {"feedback", Map{{"now", 3}}}}));
  EXPECT_EQ(said["result"],
            Value(Map{{"goal_id", id}, {"status", "SUCCEEDED"}, {"result", Map{{"reached", 5}, {"how", "fine"}}}}));
  const auto cancelled = client->call(*action->find("cancel_goal"), Map{{"goal_id", ""}}, patience(), never);
  ASSERT_TRUE(cancelled) << cancelled.error().message;
  const auto after = said_.wait([](const auto& now) {
    return std::any_of(now.begin(), now.end(), [](const Said& each) { return each.what == "cancel_goal.reply"; });
  });
  EXPECT_EQ(after.back().value, *cancelled);
}

}  // namespace
}  // namespace sentree::ros
