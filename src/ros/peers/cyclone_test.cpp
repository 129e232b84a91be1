// Each kind of traffic with a process that has another DDS: Cyclone's, as nodes of rmw_cyclonedds have it.

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>

#include "sentree/ros/action_server.h"
#include "sentree/ros/detail/overhear.h"
#include "sentree/ros/detail/test_graph.h"

extern char** environ;

namespace sentree::ros {
namespace {

using ::testing::Contains;
using ::testing::Pair;

// Loopback only, without multicast; of a thousand datagrams that it sends, so many are lost.
std::string settings(int lost) {
  return "CYCLONEDDS_URI=<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\" multicast=\"false\"/>"
         "</Interfaces><AllowMulticast>false</AllowMulticast></General><Discovery><Peers><Peer "
         "address=\"127.0.0.1\"/></Peers>"
         "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>20</MaxAutoParticipantIndex></Discovery>"
         "<Internal><Test><XmitLossiness>" +
         std::to_string(lost) + "</XmitLossiness></Test></Internal></Domain></CycloneDDS>";
}

// @param variable  Empty: as it is without any. The number of the process, everything of which is there; 0: it did not
//        begin.
pid_t start_peer(std::string domain, std::string variable) {
  std::vector<char*> variables;
  for (char** each = environ; *each != nullptr; ++each) {
    if (!std::string_view(*each).starts_with("CYCLONEDDS_URI=")) variables.push_back(*each);
  }
  if (!variable.empty()) variables.push_back(variable.data());
  variables.push_back(nullptr);
  std::string program = SENTREE_CYCLONE_PEER;
  char* const arguments[] = {program.data(), domain.data(), nullptr};
  int ready[2];
  if (::pipe2(ready, O_CLOEXEC) != 0) return 0;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ready[1], STDOUT_FILENO);
  pid_t peer = 0;
  const bool began = posix_spawn(&peer, program.c_str(), &actions, nullptr, arguments, variables.data()) == 0;
  posix_spawn_file_actions_destroy(&actions);
  ::close(ready[1]);
  char said = 0;
  const bool is_there = began && ::read(ready[0], &said, 1) == 1;
  ::close(ready[0]);
  if (began && !is_there) ::waitpid(peer, nullptr, 0);
  return is_there ? peer : 0;
}

// Whether there is a network on which others could look by multicast.
bool has_network() {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return false;
  bool found = false;
  for (const ifaddrs* each = all; each != nullptr; each = each->ifa_next) {
    constexpr unsigned kNeeded = IFF_UP | IFF_MULTICAST;
    found = found || (each->ifa_addr != nullptr && each->ifa_addr->sa_family == AF_INET &&
                      (each->ifa_flags & (kNeeded | IFF_LOOPBACK)) == kNeeded);
  }
  ::freeifaddrs(all);
  return found;
}

// Whoever looks by multicast at the loopback interface hears of us, before anybody has told us of himself.
TEST_F(Graph, TellsOfItselfByMulticastOnThisMachine) {
  const int listening = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int shared = 1;
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * std::stoi(domain_)));  // DDSI-RTPS 2.2, 9.6.1.4
  ip_mreqn group{};
  group.imr_multiaddr.s_addr = inet_addr("239.255.0.1");
  group.imr_address.s_addr = htonl(INADDR_LOOPBACK);
  group.imr_ifindex = static_cast<int>(::if_nametoindex("lo"));
  ASSERT_EQ(::setsockopt(listening, SOL_SOCKET, SO_REUSEADDR, &shared, sizeof shared), 0);
  ASSERT_EQ(::setsockopt(listening, SOL_SOCKET, SO_REUSEPORT, &shared, sizeof shared), 0);
  ASSERT_EQ(::bind(listening, reinterpret_cast<const sockaddr*>(&place), sizeof place), 0);
  if (::setsockopt(listening, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) != 0) {
    ::close(listening);
    GTEST_SKIP() << "the loopback interface has no multicast";
  }
  const auto node = node_at("/teller");
  pollfd waiting{.fd = listening, .events = POLLIN, .revents = 0};
  ASSERT_EQ(::poll(&waiting, 1, static_cast<int>(std::chrono::milliseconds(kPatience).count())), 1);
  std::string heard(4, ' ');
  EXPECT_EQ(::recv(listening, heard.data(), heard.size(), MSG_TRUNC | MSG_DONTWAIT) > 4 ? heard : "", "RTPS");
  ::close(listening);
}

// It takes any free port, and says by multicast where it is, at first and every 8 s.
TEST_F(Graph, FindsNodesOfCycloneWithoutAnySettingsOnThisMachine) {
  if (!has_network()) GTEST_SKIP() << "there is no network, where it behaves otherwise";
  const pid_t peer = start_peer(domain_, "");
  ASSERT_GT(peer, 0);
  const rpc::Address everywhere = at("/");
  const auto listed = rpc::middleware_of(everywhere).list(everywhere, std::chrono::seconds(1));
  ::kill(peer, SIGKILL);
  ::waitpid(peer, nullptr, 0);
  ASSERT_TRUE(listed) << listed.error().message;
  EXPECT_TRUE(
      std::any_of(listed->begin(), listed->end(), [](const auto& each) { return each.name == "/cyclone_lamp"; }));
}

class RosCyclone : public Graph {
 protected:
  void SetUp() override {
    Graph::SetUp();
    if (IsSkipped()) return;
    begin();
    const auto text = interface("std_msgs/msg/String");
    const rpc::Address source = at("/from_cyclone", "&qos=default");
    auto heard = rpc::middleware_of(source).subscribe(
        source, text,
        [this](const idl::Method&, Value arguments) { said_.add(std::string(arguments.find("data")->text())); },
        {.target = "from", .problem = {}});
    ASSERT_TRUE(heard) << heard.error().message;
    from_ = std::move(*heard);
    auto publisher = rpc::connect(at("/to_cyclone", "&publish"), text, {});
    ASSERT_TRUE(publisher) << publisher.error().message;
    to_ = std::move(*publisher);
    greet("good day");
  }
  void TearDown() override { end(); }

  void begin(int lost = 0) {
    peer_ = start_peer(domain_, settings(lost));
    ASSERT_GT(peer_, 0);
  }
  void end() {
    if (peer_ <= 0) return;
    ::kill(peer_, SIGKILL);
    ::waitpid(peer_, nullptr, 0);
    peer_ = 0;
  }
  // Says something until it is answered: topics forget what was published before somebody was there.
  void greet(const std::string& greeting) {
    const std::string answer = "heard " + greeting;
    ASSERT_TRUE(eventually([&] {
      tell(greeting);
      const auto all = said_.wait([](const auto&) { return true; });
      return std::find(all.begin(), all.end(), answer) != all.end();
    }));
  }
  void tell(const std::string& what) {
    const auto told = rpc::call_and_wait(*to_, "message", Map{{"data", what}}, patience());
    EXPECT_TRUE(told) << told.error().message;
  }
  // Waits until it has said so.
  bool has_said(const std::string& what) {
    const auto all =
        said_.wait([&](const auto& each) { return std::find(each.begin(), each.end(), what) != each.end(); });
    const bool has = std::find(all.begin(), all.end(), what) != all.end();
    EXPECT_TRUE(has) << what;
    return has;
  }

  pid_t peer_ = 0;
  Heard<std::string> said_;
  std::unique_ptr<rpc::Opened> from_;
  std::unique_ptr<rpc::Caller> to_;
};

TEST_F(RosCyclone, HearsAndIsHeardAlsoAfterItWasAway) {
  end();
  begin();
  greet("here again");
}

TEST_F(RosCyclone, SeesAnImageOfEightMegabytes) {
  auto publisher = rpc::connect(at("/image", "&publish"), interface("sensor_msgs/msg/Octets"), {});
  ASSERT_TRUE(publisher) << publisher.error().message;
  const auto shown =
      rpc::call_and_wait(**publisher, "message", Map{{"data", Bytes{std::vector<std::byte>(8U << 20U)}}}, patience());
  ASSERT_TRUE(shown) << shown.error().message;
  has_said("image of " + std::to_string(8U << 20U));
}

TEST_F(RosCyclone, AnswersOurCalls) {
  auto client = rpc::connect(at("/cyclone_lamp"), interface("std_srvs/srv/SetBool"), {.target = "lamp"});
  ASSERT_TRUE(client) << client.error().message;
  for (const bool on : {true, false, true}) {
    const auto reply = rpc::call_and_wait(**client, "call", Map{{"data", on}}, patience());
    ASSERT_TRUE(reply) << reply.error().message;
    EXPECT_EQ(*reply->find("message"), Value(on ? "on" : "off"));
  }
}

TEST_F(RosCyclone, GetsAndGivesEverythingThoughMuchIsLost) {
  end();
  begin(150);
  greet("here again");
  for (int i = 0; i < 30; ++i) {
    tell("number " + std::to_string(i));
    ASSERT_TRUE(has_said("heard number " + std::to_string(i)));
  }
  auto client = rpc::connect(at("/cyclone_lamp"), interface("std_srvs/srv/SetBool"), {.target = "lamp"});
  ASSERT_TRUE(client) << client.error().message;
  for (int i = 0; i < 30; ++i) {
    const auto reply = rpc::call_and_wait(**client, "call", Map{{"data", i % 2 == 0}}, patience());
    ASSERT_TRUE(reply) << reply.error().message;
    EXPECT_EQ(*reply->find("message"), Value(i % 2 == 0 ? "on" : "off"));
  }
}

TEST_F(RosCyclone, IsAnsweredByOurServices) {
  const auto served =
      rpc::serve(at("/lamp"),
                 {{"service", std::make_shared<rpc::FunctionService>(
                                  interface("std_srvs/srv/SetBool"),
                                  [](const idl::Method&, const Value& arguments) -> rpc::Outcome {
                                    const bool on = *arguments.find("data")->as_bool();
                                    return Value(Map{{"success", true}, {"message", on ? "is on" : "is off"}});
                                  })}},
                 {});
  ASSERT_TRUE(served) << served.error().message;
  tell("call");
  has_said("lamp 1 is on");
}

TEST_F(RosCyclone, IsOverheardWhenItAsksAndWhenItAnswers) {
  Heard<std::string> said;
  std::atomic<std::uint64_t> calls{0};
  const auto hear = [&](const std::string& name) {
    rpc::Middleware::Hearing hearing;
    hearing.request = [&](const idl::Method&, const Value& arguments) {
      const std::uint64_t call = ++calls;
      said.add(std::to_string(call) + to_json(arguments));
      return call;
    };
    hearing.outcome = [&](std::uint64_t call, const idl::Method&, const rpc::Outcome& outcome) {
      said.add(std::to_string(call) + (outcome ? to_json(*outcome) : outcome.error().message));
    };
    const auto listener =
        std::make_shared<Node>(stranger(), Release::kHumble, static_cast<std::uint32_t>(std::stoi(domain_)));
    auto heard = overhear(listener, *GraphAddress::parse(name + "?requests"), interface("std_srvs/srv/SetBool"), name,
                          "ros:" + name, std::move(hearing), {});
    EXPECT_TRUE(heard) << heard.error().message;
    return std::move(*heard);
  };
  const auto has = [&](const std::string& what) {
    const auto all = said.all();
    return std::any_of(all.begin(), all.end(), [&](const std::string& each) {
      return each.ends_with(what) && std::any_of(all.begin(), all.end(), [&](const std::string& asked) {
               return asked == each.substr(0, each.find('{')) + R"({"data":true})";
             });
    });
  };
  {
    const auto heard = hear("/cyclone_lamp");
    auto client = rpc::connect(at("/cyclone_lamp"), interface("std_srvs/srv/SetBool"), {.target = "lamp"});
    ASSERT_TRUE(client) << client.error().message;
    EXPECT_TRUE(eventually([&] {
      const auto reply = rpc::call_and_wait(**client, "call", Map{{"data", true}}, patience());
      EXPECT_TRUE(reply) << reply.error().message;
      return !reply || has(R"({"success":true,"message":"on"})");
    }));
    EXPECT_TRUE(has(R"({"success":true,"message":"on"})"));
  }
  const auto served = rpc::serve(
      at("/lamp"),
      {{"service", std::make_shared<rpc::FunctionService>(interface("std_srvs/srv/SetBool"),
                                                          [](const idl::Method&, const Value&) -> rpc::Outcome {
                                                            return Value(Map{{"success", true}, {"message", "ours"}});
                                                          })}},
      {});
  ASSERT_TRUE(served) << served.error().message;
  const auto heard = hear("/lamp");
  EXPECT_TRUE(eventually([&] {
    tell("call");
    return has(R"({"success":true,"message":"ours"})");
  }));
}

class RosCycloneActions : public RosCyclone {
 protected:
  using Event = std::pair<std::string, Value>;

  void connect(const std::string& name) {
    const auto count = interface("demo/action/Count");
    auto opened = rpc::middleware_of(at(name)).subscribe(at(name), count,
                                                         [this](const idl::Method& method, Value arguments) {
                                                           heard_.add({method.name, arguments});
                                                         },
                                                         {.target = "count", .problem = {}});
    ASSERT_TRUE(opened) << opened.error().message;
    heard_by_ = std::move(*opened);
    auto client = rpc::connect(at(name), count, {.target = "count"});
    ASSERT_TRUE(client) << client.error().message;
    client_ = std::move(*client);
  }
  Value send(int upto) {
    const auto reply = rpc::call_and_wait(*client_, "send_goal", Map{{"upto", upto}}, patience());
    EXPECT_TRUE(reply) << reply.error().message;
    return reply ? *reply : Value(Map{{"accepted", false}, {"goal_id", ""}});
  }
  // Waits for the one of that kind.
  Value event(const std::string& kind) {
    const auto is_it = [&](const Event& each) { return each.first == kind; };
    const auto all = heard_.wait([&](const auto& each) { return std::any_of(each.begin(), each.end(), is_it); });
    const auto found = std::find_if(all.begin(), all.end(), is_it);
    EXPECT_NE(found, all.end()) << kind;
    return found != all.end() ? found->second : Value(Map{});
  }

  Heard<Event> heard_;
  std::unique_ptr<rpc::Opened> heard_by_;
  std::unique_ptr<rpc::Caller> client_;
};

TEST_F(RosCycloneActions, TakeOurGoalsAndTellHowTheyGo) {
  connect("/cyclone_count");
  EXPECT_EQ(*send(100).find("accepted"), Value(false));
  const Value reply = send(5);
  EXPECT_EQ(*reply.find("accepted"), Value(true));
  const Value id = *reply.find("goal_id");
  EXPECT_EQ(event("feedback"), Value(Map{{"goal_id", id}, {"feedback", Map{{"now", 3}}}}));
  EXPECT_EQ(event("result"),
            Value(Map{{"goal_id", id}, {"status", "SUCCEEDED"}, {"result", Map{{"reached", 5}, {"how", "fine"}}}}));
  const Event status{"status", Map{{"goal_id", id}, {"status", "SUCCEEDED"}}};
  EXPECT_THAT(heard_.wait([&](const auto& all) { return std::find(all.begin(), all.end(), status) != all.end(); }),
              Contains(status));
}

TEST_F(RosCycloneActions, EndGoalsThatWeCancel) {
  connect("/cyclone_count");
  const Value id = *send(60).find("goal_id");
  event("feedback");
  const auto cancelled = rpc::call_and_wait(*client_, "cancel_goal", Map{{"goal_id", id}}, patience());
  ASSERT_TRUE(cancelled) << cancelled.error().message;
  EXPECT_EQ(*cancelled->find("goals_canceling"), Value(List{id}));
  EXPECT_EQ(*event("result").find("status"), Value("CANCELED"));
}

TEST_F(RosCycloneActions, SendGoalsToOurServer) {
  Heard<std::pair<std::string, Value>> goals;
  Heard<std::string> cancelled;
  ActionServerOptions options;
  options.accept = [&](const std::string& id, const Value& goal) {
    goals.add({id, *goal.find("upto")});
    return true;
  };
  options.cancel = [&](const std::string& id) {
    cancelled.add(id);
    return true;
  };
  options.now = [] { return 7.5; };
  auto server = ActionServer::open(at("/count").path, interface("demo/action/Count"), std::move(options));
  ASSERT_TRUE(server) << server.error().message;
  tell("goal");
  has_said("goal accepted");
  const auto goal = goals.wait_for(1).at(0);
  EXPECT_EQ(goal.second, Value(5));
  (*server)->feedback(goal.first, Map{{"now", 4}});
  has_said("goal is at 4");
  tell("cancel");
  has_said("cancelling 1 with code 0");
  EXPECT_EQ(cancelled.wait_for(1).at(0), goal.first);
  (*server)->end(goal.first, GoalEnd::kCanceled, Map{{"reached", 2}, {"how", "so far"}});
  has_said("goal ended 5 at 2 so far");
}

}  // namespace
}  // namespace sentree::ros
