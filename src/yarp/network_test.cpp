#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "sentree/base/temporary_folder.h"
#include "sentree/rpc/middleware.h"
#include "sentree/text/json.h"
#include "sentree/yarp/detail/bottle.h"
#include "sentree/yarp/detail/inbox.h"
#include "sentree/yarp/detail/port.h"
#include "sentree/yarp/detail/registrar.h"
#include "sentree/yarp/detail/test_network.h"
#include "sentree/yarp/middleware.h"
#include "sentree/yarp/name_server.h"

namespace sentree::yarp {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using test::Events;
using test::RawPeer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::string_view kEnd = "*** end of message\r\n";

std::string end(std::string_view lines = "") { return std::string(lines) + std::string(kEnd); }

std::unique_ptr<NameServer> start_names(std::uint16_t port = 0) {
  auto server = NameServer::start({.listen = {"127.0.0.1", port}});
  EXPECT_TRUE(server) << to_string(server.error());
  return std::move(*server);
}

TEST(NameTable, AnswersAsTheNameServerOfYarpDoes) {
  NameTable names({"127.0.0.1", 10000});
  const auto ask = [&](const std::string& words) { return names.answer("NAME_SERVER " + words); };
  EXPECT_EQ(ask("register /x"), end("registration name /x ip 127.0.0.1 port 10002 type tcp\r\n"));
  EXPECT_EQ(ask("register /y tcp 127.0.0.1 12345"), end("registration name /y ip 127.0.0.1 port 12345 type tcp\r\n"));
  EXPECT_EQ(ask("register ..."), end("registration name /tmp/port/1 ip 127.0.0.1 port 10003 type tcp\r\n"));
  EXPECT_EQ(ask("register /y ... ... ..."), end("registration name /y ip 127.0.0.1 port 10004 type tcp\r\n"));
  EXPECT_EQ(ask("query /x"), end("registration name /x ip 127.0.0.1 port 10002 type tcp\r\n"));
  EXPECT_EQ(ask("query /nobody"), end());
  EXPECT_EQ(ask("list /x"), end("registration name /x ip 127.0.0.1 port 10002 type tcp\r\n"));
  EXPECT_THAT(ask("list"), HasSubstr("registration name /root ip 127.0.0.1 port 10000 type tcp\r\n"));
  EXPECT_THAT(ask("list"), HasSubstr("registration name fallback ip 224.2.1.1 port 10000 type mcast\r\n"));
  EXPECT_EQ(ask("set /x offers text tcp"), end("port /x property offers = tcp text\r\n"));
  EXPECT_EQ(ask("get /x offers"), end("port /x property offers = tcp text\r\n"));
  EXPECT_EQ(ask("get /x nothing"), end("port /x property nothing =\r\n"));
  EXPECT_EQ(ask("set /nobody offers tcp"), end());
  EXPECT_EQ(ask("check /x offers tcp"), end("port /x property offers value tcp present true\r\n"));
  EXPECT_EQ(ask("check /x offers udp"), end("port /x property offers value udp present false\r\n"));
  EXPECT_EQ(ask("route /x /y"), end("port /x route /y = tcp://y\r\n"));
  EXPECT_EQ(ask("gc"), end("garbage collection done.\r\n"));
  EXPECT_EQ(ask("announce /x"), "[ok]\r\n");
  EXPECT_EQ(ask("bot query /x"), "port (name \"/x\") (ip \"127.0.0.1\") (port_number 10002) (carrier tcp)\r\n");
  EXPECT_EQ(ask("bot query /nobody"), "port (error -2 \"port not known\")\r\n");
  EXPECT_THAT(ask("bot list"), HasSubstr("ports (port (name \"/root\")"));
  EXPECT_EQ(ask("unregister /x"), end());
  EXPECT_EQ(ask("unregister /x"), end());
  EXPECT_EQ(ask("query /x"), end());
  EXPECT_EQ(ask("bogus"), end());
  EXPECT_EQ(names.answer(""), end());
}

TEST(NameTable, BoundsItsNames) {
  NameTable names({"127.0.0.1", 10000});
  for (std::size_t i = 0; i + 2 < kNamesMax; ++i)
    EXPECT_NE(names.answer("NAME_SERVER register /p" + std::to_string(i) + " tcp 127.0.0.1 1"), end());
  EXPECT_EQ(names.answer("NAME_SERVER register /one/more tcp 127.0.0.1 1"), end());
  EXPECT_NE(names.answer("NAME_SERVER register /p0 tcp 127.0.0.1 2"), end());
}

TEST(NameServer, TakesLinesHoweverTheyAreCut) {
  const auto server = start_names();
  const RawPeer peer(server->at());
  for (const char* piece : {"NAME_SER", "VER ", "register /x tcp 127.0.0.1 12345\n", "NAME_SERVER query /x\r\n"})
    peer.send(piece);
  EXPECT_EQ(peer.receive_until(kEnd), end("registration name /x ip 127.0.0.1 port 12345 type tcp\r\n"));
  EXPECT_EQ(peer.receive_until(kEnd), end("registration name /x ip 127.0.0.1 port 12345 type tcp\r\n"));
}

TEST(NameServer, TalksToWhoeverDetectsIt) {
  const auto server = start_names();
  const RawPeer peer(server->at());
  peer.send("CONNACK admin\r\na\r\n[ver]\r\nq\r\n");
  EXPECT_EQ(peer.receive_rest(), "Welcome admin\r\n[ver] 1 2 3\r\n<ACK>\r\n<ACK>\r\n");
  const RawPeer silent(server->at());
  silent.send("CONNECT admin\r\na\r\n[ver]\r\nq\r\n");
  EXPECT_EQ(silent.receive_rest(), "Welcome admin\r\n") << "the carrier text has no answers";
}

TEST(NameServer, SaysForWhomAPortIsTaken) {
  const auto first = start_names();
  const auto second = NameServer::start({.listen = first->at()});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().message, "name server of YARP: tcp://" + to_string(first->at()) +
                                        " is taken: another process listens there; stop it or choose another port (0 "
                                        "takes a free one)");
}

TEST(NameServer, SurvivesWhoAsksNothingSensible) {
  const auto server = start_names();
  for (const std::string& hello : {std::string("GET / HTTP/1.1\r\n"), std::string(20'000, 'x')}) {
    const RawPeer peer(server->at());
    peer.send(hello);
    EXPECT_EQ(peer.receive_rest(), "");
  }
  const RawPeer octets(server->at());
  octets.send(test::octets("5941 e41e0000 5250 06000000 'admin' 00"));
  EXPECT_THAT(octets.receive_rest(), HasSubstr("Protocol not found"));
  EXPECT_TRUE(answers(server->at(), test::kPatience));
}

TEST(NameServer, TakesNamesOutOfTheirQuotes) {
  const auto server = start_names();
  const RawPeer peer(server->at());
  peer.send("NAME_SERVER register \"/x\" tcp 127.0.0.1 12345\nNAME_SERVER query /x\n");
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(peer.receive_until(kEnd), end("registration name /x ip 127.0.0.1 port 12345 type tcp\r\n"));
}

TEST(NameServer, ConnectsWhatIsToStayConnected) {
  const auto server = start_names();
  const PortOptions options{.name_server = server->at()};
  Events heard;
  PortOptions from = options;
  from.name = "/from:o";
  auto sender = Port::open(from, {.sends = true});
  ASSERT_TRUE(sender);
  NameClient names(server->at());
  const auto deadline = steady_clock::now() + test::kPatience;
  ASSERT_TRUE(names.enter("/from:o", (*sender)->at(), deadline));
  const RawPeer tool(server->at());
  tool.send("CONNACK admin\r\nd\r\nsubscribe \"/from:o\" \"/to:i\"\r\n");
  EXPECT_EQ(tool.receive_until("<ACK>\r\n"), "Welcome admin\r\n[ok]\r\n<ACK>\r\n");
  PortOptions to = options;
  to.name = "/to:i";
  auto receiver = Port::open(to, {.print = [&](const std::string& text) { heard.add(text); }});
  ASSERT_TRUE(receiver);
  ASSERT_TRUE(names.enter("/to:i", (*receiver)->at(), deadline));
  EXPECT_TRUE(test::becomes_true([&] { return (*sender)->outputs() == std::vector<std::string>{"/to:i"}; }));
  const idl::ServicePtr data = test::schema().service("Data");
  (*sender)->write(*data->find("level"), Map{{"percent", 40.0}, {"charging", true}}, false);
  EXPECT_THAT(heard.await(1), ElementsAre("40.0 [ok]"));
}

TEST(NameClient, SaysWhatToDoWhereNobodyAnswers) {
  NameClient names({"127.0.0.1", 1});
  const auto found = names.query("/x", steady_clock::now() + test::kPatience);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, "yarp.no-name-server");
  EXPECT_THAT(found.error().message, HasSubstr("start yarpserver, or sentree run --yarp-server"));
}

TEST(NameClient, FindsTheServerThatYarpConfWrites) {
  const TemporaryFolder folder("yarp");

  std::ofstream(folder.path() / "yarp.conf") << "10.0.0.7 10042 yarp\n";
  ::setenv("YARP_CONFIG_HOME", folder.path().c_str(), 1);
  ::unsetenv("SENTREE_YARP_SERVER");
  EXPECT_EQ(configured_name_server(), (HostPort{"10.0.0.7", 10042}));
  ::setenv("SENTREE_YARP_SERVER", "10.0.0.8:10043", 1);
  EXPECT_EQ(configured_name_server(), (HostPort{"10.0.0.8", 10043}));
  EXPECT_TRUE(check_name_server());
  // What cannot be meant is told, and nobody else is asked.
  rpc::register_middleware(make_middleware());
  const rpc::Address address = *rpc::Address::parse("yarp:/x:o");
  ::setenv("SENTREE_YARP_SERVER", "foo", 1);
  EXPECT_THAT(check_name_server().error().message, HasSubstr("SENTREE_YARP_SERVER=\"foo\" is no HOST:PORT"));
  const auto listed = rpc::middleware_of(address).list(address, std::chrono::milliseconds(1));
  ASSERT_FALSE(listed);
  EXPECT_EQ(listed.error().code, "yarp.environment");
  ::unsetenv("SENTREE_YARP_SERVER");
  EXPECT_TRUE(check_name_server());
  std::ofstream(folder.path() / "yarp.conf") << "garbage\n";
  EXPECT_THAT(check_name_server().error().message, HasSubstr("yarp.conf does not begin with HOST PORT"));
  EXPECT_THAT(rpc::middleware_of(address).lacks(), HasSubstr("yarp conf HOST PORT"));
  ::unsetenv("YARP_CONFIG_HOME");
}

TEST(Registrar, MakesPortsKnownAgainToANameServerThatWasStartedAnew) {
  auto server = start_names();
  const HostPort at = server->at();
  Events problems;
  Registrar registrar(
      at, [&](const std::string& what) { problems.add(what); }, milliseconds(5));
  ASSERT_TRUE(registrar.add("/x", {"127.0.0.1", 4711}));
  server->stop();
  EXPECT_THAT(problems.await(1)[0], HasSubstr("no name server"));
  server = start_names(at.port);
  EXPECT_TRUE(test::becomes_true([&] {
    NameClient names(at);
    const auto found = names.query("/x", steady_clock::now() + test::kPatience);
    return found && *found && (*found)->at == HostPort{"127.0.0.1", 4711};
  }));
  registrar.stop();
  NameClient names(at);
  const auto gone = names.query("/x", steady_clock::now() + test::kPatience);
  ASSERT_TRUE(gone);
  EXPECT_FALSE(gone->has_value());
}

TEST(Registrar, LeavesANameToWhoHasTakenItOver) {
  const auto server = start_names();
  Events problems;
  Registrar registrar(
      server->at(), [&](const std::string& what) { problems.add(what); }, milliseconds(5));
  ASSERT_TRUE(registrar.add("/x", {"127.0.0.1", 4711}));
  NameClient names(server->at());
  ASSERT_TRUE(names.enter("/x", {"127.0.0.1", 4712}, steady_clock::now() + test::kPatience));
  EXPECT_THAT(problems.await(1)[0], HasSubstr("taken over"));
  registrar.stop();
  const auto found = names.query("/x", steady_clock::now() + test::kPatience);
  ASSERT_TRUE(found && *found);
  EXPECT_EQ((*found)->at.port, 4712);
}

TEST(Bottle, PrintsAndReadsWhatToolsShow) {
  const std::string text = R"(hello 42 3.5 (a b) [ok] {1 2 3} "two words" "/x" (1 (2.0 "3")))";
  const auto items = parse_text(text);
  ASSERT_TRUE(items) << items.error().message;
  EXPECT_EQ(to_text(*items), text);
  for (const Version version : {Version::kYarp3, Version::kYarp4}) {
    std::vector<std::uint8_t> octets;
    write_bottle(octets, *items, version);
    Inbox in(std::string_view(reinterpret_cast<const char*>(octets.data()), octets.size()));
    EXPECT_EQ(to_text(read_bottle(in, version)), text);
  }
  for (const std::string_view wrong : {"(", ")", "[a b]", "\"x", "((((((((((((((((((((((((((((((((((((((1"})
    EXPECT_FALSE(parse_text(wrong)) << wrong;
}

TEST(Bottle, ReadsADictionaryInAList) {
  const std::string bytes = test::octets(
      "00010000 03000000 01000000 01000000 00020000 00010000 01000000 04010000 02000000 01000000 'k' 01000000 'v'"
      " 04000000 01000000 'z'");
  Inbox in{std::string_view(bytes)};
  EXPECT_EQ(to_text(read_bottle(in, Version::kYarp3)), "1 ((k v)) z");
}

TEST(PortAddress, ReadsItsForms) {
  const auto parsed =
      PortAddress::parse("//127.0.0.1:10012/battery/rpc:i?carrier=fast_tcp&yarp=4&server=10.0.0.1:10000");
  ASSERT_TRUE(parsed) << parsed.error().message;
  EXPECT_EQ(parsed->name, "/battery/rpc:i");
  EXPECT_EQ(parsed->direct, (HostPort{"127.0.0.1", 10012}));
  EXPECT_EQ(parsed->server, (HostPort{"10.0.0.1", 10000}));
  EXPECT_EQ(parsed->carrier, Carrier::kFastTcp);
  EXPECT_EQ(parsed->version, Version::kYarp4);
  EXPECT_EQ(to_string(*parsed), "yarp://127.0.0.1:10012/battery/rpc:i?carrier=fast_tcp&yarp=4&server=10.0.0.1:10000");
  EXPECT_TRUE(PortAddress::parse("/x:o")->is_source());
  EXPECT_FALSE(PortAddress::parse("/x:i")->is_source());
  EXPECT_FALSE(PortAddress::parse("/x:o?open")->is_source());
  EXPECT_TRUE(PortAddress::parse("/x:i?open")->is_source());
  EXPECT_FALSE(PortAddress::parse("/x")->is_source());
  EXPECT_TRUE(PortAddress::parse("/x?read")->is_source());
  EXPECT_EQ(to_string(*PortAddress::parse("/x?read")), "yarp:/x?read");
  for (const auto& [text, why] :
       std::vector<std::pair<std::string, std::string>>{{"/x?carrier=mcast", "carrier \"mcast\", which is not spoken"},
                                                        {"/x?bogus", "unknown option"},
                                                        {"/x?open&read", "is both open"},
                                                        {"/x?yarp=3&yarp=4", "gives yarp twice: yarp=3 and yarp=4"},
                                                        {"x", "does not begin"},
                                                        {"/a b", "blank"},
                                                        {"//host/x", "bad host"},
                                                        {"/" + std::string(1000, 'a'), "1000 bytes"}}) {
    const auto wrong = PortAddress::parse(text);
    ASSERT_FALSE(wrong) << text;
    EXPECT_THAT(wrong.error().message, HasSubstr(why));
  }
}

// ---- through the seam

class Network : public ::testing::Test {
 protected:
  Network() { rpc::register_middleware(make_middleware()); }

  rpc::Address address(const std::string& text) const {
    const auto parsed = rpc::Address::parse(text + (text.find('?') == std::string::npos ? "?" : "&") +
                                            "server=" + to_string(names_->at()));
    EXPECT_TRUE(parsed) << parsed.error().message;
    return *parsed;
  }
  static rpc::Outcome call(rpc::Caller& caller, std::string_view method, Value arguments) {
    return rpc::call_and_wait(caller, method, std::move(arguments), steady_clock::now() + test::kPatience);
  }

  std::unique_ptr<NameServer> names_ = start_names();
};

TEST_F(Network, CallsAServiceByItsName) {
  auto served =
      rpc::serve(address("yarp:/robot/"), {{"probe", test::probe_service()}, {"other", test::probe_service()}});
  ASSERT_TRUE(served) << to_string(served.error());
  EXPECT_EQ((*served)->address(), to_string(address("yarp:/robot/")));
  auto caller = rpc::connect(address("yarp:/robot/probe/rpc:i"), test::schema().service("Probe"));
  ASSERT_TRUE(caller);
  EXPECT_EQ(call(**caller, "ri32", Map{{"x", 5}}), rpc::Outcome(Value(5)));
  rpc::Address beside = address("yarp:/robot/");
  beside.service = "other";
  auto other = rpc::connect(beside, test::schema().service("Probe"));
  ASSERT_TRUE(other);
  EXPECT_EQ(call(**other, "ri32", Map{{"x", 6}}), rpc::Outcome(Value(6)));
  const auto listed = rpc::middleware_of(address("yarp:/robot")).list(address("yarp:/robot"), test::kPatience);
  ASSERT_TRUE(listed);
  EXPECT_EQ(listed->size(), 2U);
  // Gone and come back, elsewhere.
  (*served)->stop();
  EXPECT_FALSE(call(**caller, "ri32", Map{{"x", 5}}));
  served = rpc::serve(address("yarp:/robot/probe/rpc:i"), {{"probe", test::probe_service()}});
  ASSERT_TRUE(served);
  EXPECT_TRUE(test::becomes_true([&] { return call(**caller, "ri32", Map{{"x", 6}}) == rpc::Outcome(Value(6)); }));
}

TEST_F(Network, SaysWhyAServiceIsNotThere) {
  auto caller = rpc::connect(address("yarp:/nobody"), test::schema().service("Probe"));
  ASSERT_TRUE(caller);
  const auto out = call(**caller, "rvoid", Map());
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, rpc::CallErrorKind::kUnreachable);
  EXPECT_THAT(out.error().message, HasSubstr("knows no such port"));
}

TEST_F(Network, RefusesWhatItCannotServe) {
  EXPECT_FALSE(rpc::serve(address("yarp:/one:i"), {{"a", test::probe_service()}, {"b", test::probe_service()}}));
  const auto far = rpc::serve(address("yarp:/x:i?listen=0.0.0.0"), {{"a", test::probe_service()}});
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, "rpc.not-loopback");
  EXPECT_THAT(far.error().message, HasSubstr("0.0.0.0 can be reached from other machines, and YARP has no "
                                             "authentication"));
  const auto names = NameServer::start({.listen = {"0.0.0.0", 10000}});
  ASSERT_FALSE(names);
  EXPECT_EQ(names.error().code, "rpc.not-loopback");
  EXPECT_THAT(names.error().message, AllOf(HasSubstr("0.0.0.0:10000"), HasSubstr("YARP has no authentication"),
                                           HasSubstr("allow it with --insecure")));
  names_->stop();
  const auto nameless = rpc::serve(address("yarp:/x:i"), {{"a", test::probe_service()}});
  ASSERT_FALSE(nameless);
  EXPECT_EQ(nameless.error().code, "yarp.no-name-server");
}

TEST_F(Network, SaysThatNobodyIsAuthenticatedWhereItServes) {
  Events told;
  rpc::ServerOptions options;
  options.on_peer_error = [&](const std::string& what) { told.add(what); };
  const auto served = rpc::serve(address("yarp:/x:i"), {{"a", test::probe_service()}}, options);
  ASSERT_TRUE(served) << to_string(served.error());
  EXPECT_THAT(told.await(1)[0], HasSubstr("listens on 127.0.0.1; whoever reaches it can do everything, YARP has no "
                                          "authentication"));
}

TEST_F(Network, ReadsWhatIsPublished) {
  const idl::ServicePtr data = test::schema().service("Data");
  auto publisher = rpc::connect(address("yarp:/battery/level:o?open"), data);
  ASSERT_TRUE(publisher) << to_string(publisher.error());
  Events heard;
  Events text;
  const rpc::Address source = address("yarp:/battery/level:o");
  ASSERT_TRUE(rpc::middleware_of(source).is_source(source, nullptr));
  auto subscribed = rpc::middleware_of(source).subscribe(
      source, data,
      [&](const idl::Method& method, const Value& arguments) { heard.add(method.name + to_json(arguments)); },
      {.target = "battery", .problem = {}});
  ASSERT_TRUE(subscribed) << to_string(subscribed.error());
  auto watched = rpc::middleware_of(source).watch(source, [&](const std::string& what) { text.add(what); },
                                                  {.target = "echo", .problem = {}});
  ASSERT_TRUE(watched);
  // Whoever connects has connected when something comes; until then it is published again.
  ASSERT_TRUE(test::becomes_true([&] {
    EXPECT_TRUE(call(**publisher, "level", Map{{"percent", 40.0}, {"charging", true}}));
    return !heard.await(0).empty() && !text.await(0).empty();
  }));
  EXPECT_EQ(heard.await(1)[0], R"(level{"percent":40.0,"charging":true})");
  EXPECT_EQ(text.await(1)[0], "40.0 [ok]");
}

TEST_F(Network, ReadsAPortWhateverItsNameAndWhateverIsBetween) {
  const rpc::Address source = address("yarp:/writer");
  rpc::Middleware& yarp = rpc::middleware_of(source);
  EXPECT_TRUE(yarp.is_source(source, nullptr)) << "as nobody wants to call it";
  EXPECT_FALSE(yarp.is_source(source, test::schema().service("Data").get()));
  EXPECT_TRUE(yarp.is_source(address("yarp:/writer?read"), test::schema().service("Data").get()));
  Events heard;
  Events told;
  auto port = Port::open({.name = "/reader", .on_peer_error = [&](const std::string& what) { told.add(what); }},
                         {.print = [&](const std::string& what) { heard.add(what); }});
  ASSERT_TRUE(port) << to_string(port.error());
  const RawPeer peer((*port)->at());
  peer.send(octets("5941 e41e0000 5250 02000000 'a' 00"));
  EXPECT_EQ(peer.receive(8).size(), 8U);
  const std::string head = octets("5941 0a000000 5250 01 01 ffffffffffffffff 18000000 00000000 00000000 7e44 00 01");
  for (const std::string_view item : {"01000000 01000000", "ff000000 01000000", "01000000 02000000"})
    peer.send(head + octets("00010000 01000000") + octets(item));
  EXPECT_EQ(heard.await(2), (std::vector<std::string>{"1", "2"}));
  EXPECT_THAT(told.await(1),
              ElementsAre(HasSubstr("data for yarp:/reader cannot be read: an item has the unknown tag 255")));
}

TEST_F(Network, SaysOfWhichPortDataDoNotFit) {
  const idl::ServicePtr data = test::schema().service("Data");
  // The name of the method comes first, which nobody expects.
  auto publisher = rpc::connect(address("yarp:/battery/level:o?open&named"), data);
  ASSERT_TRUE(publisher) << to_string(publisher.error());
  Events told;
  const rpc::Address source = address("yarp:/battery/level:o");
  auto subscribed = rpc::middleware_of(source).subscribe(
      source, data, [](const idl::Method&, const Value&) { ADD_FAILURE() << "it was taken"; },
      {.target = "battery", .problem = [&](const std::string& what) { told.add(what); }});
  ASSERT_TRUE(subscribed) << to_string(subscribed.error());
  ASSERT_TRUE(test::becomes_true([&] {
    EXPECT_TRUE(call(**publisher, "level", Map{{"percent", 40.0}, {"charging", true}}));
    const auto all = told.await(0);
    return std::any_of(all.begin(), all.end(), [](const std::string& what) {
      return what.find(
                 "data of yarp:/battery/level:o are none of Data: level 40.0 [ok] came, where (double percent, bool "
                 "charging) is due") != std::string::npos;
    });
  })) << ::testing::PrintToString(told.await(0));
}

TEST_F(Network, WritesToAPortForData) {
  const idl::ServicePtr data = test::schema().service("Data");
  Events heard;
  const rpc::Address own = address("yarp:/cmd:i?open");
  auto subscribed = rpc::middleware_of(own).subscribe(
      own, data,
      [&](const idl::Method& method, const Value& arguments) { heard.add(method.name + to_json(arguments)); },
      {.target = "cmd", .problem = {}});
  ASSERT_TRUE(subscribed) << to_string(subscribed.error());
  auto writer = rpc::connect(address("yarp:/cmd:i"), data);
  ASSERT_TRUE(writer);
  for (int i = 0; i < 500; ++i) EXPECT_TRUE(call(**writer, "level", Map{{"percent", i}, {"charging", false}}));
  EXPECT_EQ(heard.await(500)[499], R"(level{"percent":499.0,"charging":false})");
}

TEST_F(Network, FindsTheServiceBesideAnother) {
  const rpc::Address battery = address("yarp:/robot/battery/rpc:i");
  EXPECT_THAT(to_string(rpc::middleware_of(battery).beside(battery, "battery", "simulation")),
              HasSubstr("yarp:/robot/simulation/rpc:i?"));
}

}  // namespace
}  // namespace sentree::yarp
