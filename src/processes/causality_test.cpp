// Whatever the topology, the delays and the clocks of the parts: nobody who observes a run sees an effect before its
// cause.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <thread>
#include <vector>

#include "sentree/processes/remote_skill.h"
#include "sentree/runtime/stream.h"

namespace sentree::processes {

using runtime::Publisher;
using runtime::Stream;
namespace {

constexpr int kEvents = 1500;

class LocalPublisher final : public Publisher {
 public:
  explicit LocalPublisher(Stream& stream) : stream_(stream) {}
  void publish(Message message) override { stream_.publish(std::move(message)); }
  std::optional<mission::Admission> request(Message message, Stream::Decided) override {
    stream_.publish(std::move(message));
    return mission::Admission{};
  }
  std::uint64_t next_call() override { return stream_.next_call(); }

 private:
  Stream& stream_;
};

// A part that publishes what it does because of a message, and only then sends messages on: what skills and callers do.
class Part {
 public:
  Part(std::uint64_t seed, std::unique_ptr<Publisher> own, Publisher* shared, std::atomic<int>& left)
      : random_(seed), own_(std::move(own)), publisher_(shared != nullptr ? *shared : *own_), left_(left) {
    skew_ = Duration(std::uniform_int_distribution<std::int64_t>(-1'000'000'000, 1'000'000'000)(random_));
  }
  void connect(std::vector<Part*> peers) { peers_ = std::move(peers); }
  void start() {
    thread_ = std::thread([this] { work(); });
  }
  void receive(std::int64_t cause) {
    {
      const std::lock_guard lock(mutex_);
      mail_.push_back(cause);
    }
    changed_.notify_one();
  }
  void join() { thread_.join(); }

 private:
  void work() {
    for (;;) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return !mail_.empty(); });
      const std::int64_t cause = mail_.front();
      mail_.pop_front();
      lock.unlock();
      if (cause < 0) return;
      const int number = --left_;
      if (number < 0) {
        for (Part* part : peers_) part->receive(-1);
        return;
      }
      const std::int64_t id = number + 1;
      hesitate();
      Message message;
      // A request takes another way through the observer's interface than an event.
      message.kind = random_() % 2 == 0 ? MessageKind::kRequest : MessageKind::kEvent;
      message.name = "part.effect.request";
      message.time = TimePoint(skew_);
      message.data = Map{{"id", id}, {"cause", cause}};
      if (message.kind == MessageKind::kRequest) {
        ASSERT_TRUE(publisher_.request(std::move(message), {}));
      } else {
        publisher_.publish(std::move(message));
      }
      hesitate();
      for (std::size_t i = 0; i <= random_() % 2; ++i) peers_[random_() % peers_.size()]->receive(id);
    }
  }

  void hesitate() {
    for (std::uint64_t n = random_() % 4; n > 0; --n) std::this_thread::yield();
  }

  std::mt19937_64 random_;
  std::unique_ptr<Publisher> own_;
  Publisher& publisher_;
  std::atomic<int>& left_;
  Duration skew_{};
  std::vector<Part*> peers_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::int64_t> mail_;
  std::thread thread_;
};

TEST(Causality, NoEffectIsSeenBeforeItsCause) {
  const unsigned seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);

  const auto scheduler = runtime::make_real_scheduler();
  Stream stream(*scheduler);
  std::set<std::int64_t> seen{0};
  TimePoint last{};
  int effects_first = 0;
  int back_in_time = 0;
  stream.subscribe([&](const Message& message) {
    if (message.data.find("cause") == nullptr) {
      ADD_FAILURE() << "lost: " << message.name;
      return;
    }
    if (!seen.contains(*message.data.find("cause")->as_int())) ++effects_first;
    seen.insert(*message.data.find("id")->as_int());
    if (message.time < last) ++back_in_time;
    last = message.time;
  });
  std::thread running([&] { (void)scheduler->run(); });

  const auto interface = observer_interface();
  ASSERT_TRUE(interface);
  LocalPublisher local(stream);
  const std::string socket = testing::TempDir() + "causality-" + std::to_string(seed) + ".sock";
  auto server = rpc::Server::start(*rpc::Address::parse("unix:" + socket),
                                   {{"observer", make_observer_service(*interface, local)}});
  ASSERT_TRUE(server);

  std::atomic<int> left = kEvents;
  std::vector<std::unique_ptr<Part>> parts;
  const std::size_t count = 2 + random() % 5;
  for (std::size_t i = 0; i < count; ++i) {
    std::unique_ptr<Publisher> remote;
    if (random() % 3 != 0) {
      remote = *make_remote_publisher((*server)->address(), *interface, "part" + std::to_string(i),
                                      [](const std::string& problem) { ADD_FAILURE() << problem; });
    }
    Publisher* shared = remote ? nullptr : &local;
    parts.push_back(std::make_unique<Part>(random(), std::move(remote), shared, left));
  }
  std::vector<Part*> all;
  for (const auto& part : parts) all.push_back(part.get());
  for (const auto& part : parts) {
    std::vector<Part*> peers = all;
    std::shuffle(peers.begin(), peers.end(), random);
    part->connect(peers);
    part->start();
  }
  for (Part* part : all) part->receive(0);
  for (Part* part : all) part->join();

  scheduler->stop();
  running.join();
  (*server)->stop();
  stream.flush();
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(kEvents) + 1);
  EXPECT_EQ(effects_first, 0);
  EXPECT_EQ(back_in_time, 0);
}

}  // namespace
}  // namespace sentree::processes
