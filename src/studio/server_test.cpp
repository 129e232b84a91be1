#include "sentree/studio/server.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <thread>

#include "sentree/base/json.h"
#include "sentree/record/sink.h"
#include "sentree/runtime/run.h"
#include "sentree/studio/detail/test_support.h"
#include "sentree/studio/live.h"

namespace sentree::studio {
namespace {

// A run with a page, in a thread of its own.
struct Shown {
  explicit Shown(Duration duration = std::chrono::seconds(30), ServerOptions options = {})
      : plan(recharge_plan("experiment1", duration)) {
    auto started = Live::start(plan, std::move(options));
    EXPECT_TRUE(started.has_value()) << to_string(started.error());
    live = std::move(*started);
  }
  ~Shown() {
    if (thread.joinable()) thread.join();
  }

  void run() {
    thread = std::thread([this] {
      runtime::RunOptions options;
      live->install(options);
      replay::RunRecorder recorder(
          plan, {}, std::make_unique<record::NullSink>(),
          {.compression = record::Compression::kNone, .on_failure = {}, .story = {}, .tap = live->tap()});
      recorder.install(options);
      runtime::Run run(plan, std::move(options));
      const runtime::RunReport report = run.execute();
      recorder.finish(report);
      live->ended(report);
    });
  }
  void run_to_the_end() {
    run();
    thread.join();
  }
  [[nodiscard]] std::uint16_t port() const { return live->server().port(); }

  project::Plan plan;
  std::unique_ptr<Live> live;
  std::thread thread;
};

std::string request(int id, const std::string& op, const std::string& more = "") {
  return R"({"op":")" + op + R"(","id":)" + std::to_string(id) + (more.empty() ? "" : "," + more) + "}";
}

// What a page makes of a state and the deltas after it.
void fold(Value& state, const Value& delta) {
  for (const auto& [name, value] : *delta.as_map()) {
    if (name == "messages" || name == "missed" || name == "type") continue;
    if (name != "charts" && name != "monitors" && name != "robots") {
      (*state.as_map())[name] = value;
      continue;
    }
    if (state.as_map()->find(name) == nullptr) (*state.as_map())[name] = Map();
    for (const auto& [key, entry] : *value.as_map()) (*(*state.as_map())[name].as_map())[key] = entry;
  }
}

// Equal but for the order of members.
bool same(const Value& a, const Value& b) {
  const Map* left = a.as_map();
  const Map* right = b.as_map();
  if (left == nullptr || right == nullptr) return a == b;
  if (left->size() != right->size()) return false;
  for (const auto& [name, value] : *left) {
    const Value* other = right->find(name);
    if (other == nullptr || !same(value, *other)) return false;
  }
  return true;
}

TEST(StudioServer, GreetsWithHelloModelAndState) {
  Shown shown;
  TestClient client(shown.port());
  ASSERT_EQ(client.status(), 101);
  const Value hello = client.next();
  EXPECT_EQ(hello.find("type")->text(), "hello");
  EXPECT_EQ(hello.find("mode")->text(), "live");
  EXPECT_EQ(*hello.find("protocol")->as_int(), 1);
  const Value model = client.next();
  EXPECT_EQ(model.find("type")->text(), "model");
  const Value* nodes = model.at({"tree", "nodes"});
  ASSERT_NE(nodes, nullptr);
  EXPECT_EQ(nodes->as_list()->size(), shown.plan.tree.size());
  EXPECT_EQ(model.at({"tree", "layout", "nodes"})->as_list()->size(), shown.plan.tree.size());
  EXPECT_FALSE(model.find("charts")->as_list()->empty());
  EXPECT_EQ(client.next().find("type")->text(), "state");
}

TEST(StudioServer, DeltasAddUpToTheStateOfTheirMoment) {
  Shown shown;
  TestClient client(shown.port());
  Value state = client.next("state");
  ASSERT_FALSE(state.is_null());
  shown.run();
  std::uint64_t messages = 0;
  // Until the run has ended and everything of it has come.
  for (;;) {
    const Value delta = client.next("delta");
    ASSERT_FALSE(delta.is_null());
    if (const Value* missed = delta.find("missed")) {
      messages += static_cast<std::uint64_t>(*missed->as_int()) + delta.find("messages")->as_list()->size();
      EXPECT_LE(delta.find("messages")->as_list()->size(), kDeltaMessagesMax);
    }
    fold(state, delta);
    if (state.at({"run", "state"})->text() == "ended") break;
  }
  shown.thread.join();
  const Nanoseconds end = shown.live->history().end();
  client.send(request(1, "seek", "\"time\":" + std::to_string(end)));
  Value sought;
  for (;;) {
    Value message = client.next();
    ASSERT_FALSE(message.is_null());
    const auto type = message.find("type")->text();
    if (type == "delta") {
      fold(state, message);
      if (const Value* missed = message.find("missed"))
        messages += static_cast<std::uint64_t>(*missed->as_int()) + message.find("messages")->as_list()->size();
    }
    if (type == "state") sought = std::move(message);
    if (type == "answer") break;
  }
  EXPECT_EQ(messages, shown.live->history().end_observation());
  EXPECT_EQ(*sought.find("live")->as_bool(), false);
  for (const auto& [name, value] : *sought.as_map()) {
    if (name == "live" || name == "type") continue;
    const Value* folded = state.find(name);
    ASSERT_NE(folded, nullptr) << name;
    EXPECT_TRUE(same(*folded, value)) << name << ": " << to_json(*folded) << "\nis not " << to_json(value);
  }
}

TEST(StudioServer, SeeksToAnyMomentAndBack) {
  Shown shown;
  shown.run_to_the_end();
  TestClient client(shown.port());
  ASSERT_FALSE(client.next("state").is_null());
  client.send(request(1, "seek", "\"time\":5000000000"));
  const Value past = client.next("state");
  EXPECT_EQ(*past.find("time")->as_int(), 5'000'000'000);
  EXPECT_EQ(*past.find("live")->as_bool(), false);
  EXPECT_TRUE(*client.next("answer").find("ok")->as_bool());
  client.send(request(2, "live"));
  EXPECT_EQ(*client.next("state").find("live")->as_bool(), true);
}

TEST(StudioServer, TellsAPageThatLooksAtThePastHowFarTheRunHasCome) {
  constexpr Duration kLength = std::chrono::seconds(30);
  Shown shown(kLength);
  TestClient client(shown.port());
  client.send(request(1, "seek", "\"time\":0"));
  ASSERT_TRUE(*client.next("answer").find("ok")->as_bool());
  shown.run();
  Nanoseconds end = 0;
  for (bool has_ended = false; !has_ended || end < kLength.count();) {
    const Value delta = client.next("delta");
    ASSERT_FALSE(delta.is_null());
    EXPECT_EQ(delta.find("time"), nullptr) << "the moment shown stays where it is";
    EXPECT_EQ(delta.find("robots"), nullptr);
    EXPECT_GE(*delta.find("end")->as_int(), end);
    end = *delta.find("end")->as_int();
    if (const Value* state = delta.at({"run", "state"})) has_ended = state->text() == "ended";
  }
  EXPECT_EQ(end, shown.live->history().end());
}

TEST(StudioServer, AnswersMessagesLanesFindAndLayout) {
  Shown shown;
  shown.run_to_the_end();
  TestClient client(shown.port());
  client.send(request(1, "messages", R"("limit":10,"filter":{"kind":"reply"})"));
  const Value messages = client.next("answer");
  ASSERT_EQ(messages.at({"value", "messages"})->as_list()->size(), 10U);
  for (const Value& message : *messages.at({"value", "messages"})->as_list())
    EXPECT_EQ(message.find("kind")->text(), "reply");
  client.send(request(2, "find", R"("after":0,"filter":{"name":"monitor.violated"})"));
  const Value found = client.next("answer");
  EXPECT_EQ(found.at({"value", "name"})->text(), "monitor.violated");
  client.send(request(3, "lanes", R"("from":0,"to":30000000000,"width":100)"));
  EXPECT_FALSE(client.next("answer").at({"value", "lanes"})->as_list()->empty());
  client.send(request(4, "layout", R"("collapsed":[1])"));
  const Value layout = client.next("answer");
  EXPECT_LT(layout.at({"value", "nodes"})->as_list()->size(), shown.plan.tree.size());
  client.send(request(5, "fold_chart", R"("chart":"skill:GoToKitchen","closed":["going"])"));
  const Value fold = client.next("answer");
  EXPECT_EQ(fold.at({"value", "states"})->as_list()->size(), fold.at({"value", "layout", "states"})->as_list()->size());
  EXPECT_TRUE(std::any_of(fold.at({"value", "hidden"})->as_list()->begin(),
                          fold.at({"value", "hidden"})->as_list()->end(),
                          [](const Value& hidden) { return hidden.number() > 1; }));
  client.send(request(6, "fold_chart", R"("chart":"skill:Nobody","closed":[])"));
  EXPECT_EQ(client.next("answer").find("error")->text(), "there is no chart \"skill:Nobody\"");
  client.send(request(7, "no_such_thing"));
  EXPECT_FALSE(*client.next("answer").find("ok")->as_bool());
}

// What the history says of a robot's place at that moment.
double x_of(const History& history, const History::PartId& robot, Nanoseconds time) {
  std::string json;
  history.append(json, robot, time);
  return text::parse_json(json)->find("pose")->as_list()->front().number();
}

TEST(StudioServer, ASignalOfMessagesHasEachPixelsFirstLastAndExtremes) {
  Shown shown;
  shown.run_to_the_end();
  const History& history = shown.live->history();
  TestClient client(shown.port());
  const std::string reply = "battery.getBatteryState.reply";
  const auto ask = [&](int id, Nanoseconds from, Nanoseconds to, int width) {
    client.send(request(id, "signal",
                        R"("path":["messages",")" + reply + R"(","result","percentage"],"from":)" +
                            std::to_string(from) + ",\"to\":" + std::to_string(to) +
                            ",\"width\":" + std::to_string(width)));
    const Value answer = client.next("answer");
    EXPECT_TRUE(*answer.find("ok")->as_bool());
    return *answer.at({"value", "points"})->as_list();
  };
  // All there are, by looking at each observation.
  List all;
  for (std::size_t i = 0; i < history.end_observation(); ++i) {
    const auto message = text::parse_json(history.observation(i));
    ASSERT_TRUE(message.has_value());
    if (message->find("name")->text() != reply) continue;
    all.push_back(List{*message->find("time")->as_int(), message->at({"data", "result", "percentage"})->number()});
  }
  ASSERT_GT(all.size(), 8U);
  // Wide enough that each has a pixel of its own.
  EXPECT_EQ(ask(1, 0, history.end(), 4000), all);

  // Two pixels: at most four of each, in order, with the extremes of all.
  const List few = ask(2, 0, history.end(), 2);
  EXPECT_LE(few.size(), 12U);  // two and a half pixels, as the last may be cut
  EXPECT_EQ(few.front(), all.front());
  EXPECT_EQ(few.back(), all.back());
  const auto number = [](const Value& point) { return (*point.as_list())[1].number(); };
  const auto less = [&](const Value& a, const Value& b) { return number(a) < number(b); };
  EXPECT_EQ(number(*std::min_element(few.begin(), few.end(), less)),
            number(*std::min_element(all.begin(), all.end(), less)));
  EXPECT_EQ(number(*std::max_element(few.begin(), few.end(), less)),
            number(*std::max_element(all.begin(), all.end(), less)));
  for (std::size_t i = 1; i < few.size(); ++i)
    EXPECT_LE(*(*few[i - 1].as_list())[0].as_int(), *(*few[i].as_list())[0].as_int());

  // A part of the time.
  const Nanoseconds from = *(*all[2].as_list())[0].as_int();
  const Nanoseconds to = *(*all[5].as_list())[0].as_int();
  EXPECT_EQ(ask(3, from, to, 4000), List(all.begin() + 2, all.begin() + 6));
  EXPECT_TRUE(ask(4, history.end() + 1, history.end() + 2, 10).size() <= 1U);
}

TEST(StudioServer, ASignalOfTheStateHasItsValueAtEachPixel) {
  Shown shown;
  shown.run_to_the_end();
  const History& history = shown.live->history();
  const std::string robot = Subject(shown.plan).robots.front();
  TestClient client(shown.port());
  constexpr int kWidth = 7;
  client.send(request(1, "signal",
                      R"("path":["robots",")" + robot + R"(","pose","0"],"from":0,"to":)" +
                          std::to_string(history.end()) + ",\"width\":" + std::to_string(kWidth)));
  const Value answer = client.next("answer");
  const List& points = *answer.at({"value", "points"})->as_list();
  ASSERT_EQ(points.size(), kWidth + 1U);
  for (const Value& point : points) {
    const List& pair = *point.as_list();
    EXPECT_EQ(pair[1].number(), x_of(history, {History::Part::kRobot, 0}, *pair[0].as_int()));
  }
  EXPECT_NE((*points.front().as_list())[1].number(), (*points.back().as_list())[1].number()) << "it drives";
}

TEST(StudioServer, OffersTheSignalsOfAllMessagesThatThereWereAndOfCharts) {
  Shown shown;
  shown.run_to_the_end();
  TestClient client(shown.port());
  client.send(request(1, "signals"));
  std::set<std::string> offered;
  const Value answer = client.next("answer");
  for (const Value& path : *answer.at({"value", "paths"})->as_list()) {
    std::string joined;
    for (const Value& key : *path.as_list()) joined += "/" + std::string(key.text());
    EXPECT_TRUE(offered.insert(joined).second) << joined;
  }
  EXPECT_TRUE(offered.contains("/messages/battery.getBatteryState.reply/result/percentage"));
  EXPECT_TRUE(offered.contains("/messages/navigation.gotoTargetByLocationName.reply/result/goal_id"))
      << "it was said once, at the beginning";
  EXPECT_TRUE(offered.contains("/charts/skill:GoToKitchen/data/goal"));
}

TEST(StudioServer, RefusesASignalOfNothing) {
  Shown shown;
  shown.run_to_the_end();
  TestClient client(shown.port());
  const auto why = [&](const std::string& path) {
    client.send(request(1, "signal", "\"path\":" + path + R"(,"from":0,"to":1000000000,"width":10)"));
    const Value answer = client.next("answer");
    EXPECT_FALSE(*answer.find("ok")->as_bool());
    return std::string(answer.find("error")->text());
  };
  EXPECT_EQ(why(R"(["robots","nobody","pose"])"), "there is no robots \"nobody\"");
  EXPECT_EQ(why(R"(["weather","today"])"), "there is no weather \"today\"");
  EXPECT_NE(why(R"(["messages"])").find("a signal is a path"), std::string::npos);
  EXPECT_NE(why("[]").find("a signal is a path"), std::string::npos);
}

TEST(StudioServer, TransitionsOfANodeAreItsStatusesInTheirOrder) {
  Shown shown;
  shown.run_to_the_end();
  const History& history = shown.live->history();
  TestClient client(shown.port());
  for (std::size_t node = 0; node < shown.plan.tree.size(); ++node) {
    client.send(request(static_cast<int>(node) + 1, "transitions", "\"node\":" + std::to_string(node)));
    const Value answer = client.next("answer");
    ASSERT_TRUE(*answer.find("ok")->as_bool());
    EXPECT_EQ(*answer.at({"value", "left_out"})->as_int(), 0);
    const List& rows = *answer.at({"value", "rows"})->as_list();
    Nanoseconds before = -1;
    std::string_view status = "IDLE";
    for (const Value& row : rows) {
      const List& pair = *row.as_list();
      EXPECT_GE(*pair[0].as_int(), before);
      EXPECT_LE(*pair[0].as_int(), history.end());
      EXPECT_NE(pair[1].text(), status) << "a row is a change";
      before = *pair[0].as_int();
      status = pair[1].text();
    }
    EXPECT_TRUE(node != 0 || !rows.empty()) << "the root is ticked";
  }
  client.send(request(1000, "transitions", "\"node\":" + std::to_string(shown.plan.tree.size())));
  EXPECT_FALSE(*client.next("answer").find("ok")->as_bool());
}

TEST(StudioServer, APageThatNeverReadsCostsTheRunNothing) {
  Shown shown(std::chrono::minutes(2));
  TestClient lazy(shown.port());
  ASSERT_EQ(lazy.status(), 101);
  shown.run_to_the_end();
  TestClient other(shown.port());
  // What the run left is taken into the history before a page is shown its state.
  const Value state = other.next("state");
  EXPECT_EQ(*state.find("end")->as_int(), shown.live->history().end());
}

TEST(StudioServer, RefusesPagesOfOthers) {
  Shown shown;
  EXPECT_EQ(TestClient(shown.port(), {.host = "evil.example", .origin = {}}).status(), 403);
  EXPECT_EQ(TestClient(shown.port(), {.host = {}, .origin = "http://evil.example"}).status(), 403);
  EXPECT_EQ(TestClient(shown.port(), {.host = {}, .origin = {}, .path = "/elsewhere"}).status(), 404);
  const std::string own = "http://127.0.0.1:" + std::to_string(shown.port());
  EXPECT_EQ(TestClient(shown.port(), {.host = {}, .origin = own}).status(), 101);
}

TEST(StudioServer, KnowsItsOwnPage) {
  EXPECT_TRUE(is_own_page("localhost:4711", "http://localhost:4711", "127.0.0.1", 4711));
  EXPECT_FALSE(is_own_page("localhost:4711", "http://localhost:4712", "127.0.0.1", 4711));
  EXPECT_FALSE(is_own_page("localhost:4712", "", "127.0.0.1", 4711));
  EXPECT_FALSE(is_own_page("rebound.example:4711", "http://rebound.example:4711", "127.0.0.1", 4711));
  EXPECT_FALSE(is_own_page("", "", "127.0.0.1", 4711));
  EXPECT_TRUE(is_own_page("192.168.1.7:4711", "http://192.168.1.7:4711", "0.0.0.0", 4711));
  EXPECT_FALSE(is_own_page("rebound.example:4711", "http://rebound.example:4711", "0.0.0.0", 4711));
  EXPECT_FALSE(is_own_page("127.0.0.1:4711", "null", "127.0.0.1", 4711));
}

TEST(StudioServer, WithoutTheTokenNobodySteersWhereOthersCanReachIt) {
  Shown shown(std::chrono::seconds(5), {.address = "0.0.0.0", .insecure = true, .version = "test"});
  TestClient client(shown.port());
  client.send(request(1, "pause"));
  const Value refused = client.next("answer");
  EXPECT_FALSE(*refused.find("ok")->as_bool());
  EXPECT_NE(refused.find("error")->text().find("token"), std::string::npos);
  client.send(request(2, "hello", R"("token":"wrong")"));
  EXPECT_FALSE(*client.next("answer").at({"value", "steerable"})->as_bool());
  const std::string url = shown.live->server().url();
  const std::string token = url.substr(url.find("#token=") + 7);
  ASSERT_GE(token.size(), 32U);
  client.send(request(3, "hello", "\"token\":\"" + token + "\""));
  EXPECT_TRUE(*client.next("answer").at({"value", "steerable"})->as_bool());
}

TEST(StudioServer, RefusesTheSeventeenthPage) {
  Shown shown;
  std::deque<TestClient> clients;
  for (std::size_t i = 0; i < kClientsMax; ++i) {
    clients.emplace_back(shown.port());
    ASSERT_EQ(clients.back().status(), 101);
  }
  EXPECT_EQ(TestClient(shown.port()).status(), 503);
}

TEST(StudioServer, AHandshakeThatFailsTakesNoPlace) {
  Shown shown;
  for (std::size_t i = 0; i < kClientsMax * 2; ++i) {
    TestClient old(shown.port(), {.host = {}, .origin = {}, .version = "8"});
    EXPECT_EQ(old.status(), 426);
    EXPECT_FALSE(old.receive());  // its end
  }
  EXPECT_EQ(TestClient(shown.port()).status(), 101);
}

TEST(StudioServer, EndsTheSocketOfWhoSendsTooMuchOrNonsense) {
  Shown shown;
  TestClient huge(shown.port());
  huge.send(R"({"op":")" + std::string(100'000, 'x') + "\"}");
  EXPECT_TRUE(huge.next("never").is_null());
  TestClient nonsense(shown.port());
  nonsense.send("[1, 2");
  EXPECT_TRUE(nonsense.next("never").is_null());
}

TEST(StudioServer, SteersTheRun) {
  Shown shown(std::chrono::seconds(20));
  TestClient client(shown.port());
  client.send(request(1, "intervene", R"("call":"simulation.setBatteryCharge","args":{"percent":10})"));
  const Value early = client.next("answer");
  EXPECT_FALSE(*early.find("ok")->as_bool());
  EXPECT_NE(early.find("error")->text().find("not begun"), std::string::npos);
  shown.run_to_the_end();
  client.send(request(2, "pause"));
  EXPECT_NE(client.next("answer").find("error")->text().find("ended"), std::string::npos);
}

}  // namespace
}  // namespace sentree::studio
