#include "sentree/http/http.h"

#include <gtest/gtest.h>

#include <string>

namespace sentree::http {
namespace {

Result<Server> echo(Limits limits = {}) {
  return Server::listen(
      "127.0.0.1", 0,
      [](const Request& request) {
        return Response{200, "text/plain", request.text()};
      },
      limits);
}

TEST(Http, AServerAnswersWhatAClientSends) {
  auto server = echo();
  ASSERT_TRUE(server);
  const auto answer = send(server->url() + "/a?b=c", {.method = "POST", .headers = {{"X-One", "1"}}, .body = "hello"});
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->status, 200);
  EXPECT_EQ(answer->body.substr(0, 22), "POST /a?b=c HTTP/1.1\r\n");
  EXPECT_NE(answer->body.find("X-One: 1\r\n"), std::string::npos);
  EXPECT_NE(answer->body.find("Host: 127.0.0.1:" + std::to_string(server->port()) + "\r\n"), std::string::npos);
  EXPECT_TRUE(answer->body.ends_with("\r\n\r\nhello"));
}

TEST(Http, ABodyBeyondTheBoundIsRefused) {
  auto server = echo({.body_bytes_max = 10});
  ASSERT_TRUE(server);
  const auto answer = send(server->url(), {.method = "POST", .body = std::string(11, 'x')});
  ASSERT_TRUE(answer) << answer.error().message;
  EXPECT_EQ(answer->status, 413);
}

TEST(Http, AnAnswerBeyondTheBoundIsAnError) {
  auto server = Server::listen("127.0.0.1", 0, [](const Request&) {
    return Response{200, "text/plain", std::string(1000, 'x')};
  });
  ASSERT_TRUE(server);
  const auto answer = send(server->url(), {}, {.body_bytes_max = 999});
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, "http.too-large");
}

TEST(Http, AConnectionBeyondTheBoundIsClosed) {
  auto server = Server::listen("127.0.0.1", 0, [](const Request&) { return Response(); }, {.connections_max = 0});
  ASSERT_TRUE(server);
  const auto answer = send(server->url(), {});
  ASSERT_FALSE(answer);
  EXPECT_TRUE(answer.error().code == "http.bad-answer" || answer.error().code == "http.unreachable")
      << answer.error().message;
}

TEST(Http, RefusesAddressesThatOthersCanReach) {
  const auto server = Server::listen("0.0.0.0", 0, [](const Request&) { return Response(); });
  ASSERT_FALSE(server);
  EXPECT_EQ(server.error().code, "http.not-loopback");
}

TEST(Http, NamesWhatIsWrongWithAnAddress) {
  EXPECT_EQ(send("ftp://x", {}).error().code, "http.bad-url");
  EXPECT_EQ(send("http://127.0.0.1:99999/", {}).error().code, "http.bad-url");
  EXPECT_EQ(send("http://127.0.0.1/a b", {}).error().code, "http.bad-url");
  EXPECT_EQ(send("http://[::1", {}).error().code, "http.bad-url");
  EXPECT_EQ(send("http://[::1]x/", {}).error().code, "http.bad-url");
  std::string gone;
  {
    auto server = echo();
    ASSERT_TRUE(server);
    gone = server->url();
  }
  EXPECT_EQ(send(gone, {}).error().code, "http.unreachable");
}

TEST(Http, APortIsTakenOnce) {
  auto first = echo();
  ASSERT_TRUE(first);
  const auto second = Server::listen("127.0.0.1", first->port(), [](const Request&) { return Response(); });
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, "http.port-taken");
}

}  // namespace
}  // namespace sentree::http
