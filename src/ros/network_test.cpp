#include <gmock/gmock.h>

#include <cstdlib>
#include <iostream>
#include <optional>

#include "sentree/ros/action_server.h"
#include "sentree/ros/address.h"
#include "sentree/ros/detail/cdr.h"
#include "sentree/ros/detail/goal_id.h"
#include "sentree/ros/detail/mapping.h"
#include "sentree/ros/detail/service.h"
#include "sentree/ros/detail/test_count_server.h"
#include "sentree/ros/detail/test_graph.h"

namespace sentree::ros {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

std::string address_error(const std::string& text) {
  const auto parsed = GraphAddress::parse(text);
  return parsed ? "" : parsed.error().message;
}

TEST(GraphAddress, IsANameAndOptions) {
  const auto plain = GraphAddress::parse("/robot1/scan");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->name, "/robot1/scan");
  EXPECT_FALSE(plain->publish);
  const auto whole = GraphAddress::parse("/map?publish&qos=transient_local&domain=7&range=subnet&release=jazzy");
  ASSERT_TRUE(whole);
  EXPECT_TRUE(whole->publish);
  EXPECT_TRUE(whole->qos_of(true).transient_local);
  EXPECT_EQ(whole->domain_or_environment(), 7U);
  EXPECT_FALSE(whole->localhost_or_environment());
  EXPECT_EQ(whole->release_or_environment(), Release::kIron);
  EXPECT_EQ(GraphAddress::parse("/robot/")->name_of("battery"), "/robot/battery");
  EXPECT_FALSE(plain->qos_of(false).reliable);
  EXPECT_TRUE(plain->qos_of(true).reliable);
}

// Sets variables of the environment as long as it is there; null: takes them away.
class Environment {
 public:
  explicit Environment(const std::map<std::string, const char*>& all) {
    for (const auto& [name, value] : all) {
      const char* const before = std::getenv(name.c_str());
      before_[name] = before != nullptr ? std::optional<std::string>(before) : std::nullopt;
      set(name, value);
    }
  }
  ~Environment() {
    for (const auto& [name, value] : before_) set(name, value ? value->c_str() : nullptr);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  static void set(const std::string& name, const char* value) {
    if (value != nullptr)
      ::setenv(name.c_str(), value, 1);
    else
      ::unsetenv(name.c_str());
  }
  std::map<std::string, std::optional<std::string>> before_;
};

TEST(GraphAddress, HasWhatItDoesNotSayFromTheVariablesOfRos) {
  const auto plain = *GraphAddress::parse("/scan");
  const auto own = *GraphAddress::parse("/scan?domain=7&range=localhost&release=humble");
  {
    const Environment none({{"ROS_DOMAIN_ID", nullptr},
                            {"ROS_LOCALHOST_ONLY", nullptr},
                            {"ROS_AUTOMATIC_DISCOVERY_RANGE", nullptr},
                            {"ROS_DISTRO", nullptr}});
    EXPECT_EQ(plain.domain_or_environment(), 0U);
    EXPECT_TRUE(plain.localhost_or_environment()) << "nothing leaves the machine unless it is asked for";
    EXPECT_EQ(plain.release_or_environment(), Release::kHumble);
  }
  const Environment all({{"ROS_DOMAIN_ID", "42"},
                         {"ROS_LOCALHOST_ONLY", "0"},
                         {"ROS_AUTOMATIC_DISCOVERY_RANGE", nullptr},
                         {"ROS_DISTRO", "jazzy"}});
  EXPECT_EQ(plain.domain_or_environment(), 42U);
  EXPECT_FALSE(plain.localhost_or_environment());
  EXPECT_EQ(plain.release_or_environment(), Release::kIron);
  EXPECT_EQ(own.domain_or_environment(), 7U);
  EXPECT_TRUE(own.localhost_or_environment());
  EXPECT_EQ(own.release_or_environment(), Release::kHumble);
  const Environment range({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}, {"ROS_LOCALHOST_ONLY", "0"}});
  EXPECT_TRUE(plain.localhost_or_environment()) << "the newer variable decides";
  const Environment subnet({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET"}, {"ROS_LOCALHOST_ONLY", "1"}});
  EXPECT_FALSE(plain.localhost_or_environment());
}

TEST(GraphAddress, HasPeersOfItsOwnOrThoseOfTheVariable) {
  const auto plain = *GraphAddress::parse("/scan");
  const auto own = *GraphAddress::parse("/scan?peers=robot.local,10.0.0.6");
  const Environment none({{"ROS_STATIC_PEERS", nullptr}, {"ROS_LOCALHOST_ONLY", nullptr}});
  EXPECT_THAT(plain.participant().peers, ElementsAre());
  const Environment two({{"ROS_STATIC_PEERS", "10.0.0.5;;robot.local"}, {"ROS_LOCALHOST_ONLY", nullptr}});
  EXPECT_THAT(plain.participant().peers, ElementsAre("10.0.0.5", "robot.local"));
  EXPECT_THAT(own.participant().peers, ElementsAre("robot.local", "10.0.0.6"));
  EXPECT_EQ(GraphAddress::parse("/scan?peers=").error().code, "rpc.address");
  EXPECT_THAT(address_error("/scan?peers=a;b"), HasSubstr("where a comma is meant"));
  const Environment commas({{"ROS_STATIC_PEERS", "10.0.0.5,robot.local"}, {"ROS_LOCALHOST_ONLY", nullptr}});
  EXPECT_THAT(plain.check_environment().error().message, HasSubstr("other than a semicolon between them"));
  EXPECT_TRUE(own.check_environment());
}

TEST(GraphAddress, RefusesVariablesOfRosThatMeanNothing) {
  const auto told = [](const char* address, const char* domain, const char* range) {
    const Environment given({{"ROS_DOMAIN_ID", domain}, {"ROS_AUTOMATIC_DISCOVERY_RANGE", range}});
    const auto checked = GraphAddress::parse(address)->check_environment();
    return checked ? std::string() : checked.error().message;
  };
  EXPECT_EQ(told("/scan", nullptr, nullptr), "");
  for (const char* range : {"", "SUBNET", "LOCALHOST", "SYSTEM_DEFAULT"}) EXPECT_EQ(told("/scan", "232", range), "");
  for (const char* domain : {"abc", "300", "-1", "7 "}) {
    EXPECT_THAT(told("/scan", domain, nullptr), HasSubstr("is no number from 0 to 232; unset it for domain 0"));
    EXPECT_EQ(told("/scan?domain=7", domain, nullptr), "") << "the address decides";
  }
  EXPECT_THAT(told("/scan", nullptr, "foo"), HasSubstr("is none of LOCALHOST, SUBNET, OFF and SYSTEM_DEFAULT"));
  EXPECT_THAT(told("/scan", nullptr, "OFF"), HasSubstr("set it to LOCALHOST or SUBNET"));
  EXPECT_EQ(told("/scan?range=localhost", nullptr, "OFF"), "");
}

TEST(RosMiddleware, TellsVariablesOfRosThatDoNotFit) {
  const Environment odd({{"ROS_DISTRO", "foo"}, {"RMW_IMPLEMENTATION", "rmw_zenoh_cpp"}});
  EXPECT_THAT(oddities_of_environment(), HasSubstr("ROS_DISTRO=\"foo\" is no release that is known here"));
  EXPECT_THAT(oddities_of_environment(), HasSubstr("RMW_IMPLEMENTATION=\"rmw_zenoh_cpp\" is not by DDS"));
  const Environment even({{"ROS_DISTRO", "jazzy"}, {"RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"}});
  EXPECT_EQ(oddities_of_environment(), "");
  const Environment maybe({{"ROS_LOCALHOST_ONLY", "maybe"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE", nullptr}});
  const auto checked = GraphAddress::parse("/scan")->check_environment();
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().message, HasSubstr("ROS_LOCALHOST_ONLY=\"maybe\" is neither 0 nor 1"));
  EXPECT_TRUE(GraphAddress::parse("/scan?range=localhost")->check_environment());
}

TEST(Settling, EndsWhenNobodyNewComes) {
  using std::chrono::milliseconds;
  const Settling::SteadyClock::time_point begun{};
  Settling busy(begun);
  EXPECT_FALSE(busy.look(begun + milliseconds(2600), 3)) << "somebody has only just come";
  EXPECT_FALSE(busy.look(begun + milliseconds(3500), 4));
  EXPECT_TRUE(busy.look(begun + milliseconds(4500), 4));
  Settling quiet(begun);
  EXPECT_FALSE(quiet.look(begun + milliseconds(100), 4));
  EXPECT_FALSE(quiet.look(begun + milliseconds(2400), 4));
  EXPECT_TRUE(quiet.look(begun + milliseconds(2500), 4));
  Settling alone(begun);
  EXPECT_FALSE(alone.look(begun + milliseconds(4900), 0)) << "where others have the processors, it takes longer";
  EXPECT_TRUE(alone.look(begun + milliseconds(5000), 0));
  Settling crowded(begun);
  EXPECT_TRUE(crowded.look(begun + milliseconds(10000), 1)) << "however many come";
}

TEST(RosMiddleware, OpensNothingWhereItIsNotKnownInWhichDomain) {
  rpc::register_middleware(make_middleware({.find = load}));
  const Environment wrong({{"ROS_DOMAIN_ID", "abc"}, {"ROS_LOCALHOST_ONLY", nullptr}});
  const auto ros = make_middleware({.find = load});
  EXPECT_THAT(ros->lacks(), HasSubstr("ROS_DOMAIN_ID"));
  const auto opened = ros->watch(*rpc::Address::parse("ros:/scan"), [](const std::string&) {}, {});
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, "ros.environment");
}

TEST(GraphAddress, SaysWhatIsWrong) {
  EXPECT_THAT(address_error("scan"), HasSubstr("begins with a slash"));
  EXPECT_THAT(address_error("/a//b"), HasSubstr("cannot be one"));
  EXPECT_THAT(address_error("/1a"), HasSubstr("begin with no digit"));
  EXPECT_THAT(address_error("/a?domain=999"), HasSubstr("from 0 to 232"));
  EXPECT_THAT(address_error("/a?release=galactica"), HasSubstr("not known"));
  EXPECT_THAT(address_error("/a?qos=best"), HasSubstr("unknown option \"qos=best\""));
  EXPECT_THAT(address_error("/a?domain=1&domain=2"), HasSubstr("gives domain twice: domain=1 and domain=2"));
  EXPECT_THAT(address_error("/a?range=localhost&publish&range=subnet"), HasSubstr("gives range twice"));
}

TEST(RosMiddleware, TellsOptionsThatAreNotOfTheInterface) {
  rpc::register_middleware(make_middleware({.find = load}));
  const auto told = [](const char* address, const char* type, bool observed) {
    const rpc::Address at = *rpc::Address::parse(address);
    const auto checked = observed ? rpc::middleware_of(at).check_overheard(at, *interface(type))
                                  : rpc::middleware_of(at).check_service(at, *interface(type));
    return checked ? std::string() : checked.error().message;
  };
  EXPECT_EQ(told("ros:/a?publish&qos=sensor_data", "std_msgs/msg/String", false), "");
  EXPECT_EQ(told("ros:/a?domain=3", "std_srvs/srv/SetBool", false), "");
  EXPECT_EQ(told("ros:/a?requests", "std_srvs/srv/SetBool", true), "");
  EXPECT_THAT(told("ros:/a?publish", "std_srvs/srv/SetBool", false), HasSubstr("has publish, which is of topics"));
  EXPECT_THAT(told("ros:/a?qos=default", "demo/action/Count", false), HasSubstr("has qos=default, which is of topics"));
  EXPECT_THAT(told("ros:/a?qos=default", "demo/action/Count", true), HasSubstr("has qos=default, which is of topics"));
  EXPECT_THAT(told("ros:/a?requests", "std_msgs/msg/String", true), HasSubstr("has requests"));
  EXPECT_THAT(told("ros:/a?requests", "std_srvs/srv/SetBool", false), HasSubstr("stands under observe:"));
}

TEST(GraphAddress, OfOneDomainIsOfOneRelease) {
  rpc::register_middleware(make_middleware({.find = load}));
  const auto beside = [](const char* one, const char* two) {
    const auto address = *rpc::Address::parse(one);
    const auto checked = rpc::middleware_of(address).check_beside(address, *rpc::Address::parse(two));
    return checked ? std::string() : checked.error().message;
  };
  const Environment none({{"ROS_DISTRO", nullptr}, {"ROS_DOMAIN_ID", nullptr}});
  EXPECT_THAT(beside("ros:/a?release=jazzy", "ros:/b"), HasSubstr("all addresses of domain 0 are one node"));
  EXPECT_THAT(beside("ros:/a?release=humble&domain=3", "ros:/b?release=iron&domain=3"), HasSubstr("domain 3"));
  EXPECT_EQ(beside("ros:/a?release=jazzy&domain=3", "ros:/b"), "") << "another domain is another node";
  EXPECT_EQ(beside("ros:/a?release=jazzy", "ros:/b?release=kilted"), "") << "what differs is the same there";
}

TEST_F(Graph, IsOfTheReleaseThatOpenedIt) {
  const auto node = Node::of(*GraphAddress::parse(at("/a", "&release=humble").path));
  ASSERT_TRUE(node);
  const auto other = Node::of(*GraphAddress::parse(at("/b", "&release=jazzy").path));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("write the same release= everywhere"));
}

TEST(Names, AreThoseOfNodes) {
  const TypeName type = *type_name("nav2_msgs/action/NavigateToPose");
  EXPECT_EQ(dds_name(type, "_SendGoal_Request"), "nav2_msgs::action::dds_::NavigateToPose_SendGoal_Request_");
  EXPECT_EQ(dds_name(*type_name("sensor_msgs/msg/BatteryState")), "sensor_msgs::msg::dds_::BatteryState_");
  EXPECT_EQ(ros_name("sensor_msgs::msg::dds_::BatteryState_"), "sensor_msgs/msg/BatteryState");
  EXPECT_EQ(ros_name("HelloWorld"), "");
  EXPECT_FALSE(type_name("Battery"));
}

class RosServices : public Graph {
 protected:
  std::unique_ptr<rpc::Opened> serve(const std::string& name, const idl::ServicePtr& of,
                                     rpc::FunctionService::Function function) {
    rpc::ServerOptions options;
    // That nobody is authenticated is told once of each domain.
    options.on_peer_error = [this](const std::string& what) {
      if (!what.starts_with("domain ")) problems_.add(what);
    };
    auto opened = rpc::serve(at(name), {{"service", std::make_shared<rpc::FunctionService>(of, std::move(function))}},
                             std::move(options));
    EXPECT_TRUE(opened) << (opened ? "" : opened.error().message);
    return opened ? std::move(*opened) : nullptr;
  }
  std::unique_ptr<rpc::Caller> connect(const std::string& name, const idl::ServicePtr& of) {
    auto client = rpc::connect(at(name), of, {.target = "service"});
    EXPECT_TRUE(client) << (client ? "" : client.error().message);
    return client ? std::move(*client) : nullptr;
  }
  Heard<std::string> problems_;
};

TEST_F(RosServices, AnswerCalls) {
  const auto set_bool = interface("std_srvs/srv/SetBool");
  const auto served = serve("/lamp", set_bool, [](const idl::Method&, const Value& arguments) -> rpc::Outcome {
    const bool on = *arguments.find("data")->as_bool();
    return Value(Map{{"success", true}, {"message", on ? "on" : "off"}});
  });
  const auto client = connect("/lamp", set_bool);
  for (const bool on : {true, false, true}) {
    const auto reply = rpc::call_and_wait(*client, "call", Map{{"data", on}}, patience());
    ASSERT_TRUE(reply) << reply.error().message;
    EXPECT_EQ(*reply->find("message"), Value(on ? "on" : "off"));
  }
  EXPECT_EQ(client->counters().calls, 3U);
}

TEST_F(RosServices, OfAThriftInterfaceAreOneForEachMethod) {
  const auto loaded = idl::Schema::load(
      "exception Empty { 1: double charge }\n"
      "service Battery { double charge() throws (1: Empty empty) void drain(1: i32 by) string fail() }\n",
      "robot.thrift");
  const auto battery = loaded.value->service("Battery");
  double charge = 50;
  const auto served =
      serve("/robot1/", battery, [&](const idl::Method& method, const Value& arguments) -> rpc::Outcome {
        if (method.name == "fail")
          return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kUnreachable, "unplugged", {}, {}});
        if (method.name == "drain") return charge -= arguments.find("by")->number(), Value();
        if (charge > 0) return Value(charge);
        return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kException, "", "Empty", Map{{"charge", charge}}});
      });
  const auto client = connect("/robot1/", battery);
  EXPECT_EQ(*rpc::call_and_wait(*client, "charge", Map(), patience()), Value(50.0));
  EXPECT_EQ(*rpc::call_and_wait(*client, "drain", Map{{"by", 60}}, patience()), Value());
  const auto empty = rpc::call_and_wait(*client, "charge", Map(), patience());
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().kind, rpc::CallErrorKind::kException);
  EXPECT_EQ(*empty.error().data.find("charge"), Value(-10.0));
  const auto failed = rpc::call_and_wait(*client, "fail", Map(), patience());
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, rpc::CallErrorKind::kProtocol);
  EXPECT_THAT(failed.error().message, HasSubstr("unplugged"));
}

TEST_F(RosServices, AreListedOnceTheyHaveBeenDiscovered) {
  const auto nothing = [](const std::string&) {};
  const auto names = [&](const std::string& of) {
    std::vector<std::string> out;
    const auto listed = rpc::middleware_of(at(of)).list(at(of), std::chrono::milliseconds(10));
    if (!listed) return std::vector<std::string>{listed.error().message};
    for (const rpc::NetworkEntry& each : *listed) out.push_back(each.at + " " + each.kind);
    return out;
  };
  EXPECT_THAT(names("/"), ElementsAre(HasSubstr("nobody offers anything in domain " + domain_ +
                                                " of ROS 2 on this machine; domain= and range= behind the address")));
  const rpc::Address further = at("/", "&peers=127.0.0.1");
  const auto nobody = rpc::middleware_of(further).list(further, std::chrono::milliseconds(10));
  ASSERT_FALSE(nobody);
  EXPECT_THAT(nobody.error().message, HasSubstr(" of ROS 2 on this machine and 127.0.0.1; "));
  const auto other = stranger();
  const auto node = node_at("/");
  std::string error;
  const auto served = other->read(
      {"rq/lampRequest", "std_srvs::srv::dds_::Trigger_Request_", {}}, [](const dds::Sample&) {}, nothing, error);
  ASSERT_TRUE(eventually([&] { return !node->endpoints().empty(); }));
  EXPECT_THAT(names("/"), ElementsAre("ros:/lamp service std_srvs/srv/Trigger"));
  EXPECT_THAT(names("/door"), ElementsAre(HasSubstr("nobody offers anything whose name begins with /door")));
}

TEST_F(RosServices, ThatNobodyServesAreUnreachableWithinTheDeadline) {
  const auto client = connect("/nobody", interface("std_srvs/srv/Trigger"));
  const auto reply =
      rpc::call_and_wait(*client, "call", Map(), std::chrono::steady_clock::now() + std::chrono::milliseconds(50));
  ASSERT_FALSE(reply);
  EXPECT_EQ(reply.error().kind, rpc::CallErrorKind::kUnreachable);
  EXPECT_THAT(reply.error().message, HasSubstr("no server of /nobody (std_srvs/srv/Trigger_Request)"));
}

TEST_F(RosServices, WhoseTypesDifferAreRefusedWithWhatDiffers) {
  const auto nothing = [](const std::string&) {};
  const auto other = stranger();
  std::string error;
  // Somebody serves /lamp as a Trigger, and calls /door as one.
  const auto theirs = other->read(
      {"rq/lampRequest", "std_srvs::srv::dds_::Trigger_Request_", {}}, [](const dds::Sample&) {}, nothing, error);
  const auto asks = other->write({"rq/doorRequest", "std_srvs::srv::dds_::Trigger_Request_", {}}, nothing, error);
  const auto set_bool = interface("std_srvs/srv/SetBool");
  const auto client = connect("/lamp", set_bool);
  std::string told;
  EXPECT_TRUE(eventually([&] {
    const auto reply = rpc::call_and_wait(*client, "call", Map{{"data", true}},
                                          std::chrono::steady_clock::now() + std::chrono::milliseconds(20));
    told = reply ? "" : reply.error().message;
    return told.find("there; sentree") != std::string::npos;
  }));
  EXPECT_THAT(told, HasSubstr("no server of /lamp (std_srvs/srv/SetBool_Request) is there, in domain " + domain_ +
                              ", but somebody has std_srvs/srv/Trigger_Request there"));
  const auto served =
      serve("/door", set_bool, [](const idl::Method&, const Value&) -> rpc::Outcome { return Value(); });
  EXPECT_THAT(problems_.wait_for(1),
              Contains("the types of /doorRequest differ: it is std_srvs/srv/SetBool_Request here, and somebody "
                       "publishes std_srvs/srv/Trigger_Request, so that nothing passes"));
}

TEST_F(RosServices, BeyondThisMachineAreOpenedWithAWarning) {
  Heard<std::string> told;
  const auto ros = make_middleware({.find = load, .warn = [&](const std::string& what) { told.add(what); }});
  const auto set_bool = interface("std_srvs/srv/SetBool");
  const auto here = ros->connect(at("/lamp"), set_bool, {});
  ASSERT_TRUE(here) << here.error().message;
  const rpc::Address open = *rpc::Address::parse("ros:/lamp?range=subnet&domain=" + domain_);
  for (int i = 0; i < 2; ++i) {
    const auto there = ros->connect(open, set_bool, {});
    ASSERT_TRUE(there) << there.error().message;
  }
  EXPECT_THAT(told.wait_for(1), ElementsAre("domain " + domain_ +
                                            " of ROS 2 is open to all machines of the network; whoever reaches it can "
                                            "do everything, DDS is used without authentication"));
}

TEST_F(RosServices, AreReachedWithPeersBesideThisMachine) {
  Heard<std::string> told;
  const auto ros = make_middleware({.find = load, .warn = [&](const std::string& what) { told.add(what); }});
  const auto set_bool = interface("std_srvs/srv/SetBool");
  const auto served = rpc::serve(
      at("/lamp", "&peers=127.0.0.1"),
      {{"lamp", std::make_shared<rpc::FunctionService>(
                    set_bool, [](const idl::Method&, const Value&) -> rpc::Outcome { return Value(Map{}); })}},
      {});
  ASSERT_TRUE(served) << served.error().message;
  const auto lamp = ros->connect(at("/lamp", "&peers=127.0.0.1"), set_bool, {});
  ASSERT_TRUE(lamp) << lamp.error().message;
  EXPECT_TRUE(rpc::call_and_wait(**lamp, "call", Map{{"data", true}}, patience()).has_value());
  const auto nowhere = ros->connect(at("/lamp", "&peers=no.such.host.invalid"), set_bool, {});
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(nowhere.error().message, HasSubstr("no machine is known by the name \"no.such.host.invalid\""));
  EXPECT_THAT(told.wait_for(1),
              ElementsAre(HasSubstr("all machines of the network (looked for: this one and 127.0.0.1)")));
}

TEST_F(RosServices, AreServedWithAWarningOnThisMachineToo) {
  Heard<std::string> told;
  const auto ros = make_middleware({.find = load});
  const auto trigger = interface("std_srvs/srv/Trigger");
  const auto service = std::make_shared<rpc::FunctionService>(
      trigger, [](const idl::Method&, const Value&) -> rpc::Outcome { return Value(); });
  rpc::ServerOptions options;
  options.on_peer_error = [&](const std::string& what) { told.add(what); };
  std::vector<std::unique_ptr<rpc::Opened>> served;
  for (const char* name : {"/one", "/two"}) {
    auto opened = ros->serve(at(name), {{"x", service}}, options);
    ASSERT_TRUE(opened) << opened.error().message;
    served.push_back(std::move(*opened));
  }
  EXPECT_THAT(told.wait_for(1), ElementsAre("domain " + domain_ +
                                            " of ROS 2 is open to all programs of this machine; whoever reaches it can "
                                            "do everything, DDS is used without authentication"));
}

TEST_F(RosServices, AreOpenedWithWhatIsOddAboutTheEnvironmentOnce) {
  const Environment odd({{"ROS_DISTRO", "foxy"}, {"RMW_IMPLEMENTATION", nullptr}});
  Heard<std::string> told;
  const auto ros = make_middleware({.find = load, .warn = [&](const std::string& what) { told.add(what); }});
  const auto trigger = interface("std_srvs/srv/Trigger");
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(ros->connect(at("/one"), trigger, {}));
  EXPECT_THAT(told.all(),
              ElementsAre("ROS_DISTRO=\"foxy\" is no release that is known here, and Humble is taken: write "
                          "release= behind the address"));
}

TEST_F(RosServices, AreWatchedByTheirReplies) {
  const auto trigger = interface("std_srvs/srv/Trigger");
  const auto served = serve("/bell", trigger, [](const idl::Method&, const Value&) -> rpc::Outcome {
    return Value(Map{{"success", true}, {"message", "ding"}});
  });
  Heard<std::string> seen;
  rpc::Middleware& ros = rpc::middleware_of(at("/bell"));
  const auto watched =
      ros.watch(at("/bell"), [&](const std::string& what) { seen.add(what); }, {.target = "echo", .problem = {}});
  ASSERT_TRUE(watched) << watched.error().message;
  const auto client = connect("/bell", trigger);
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(rpc::call_and_wait(*client, "call", Map(), patience()));
    bool any = false;
    seen.wait([&](const auto& all) { return any = !all.empty(), true; });
    return any;
  }));
  EXPECT_THAT(seen.wait_for(1).front(), testing::AllOf(HasSubstr(R"({"call.reply":{)"), HasSubstr("ding")));
}

TEST_F(RosServices, ThatDoNotAnswerAreLate) {
  const auto trigger = interface("std_srvs/srv/Trigger");
  const auto served = serve("/slow", trigger, [](const idl::Method&, const Value&) -> rpc::Outcome {
    return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kUnreachable, "broken", {}, {}});
  });
  const auto client = connect("/slow", trigger);
  ASSERT_TRUE(eventually([&] {
    const auto reply =
        rpc::call_and_wait(*client, "call", Map(), std::chrono::steady_clock::now() + std::chrono::milliseconds(200));
    return !reply && reply.error().kind == rpc::CallErrorKind::kLate;
  }));
  EXPECT_THAT(problems_.wait_for(1).front(), HasSubstr("/slow gives no answer: broken"));
}

TEST_F(RosServices, AreFoundAnewWhenTheirServerComesBack) {
  const auto trigger = interface("std_srvs/srv/Trigger");
  const auto answer = [](std::string who) {
    return [who = std::move(who)](const idl::Method&, const Value&) -> rpc::Outcome {
      return Value(Map{{"success", true}, {"message", who}});
    };
  };
  auto served = serve("/robot", trigger, answer("first"));
  const auto client = connect("/robot", trigger);
  EXPECT_EQ(*rpc::call_and_wait(*client, "call", Map(), patience())->find("message"), Value("first"));
  served->stop();
  served = serve("/robot", trigger, answer("second"));
  ASSERT_TRUE(eventually([&] {
    const auto reply = rpc::call_and_wait(*client, "call", Map(), patience());
    return reply && *reply->find("message") == Value("second");
  }));
}

TEST_F(RosServices, RefuseWhatIsNoRequestAndGoOn) {
  const auto set_bool = interface("std_srvs/srv/SetBool");
  const auto served = serve("/lamp", set_bool, [](const idl::Method&, const Value&) -> rpc::Outcome {
    return Value(Map{{"success", true}, {"message", "fine"}});
  });
  const auto other = stranger();
  std::string error;
  const auto writer = other->write(
      {"rq/lampRequest", "std_srvs::srv::dds_::SetBool_Request_", {}}, [](const std::string&) {}, error);
  ASSERT_NE(writer, nullptr) << error;
  ASSERT_TRUE(eventually([&] { return !writer->matched().empty(); }));
  for (const std::vector<std::uint8_t>& bad :
       {std::vector<std::uint8_t>{0, 1}, {0, 1, 0, 0}, {9, 9, 9, 9, 1}, {0, 1, 0, 0, 1}})
    static_cast<void>(writer->write(bad, nullptr));
  EXPECT_THAT(problems_.wait([](const auto& all) { return all.size() >= 2; }), Contains(HasSubstr("cannot be read")));
  const auto client = connect("/lamp", set_bool);
  EXPECT_EQ(*rpc::call_and_wait(*client, "call", Map{{"data", true}}, patience())->find("message"), Value("fine"));
}

class RosTopics : public Graph {};

TEST_F(RosTopics, PassFromPublishersToSubscribers) {
  const auto text = interface("std_msgs/msg/String");
  const rpc::Address source = at("/chatter");
  rpc::Middleware& ros = rpc::middleware_of(source);
  EXPECT_TRUE(ros.is_source(source, text.get()));
  EXPECT_FALSE(ros.is_source(at("/chatter", "&publish"), text.get()));
  EXPECT_FALSE(ros.is_source(at("/lamp"), interface("std_srvs/srv/SetBool").get()));
  Heard<std::string> heard;
  auto opened = ros.subscribe(
      source, text,
      [&](const idl::Method& method, Value arguments) { heard.add(method.name + " " + to_json(arguments)); },
      {.target = "chatter", .problem = {}});
  ASSERT_TRUE(opened) << opened.error().message;
  Heard<std::string> seen;
  auto watched = ros.watch(source, [&](const std::string& what) { seen.add(what); }, {.target = "echo", .problem = {}});
  ASSERT_TRUE(watched);
  auto publisher = rpc::connect(at("/chatter", "&publish"), text, {});
  ASSERT_TRUE(publisher) << publisher.error().message;
  int said = 0;
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(
        rpc::call_and_wait(**publisher, "message", Map{{"data", "hello " + std::to_string(++said)}}, patience()));
    bool both = false;
    heard.wait([&](const auto& all) { return both = !all.empty(), true; });
    bool other = false;
    seen.wait([&](const auto& all) { return other = !all.empty(), true; });
    return both && other;
  }));
  EXPECT_THAT(heard.wait_for(1).front(), HasSubstr("message {\"data\":\"hello "));
  EXPECT_THAT(seen.wait_for(1).front(), HasSubstr("{\"data\":\"hello "));
  EXPECT_FALSE(rpc::connect(source, text, {})) << "it is read from";
}

TEST_F(RosTopics, ThatAreTransientLocalGiveTheirLastToWhoComesLate) {
  const auto text = interface("std_msgs/msg/String");
  auto publisher = rpc::connect(at("/map", "&publish&qos=transient_local"), text, {});
  ASSERT_TRUE(publisher);
  ASSERT_TRUE(rpc::call_and_wait(**publisher, "message", Map{{"data", "old"}}, patience()));
  ASSERT_TRUE(rpc::call_and_wait(**publisher, "message", Map{{"data", "last"}}, patience()));
  Heard<std::string> heard;
  const rpc::Address source = at("/map", "&qos=transient_local");
  auto opened = rpc::middleware_of(source).subscribe(
      source, text, [&](const idl::Method&, Value arguments) { heard.add(to_json(arguments)); },
      {.target = "map", .problem = {}});
  ASSERT_TRUE(opened);
  EXPECT_THAT(heard.wait_for(1), ElementsAre(R"({"data":"last"})"));
}

TEST_F(RosTopics, ThatAreTransientLocalAreWatchedAsSuchAndAskedForWhereNothingComes) {
  const auto text = interface("std_msgs/msg/String");
  auto publisher = rpc::connect(at("/map", "&publish&qos=transient_local"), text, {});
  ASSERT_TRUE(publisher);
  ASSERT_TRUE(rpc::call_and_wait(**publisher, "message", Map{{"data", "last"}}, patience()));
  const auto other =
      std::make_shared<Node>(stranger(), Release::kHumble, static_cast<std::uint32_t>(std::stoi(domain_)));
  std::string error;
  auto latched = other->participant().write(
      {"rt/latched", "std_msgs::msg::dds_::String_", {.reliable = true, .transient_local = true, .depth = 1}},
      [](const std::string&) {}, error);
  ASSERT_TRUE(latched) << error;
  std::vector<std::uint8_t> octets{0, 1, 0, 0, 5, 0, 0, 0, 'l', 'a', 's', 't', 0};
  ASSERT_NE(latched->write(octets, nullptr), 0);
  rpc::Middleware& ros = rpc::middleware_of(at("/latched"));
  Heard<std::string> seen;
  auto watched =
      ros.watch(at("/latched"), [&](const std::string& what) { seen.add(what); }, {.target = "echo", .problem = {}});
  ASSERT_TRUE(watched);
  EXPECT_THAT(seen.wait_for(1), ElementsAre(HasSubstr("last")));
  Heard<std::string> heard;
  auto subscribed =
      ros.subscribe(at("/latched"), text, [&](const idl::Method&, Value value) { heard.add(to_json(value)); },
                    {.target = "map", .problem = {}});
  ASSERT_TRUE(subscribed);
  EXPECT_THAT(ros.why_silent(at("/latched"), *text, "map"), HasSubstr("write ?qos=transient_local"));
  EXPECT_EQ(ros.why_silent(at("/latched", "&qos=transient_local"), *text, "map"), "");
  EXPECT_EQ(ros.why_silent(at("/nobody"), *text, "map"), "");
}

TEST_F(RosTopics, CarryEightMegabytes) {
  const auto octets = interface("sensor_msgs/msg/Octets");
  const auto other = stranger();
  std::string error;
  Heard<std::size_t> sizes;
  const auto reader = other->read(
      {"rt/image", "sensor_msgs::msg::dds_::Octets_", {.reliable = true}},
      [&](dds::Sample sample) { sizes.add(sample.octets.size()); }, [](const std::string&) {}, error);
  ASSERT_NE(reader, nullptr) << error;
  auto publisher = rpc::connect(at("/image", "&publish"), octets, {});
  ASSERT_TRUE(publisher);
  ASSERT_TRUE(eventually([&] { return !reader->matched().empty(); }));
  ASSERT_TRUE(eventually([&] {
    bool came = false;
    static_cast<void>(rpc::call_and_wait(**publisher, "message",
                                         Map{{"data", Bytes{std::vector<std::byte>(8U << 20U)}}}, patience()));
    sizes.wait([&](const auto& all) { return came = !all.empty(), true; });
    return came;
  }));
  EXPECT_EQ(sizes.wait_for(1).front(), (8U << 20U) + 8);
}

TEST_F(RosTopics, SayThatQualitiesOfServiceDoNotFit) {
  const auto text = interface("std_msgs/msg/String");
  auto publisher = rpc::connect(at("/scan", "&publish&qos=sensor_data"), text, {});
  ASSERT_TRUE(publisher);
  Heard<std::string> problems;
  const rpc::Address source = at("/scan", "&qos=default");
  auto other = stranger();
  std::string error;
  const auto writer = other->write(
      {"rt/scan", "std_msgs::msg::dds_::String_", {.reliable = false}}, [](const std::string&) {}, error);
  auto opened = rpc::middleware_of(source).subscribe(
      source, text, [](const idl::Method&, Value) {},
      {.target = "scan", .problem = [&](const std::string& what) { problems.add(what); }});
  ASSERT_TRUE(opened);
  EXPECT_THAT(problems.wait_for(1),
              Contains("somebody who publishes /scan offers another quality of service (reliability), so that nothing "
                       "passes; write qos=best_effort behind the address"));
}

TEST_F(RosTopics, ThatNobodyPublishesAreToldWithWhatIsNear) {
  const auto text = interface("std_msgs/msg/String");
  const auto other = stranger();
  std::string error;
  const auto theirs = other->write(
      {"rt/chatter", "std_msgs::msg::dds_::String_", {}}, [](const std::string&) {}, error);
  Heard<std::string> problems;
  std::vector<std::unique_ptr<rpc::Opened>> opened;
  for (const char* const name : {"/optional", "/chatter", "/chater", "/speech"}) {
    auto heard =
        rpc::middleware_of(at(name)).subscribe(at(name), text, [](const idl::Method&, const Value&) {},
                                               {.target = "it",
                                                .problem = [&](const std::string& what) { problems.add(what); },
                                                .optional = name == std::string_view("/optional")});
    ASSERT_TRUE(heard) << heard.error().message;
    opened.push_back(std::move(*heard));
  }
  problems.wait([](const auto& all) { return all.size() >= 2; });
  opened.clear();
  EXPECT_THAT(
      problems.all(),
      UnorderedElementsAre(
          HasSubstr("nobody publishes ros:/chater yet, in domain " + domain_ + "; did you mean \"/chatter\"?"),
          HasSubstr("nobody publishes ros:/speech yet, in domain " + domain_ + "; of its type there is /chatter")));
}

TEST_F(RosTopics, TellWhoPublishesThatTypesDifferWhoeverComesFirst) {
  const auto text = interface("std_msgs/msg/String");
  const auto other = stranger();
  const auto nothing = [](const std::string&) {};
  const auto take = [](const dds::Sample&) {};
  std::string error;
  const auto early = other->read({"rt/early", "std_msgs::msg::dds_::Bool_", {}}, take, nothing, error);
  Heard<std::string> problems;
  std::vector<std::unique_ptr<rpc::Caller>> publishers;
  for (const char* const name : {"/early", "/early", "/late"}) {
    auto made =
        rpc::connect(at(name, "&publish"), text, {.problem = [&](const std::string& what) { problems.add(what); }});
    ASSERT_TRUE(made) << made.error().message;
    publishers.push_back(std::move(*made));
  }
  const auto differ = [](const std::string& name) {
    return "the types of " + name +
           " differ: it is std_msgs/msg/String here, and somebody reads std_msgs/msg/Bool, so "
           "that nothing passes";
  };
  EXPECT_THAT(problems.wait([](const auto& all) { return all.size() >= 2; }),
              testing::ElementsAre(differ("/early"), differ("/early")))
      << "each who publishes there is told";
  const auto late = other->read({"rt/late", "std_msgs::msg::dds_::Bool_", {}}, take, nothing, error);
  EXPECT_EQ(problems.wait([](const auto& all) { return all.size() >= 3; }).back(), differ("/late"));
  for (const auto& each : publishers) each->end();
}

TEST_F(RosTopics, SayThatTypesDifferWhoeverComesFirst) {
  const auto text = interface("std_msgs/msg/String");
  const auto other = stranger();
  const auto nothing = [](const std::string&) {};
  std::string error;
  Heard<std::string> problems;
  const auto hear = [&](const char* name) {
    const rpc::Address source = at(name);
    auto opened = rpc::middleware_of(source).subscribe(
        source, text, [](const idl::Method&, Value) {},
        {.target = "it", .problem = [&](const std::string& what) { problems.add(what); }});
    EXPECT_TRUE(opened);
    return opened ? std::move(*opened) : nullptr;
  };
  const auto first = other->write({"rt/first", "std_msgs::msg::dds_::Int32_", {}}, nothing, error);
  const auto heard_first = hear("/first");
  EXPECT_THAT(problems.wait_for(1),
              ElementsAre("the types of /first differ: it is std_msgs/msg/String here, and somebody publishes "
                          "std_msgs/msg/Int32, so that nothing passes"));
  const auto heard_second = hear("/second");
  const auto second = other->write({"rt/second", "std_msgs::msg::dds_::Bool_", {}}, nothing, error);
  const auto is_told = HasSubstr("somebody publishes std_msgs/msg/Bool");
  EXPECT_THAT(problems.wait([&](const auto& all) { return ::testing::Matches(Contains(is_told))(all); }),
              Contains(is_told));
}

TEST_F(RosTopics, FiftyLoseNothing) {
  constexpr std::size_t kTopics = 50;
  constexpr std::size_t kRounds = 100;
  const auto text = interface("std_msgs/msg/String");
  const auto other = stranger();
  std::string error;
  Heard<std::size_t> heard;
  std::vector<std::unique_ptr<dds::Reader>> readers;
  std::vector<std::unique_ptr<rpc::Caller>> publishers;
  for (std::size_t i = 0; i < kTopics; ++i) {
    const std::string name = "/topic" + std::to_string(i);
    readers.push_back(other->read(
        {"rt" + name, "std_msgs::msg::dds_::String_", {.reliable = true}}, [&heard, i](dds::Sample) { heard.add(i); },
        [](const std::string&) {}, error));
    ASSERT_NE(readers.back(), nullptr) << error;
    auto made = rpc::connect(at(name, "&publish"), text, {});
    ASSERT_TRUE(made) << made.error().message;
    publishers.push_back(std::move(*made));
    // Its writer is made by the first message.
    ASSERT_TRUE(rpc::call_and_wait(*publishers.back(), "message", Map{{"data", "first"}}, patience()));
  }
  for (const auto& reader : readers) ASSERT_TRUE(eventually([&] { return !reader->matched().empty(); }));
  const auto so_far = [&] {
    std::size_t count = 0;
    heard.wait([&](const auto& all) { return count = all.size(), true; });
    return count;
  };
  const std::string data(100, 'x');
  for (const auto& each : publishers)
    ASSERT_TRUE(rpc::call_and_wait(*each, "message", Map{{"data", data}}, patience()));
  // What was said before the readers were there may have come or not.
  std::size_t before = 0;
  ASSERT_TRUE(eventually([&] {
    const std::size_t now = so_far();
    const bool rests = now == before && now >= kTopics;
    before = now;
    return rests;
  }));
  const auto began = std::chrono::steady_clock::now();
  for (std::size_t round = 1; round <= kRounds; ++round) {
    for (const auto& each : publishers)
      ASSERT_TRUE(rpc::call_and_wait(*each, "message", Map{{"data", data}}, patience()));
    ASSERT_GE(heard.wait_for(before + round * kTopics).size(), before + round * kTopics) << "round " << round;
  }
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
  RecordProperty("ms_per_round", std::to_string(took.count() / kRounds));
  std::cout << kTopics << " topics, " << took.count() / kRounds << " ms for a message on each\n";
}

class RosNodes : public Graph, public ::testing::WithParamInterface<std::pair<const char*, std::size_t>> {};
INSTANTIATE_TEST_SUITE_P(, RosNodes,
                         ::testing::Values(std::pair("humble", std::size_t{24}), std::pair("jazzy", std::size_t{16})),
                         [](const auto& one) { return one.param.first; });

TEST_P(RosNodes, AreToldAsTheirReleaseDoes) {
  const auto [release, gid_size] = GetParam();
  const auto other = stranger();
  std::string error;
  Heard<std::vector<std::uint8_t>> told;
  const auto reader = other->read(
      {"ros_discovery_info",
       "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
       {.reliable = true, .transient_local = true, .depth = 1}},
      [&](dds::Sample sample) { told.add(std::move(sample.octets)); }, [](const std::string&) {}, error);
  ASSERT_NE(reader, nullptr) << error;
  auto publisher =
      rpc::connect(at("/chatter", std::string("&publish&release=") + release), interface("std_msgs/msg/String"), {});
  ASSERT_TRUE(publisher);
  const std::string name = "sentree_" + std::to_string(::getpid());
  // The participant, one node, its namespace and name, no reader and one writer.
  const std::size_t name_size = (name.size() + 1 + 3) / 4 * 4;
  const std::size_t whole = 4 + gid_size + 4 + 8 + 4 + name_size + 4 + 4 + gid_size;
  const auto all = told.wait([&](const auto& each) {
    return std::any_of(each.begin(), each.end(), [&](const auto& message) { return message.size() >= whole; });
  });
  const auto& message = all.back();
  EXPECT_EQ(message.size(), whole);
  EXPECT_NE(std::search(message.begin(), message.end(), name.begin(), name.end()), message.end());
}

TEST_F(RosTopics, AreListedWithTheirTypes) {
  auto other = stranger();
  std::string error;
  const auto nothing = [](const std::string&) {};
  const auto scan = other->write({"rt/robot1/scan", "sensor_msgs::msg::dds_::LaserScan_", {}}, nothing, error);
  const auto lamp = other->read(
      {"rq/lampRequest", "std_srvs::srv::dds_::SetBool_Request_", {}}, [](dds::Sample) {}, nothing, error);
  const auto count = other->read(
      {"rq/count/_action/send_goalRequest", "demo::action::dds_::Count_SendGoal_Request_", {}}, [](dds::Sample) {},
      nothing, error);
  std::vector<std::string> lines;
  ASSERT_TRUE(eventually([&] {
    const auto listed = rpc::middleware_of(at("/")).list(at("/"), std::chrono::milliseconds(50));
    lines.clear();
    if (!listed) return false;
    for (const auto& each : *listed) lines.push_back(each.at + " " + each.kind);
    return lines.size() >= 3;
  }));
  EXPECT_THAT(lines, ElementsAre("ros:/count action demo/action/Count", "ros:/lamp service std_srvs/srv/SetBool",
                                 "ros:/robot1/scan topic sensor_msgs/msg/LaserScan"));
}

class RosActions : public Graph {
 protected:
  void open() {
    const auto count = interface("demo/action/Count");
    ASSERT_TRUE(rpc::middleware_of(at("/count")).is_source(at("/count"), count.get()));
    auto opened = rpc::middleware_of(at("/count"))
                      .subscribe(at("/count"), count,
                                 [this](const idl::Method& method, Value arguments) {
                                   heard_.add({method.name, std::move(arguments)});
                                 },
                                 {.target = "count", .problem = {}});
    ASSERT_TRUE(opened) << opened.error().message;
    heard_at_ = std::move(*opened);
    auto client = rpc::connect(at("/count"), count, {.target = "count"});
    ASSERT_TRUE(client) << client.error().message;
    client_ = std::move(*client);
  }
  Value end_of_goal() {
    for (const auto& [name, arguments] : heard_.wait([](const auto& all) {
           return std::any_of(all.begin(), all.end(), [](const auto& each) { return each.first == "result"; });
         })) {
      if (name == "result") return arguments;
    }
    return {};
  }
  Heard<std::pair<std::string, Value>> heard_;
  std::unique_ptr<rpc::Opened> heard_at_;
  std::unique_ptr<rpc::Caller> client_;
};

TEST_F(RosActions, TellFeedbackStatusAndResultOfAGoal) {
  CountServer server(node_at("/count"), "/count", true);
  open();
  const auto reply = rpc::call_and_wait(*client_, "send_goal", Map{{"upto", 5}}, patience());
  ASSERT_TRUE(reply) << reply.error().message;
  EXPECT_EQ(*reply->find("accepted"), Value(true));
  const std::string id(reply->find("goal_id")->text());
  EXPECT_EQ(id.size(), 32U);
  const Value end = end_of_goal();
  EXPECT_EQ(to_json(end),
            "{\"goal_id\":\"" + id + "\",\"status\":\"SUCCEEDED\",\"result\":{\"reached\":5,\"how\":\"fine\"}}");
  const auto all = heard_.wait([](const auto& each) {
    return std::any_of(each.begin(), each.end(), [](const auto& e) { return e.first == "feedback"; });
  });
  EXPECT_THAT(all,
              Contains(std::pair<std::string, Value>("feedback", Map{{"goal_id", id}, {"feedback", Map{{"now", 3}}}})));
  // A server tells the statuses of all goals that it remembers.
  for (const std::string& goal : {id, std::string(32, 'e')}) {
    const std::pair<std::string, Value> status{"status", Map{{"goal_id", goal}, {"status", "SUCCEEDED"}}};
    EXPECT_THAT(
        heard_.wait([&](const auto& told) { return std::find(told.begin(), told.end(), status) != told.end(); }),
        Contains(status));
  }
}

TEST_F(RosActions, AreRefusedByTheirServer) {
  CountServer server(node_at("/count"), "/count", true);
  open();
  const auto reply = rpc::call_and_wait(*client_, "send_goal", Map{{"upto", 100}}, patience());
  ASSERT_TRUE(reply) << reply.error().message;
  EXPECT_EQ(*reply->find("accepted"), Value(false));
}

TEST_F(RosActions, WhoseTypesDifferAreRefusedWithWhatDiffers) {
  const auto other = stranger();
  std::string error;
  const auto theirs = other->read(
      {"rq/count/_action/send_goalRequest", "demo::action::dds_::Spin_SendGoal_Request_", {}},
      [](const dds::Sample&) {}, [](const std::string&) {}, error);
  open();
  EXPECT_TRUE(eventually([&] {
    const auto reply = rpc::call_and_wait(*client_, "send_goal", Map{{"upto", 1}},
                                          std::chrono::steady_clock::now() + std::chrono::milliseconds(20));
    return !reply && reply.error().message ==
                         "no server of the action /count is there, but somebody has "
                         "demo/action/Spin_SendGoal_Request there";
  }));
}

TEST_F(RosActions, EndWhenTheyAreCancelled) {
  CountServer server(node_at("/count"), "/count", false);
  open();
  const auto reply = rpc::call_and_wait(*client_, "send_goal", Map{{"upto", 9}}, patience());
  ASSERT_TRUE(reply) << reply.error().message;
  heard_.wait_for(1);
  const Value id = *reply->find("goal_id");
  const auto cancelled = rpc::call_and_wait(*client_, "cancel_goal", Map{{"goal_id", id}}, patience());
  ASSERT_TRUE(cancelled) << cancelled.error().message;
  EXPECT_EQ(*cancelled->find("goals_canceling"), Value(List{id}));
  EXPECT_EQ(*end_of_goal().find("status"), Value("CANCELED"));
  EXPECT_FALSE(rpc::call_and_wait(*client_, "cancel_goal", Map{{"goal_id", "kitchen"}}, patience()));
}

TEST_F(RosActions, AreNotCancelledByWhatIsOnlyHeardOfThem) {
  CountServer server(node_at("/count"), "/count", false);
  open();
  const auto reply = rpc::call_and_wait(*client_, "send_goal", Map{{"upto", 9}}, patience());
  ASSERT_TRUE(reply) << reply.error().message;
  for (const char* const method : {"feedback", "result", "status"}) {
    const auto asked = rpc::call_and_wait(*client_, method, Map(), patience());
    ASSERT_FALSE(asked) << method;
    EXPECT_EQ(asked.error().kind, rpc::CallErrorKind::kArguments);
    EXPECT_THAT(asked.error().message, HasSubstr("send_goal and cancel_goal are"));
    const auto count = interface("demo/action/Count");
    EXPECT_FALSE(rpc::middleware_of(at("/count")).check_called(at("/count"), *count, *count->find(method)));
  }
  // Calls are made one after the other: had one of those cancelled the goal, the server would know it now.
  ASSERT_TRUE(rpc::call_and_wait(*client_, "cancel_goal", Map{{"goal_id", *reply->find("goal_id")}}, patience()));
  EXPECT_EQ(server.cancelled_.wait_for(1).size(), 1U);
}

TEST_F(RosActions, AreCancelledWhenWhoSentThemGoes) {
  CountServer server(node_at("/count"), "/count", false);
  open();
  ASSERT_TRUE(rpc::call_and_wait(*client_, "send_goal", Map{{"upto", 9}}, patience()));
  client_->end();
  EXPECT_EQ(server.cancelled_.wait_for(1).size(), 1U);
}

TEST_F(RosActions, EndUnknownWhenTheirServerGoes) {
  auto server = std::make_unique<CountServer>(node_at("/count"), "/count", false);
  open();
  ASSERT_TRUE(rpc::call_and_wait(*client_, "send_goal", Map{{"upto", 9}}, patience()));
  heard_.wait_for(1);
  server.reset();
  EXPECT_EQ(*end_of_goal().find("status"), Value("UNKNOWN"));
}

class RosActionServer : public RosActions {
 protected:
  void serve() {
    ActionServerOptions options;
    options.accept = [this](const std::string& id, const Value& goal) {
      goals_.add({id, *goal.find("upto")});
      return *goal.find("upto")->as_int() > 0;
    };
    options.cancel = [this](const std::string& id) {
      cancelled_.add(id);
      return true;
    };
    options.now = [] { return 7.3; };
    auto opened = ActionServer::open(at("/count").path, interface("demo/action/Count"), std::move(options));
    ASSERT_TRUE(opened) << opened.error().message;
    server_ = std::move(*opened);
    open();
  }
  std::string send(int upto) {
    const auto reply = rpc::call_and_wait(*client_, "send_goal", Map{{"upto", upto}}, patience());
    EXPECT_TRUE(reply) << (reply ? "" : reply.error().message);
    return reply && *reply->find("accepted")->as_bool() ? std::string(reply->find("goal_id")->text()) : "";
  }
  Heard<std::pair<std::string, Value>> goals_;
  Heard<std::string> cancelled_;
  std::unique_ptr<ActionServer> server_;
};

TEST_F(RosActionServer, TellsClientsHowTheirGoalsGo) {
  serve();
  const std::string id = send(5);
  EXPECT_THAT(goals_.wait_for(1), ElementsAre(std::pair(id, Value(5))));
  server_->feedback(id, Map{{"now", 4}});
  EXPECT_THAT(heard_.wait([](const auto& all) {
    return std::any_of(all.begin(), all.end(), [](const auto& each) { return each.first == "feedback"; });
  }),
              Contains(std::pair<std::string, Value>("feedback", Map{{"goal_id", id}, {"feedback", Map{{"now", 4}}}})));
  server_->end(id, GoalEnd::kSucceeded, Map{{"reached", 5}});
  const Value end = end_of_goal();
  EXPECT_EQ(*end.find("status"), Value("SUCCEEDED"));
  EXPECT_EQ(*end.at({"result", "reached"}), Value(5));
  EXPECT_EQ(send(0), "") << "it refuses";
}

TEST_F(RosActionServer, CancelsAGoalOrAllOfThem) {
  serve();
  const std::string first = send(1);
  const std::string second = send(2);
  auto reply = rpc::call_and_wait(*client_, "cancel_goal", Map{{"goal_id", first}}, patience());
  ASSERT_TRUE(reply) << reply.error().message;
  EXPECT_EQ(to_json(*reply), "{\"return_code\":0,\"goals_canceling\":[\"" + first + "\"]}");
  server_->end(first, GoalEnd::kCanceled, Value());
  reply = rpc::call_and_wait(*client_, "cancel_goal", Map{{"goal_id", first}}, patience());
  EXPECT_EQ(*reply->find("return_code"), Value(3)) << "it has ended";
  reply = rpc::call_and_wait(*client_, "cancel_goal", Map{{"goal_id", new_goal_id()}}, patience());
  EXPECT_EQ(*reply->find("return_code"), Value(2)) << "nobody knows it";
  reply = rpc::call_and_wait(*client_, "cancel_goal", Map(), patience());
  EXPECT_EQ(*reply->find("goals_canceling"), Value(List{second}));
  EXPECT_THAT(cancelled_.wait_for(2), ElementsAre(first, second));
}

TEST_F(RosActionServer, AnswersAsServersOfRosDo) {
  serve();
  const auto other = stranger();
  std::string error;
  Heard<std::vector<std::uint8_t>> statuses;
  Heard<std::vector<std::uint8_t>> replies;
  const auto nothing = [](const std::string&) {};
  const auto status = other->read(
      {"rt/count/_action/status",
       "action_msgs::msg::dds_::GoalStatusArray_",
       {.reliable = true, .transient_local = true, .depth = 1}},
      [&](dds::Sample sample) { statuses.add(std::move(sample.octets)); }, nothing, error);
  const auto reader = other->read(
      {"rr/count/_action/send_goalReply", "demo::action::dds_::Count_SendGoal_Response_", {}},
      [&](dds::Sample sample) { replies.add(std::move(sample.octets)); }, nothing, error);
  const auto writer = other->write(
      {"rq/count/_action/send_goalRequest", "demo::action::dds_::Count_SendGoal_Request_", {}}, nothing, error);
  ASSERT_TRUE(eventually([&] { return !writer->matched().empty() && !reader->matched().empty(); }));
  std::vector<std::uint8_t> request{0, 1, 0, 0};
  for (std::uint8_t i = 0; i < 16; ++i) request.push_back(static_cast<std::uint8_t>(0xa0 + i));
  request.insert(request.end(), {5, 0, 0, 0});
  const dds::SampleId from{reader->guid(), -(std::int64_t{1} << 32)};
  ASSERT_NE(writer->write(request, &from), 0);
  // accepted, at 7.3 s, rounded to the nanosecond
  const std::vector<std::uint8_t> expected{0, 1, 0, 0, 1, 0, 0, 0, 7, 0, 0, 0, 0x00, 0xa3, 0xe1, 0x11};
  EXPECT_THAT(replies.wait_for(1), Contains(expected));
  request[4] = 0xb0;
  ASSERT_NE(writer->write(request, &from), 0);
  // Both goals; what is aligned to four octets behind the second's identity is its time.
  std::vector<std::uint8_t> array{0, 1, 0, 0, 2, 0, 0, 0, 0xa0};
  array.insert(array.end(), request.begin() + 5, request.begin() + 20);
  array.insert(array.end(), {7, 0, 0, 0, 0x00, 0xa3, 0xe1, 0x11, 2});
  array.insert(array.end(), request.begin() + 4, request.begin() + 20);
  array.insert(array.end(), {0, 0, 0, 7, 0, 0, 0, 0x00, 0xa3, 0xe1, 0x11, 2});
  const auto all = statuses.wait([&](const auto& each) {
    return std::any_of(each.begin(), each.end(), [&](const auto& octets) { return octets.size() >= array.size(); });
  });
  // Samples may have surplus octets at their end.
  EXPECT_EQ(
      std::vector<std::uint8_t>(all.back().begin(), all.back().begin() + static_cast<std::ptrdiff_t>(array.size())),
      array);
}

}  // namespace
}  // namespace sentree::ros
