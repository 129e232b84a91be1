#include "sentree/studio/foxglove.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "sentree/http/detail/test_peer.h"
#include "sentree/record/reader.h"
#include "sentree/replay/recording.h"
#include "sentree/studio/detail/test_support.h"
#include "sentree/text/json.h"

namespace sentree::studio {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr const char* kProtocolV1 = "foxglove.websocket.v1";

// A client's side: what it was sent, one message after the other.
class FoxgloveClient {
 public:
  explicit FoxgloveClient(std::uint16_t port, const std::string& protocols = kProtocolV1,
                          const std::string& origin = "", int receive_buffer = 0)
      : peer_(port, receive_buffer) {
    head_ = peer_.upgrade("Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n" +
                          (protocols.empty() ? "" : "Sec-WebSocket-Protocol: " + protocols + "\r\n") +
                          (origin.empty() ? "" : "Origin: " + origin + "\r\n"));
  }
  [[nodiscard]] const std::string& head() const { return head_; }

  void send(const std::string& text) { peer_.frame(http::kLast | http::kText, text); }
  void subscribe(std::int64_t id, std::int64_t channel) {
    send(R"({"op":"subscribe","subscriptions":[{"id":)" + std::to_string(id) + R"(,"channelId":)" +
         std::to_string(channel) + "}]}");
  }

  struct Message {
    Value json;  // of a text
    std::uint8_t op = 0;
    std::uint32_t subscription = 0;
    std::uint64_t time = 0;
    std::string data;
  };
  // Nothing once the socket is closed, with that code.
  std::optional<Message> next() {
    for (;;) {
      const auto frame = peer_.next();
      if (!frame) return std::nullopt;
      if (frame->op() == http::kClose) {
        closed_ = frame->code();
        peer_.frame(http::kLast | http::kClose, frame->text.substr(0, 2));
        peer_.end();
        return std::nullopt;
      }
      if (frame->op() == http::kText) {
        auto json = text::parse_json(frame->text);
        EXPECT_TRUE(json.has_value()) << frame->text;
        return Message{.json = json ? *json : Value()};
      }
      if (frame->op() != http::kBinary) continue;
      const std::string& octets = frame->text;
      const auto little = [&](std::size_t from, std::size_t count) {
        std::uint64_t number = 0;
        for (std::size_t i = count; i > 0; --i)
          number = number << 8U | static_cast<unsigned char>(octets.at(from + i - 1));
        return number;
      };
      Message message{.op = static_cast<std::uint8_t>(octets.at(0))};
      if (message.op == 2) {
        EXPECT_EQ(octets.size(), 9U);
        message.time = little(1, 8);
      } else {
        message.subscription = static_cast<std::uint32_t>(little(1, 4));
        message.time = little(5, 8);
        message.data = octets.substr(13);
      }
      return message;
    }
  }
  // The next text with that "op"; others are passed over.
  Value next(std::string_view op) {
    while (const auto message = next()) {
      if (message->op == 0 && message->json.find("op")->text() == op) return message->json;
    }
    ADD_FAILURE() << "no more \"" << op << '"';
    return Map{};
  }
  // The next message of a topic.
  Message data() {
    while (auto message = next()) {
      if (message->op == 1) return std::move(*message);
    }
    ADD_FAILURE() << "no more messages";
    return {};
  }
  [[nodiscard]] unsigned closed() const { return closed_; }

 private:
  http::Peer peer_;
  std::string head_;
  unsigned closed_ = 0;
};

std::unique_ptr<Foxglove> foxglove(FoxgloveOptions options = {}) {
  options.port = 0;
  auto started = Foxglove::start(std::move(options));
  EXPECT_TRUE(started.has_value());
  (*started)->begin("a run");
  return std::move(*started);
}

void publish(Foxglove& shown, record::ChannelId channel, std::uint64_t time, std::string_view data) {
  shown.message({.channel = channel, .sequence = 1, .log_time = time, .publish_time = time, .data = data});
}

record::Channel topic(record::ChannelId id, const std::string& name) { return {id, 1, name, "json", {}}; }
const record::Schema kAnything{1, "sentree.Thing", "jsonschema", R"({"type":"object"})"};

std::int64_t number_of(const Value& message, const char* name) { return *message.find(name)->as_int(); }
// The channels of an "advertise" by topic.
std::map<std::string, std::int64_t> channels_in(const Value& advertisement) {
  std::map<std::string, std::int64_t> channels;
  for (const Value& each : *advertisement.find("channels")->as_list())
    channels[std::string(each.find("topic")->text())] = number_of(each, "id");
  return channels;
}

// ---- Opening ----

TEST(Foxglove, SaysWhoItIsAndWhatThereIs) {
  const auto shown = foxglove({.version = "1.2.3"});
  shown->channel(topic(1, "/tree"), kAnything);
  FoxgloveClient client(shown->port());
  EXPECT_THAT(client.head(), StartsWith("HTTP/1.1 101 "));
  EXPECT_THAT(client.head(), HasSubstr("Sec-WebSocket-Protocol: foxglove.websocket.v1"));
  const Value info = client.next("serverInfo");
  EXPECT_EQ(info.find("name")->text(), "sentree: a run");
  EXPECT_EQ(to_json(*info.find("capabilities")), R"(["time"])");
  EXPECT_EQ(info.find("metadata")->find("version")->text(), "1.2.3");
  const Value offered = client.next("advertise");
  const Value& channel = offered.find("channels")->as_list()->front();
  EXPECT_EQ(channel.find("topic")->text(), "/tree");
  EXPECT_EQ(channel.find("encoding")->text(), "json");
  EXPECT_EQ(channel.find("schemaName")->text(), "sentree.Thing");
  EXPECT_EQ(channel.find("schemaEncoding")->text(), "jsonschema");
  EXPECT_EQ(channel.find("schema")->text(), R"({"type":"object"})");
}

TEST(Foxglove, SpeaksTheFirstSubprotocolOfTheOfferThatItKnows) {
  const auto shown = foxglove();
  EXPECT_THAT(FoxgloveClient(shown->port(), "other , foxglove.sdk.v1, foxglove.websocket.v1").head(),
              HasSubstr("Sec-WebSocket-Protocol: foxglove.sdk.v1"));
  EXPECT_THAT(FoxgloveClient(shown->port(), "other").head(), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(FoxgloveClient(shown->port(), "").head(), StartsWith("HTTP/1.1 400 "));
}

TEST(Foxglove, PagesOfOtherSitesMayNotLook) {
  EXPECT_TRUE(may_look(""));
  EXPECT_TRUE(may_look("http://localhost:8080"));
  EXPECT_TRUE(may_look("https://127.0.0.1"));
  EXPECT_TRUE(may_look("http://[::1]:9000"));
  EXPECT_TRUE(may_look("https://app.foxglove.dev"));
  EXPECT_TRUE(may_look("file://"));
  EXPECT_FALSE(may_look("http://app.foxglove.dev"));
  EXPECT_FALSE(may_look("https://app.foxglove.dev.example.com"));
  EXPECT_FALSE(may_look("http://localhost.example.com"));
  EXPECT_FALSE(may_look("http://[::1].example.com"));
  EXPECT_FALSE(may_look("null"));
  const auto shown = foxglove();
  EXPECT_THAT(FoxgloveClient(shown->port(), kProtocolV1, "http://example.com").head(), StartsWith("HTTP/1.1 403 "));
  const auto open = foxglove({.insecure = true});
  EXPECT_THAT(FoxgloveClient(open->port(), kProtocolV1, "http://example.com").head(), StartsWith("HTTP/1.1 101 "));
}

TEST(Foxglove, ListensOnLoopbackUnlessToldOtherwise) {
  const auto refused = Foxglove::start({.address = "0.0.0.0", .port = 0});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, "http.not-loopback");
  EXPECT_THAT(foxglove()->told(), HasSubstr("no authentication: any program of this machine"));
  EXPECT_THAT(foxglove({.address = "0.0.0.0", .insecure = true})->told(), HasSubstr("any machine that reaches it"));
}

TEST(Foxglove, SaysForWhomAPortIsTaken) {
  const auto first = foxglove();
  const auto second = Foxglove::start({.port = first->port()});
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().message, "Foxglove: 127.0.0.1:" + std::to_string(first->port()) +
                                        " is taken: another process listens there; stop it or choose another port (0 "
                                        "takes a free one)");
}

TEST(Foxglove, TakesSoManyClientsAndNoMore) {
  const auto shown = foxglove();
  std::vector<std::unique_ptr<FoxgloveClient>> clients;
  for (std::size_t i = 0; i < kFoxgloveClientsMax; ++i) {
    clients.push_back(std::make_unique<FoxgloveClient>(shown->port()));
    EXPECT_THAT(clients.back()->head(), StartsWith("HTTP/1.1 101 "));
  }
  EXPECT_THAT(FoxgloveClient(shown->port()).head(), StartsWith("HTTP/1.1 503 "));
}

// ---- Messages ----

TEST(Foxglove, GivesTheLatestMessageThenAllThatFollow) {
  const auto shown = foxglove();
  FoxgloveClient client(shown->port());
  client.next("advertise");
  shown->channel(topic(7, "/map"), kAnything);
  publish(*shown, 7, 3'000'000, "{\"old\":1}");
  publish(*shown, 7, 5'000'000, "{\"n\":1}");
  const std::int64_t channel = channels_in(client.next("advertise")).at("/map");
  client.subscribe(42, channel);
  const auto latest = client.data();
  EXPECT_EQ(latest.subscription, 42U);
  EXPECT_EQ(latest.time, 5'000'000U);
  EXPECT_EQ(latest.data, "{\"n\":1}");
  publish(*shown, 7, 9'000'000, "{\"n\":2}");
  const auto time = client.next();
  ASSERT_TRUE(time);
  EXPECT_EQ(time->op, 2);
  EXPECT_EQ(time->time, 9'000'000U);
  EXPECT_EQ(client.data().data, "{\"n\":2}");
}

TEST(Foxglove, SendsNothingOfWhatNobodySubscribedOrNoLonger) {
  const auto shown = foxglove();
  shown->channel(topic(1, "/a"), kAnything);
  shown->channel(topic(2, "/b"), kAnything);
  FoxgloveClient client(shown->port());
  const auto channels = channels_in(client.next("advertise"));
  client.subscribe(1, channels.at("/b"));
  client.send(R"({"op":"unsubscribe","subscriptionIds":[1]})");
  client.subscribe(1, channels.at("/b"));  // the number is free again
  client.send(R"({"op":"unsubscribe","subscriptionIds":[9]})");
  EXPECT_EQ(client.next("status").find("message")->text(), "there is no such subscription");
  publish(*shown, 1, 1, "{}");
  publish(*shown, 2, 2, "{\"b\":1}");
  EXPECT_EQ(client.data().data, "{\"b\":1}");
}

TEST(Foxglove, SaysWhatIsWrongWithARequest) {
  const auto shown = foxglove();
  shown->channel(topic(1, "/a"), kAnything);
  FoxgloveClient client(shown->port());
  const std::int64_t a = channels_in(client.next("advertise")).at("/a");
  client.subscribe(1, a);
  const std::string again = std::to_string(a);
  for (const auto& [request, answer] : std::map<std::string, std::string>{
           {"{", "no JSON object"},
           {"[]", "no JSON object"},
           {"{\"op\":7}", "no JSON object"},
           {R"({"op":"advertise","channels":[]})", "\"advertise\" is not offered"},
           {R"({"op":"subscribe","subscriptions":[7]})", "an id and a channelId"},
           {R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":0}]})", "an id and a channelId"},
           {R"({"op":"subscribe","subscriptions":[{"id":3,"channelId":4294967295}]})", "no channel 4294967295"},
           {R"({"op":"subscribe","subscriptions":[{"id":3,"channelId":)" + again + "}]}", "is subscribed already"},
           {R"({"op":"unsubscribe","subscriptionIds":["1"]})", "no such subscription"}}) {
    client.send(request);
    const Value status = client.next("status");
    EXPECT_EQ(number_of(status, "level"), 2) << request;
    EXPECT_THAT(std::string(status.find("message")->text()), HasSubstr(answer)) << request;
  }
  publish(*shown, 1, 1, "{\"still\":1}");
  EXPECT_EQ(client.data().data, "{\"still\":1}");
}

TEST(Foxglove, ASlowClientLosesMessagesIsToldHowManyAndStandsWhereTheOthersDo) {
  const auto shown = foxglove({.queue_bytes_max = 1U << 20U});
  shown->channel(topic(1, "/big"), kAnything);
  FoxgloveClient client(shown->port(), kProtocolV1, "", 4096);
  client.subscribe(5, channels_in(client.next("advertise")).at("/big"));
  // Answered once the subscription is there.
  client.send("{}");
  client.next("status");
  constexpr std::uint64_t kMessages = 1000;
  const std::string data(100'000, 'x');
  for (std::uint64_t i = 1; i <= kMessages; ++i) publish(*shown, 1, i, data);
  // What is not told to be missing comes, in its order, and the last one in any case.
  std::uint64_t received = 0;
  std::uint64_t missing = 0;
  for (std::uint64_t last = 0; last < kMessages;) {
    const auto message = client.next();
    ASSERT_TRUE(message);
    if (message->op == 1) {
      EXPECT_GT(message->time, last);
      last = message->time;
      ++received;
    } else if (message->op == 0) {
      EXPECT_EQ(number_of(message->json, "level"), 1);
      const std::string told(message->json.find("message")->text());
      EXPECT_THAT(told, HasSubstr(" messages are not here"));
      missing += std::stoull(told);
    }
  }
  EXPECT_GT(missing, 0U);
  EXPECT_EQ(received + missing, kMessages);
}

TEST(Foxglove, TheNextRunTakesThePlaceOfTheOneBefore) {
  const auto shown = foxglove();
  shown->channel(topic(1, "/a"), kAnything);
  FoxgloveClient client(shown->port());
  const std::string session(client.next("serverInfo").find("sessionId")->text());
  const std::int64_t before = channels_in(client.next("advertise")).at("/a");
  client.subscribe(1, before);
  publish(*shown, 1, 9'000'000'000, "{}");
  client.data();
  shown->begin("another");
  EXPECT_EQ(to_json(*client.next("unadvertise").find("channelIds")), "[" + std::to_string(before) + "]");
  const Value info = client.next("serverInfo");
  EXPECT_EQ(info.find("name")->text(), "sentree: another");
  EXPECT_NE(info.find("sessionId")->text(), session);
  shown->channel(topic(1, "/b"), kAnything);
  const std::int64_t after = channels_in(client.next("advertise")).at("/b");
  EXPECT_NE(after, before);
  client.subscribe(1, after);
  publish(*shown, 1, 2'000'000, "{\"new\":1}");
  EXPECT_EQ(client.data().time, 2'000'000U);
}

TEST(Foxglove, EndsOnceAllHaveTakenWhatWaits) {
  const auto shown = foxglove();
  shown->channel(topic(1, "/a"), kAnything);
  FoxgloveClient client(shown->port());
  client.subscribe(1, channels_in(client.next("advertise")).at("/a"));
  client.send("{}");
  client.next("status");
  constexpr std::uint64_t kMessages = 500;
  for (std::uint64_t i = 1; i <= kMessages; ++i) publish(*shown, 1, i, "{}");
  std::thread ending([&] { shown->end(); });
  std::uint64_t last = 0;
  while (const auto message = client.next()) {
    if (message->op == 1) last = message->time;
  }
  ending.join();
  EXPECT_EQ(last, kMessages);
  EXPECT_EQ(client.closed(), 1001U);
}

// ---- Of a run ----

// Everything that an audience is given, by topic.
class Everything final : public record::Audience {
 public:
  void channel(const record::Channel& channel, const record::Schema& schema) override {
    topics[channel.id] = channel.topic;
    schemas[channel.topic] = schema.name + schema.data;
  }
  void message(const record::RawMessage& message) override {
    messages[topics.at(message.channel)].emplace_back(message.log_time, std::string(message.data));
  }
  std::map<record::ChannelId, std::string> topics;
  std::map<std::string, std::string> schemas;
  std::map<std::string, std::vector<std::pair<std::uint64_t, std::string>>> messages;
};

// The recording of a run, which somebody may follow.
std::string recorded_run(const project::Plan& plan, record::Audience* audience) {
  std::string file;
  runtime::RunOptions options;
  replay::RunRecorder recording(plan, {}, std::make_unique<record::StringSink>(file), {.audience = audience});
  recording.install(options);
  runtime::Run run(plan, std::move(options));
  const auto report = run.execute();
  recording.finish(report);
  return file;
}

TEST(Foxglove, IsGivenTheOctetsOfTheRecordingWhichStaysTheSame) {
  const project::Plan plan = recharge_plan("experiment1", std::chrono::seconds(30));
  Everything seen;
  const std::string file = recorded_run(plan, &seen);
  EXPECT_TRUE(file == recorded_run(plan, nullptr));

  auto reader = record::Reader::open(std::make_unique<record::StringSource>(file), "run.mcap");
  ASSERT_TRUE(reader.has_value());
  std::map<std::string, std::vector<std::pair<std::uint64_t, std::string>>> recorded;
  ASSERT_TRUE((*reader)->read({}, [&](const record::RawMessage& message) {
    recorded[(*reader)->channels().at(message.channel).topic].emplace_back(message.log_time, std::string(message.data));
    return true;
  }));
  EXPECT_GT(recorded["/observations"].size(), 1000U);
  EXPECT_EQ(seen.messages.size(), recorded.size());
  for (auto& [name, messages] : recorded) {
    // Read in the order of time.
    auto& given = seen.messages[name];
    std::stable_sort(given.begin(), given.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    EXPECT_TRUE(given == messages) << name << ": " << given.size() << " and " << messages.size();
  }
  for (const auto& [id, channel] : (*reader)->channels()) {
    const record::Schema& schema = (*reader)->schemas().at(channel.schema);
    EXPECT_EQ(seen.schemas.at(channel.topic), schema.name + schema.data);
  }
}

}  // namespace
}  // namespace sentree::studio
