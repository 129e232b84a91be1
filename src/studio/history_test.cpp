#include "sentree/studio/history.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <string>

#include "sentree/base/json.h"
#include "sentree/record/observation.h"
#include "sentree/record/sink.h"
#include "sentree/replay/recording.h"
#include "sentree/runtime/run.h"
#include "sentree/studio/detail/record_queue.h"
#include "sentree/studio/detail/test_support.h"

namespace sentree::studio {
namespace {

// One run, with its history as it went on, its recording, and its observations for a straightforward look.
struct Watched {
  explicit Watched(std::string scenario = "experiment1", Duration duration = std::chrono::seconds(30),
                   std::size_t bytes_max = kHistoryBytesMax)
      : plan(recharge_plan(scenario, duration)), subject(plan), history(subject, bytes_max) {
    RecordQueue queue(history);
    runtime::RunOptions options;
    options.listeners.push_back([this](const Message& message) { observations.push_back(message); });
    replay::RecordingOptions recording;
    recording.tap = [&](TimePoint time, record::RunRecord record) { queue.put(time, std::move(record)); };
    replay::RunRecorder recorder(plan, {}, std::make_unique<record::StringSink>(file), std::move(recording));
    recorder.install(options);
    runtime::Run run(plan, std::move(options));
    recorder.finish(run.execute());
    queue.drain();
  }

  project::Plan plan;
  Subject subject;
  History history;
  std::string file;
  std::vector<Message> observations;
};

std::string part_text(const History& history, const History::PartId& part, Nanoseconds time) {
  std::string text;
  history.append(text, part, time);
  return text;
}

Nanoseconds ns(TimePoint time) { return time.time_since_epoch().count(); }

TEST(History, SaysOfTheTreeWhatAReplayOfAllMessagesSays) {
  const Watched run;
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int i = 0; i < 100; ++i) {
    const Nanoseconds time = std::uniform_int_distribution<Nanoseconds>(0, run.history.end())(random);
    std::vector<std::int64_t> status(run.plan.tree.size(), 0);
    std::vector<std::int64_t> since(run.plan.tree.size(), 0);
    std::vector<std::int64_t> last(run.plan.tree.size(), 0);
    std::uint64_t sequence = 0;
    std::uint64_t tick = 0;
    for (const Message& message : run.observations) {
      if (ns(message.time) > time) break;
      sequence = message.sequence;
      tick = message.tick;
      if (message.name != "node.status") continue;
      const auto node = static_cast<std::size_t>(*message.data.find("node")->as_int());
      status[node] = static_cast<std::int64_t>(*bt::parse_status(message.data.find("to")->text()));
      since[node] = ns(message.time);
      if (status[node] != 0) last[node] = status[node];
    }
    const auto tree = text::parse_json(part_text(run.history, {History::Part::kTree, 0}, time));
    ASSERT_TRUE(tree);
    for (std::size_t node = 0; node < status.size(); ++node) {
      EXPECT_EQ((*tree->find("status")->as_list())[node], Value(status[node])) << node << " at " << time;
      EXPECT_EQ((*tree->find("since")->as_list())[node], Value(since[node])) << node << " at " << time;
      EXPECT_EQ((*tree->find("last")->as_list())[node], Value(last[node])) << node << " at " << time;
    }
    EXPECT_EQ(run.history.moment(time).sequence, sequence);
    EXPECT_EQ(run.history.moment(time).tick, tick);
  }
}

TEST(History, SaysOfAChartSinceWhenItIsInItsStates) {
  const Watched run;
  Nanoseconds longest = 0;
  for (const History::PartId& part : run.history.parts()) {
    if (part.part != History::Part::kChart) continue;
    const auto states_at = [&](Nanoseconds time) {
      const auto chart = text::parse_json(part_text(run.history, part, time));
      return chart ? to_json(*chart->find("running")) + to_json(*chart->find("active")) : std::string();
    };
    for (int i = 1; i <= 20; ++i) {
      const Nanoseconds time = run.history.end() * i / 20;
      const auto chart = text::parse_json(part_text(run.history, part, time));
      if (!chart) continue;
      const Nanoseconds since = *chart->find("since")->as_int();
      EXPECT_EQ(states_at(since), states_at(time)) << part.index << " at " << time;
      EXPECT_EQ(states_at(since + (time - since) / 2), states_at(time)) << part.index << " at " << time;
      // A skill that does not run may have run within that instant, and a monitor may have left and come back.
      if (!*chart->find("running")->as_bool() || chart->find("last") == nullptr) continue;
      EXPECT_NE(states_at(since - 1), states_at(time)) << part.index << " at " << time;
      // While it drives, its data and its last event change with every tick.
      longest = std::max(longest, time - since);
    }
  }
  EXPECT_GT(longest, ns(TimePoint(std::chrono::seconds(5))));
}

TEST(History, HasTheDataOfMonitorsAndWhatTheyGotLast) {
  const Watched run;
  std::size_t with_data = 0;
  std::set<std::string> events;
  std::set<std::string> different;
  for (const History::PartId& part : run.history.parts()) {
    if (part.part != History::Part::kChart || !run.subject.charts[part.index].is_monitor) continue;
    const auto& items = run.subject.charts[part.index].chart.data();
    with_data += items.empty() ? 0 : 1;
    for (int i = 1; i <= 50; ++i) {
      const auto chart = text::parse_json(part_text(run.history, part, run.history.end() * i / 50));
      ASSERT_TRUE(chart && chart->find("data") != nullptr) << part.index;
      events.insert(std::string(chart->find("event")->text()));
      // What is undefined at first comes with its first value.
      for (const auto& item : items) EXPECT_TRUE(i < 50 || chart->find("data")->find(item.id) != nullptr) << item.id;
      if (!items.empty()) different.insert(to_json(*chart->find("data")));
    }
  }
  EXPECT_GT(with_data, 0U);
  EXPECT_GT(events.size(), 2U);
  EXPECT_GT(different.size(), 10U);
}

TEST(History, OfARecordingIsThatOfTheRun) {
  Watched run;
  auto reader = record::Reader::open(std::make_unique<record::StringSource>(run.file), "run.mcap");
  ASSERT_TRUE(reader);
  History recorded(run.subject, **reader);
  recorded.read_index();
  ASSERT_EQ(recorded.end(), run.history.end());
  ASSERT_EQ(recorded.end_observation(), run.observations.size());
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int i = 0; i < 50; ++i) {
    const Nanoseconds time = std::uniform_int_distribution<Nanoseconds>(0, run.history.end())(random);
    for (const History::PartId& part : run.history.parts())
      ASSERT_EQ(part_text(recorded, part, time), part_text(run.history, part, time)) << static_cast<int>(part.part);
    const std::size_t position = std::uniform_int_distribution<std::size_t>(0, run.observations.size() - 1)(random);
    ASSERT_EQ(recorded.observation(position), run.history.observation(position));
  }
  EXPECT_EQ(to_json(recorded.lanes(0, recorded.end(), 300)), to_json(run.history.lanes(0, recorded.end(), 300)));
  ASSERT_EQ(recorded.violations(), run.history.violations());
  for (std::size_t i = 0; i < recorded.violations(); ++i) EXPECT_EQ(recorded.violation(i), run.history.violation(i));
}

TEST(History, OfARecordingFindsWhatThatOfTheRunFinds) {
  const Watched run("experiment1", std::chrono::minutes(5));
  auto reader = record::Reader::open(std::make_unique<record::StringSource>(run.file), "run.mcap");
  ASSERT_TRUE(reader);
  ASSERT_GT((*reader)->parts(), 1U);
  History recorded(run.subject, **reader);
  recorded.read_index();
  const auto all = [](const History& history, const Filter& filter, bool forwards) {
    std::vector<std::size_t> found;
    for (std::size_t at = forwards ? 0 : history.end_observation();;) {
      const History::Found next = history.find(filter, at, forwards, 100);
      if (next.position) found.push_back(*next.position);
      if (next.at_end) return found;
      at = next.next;
    }
  };
  for (const Filter& filter :
       {Filter{}, Filter{.kind = "error"}, Filter{.name = "scenario.*"}, Filter{.name = "nothing"},
        Filter{.text = "PERCENTAGE", .service = "battery", .kind = "reply"}}) {
    for (const bool forwards : {true, false})
      EXPECT_EQ(all(recorded, filter, forwards), all(run.history, filter, forwards)) << filter.text << filter.name;
  }
  for (std::uint64_t sequence = 0; sequence <= run.observations.back().sequence + 1; ++sequence)
    ASSERT_EQ(recorded.find_sequence(sequence), run.history.find_sequence(sequence)) << sequence;
}

TEST(History, OfARecordingCanBeLookedAtWhileItIsRead) {
  const Watched run("experiment1", std::chrono::minutes(5));
  auto reader = record::Reader::open(std::make_unique<record::StringSource>(run.file), "run.mcap");
  ASSERT_TRUE(reader);
  ASSERT_GT((*reader)->parts(), 1U);
  History recorded(run.subject, **reader);
  std::size_t looked = 0;
  double read = -1.0;
  recorded.read_index([&] {
    EXPECT_GT(recorded.read_so_far(), read);
    read = recorded.read_so_far();
    const std::size_t end = recorded.end_observation();
    if (end == 0) return true;
    EXPECT_EQ(recorded.observation(end - 1), run.history.observation(end - 1));
    EXPECT_EQ(recorded.find_sequence(run.observations[end - 1].sequence), end - 1);
    EXPECT_EQ(recorded.moment(recorded.end()).observations, end);
    ++looked;
    return true;
  });
  EXPECT_GT(looked, 0U);
  EXPECT_EQ(recorded.read_so_far(), 1.0);
  EXPECT_EQ(recorded.end_observation(), run.observations.size());
  History left(run.subject, **reader);
  left.read_index([] { return false; });
  EXPECT_EQ(left.end_observation(), 0U);
}

TEST(History, KnowsTheViolationWithItsWitness) {
  const Watched run;
  ASSERT_GE(run.history.violations(), 1U);
  const auto violation = text::parse_json(run.history.violation(0));
  ASSERT_TRUE(violation);
  EXPECT_EQ(violation->find("type")->text(), "violation");
  EXPECT_FALSE(violation->find("witness")->as_list()->empty());
  EXPECT_TRUE(*violation->find("witness_complete")->as_bool());
  EXPECT_TRUE(*violation->find("witness_minimal")->as_bool());
}

TEST(History, FindsWhatMatchesInBothDirections) {
  const Watched run;
  const Filter filter{.text = "PERCENTAGE", .service = "battery", .leaf = {}, .kind = "reply", .name = "*.reply"};
  std::vector<std::size_t> wanted;
  for (std::size_t i = 0; i < run.observations.size(); ++i) {
    const Message& message = run.observations[i];
    if (message.kind == MessageKind::kReply && message.name.starts_with("battery.") &&
        to_json(message).find("percentage") != std::string::npos)
      wanted.push_back(i);
  }
  ASSERT_FALSE(wanted.empty());
  std::vector<std::size_t> found;
  for (std::size_t at = 0;;) {
    const History::Found next = run.history.find(filter, at, true, 100);
    if (next.position) found.push_back(*next.position);
    if (next.at_end) break;
    at = next.next;
  }
  EXPECT_EQ(found, wanted);
  found.clear();
  for (std::size_t at = run.history.end_observation();;) {
    const History::Found next = run.history.find(filter, at, false, 100);
    if (next.position) found.insert(found.begin(), *next.position);
    if (next.at_end) break;
    at = next.next;
  }
  EXPECT_EQ(found, wanted);
}

TEST(History, ForgetsTheOldestWhenItsBoundIsReachedAndStaysRight) {
  constexpr std::size_t kSmall = std::size_t{3} << 20U;
  const Watched whole("experiment1", std::chrono::seconds(60));
  const Watched bounded("experiment1", std::chrono::seconds(60), kSmall);
  EXPECT_LE(bounded.history.bytes(), 2 * kSmall);
  EXPECT_GT(bounded.history.begin(), 0);
  EXPECT_GT(bounded.history.first_observation(), 0U);
  EXPECT_EQ(bounded.history.end(), whole.history.end());
  for (const Nanoseconds time :
       {bounded.history.begin(), (bounded.history.begin() + bounded.history.end()) / 2, bounded.history.end()}) {
    for (const History::PartId& part : whole.history.parts()) {
      EXPECT_EQ(part_text(bounded.history, part, time), part_text(whole.history, part, time))
          << static_cast<int>(part.part) << " " << part.index << " at " << time;
    }
    EXPECT_EQ(bounded.history.moment(time).sequence, whole.history.moment(time).sequence);
  }
}

TEST(History, DrawsLanesNoFinerThanPixels) {
  const Watched run;
  constexpr int kWidth = 50;
  const Value lanes = run.history.lanes(0, run.history.end(), kWidth);
  ASSERT_FALSE(lanes.find("lanes")->as_list()->empty());
  for (const Value& lane : *lanes.find("lanes")->as_list()) {
    const Value* spans = lane.find("spans");
    const Value* points = lane.find("points");
    const std::size_t count = spans != nullptr ? spans->as_list()->size() : points->as_list()->size();
    EXPECT_LE(count, 2U * kWidth + 2) << lane.find("id")->text();
  }
  EXPECT_FALSE(lanes.find("marks")->as_list()->empty());
}

}  // namespace
}  // namespace sentree::studio
