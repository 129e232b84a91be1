#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>
#include <future>
#include <thread>
#include <vector>

#include "sentree/rpc/certificates.h"
#include "sentree/rpc/detail/test_peers.h"
#include "sentree/rpc/stream.h"

namespace sentree::rpc {
namespace {

using namespace std::chrono_literals;
using test::Folder;
using test::in;
using test::Robot;
using ::testing::AllOf;
using ::testing::HasSubstr;

// Certificates as docs/how-to/certificates.md makes them.
class Tls : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new Folder;
    for (const char* authority : {"ours", "theirs"}) {
      run(std::string("req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 30 -subj /CN=") +
          authority + " -keyout " + file(authority, "key") + " -out " + file(authority, "pem"));
    }
    issue("server", "ours", "DNS:localhost,IP:127.0.0.1");
    issue("client", "ours", "DNS:client");
    issue("elsewhere", "ours", "DNS:elsewhere");
    issue("stranger", "theirs", "DNS:localhost,IP:127.0.0.1");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static std::string file(const std::string& name, const char* kind) { return folder_->file(name + "." + kind); }
  static void run(const std::string& arguments) {
    ASSERT_EQ(std::system(("openssl " + arguments + " 2>/dev/null").c_str()), 0) << arguments;
  }
  static void issue(const std::string& name, const std::string& authority, const std::string& names,
                    const std::string& time = "-days 30") {
    run("req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj /CN=" + name +
        " -addext subjectAltName=" + names + " -keyout " + file(name, "key") + " -out " + file(name, "csr"));
    run("x509 -req " + time + " -copy_extensions copy -in " + file(name, "csr") + " -CA " + file(authority, "pem") +
        " -CAkey " + file(authority, "key") + " -CAcreateserial -out " + file(name, "pem"));
  }
  static TlsFiles files(const std::string& name, const std::string& authority = "ours") {
    return {file(authority, "pem"), file(name, "pem"), file(name, "key")};
  }

  std::unique_ptr<Server> start(TlsFiles tls) {
    return test::serve(*Address::parse("tls://127.0.0.1:0"), robot_,
                       {.tls = std::move(tls), .message_time_max = 2000ms});
  }
  static Outcome ping(const Server& server, TlsFiles tls) {
    return test::connect(server.address(), {.tls = std::move(tls)})->call("ping", {}, in(10s));
  }

  static Folder* folder_;
  std::shared_ptr<Robot> robot_ = std::make_shared<Robot>();
};
Folder* Tls::folder_ = nullptr;

TEST_F(Tls, CarriesCallsBetweenThoseWhoTrustEachOther) {
  const auto server = start(files("server"));
  const auto client = test::connect(server->address(), {.tls = files("client")});
  const std::string text(100000, 'x');
  for (int i = 0; i < 5; ++i) EXPECT_EQ(client->call("echo", Map{{"text", text}}, in(10s)), Outcome(Value(text)));
  EXPECT_EQ(client->counters().connections, 1U);
}

TEST_F(Tls, ADeadlineHolds) {
  const auto server = start(files("server"));
  const auto client = test::connect(server->address(), {.tls = files("client")});
  ASSERT_TRUE(client->call("ping", {}, in(10s)));
  EXPECT_EQ(client->call("wait", {}, in(50ms)).error().kind, CallErrorKind::kLate);
  robot_->release();
  EXPECT_TRUE(client->call("ping", {}, in(10s)));
  EXPECT_EQ(client->counters().late_replies, 1U);
}

TEST_F(Tls, CarriesCallsThatNobodyWaitsForAndAnswersThatComeLater) {
  const auto later = std::make_shared<test::LaterRobot>();
  const auto server = test::serve(*Address::parse("tls://127.0.0.1:0"), later, {.tls = files("server")});
  const auto client = test::make_client(server->address(), {.tls = files("client")});
  const std::string text(1000000, 'x');
  for (std::size_t i = 1; i <= 5; ++i) {
    auto outcome = test::begin(*client, "echo", Map{{"text", text}}, in(10s));
    const auto held = later->take(i);
    held.reply.give(held.answer);
    EXPECT_EQ(outcome.get(), Outcome(Value(text)));
  }
  EXPECT_EQ(client->counters().connections, 1U);
  EXPECT_EQ(test::call(*client, "echo", Map{{"text", "x"}}, in(50ms)).error().kind, CallErrorKind::kLate);
}

TEST_F(Tls, AClientOfAnotherAuthorityIsRefused) {
  const auto server = start(files("server"));
  const Outcome out = ping(*server, files("stranger"));
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, CallErrorKind::kUnreachable) << out.error().message;
  EXPECT_TRUE(ping(*server, files("client")));
}

TEST_F(Tls, AServerOfAnotherAuthorityIsRefused) {
  const auto server = start(files("stranger"));
  const Outcome out = ping(*server, files("client"));
  ASSERT_FALSE(out);
  EXPECT_THAT(out.error().message, HasSubstr("certificate refused"));
}

TEST_F(Tls, AServerUnderAnotherNameIsRefused) {
  const auto server = start(files("elsewhere"));
  const Outcome out = ping(*server, files("client"));
  ASSERT_FALSE(out);
  EXPECT_THAT(out.error().message, HasSubstr("certificate refused"));
}

TEST_F(Tls, APlainPeerIsAnErrorOnEitherSide) {
  const auto server = start(files("server"));
  Address plain = server->address();
  plain.kind = Address::Kind::kTcp;
  EXPECT_FALSE(test::connect(plain)->call("ping", {}, in(10s)));
  const auto open = test::serve(*Address::parse("tcp://127.0.0.1:0"), robot_, {.message_time_max = 100ms});
  Address secure = open->address();
  secure.kind = Address::Kind::kTls;
  EXPECT_FALSE(test::connect(secure, {.tls = files("client")})->call("ping", {}, in(10s)));
}

TEST_F(Tls, MissingAndWrongFilesAreNamed) {
  const auto message = [&](TlsFiles tls) {
    const auto server = Server::start(*Address::parse("tls://127.0.0.1:0"), {}, {.tls = std::move(tls)});
    return server ? std::string() : server.error().message;
  };
  EXPECT_THAT(message({}), HasSubstr("there is no authority"));
  EXPECT_THAT(message({file("ours", "pem"), "/no/such.pem", file("server", "key")}),
              HasSubstr("the certificate \"/no/such.pem\" cannot be used"));
  EXPECT_THAT(message({file("ours", "pem"), file("server", "pem"), file("client", "key")}), HasSubstr("the key"));
}

// What was issued for another time.
TEST_F(Tls, AServerWithoutAValidCertificateDoesNotStart) {
  issue("expired", "ours", "IP:127.0.0.1", "-days -1");
  const auto message = [&](const TlsFiles& tls) {
    const auto server = Server::start(*Address::parse("tls://127.0.0.1:0"), {}, {.tls = tls});
    return server ? std::string("started") : server.error().message;
  };
  EXPECT_THAT(message(files("expired")),
              AllOf(HasSubstr("expired.pem\" has expired at "), HasSubstr("issue a new one")));
  std::ofstream(file("ca", "cnf")) << "[ca]\ndefault_ca=d\n[d]\ndatabase=" << file("ca", "db")
                                   << "\nnew_certs_dir=" << folder_->file("")
                                   << "\nrand_serial=yes\npolicy=p\ndefault_md=sha256\n[p]\ncommonName=supplied\n";
  std::ofstream(file("ca", "db"));
  run("ca -batch -notext -startdate 21000101000000Z -enddate 21010101000000Z -config " + file("ca", "cnf") + " -cert " +
      file("ours", "pem") + " -keyfile " + file("ours", "key") + " -in " + file("server", "csr") + " -out " +
      file("early", "pem"));
  EXPECT_THAT(message({file("ours", "pem"), file("early", "pem"), file("server", "key")}),
              HasSubstr("early.pem\" is not valid before Jan  1 00:00:00 2100 GMT"));
  EXPECT_EQ(message(files("server")), "started");
}

// Neither a deadline nor idleness makes room here.
TEST_F(Tls, PeersThatSayNothingKeepOutNobody) {
  const auto server = test::serve(
      *Address::parse("tls://127.0.0.1:0"), robot_,
      {.connections_max = 4, .tls = files("server"), .message_time_max = 10min, .idle_before_eviction = 10min});
  const auto first = test::connect(server->address(), {.tls = files("client")});
  ASSERT_TRUE(first->call("ping", {}, in(10s)));
  Address plain = server->address();
  plain.kind = Address::Kind::kTcp;
  Resolver resolver;
  std::vector<std::unique_ptr<Stream>> silent;
  for (std::size_t i = 1; i <= 20; ++i) {
    silent.push_back(connect_to(plain, resolver, nullptr, in(10s)).stream);
    ASSERT_NE(silent.back(), nullptr);
    while (server->counters().connections < i + 1) std::this_thread::yield();
  }
  const auto second = test::connect(server->address(), {.tls = files("client")});
  EXPECT_TRUE(second->call("ping", {}, in(10s)));
  EXPECT_TRUE(first->call("ping", {}, in(10s)));
  EXPECT_EQ(first->counters().connections, 1U) << "who had come before is not sent away";
  EXPECT_EQ(server->counters().refused, 0U);
}

TEST_F(Tls, AHandshakeHasADeadline) {
  std::promise<std::string> complaint;
  const auto server =
      test::serve(*Address::parse("tls://127.0.0.1:0"), robot_,
                  {.tls = files("server"), .message_time_max = 50ms, .on_peer_error = [&](const auto& why) {
                     complaint.set_value(why);
                   }});
  Address plain = server->address();
  plain.kind = Address::Kind::kTcp;
  Resolver resolver;
  const auto silent = connect_to(plain, resolver, nullptr, in(10s));
  EXPECT_THAT(complaint.get_future().get(), HasSubstr("TLS: the handshake took too long"));
}

TEST_F(Tls, FilesAreExaminedAsAPeerWould) {
  const auto good = examine(files("server"));
  ASSERT_TRUE(good) << good.error().message;
  EXPECT_EQ(good->names, "DNS:localhost, IP Address:127.0.0.1");
  EXPECT_GE(good->days_left, 28);
  EXPECT_LE(good->days_left, 30);

  const auto refused = [](const TlsFiles& tls) {
    const auto examined = examine(tls);
    return examined ? std::string("accepted") : examined.error().message;
  };
  EXPECT_THAT(refused(files("stranger")), HasSubstr("stranger.pem\" will be refused: unable to get local issuer"));
  EXPECT_THAT(refused({file("ours", "pem"), file("server", "pem"), file("client", "key")}),
              HasSubstr("client.key\" cannot be used: key values mismatch"));
  EXPECT_THAT(refused({file("ours", "pem"), file("server", "pem"), file("nobody", "key")}),
              HasSubstr("nobody.key\" cannot be used: No such file"));
  EXPECT_THAT(refused({file("ours", "pem"), "", file("client", "key")}),
              HasSubstr("there is no certificate (commands take them from SENTREE_TLS_AUTHORITY"));
}

}  // namespace
}  // namespace sentree::rpc
