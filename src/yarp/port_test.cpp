#include "sentree/yarp/detail/port.h"

#include <gmock/gmock.h>

#include <future>

#include "sentree/rpc/async_client.h"
#include "sentree/yarp/detail/line.h"
#include "sentree/yarp/detail/test_network.h"

namespace sentree::yarp {
namespace {

using test::Events;
using test::octets;
using test::RawPeer;
using test::shown;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::unique_ptr<Port> open_probe(Events* complaints = nullptr, Events* calls = nullptr,
                                 std::size_t connections_max = 64) {
  PortOptions options;
  options.name = "/probe";
  options.connections_max = connections_max;
  if (complaints != nullptr) options.on_peer_error = [complaints](const std::string& what) { complaints->add(what); };
  auto port = Port::open(std::move(options), {.service = test::probe_service(calls)});
  EXPECT_TRUE(port) << to_string(port.error());
  return std::move(*port);
}

std::string number_of(const Port& port) {
  const std::uint16_t number = port.at().port;
  return {static_cast<char>(number & 0xff), static_cast<char>(number >> 8U), '\0', '\0'};
}

// Says who it is, as a sender on tcp does, and takes the answer.
RawPeer greeted(const Port& port, std::string_view name = "anon", bool fast = false) {
  RawPeer peer(port.at());
  const std::string length{static_cast<char>(name.size() + 1), '\0', '\0', '\0'};
  peer.send(octets(fast ? "5941 641e0000 5250" : "5941 e41e0000 5250") + length + std::string(name) +
            std::string(1, '\0'));
  EXPECT_EQ(peer.receive(8), "YA" + number_of(port) + "RP");
  return peer;
}

// One block: the command, then the payload.
std::string message(std::string_view payload, char key = 'd') {
  const std::size_t length = payload.size() + 8;
  return octets("5941 0a000000 5250 01 01 ffffffffffffffff") +
         std::string{static_cast<char>(length & 0xff), static_cast<char>(length >> 8U), '\0', '\0'} +
         octets("00000000 00000000") + "~" + std::string(1, key) + octets("00 01") + std::string(payload);
}

const std::string kAck = octets("5941 00000000 5250");
const std::string kAskRi32 = octets("00010000 02000000 09000000 'ri32' 01000000 90eefeff");
const std::string kReplyRi32 = octets("00010000 01000000 01000000 90eefeff");

TEST(Port, AnswersCallsAndConfirmsThemOnTcp) {
  const auto port = open_probe();
  const RawPeer peer = greeted(*port);
  for (int i = 0; i < 3; ++i) {
    peer.send(message(kAskRi32));
    EXPECT_EQ(shown(peer.receive(kReplyRi32.size() + 8)), shown(kReplyRi32 + kAck));
  }
}

TEST(Port, SaysThatItTakesNoMoreConnections) {
  Events complaints;
  const auto port = open_probe(&complaints, nullptr, 1);
  const RawPeer first = greeted(*port);
  const RawPeer second(port->at());
  EXPECT_THAT(complaints.await(1)[0], HasSubstr("yarp:/probe has 1 connections, and takes no more"));
}

TEST(Port, ConfirmsNothingOnFastTcp) {
  const auto port = open_probe();
  const RawPeer peer = greeted(*port, "anon", true);
  peer.send(message(kAskRi32) + message(kAskRi32));
  EXPECT_EQ(shown(peer.receive(2 * kReplyRi32.size())), shown(kReplyRi32 + kReplyRi32));
}

TEST(Port, TakesAMessageInSeveralBlocksAndPieces) {
  const auto port = open_probe();
  const RawPeer peer = greeted(*port);
  const std::string bytes =
      octets("5941 0a000000 5250 02 01 ffffffffffffffff 08000000 18000000 00000000 00000000 7e64 00 01") + kAskRi32;
  for (const char byte : bytes) peer.send(std::string(1, byte));
  EXPECT_EQ(shown(peer.receive(kReplyRi32.size() + 8)), shown(kReplyRi32 + kAck));
}

TEST(Port, AnswersAOneWayMethodWithAnAcknowledgementOnly) {
  Events calls;
  const auto port = open_probe(nullptr, &calls);
  const RawPeer peer = greeted(*port);
  const std::string tell = octets("00010000 02000000 09000000 'tell' 04000000 02000000 'hi'");
  peer.send(message(tell, 'D'));
  EXPECT_EQ(shown(peer.receive(8)), shown(kAck));
  EXPECT_EQ(calls.await(1)[0], R"(tell{"text":"hi"})");
  peer.send(message(tell, 'd'));
  EXPECT_EQ(shown(peer.receive(24)), shown(octets("00010000 01000000 09000000 'done'") + kAck));
}

TEST(Port, NeverSendsWhatAGeneratedClientHangsOn) {
  Events complaints;
  const auto port = open_probe(&complaints);
  struct Case {
    const char* what;
    std::string request;
    std::string reply;  // empty: closed before any byte
  };
  const std::vector<Case> cases = {
      {"an unknown method", octets("00010000 01000000 09000000 'nope'"), octets("09010000 01000000 'fail'") + kAck},
      {"a bool that has no result", octets("00010000 02000000 04000000 05000000 'rbool' 09000000 6f6b0000"),
       octets("00010000 01000000 09000000 'fail'") + kAck},
      {"nothing that has no result",
       octets("00010000 04000000 09000000 'two' 00 09000000 'args' 01000000 01000000 04000000 01000000 'x'"),
       octets("00010000 00000000") + kAck},
      {"a text that has no result", octets("00010000 02000000 04000000 07000000 'rstring' 04000000 06000000 'refuse'"),
       ""},
      {"a number that has no result", octets("00010000 02000000 09000000 'ri64' 01000000 01000000"), ""},
      {"a known method called otherwise", octets("00010000 01000000 09000000 'ri32'"), ""},
      {"a known method without result called otherwise", octets("00010000 02000000 09000000 'two' 00 09000000 'args'"),
       octets("09010000 01000000 'fail'") + kAck},
      {"a known bool called otherwise", octets("00010000 01000000 04000000 05000000 'rbool'"),
       octets("09010000 01000000 'fail'") + kAck},
      {"a method that cannot be carried", octets("00010000 01000000 09000000 'rset'"), ""},
      {"what only services of YARP 4 are asked", octets("04010000 01000000 18000000 'getRemoteProtocolVersion'"),
       octets("09010000 01000000 'fail'") + kAck},
  };
  for (const Case& each : cases) {
    const RawPeer peer = greeted(*port);
    peer.send(message(each.request));
    EXPECT_EQ(shown(each.reply.empty() ? peer.receive_rest() : peer.receive(each.reply.size())), shown(each.reply))
        << each.what;
  }
  EXPECT_THAT(complaints.await(1)[0], HasSubstr("the robot refuses"));
}

TEST(Port, TellsItsVersionWhereThatIsAsked) {
  PortOptions options;
  options.name = "/probe";
  options.version = Version::kYarp4;
  const auto port = Port::open(std::move(options), {.service = test::probe_service(nullptr)});
  ASSERT_TRUE(port) << to_string(port.error());
  const RawPeer peer = greeted(**port);
  peer.send(message(octets("04010000 01000000 18000000 'getRemoteProtocolVersion'")));
  const std::string version = octets("00010000 01000000 0000 0400 0000 0000") + kAck;
  EXPECT_EQ(shown(peer.receive(version.size())), shown(version));
}

TEST(Port, TellsWhatItHas) {
  const auto port = open_probe();
  const RawPeer peer = greeted(*port);
  peer.send(message(octets("00010000 01000000 09000000 'help'")));
  EXPECT_THAT(peer.receive(60), HasSubstr("*** Available commands:"));
  const RawPeer other = greeted(*port);
  other.send(message(octets("00010000 02000000 09000000 'help' 09000000 'ri32'")));
  EXPECT_THAT(other.receive(47), HasSubstr("ri32("));
}

TEST(Port, SpeaksTheTextDialogueOfTheTools) {
  const auto port = open_probe();
  const RawPeer peer(port->at());
  const std::string at = std::to_string(port->at().port);
  peer.send("CONNACK admin\r\n");
  EXPECT_EQ(peer.receive_line(), "Welcome admin\r\n");
  const auto ask = [&](const std::string& line) {
    peer.send(line);
    return peer.receive_until("<ACK>\r\n");
  };
  EXPECT_EQ(ask("*\r\n"), "This is /probe at tcp://127.0.0.1:" + at +
                              "/\r\nThere are no outgoing connections\r\n"
                              "There is an input connection from admin to /probe using text_ack\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[ver]\r\n"), "[ver] 1 2 3\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[list] [out]\r\n"), "\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[list] [in]\r\n"), "admin\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[list] [in] \"admin\"\r\n"), "(from admin) (to \"/probe\") (carrier text_ack)\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[add] \"tcp://y\"\r\n"), "-1 \"Outputs not allowed\\r\\n\"\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[del] \"/y\"\r\n"),
            "-1 \"Could not find an outgoing connection to /y\\r\\nCould not find an incoming connection from "
            "/y\\r\\n\"\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[prop] [get]\r\n"), "\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[prop] [set] \"k\" \"v\"\r\n"), "[ok]\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[prop] [get] \"k\"\r\n"), "v\r\n<ACK>\r\n");
  EXPECT_THAT(ask("a\r\n[prop] [get] \"/probe\"\r\n"),
              HasSubstr("(port ((is_input 1) (is_output 0) (is_rpc 1) (type \"\")))"));
  EXPECT_EQ(ask("a\r\n[atch] [in] x\r\n"),
            "[fail] \"Portmonitor carrier modifier cannot be find or it is not enabled in YARP!\"\r\n<ACK>\r\n");
  EXPECT_EQ(ask("a\r\n[what]\r\n"), "[fail] \"send [help] for list of valid commands\"\r\n<ACK>\r\n");
  EXPECT_EQ(ask("d\r\nri32 1\r\n"), "[fail]\r\n<ACK>\r\n");
  EXPECT_THAT(ask("bogus\r\n"), StartsWith("Port command not understood."));
  EXPECT_EQ(ask("q\r\n"), "<ACK>\r\n");
  EXPECT_EQ(peer.receive_rest(), "");
}

TEST(Port, AnswersAdministrationInOctetsToo) {
  const auto port = open_probe();
  const RawPeer peer = greeted(*port);
  peer.send(message(octets("09010000 01000000 'ver' 00"), 'a'));
  EXPECT_EQ(shown(peer.receive(48)),
            shown(octets("00010000 04000000 09000000 'ver' 00 01000000 01000000 01000000 02000000 01000000 03000000") +
                  kAck));
}

TEST(Port, EndsAConnectionThatSaysSo) {
  const auto port = open_probe();
  const RawPeer peer = greeted(*port);
  peer.send(octets("5941 0a000000 5250 01 01 ffffffffffffffff 0a000000 00000000 02000000 7e00 0001 7100"));
  EXPECT_EQ(shown(peer.receive_rest()), shown(kAck));
}

TEST(Port, RefusesAForeignCarrierByItsName) {
  Events complaints;
  const auto port = open_probe(&complaints);
  const auto refused = [&](const std::string& hello) {
    const RawPeer peer(port->at());
    peer.send(hello);
    return peer.receive_rest();
  };
  EXPECT_THAT(refused(octets("5941 611e0000 5250")), StartsWith("* Error. Protocol not found.\r\n"));
  EXPECT_THAT(refused("GET / HTTP/1.1\r\n\r\n"), StartsWith("* Error. Protocol not found.\r\n"));
  EXPECT_THAT(refused("HUMANITY"), StartsWith("* Error. Protocol not found.\r\n"));
  const auto said = complaints.await(3);
  EXPECT_THAT(said[0], HasSubstr("carrier udp;"));
  EXPECT_THAT(said[1], HasSubstr("carrier http;"));
  EXPECT_THAT(said[2], HasSubstr("carrier \"HUMANITY\";"));
}

TEST(Port, ServesOthersWhateverAPeerDoes) {
  Events complaints;
  const auto port = open_probe(&complaints);
  const std::vector<std::pair<std::string, std::string>> hostile = {
      {"a name of a gigabyte", octets("5941 e41e0000 5250 00000040")},
      {"a name of negative length", octets("5941 e41e0000 5250 ffffffff")},
      {"no mark where one is due", octets("5941 e41e0000 5250 02000000 'a' 00") + std::string(64, 'x')},
      {"a message of two gigabytes",
       octets("5941 e41e0000 5250 02000000 'a' 00 5941 0a000000 5250 01 01 ffffffffffffffff ffffff7f 00000000")},
      {"blocks that add up to too much",
       octets("5941 e41e0000 5250 02000000 'a' 00 5941 0a000000 5250 02 00 ffffffffffffffff 00000001 00000001")},
      {"a message without a command",
       octets("5941 e41e0000 5250 02000000 'a' 00 5941 0a000000 5250 00 00 ffffffffffffffff")},
      {"a command longer than its message", octets("5941 e41e0000 5250 02000000 'a' 00 5941 0a000000 5250 01 01 "
                                                   "ffffffffffffffff 08000000 00000000 ff000000 7e00 0001")},
      {"an endless line", "CONNACK " + std::string(5000, 'a')},
  };
  for (const auto& [what, bytes] : hostile) {
    const RawPeer peer(port->at());
    peer.send(bytes);
    (void)peer.receive_rest();  // closed
  }
  EXPECT_EQ(complaints.await(hostile.size()).size(), hostile.size());
  // Those who leave in the middle are nobody's fault.
  for (const std::string& half :
       {octets("5941"), octets("5941 e41e0000 5250 05000000 'ab'"), std::string("CONNACK ad")}) {
    RawPeer peer(port->at());
    peer.send(half);
    peer.close();
  }
  const RawPeer peer = greeted(*port);
  peer.send(message(kAskRi32));
  EXPECT_EQ(shown(peer.receive(kReplyRi32.size() + 8)), shown(kReplyRi32 + kAck));
}

TEST(Port, BoundsItsConnections) {
  const auto port = open_probe(nullptr, nullptr, 4);
  std::vector<RawPeer> peers;
  for (int i = 0; i < 4; ++i) peers.push_back(greeted(*port));
  const RawPeer fifth(port->at());
  EXPECT_EQ(fifth.receive_rest(), "");
  EXPECT_EQ(port->counters().refused, 1U);
  peers[0].send(message(kAskRi32));
  EXPECT_EQ(peers[0].receive(kReplyRi32.size()).size(), kReplyRi32.size());
}

TEST(Port, LetsANewConnectionOfTheSamePortReplaceTheFirst) {
  const auto port = open_probe();
  const RawPeer first = greeted(*port, "/mission/rpc:o");
  const RawPeer tool = greeted(*port, "tool");
  const RawPeer same_tool = greeted(*port, "tool");
  const RawPeer second = greeted(*port, "/mission/rpc:o");
  EXPECT_EQ(first.receive_rest(), "");
  for (const RawPeer* peer : {&tool, &same_tool, &second}) {
    peer->send(message(kAskRi32));
    EXPECT_EQ(peer->receive(kReplyRi32.size()).size(), kReplyRi32.size());
  }
}

TEST(Port, AnswersOthersWhileOneCallLasts) {
  std::mutex mutex;
  std::vector<rpc::Reply> held;
  class Later final : public rpc::Service {
   public:
    Later(std::mutex& lock, std::vector<rpc::Reply>& replies) : mutex_(lock), held_(replies) {}
    const idl::Service& interface() const override { return *interface_; }
    rpc::Outcome call(const idl::Method&, const Value&) override { return Value(); }
    void serve(const idl::Method&, const Value&, const rpc::Reply& reply) override {
      const std::lock_guard lock(mutex_);
      held_.push_back(reply);
    }

   private:
    const idl::ServicePtr interface_ = test::schema().service("Probe");
    std::mutex& mutex_;
    std::vector<rpc::Reply>& held_;
  };
  auto opened = Port::open({.name = "/later"}, {.service = std::make_shared<Later>(mutex, held)});
  ASSERT_TRUE(opened);
  const RawPeer first = greeted(**opened);
  const RawPeer second = greeted(**opened);
  first.send(message(kAskRi32));
  ASSERT_TRUE(test::becomes_true([&] {
    const std::lock_guard lock(mutex);
    return held.size() == 1;
  }));
  second.send(message(kAskRi32));
  ASSERT_TRUE(test::becomes_true([&] {
    const std::lock_guard lock(mutex);
    return held.size() == 2;
  }));
  held[1].give(Value(-70000));
  EXPECT_EQ(shown(second.receive(kReplyRi32.size() + 8)), shown(kReplyRi32 + kAck));
  held[0].give_last(Value(-70000));
  EXPECT_EQ(shown(first.receive_rest()), shown(kReplyRi32 + kAck));
}

TEST(Port, RefusesOtherMachinesUnlessItIsAllowed) {
  const auto port = Port::open({.name = "/x", .listen = {"0.0.0.0", 0}}, {});
  ASSERT_FALSE(port);
  EXPECT_EQ(port.error().code, "rpc.not-loopback");
}

// ---- as a client

struct Asked {
  std::unique_ptr<rpc::AsyncClient> client;
  rpc::Outcome call(std::string_view method, Value arguments = Map(),
                    std::chrono::milliseconds within = test::kPatience) {
    return rpc::call_and_wait(*client, method, std::move(arguments), std::chrono::steady_clock::now() + within);
  }
};

Asked client_of(const HostPort& at, Carrier carrier = Carrier::kTcp,
                const idl::ServicePtr& interface = test::schema().service("Probe")) {
  PortAddress address;
  address.name = "/probe";
  address.direct = at;
  address.carrier = carrier;
  auto line = std::make_unique<PortLine>(address, *interface, rpc::ClientOptions{.target = "probe"}, nullptr);
  auto client = rpc::AsyncClient::over(std::move(line), interface);
  EXPECT_TRUE(client);
  return {std::move(*client)};
}

TEST(PortLine, CallsAPort) {
  const auto port = open_probe();
  for (const Carrier carrier : {Carrier::kTcp, Carrier::kFastTcp}) {
    Asked asked = client_of(port->at(), carrier);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(asked.call("ri32", Map{{"x", i}}), rpc::Outcome(Value(i)));
    EXPECT_EQ(to_json(*asked.call("rstruct", Map{{"a", 4}})), R"({"a":4,"s":"in"})");
    EXPECT_EQ(asked.call("tell", Map{{"text", "hi"}}), rpc::Outcome(Value()));
    EXPECT_EQ(asked.call("rbool", Map{{"x", true}}), rpc::Outcome(Value(false))) << "a failure of that type";
    EXPECT_EQ(asked.client->counters().connections, 1U);
    const auto failed = asked.call("rstring", Map{{"x", "refuse"}});
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().kind, rpc::CallErrorKind::kUnreachable);
    EXPECT_EQ(asked.call("ri32", Map{{"x", 1}}), rpc::Outcome(Value(1))) << "connected anew";
    const auto set = asked.call("rset");
    ASSERT_FALSE(set);
    EXPECT_THAT(set.error().message, HasSubstr("cannot be called over YARP"));
  }
}

// A server's side of a call: the greeting, which is answered, and the request.
std::string take_request(const RawPeer& peer, std::size_t bytes) {
  EXPECT_EQ(shown(peer.receive(8)), shown(octets("5941 e41e0000 5250")));
  const std::string length = peer.receive(4);
  const std::string name = peer.receive(static_cast<unsigned char>(length[0]));
  EXPECT_THAT(name, StartsWith("sentree_probe_"));
  EXPECT_EQ(name.back(), '\0');
  peer.send(octets("5941 12270000 5250"));
  return peer.receive(bytes);
}

TEST(PortLine, SendsWhatWasCaptured) {
  const test::RawServer server;
  Asked asked = client_of(server.at);
  std::promise<rpc::Outcome> made;
  asked.client->call("ri32", Map{{"x", -70000}}, rpc::kNoDeadline,
                     [&](rpc::Outcome out) { made.set_value(std::move(out)); });
  const RawPeer peer = server.accept();
  EXPECT_EQ(shown(take_request(peer, message(kAskRi32).size())), shown(message(kAskRi32)));
  // The reply comes in pieces, the acknowledgement with the next.
  peer.send(kReplyRi32.substr(0, 5));
  peer.send(kReplyRi32.substr(5));
  EXPECT_EQ(made.get_future().get(), rpc::Outcome(Value(-70000)));
  peer.send(kAck.substr(0, 3));
  peer.send(kAck.substr(3));
}

TEST(PortLine, AsksWhetherAPortIsThereAsToolsDoIt) {
  const test::RawServer server;
  const auto schema = idl::Schema::load("service Asked { void sentree_ping() }", "asked.thrift");
  ASSERT_TRUE(schema.value);
  Asked asked = client_of(server.at, Carrier::kTcp, schema.value->service("Asked"));
  std::promise<rpc::Outcome> made;
  asked.client->call("sentree_ping", Map{}, rpc::kNoDeadline,
                     [&](rpc::Outcome out) { made.set_value(std::move(out)); });
  const RawPeer peer = server.accept();
  const std::string request = octets(
      "5941 0a000000 5250 01 01 ffffffffffffffff 16000000 00000000 02000000 7e000001 'a' 00 09010000 01000000 'ver' "
      "00");
  EXPECT_EQ(shown(take_request(peer, request.size())), shown(request));
  peer.send(octets("00010000 04000000 09000000 'ver' 00 01000000 01000000 01000000 02000000 01000000 03000000") + kAck);
  EXPECT_EQ(made.get_future().get(), rpc::Outcome(Value()));
}

// What a server may answer, and what the caller is told.
TEST(PortLine, SurvivesWhateverAServerAnswers) {
  struct Case {
    const char* what;
    std::string reply;
    rpc::CallErrorKind kind;
    std::string message;
    bool closes = false;
  };
  const std::vector<Case> cases = {
      {"fails", octets("09010000 01000000 'fail'") + kAck, rpc::CallErrorKind::kProtocol, "[fail]"},
      {"acknowledges only", kAck, rpc::CallErrorKind::kProtocol, "gave no reply"},
      {"closes", "", rpc::CallErrorKind::kUnreachable, "closed", true},
      {"half a reply", kReplyRi32.substr(0, 9), rpc::CallErrorKind::kUnreachable, "closed", true},
      {"garbage", "garbage and more", rpc::CallErrorKind::kProtocol, "broke the protocol"},
      {"an endless list", octets("00010000 ffffff7f"), rpc::CallErrorKind::kProtocol, "broke the protocol"},
      {"another type", octets("00010000 01000000 0c000000 01000000 00") + kAck, rpc::CallErrorKind::kProtocol,
       "interface"},
  };
  for (const Case& each : cases) {
    const test::RawServer server;
    Asked asked = client_of(server.at);
    std::promise<rpc::Outcome> made;
    asked.client->call("ri32", Map{{"x", 1}}, rpc::kNoDeadline,
                       [&](rpc::Outcome out) { made.set_value(std::move(out)); });
    RawPeer peer = server.accept();
    (void)take_request(peer, message(kAskRi32).size());
    peer.send(each.reply);
    if (each.closes) peer.close();
    const rpc::Outcome out = made.get_future().get();
    ASSERT_FALSE(out) << each.what;
    EXPECT_EQ(out.error().kind, each.kind) << each.what << ": " << out.error().message;
    EXPECT_THAT(out.error().message, HasSubstr(each.closes ? "unreachable" : each.message)) << each.what;
  }
}

TEST(PortLine, GivesUpAConnectionThatAnswersTooLate) {
  const test::RawServer server;
  Asked asked = client_of(server.at);
  std::promise<rpc::Outcome> made;
  asked.client->call("ri32", Map{{"x", 1}}, std::chrono::steady_clock::now() + std::chrono::milliseconds(100),
                     [&](rpc::Outcome out) { made.set_value(std::move(out)); });
  const RawPeer peer = server.accept();
  (void)take_request(peer, message(kAskRi32).size());
  const rpc::Outcome out = made.get_future().get();
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, rpc::CallErrorKind::kLate);
  // A reply that still comes belongs to nobody: the next call has a connection of its own.
  std::promise<rpc::Outcome> next;
  asked.client->call("ri32", Map{{"x", 2}}, rpc::kNoDeadline, [&](rpc::Outcome o) { next.set_value(std::move(o)); });
  const RawPeer again = server.accept();
  (void)take_request(again, message(kAskRi32).size());
  again.send(octets("00010000 01000000 01000000 02000000") + kAck);
  EXPECT_EQ(next.get_future().get(), rpc::Outcome(Value(2)));
}

}  // namespace
}  // namespace sentree::yarp
