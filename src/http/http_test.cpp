#include "sentree/http/http.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <ctime>
#include <string>
#include <vector>

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

// Takes every descriptor that is left, until its end.
class NoDescriptors {
 public:
  NoDescriptors() {
    getrlimit(RLIMIT_NOFILE, &before_);
    rlimit few = before_;
    few.rlim_cur = 200;
    setrlimit(RLIMIT_NOFILE, &few);
    for (int fd = open("/dev/null", O_RDONLY | O_CLOEXEC); fd >= 0; fd = open("/dev/null", O_RDONLY | O_CLOEXEC))
      taken_.push_back(fd);
  }
  ~NoDescriptors() {
    for (const int fd : taken_) close(fd);
    setrlimit(RLIMIT_NOFILE, &before_);
  }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;
  void give_back(std::size_t n) {
    for (; n > 0 && !taken_.empty(); --n) {
      close(taken_.back());
      taken_.pop_back();
    }
  }

 private:
  rlimit before_{};
  std::vector<int> taken_;
};

TEST(Http, WithoutDescriptorsNothingIsServedOrAskedAndThatIsSaid) {
  NoDescriptors none;
  const auto server = echo();
  ASSERT_FALSE(server);
  EXPECT_EQ(server.error().code, "http.exhausted");
  const auto answer = send("http://127.0.0.1:9/", {});
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, "http.unreachable");
}

TEST(Http, WhoComesWhileNoDescriptorIsLeftIsServedLaterAndCostsNoProcessorTime) {
  auto server = echo();
  ASSERT_TRUE(server);
  NoDescriptors none;
  none.give_back(1);  // for who asks
  const int asker = socket(AF_INET, SOCK_STREAM, 0);
  ASSERT_GE(asker, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(server->port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(connect(asker, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const std::string request = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
  ASSERT_EQ(::send(asker, request.data(), request.size(), 0), static_cast<ssize_t>(request.size()));
  const std::clock_t before = std::clock();
  pollfd answer{asker, POLLIN, 0};
  EXPECT_EQ(poll(&answer, 1, 1000), 0);
  EXPECT_LT(std::clock() - before, CLOCKS_PER_SEC / 4);
  none.give_back(20);
  EXPECT_EQ(poll(&answer, 1, 60'000), 1);
  close(asker);
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
  EXPECT_EQ(second.error().message, "127.0.0.1:" + std::to_string(first->port()) +
                                        " is taken: another process listens there; stop it or choose another port (0 "
                                        "takes a free one)");
}

}  // namespace
}  // namespace sentree::http
