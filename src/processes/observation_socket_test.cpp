#include "sentree/processes/detail/observation_socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/base/temporary_folder.h"

namespace sentree::processes {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class ObservationSocket : public testing::Test {
 protected:
  ObservationSocket() {
    auto inbox = ObservationInbox::open(
        path(), [this](Message message) { taken_.push_back(message.name); },
        [this](const std::string& what) { problems_.push_back(what); });
    EXPECT_TRUE(inbox.has_value());
    inbox_ = std::move(*inbox);
  }
  std::string path() const { return (folder_.path() / "observations").string(); }
  static Message named(std::string name) {
    Message message;
    message.name = std::move(name);
    return message;
  }

  const TemporaryFolder folder_{"test"};
  // Written by whoever drains, one at a time; read after `close`.
  std::vector<std::string> taken_;
  std::vector<std::string> problems_;
  std::unique_ptr<ObservationInbox> inbox_;
};

// The senders pass a token, so that each message is a cause of the next.
TEST_F(ObservationSocket, KeepsTheOrderAmongAllWhoSend) {
  constexpr int kSenders = 4;
  constexpr int kMessages = 2000;
  std::atomic<int> token = 0;
  std::vector<std::thread> senders;
  for (int i = 0; i < kSenders; ++i) {
    senders.emplace_back([&, i] {
      const auto outbox = ObservationOutbox::connect(path());
      ASSERT_NE(outbox, nullptr);
      for (int now = token; now < kMessages; now = token) {
        if (now % kSenders != i) {
          token.wait(now);
          continue;
        }
        EXPECT_TRUE(outbox->send(named(std::to_string(now))));
        token = now + 1;
        token.notify_all();
      }
    });
  }
  for (std::thread& sender : senders) sender.join();
  inbox_->close();
  ASSERT_EQ(taken_.size(), kMessages);
  for (int i = 0; i < kMessages; ++i) ASSERT_EQ(taken_[i], std::to_string(i));
}

TEST_F(ObservationSocket, DrainingHandsOnWhatWasSentBefore) {
  const auto outbox = ObservationOutbox::connect(path());
  ASSERT_NE(outbox, nullptr);
  std::size_t sent = 0;
  for (int round = 0; round < 200; ++round) {
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(outbox->send(named("message")));
      ++sent;
    }
    inbox_->drain();
    ASSERT_EQ(taken_.size(), sent);
  }
}

TEST_F(ObservationSocket, KeepsEverythingInAMessage) {
  Message full;
  full.kind = MessageKind::kReply;
  full.source = "GoToKitchen";
  full.target = "navigation";
  full.name = "navigation.stopNavigation.reply";
  full.call = (std::uint64_t{77} << 40U) + 5;
  full.stamp = 9;
  full.data = Map{{"args", Map{{"goal_id", 3}}}, {"result", "OK"}};
  std::vector<Message> taken;
  const auto inbox = ObservationInbox::open(
      path() + "2", [&](Message message) { taken.push_back(std::move(message)); }, [](const std::string&) {});
  ASSERT_TRUE(inbox);
  ASSERT_TRUE(ObservationOutbox::connect(path() + "2")->send(full));
  (*inbox)->close();
  EXPECT_THAT(taken, ElementsAre(full));
}

TEST_F(ObservationSocket, AMessageHasABound) {
  const auto outbox = ObservationOutbox::connect(path());
  ASSERT_NE(outbox, nullptr);
  Message large = named("large");
  large.data = Map{{"text", std::string(kObservationBytesMax, 'x')}};
  EXPECT_FALSE(outbox->send(large));
  EXPECT_TRUE(outbox->send(named("small")));
  inbox_->close();
  EXPECT_THAT(taken_, ElementsAre("small"));
}

TEST_F(ObservationSocket, GarbageCostsOneReport) {
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  sockaddr_un at{};
  at.sun_family = AF_UNIX;
  std::memcpy(at.sun_path, path().c_str(), path().size() + 1);
  const std::string garbage = "not an observation";
  ASSERT_EQ(::sendto(socket, garbage.data(), garbage.size(), 0, reinterpret_cast<const sockaddr*>(&at), sizeof at),
            static_cast<ssize_t>(garbage.size()));
  ::close(socket);
  EXPECT_TRUE(ObservationOutbox::connect(path())->send(named("next")));
  inbox_->close();
  EXPECT_THAT(problems_, ElementsAre(HasSubstr("cannot be read")));
  EXPECT_THAT(taken_, ElementsAre("next"));
}

TEST_F(ObservationSocket, NobodyListensAfterItIsClosed) {
  const auto outbox = ObservationOutbox::connect(path());
  ASSERT_NE(outbox, nullptr);
  inbox_.reset();
  EXPECT_FALSE(outbox->send(named("too late")));
  EXPECT_EQ(ObservationOutbox::connect(path()), nullptr);
}

}  // namespace
}  // namespace sentree::processes
