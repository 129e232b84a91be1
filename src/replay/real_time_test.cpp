// What leaves take in real time, while several faults stand at once, they take again in a replay, in that order.
//
// SENTREE_SEEDS=N runs N random scenarios instead of the usual ones, SENTREE_SEED=S only that of seed S.

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/replay/recording.h"
#include "sentree/replay/replay.h"

namespace sentree::replay {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kScenarios = 16;
// A period is two milliseconds of the machine's, which is late now and then.
constexpr double kFactor = 50;
// While a run ends, its parts do not wait for one another.
constexpr TimePoint kCompared{std::chrono::milliseconds(2900)};

// Everything that a leaf said, without times; its chart says what it hears.
using Deliveries = std::map<std::string, std::vector<std::string>>;

void note(Deliveries& deliveries, const Message& message) {
  if (message.name == "node.status" || message.name.ends_with("taken") || message.name.ends_with(".delayed")) return;
  for (const char* leaf : {"A", "B", "C"}) {
    if (message.source != leaf) continue;
    // Its answers are published by who takes them.
    const bool is_answer = message.target == "mission";
    deliveries[is_answer ? leaf + std::string(" to mission") : leaf].push_back(message.name + " " +
                                                                               to_json(message.data));
  }
}

// A component that answers and publishes, a topic that nobody serves, and three skills that ask, publish and hear.
class NoisyProject {
 public:
  NoisyProject() {
    write("interfaces/s.thrift",
          "service S { i32 ask(1: i32 n)  oneway void said(1: i32 n) }\nservice T { oneway void told(1: i32 n) }\n");
    write("models/m.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
  <datamodel><data id="n" expr="0"/></datamodel>
  <state id="a">
    <onentry>
      <send type="thrift" target="s" event="said"><param name="n" expr="n"/></send>
      <send event="again" delay="130ms"/>
    </onentry>
    <transition event="again" target="a"><assign location="n" expr="n + 1"/></transition>
    <transition event="s.ask.request">
      <send type="thrift" target="s" event="ask.reply"><param name="result" expr="_event.data.args.n"/></send>
    </transition>
  </state>
</scxml>)");
    write("sentree.yaml", R"(mission: {file: mission.xml, rate: 10 Hz, repeat: true}
services:
  s: {interface: s.thrift/S, at: model}
  t: {interface: s.thrift/T, at: topics}
models:
  - {file: models/m.scxml, serves: [s]}
skills:
  A: {subscribe: [s.said, t.told]}
  B: {subscribe: [s.said, t.told], latest: [t.told]}
  C: {subscribe: [s.said, t.told]}
)");
  }

  // One leaf goes on for ever, and hears late of its ticks from half a second on.
  fs::path make_late() {
    write("skills/A.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
<state id="s"><transition event="s.said t.told"/><transition event="halt" target="failure"/></state><final id="failure"/></scxml>)");
    write("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><A/></BehaviorTree></root>)");
    return write("scenarios/late.yaml", R"(duration: 3 s
timeline:
  - {at: 550 ms, delay: {message: A.tick, by: 10 s}}
  - {at: 1900 ms, stop: mission}
)");
  }

  // One leaf's timer is due while its script is at work, and sent anew before it rings.
  fs::path make_busy() {
    write("skills/A.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
<datamodel><data id="i" expr="0"/></datamodel>
<state id="s">
  <onentry><send id="later" event="later" delay="2s"/></onentry>
  <transition event="t.told" cond="_event.data.n == 1"><script>for (i = 0; i &lt; 500000; i++) {}</script></transition>
  <transition event="t.told"><cancel sendid="later"/><send id="later" event="later" delay="1000s"/><log label="heard" expr="'the second'"/></transition>
  <transition event="later"><log label="heard" expr="'later'"/></transition>
  <transition event="s.said"/>
  <transition event="halt" target="failure"/>
</state>
<final id="failure"/></scxml>)");
    write("mission.xml", R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><A/></BehaviorTree></root>)");
    return write("scenarios/busy.yaml", R"(duration: 3 s
timeline:
  - {at: 100 ms, call: t.told, args: {n: 1}}
  - {at: 150 ms, call: t.told, args: {n: 2}}
)");
  }

  fs::path make(std::uint64_t seed, const std::string& duration = "3 s") {
    Rng rng(seed);
    for (const char* id : {"A", "B", "C"}) write(std::string("skills/") + id + ".scxml", chart(rng));
    static constexpr const char* kTrees[] = {
        R"(<Parallel success_count="3" failure_count="3">LEAVES</Parallel>)",
        R"(<ReactiveFallback>LEAVES</ReactiveFallback>)",
        R"(<ReactiveSequence>LEAVES</ReactiveSequence>)",
        R"(<Parallel success_count="1" failure_count="1">LEAVES</Parallel>)",
    };
    std::string tree = kTrees[rng.below(4)];
    tree.replace(tree.find("LEAVES"), 6, "<A/><B/><C/>");
    write("mission.xml", "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\">" + tree + "</BehaviorTree></root>");
    std::string text = "duration: " + duration + "\ntimeline:\n";
    for (std::uint64_t entry = 2 + rng.below(3); entry > 0; --entry) text += "  - " + fault(rng, 1000) + "\n";
    for (std::uint64_t entry = rng.below(5); entry > 0; --entry) text += "  - " + act(rng) + "\n";
    return write("scenarios/faults.yaml", text);
  }

 private:
  fs::path write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_.path() / name).parent_path());
    EXPECT_TRUE(text::write_file(folder_.path() / name, text).has_value());
    return folder_.path() / name;
  }
  static std::string number(Rng& rng, std::uint64_t from, std::uint64_t to) {
    return std::to_string(from + rng.below(to - from + 1));
  }
  template <std::size_t n>
  static std::string pick(Rng& rng, const char* const (&words)[n]) {
    return words[rng.below(n)];
  }

  static std::string chart(Rng& rng) {
    const std::uint64_t states = 2 + rng.below(3);
    std::string text = R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
<datamodel><data id="n" expr="0"/></datamodel>
)";
    for (std::uint64_t i = 0; i < states; ++i) {
      text += "<state id=\"s" + std::to_string(i) + "\"><onentry><assign location=\"n\" expr=\"n + 1\"/>";
      // One at a time: of several that are due within the lateness of the machine a replay knows when the first rang.
      if (rng.below(2) == 0) {
        text +=
            "<cancel sendid=\"later\"/><send id=\"later\" event=\"later\" delay=\"" + number(rng, 10, 250) + "ms\"/>";
      }
      if (rng.below(2) == 0) text += R"(<send type="thrift" target="s" event="ask"><param name="n" expr="n"/></send>)";
      if (rng.below(3) == 0) text += R"(<send type="thrift" target="t" event="told"><param name="n" expr="n"/></send>)";
      text += "</onentry>";
      for (const char* event : {"tick", "later", "s.ask.reply", "error", "halt", "s.said", "t.told"}) {
        const std::uint64_t to = rng.below(states + 2);
        const bool ends = to >= states;
        const bool is_way_out = i == 0 && std::string_view(event) == "halt";  // check wants one
        if (is_way_out || rng.below(3) != 0 || (ends && rng.below(2) != 0)) continue;
        text += std::string("<transition event=\"") + event + "\" target=\"" +
                (!ends          ? "s" + std::to_string(to)
                 : to == states ? "success"
                                : "failure") +
                "\"/>";
      }
      if (i == 0) text += "<transition event=\"halt\" target=\"failure\"/>";
      text += R"(<transition event="*"><log label="heard" expr="_event.name + ' ' + n"/></transition></state>
)";
    }
    return text + "<final id=\"success\"/><final id=\"failure\"/></scxml>\n";
  }

  static std::string fault(Rng& rng, std::uint64_t before) {
    const std::string at = "{at: " + number(rng, 1, before) + " ms, ";
    static constexpr const char* kMessages[] = {"s.*",    "s.ask",  "s.ask.reply", "s.said", "t.told", "*.tick",
                                                "*.halt", "A.tick", "B.*",         "\"*\"",  "t.*",    "C.halt"};
    static constexpr const char* kCalls[] = {"s.ask", "\"s.*\"", "\"*\""};
    const std::string count = rng.below(4) == 0 ? "" : ", count: " + number(rng, 1, 12);
    switch (rng.below(7)) {
      case 0: return at + "unreachable: " + pick(rng, kCalls) + "}";
      case 1: return at + "late: " + pick(rng, kCalls) + "}";
      case 2: return at + "falsify: {call: s.ask, value: 77" + count + "}}";
      case 3: {
        static constexpr const char* kStatus[] = {"SUCCESS", "FAILURE", "RUNNING"};
        static constexpr const char* kLeaves[] = {"A", "B", "C"};
        const std::string leaf = pick(rng, kLeaves);
        return at + "force: {leaf: " + leaf + ", status: " + pick(rng, kStatus) + count + "}}";
      }
      default: {
        std::string message = pick(rng, kMessages);
        if (message.find('*') != std::string::npos && message[0] != '"') message = "\"" + message + "\"";
        return at + "delay: {message: " + message + ", by: " + number(rng, 1, 400) + " ms" + count + "}}";
      }
    }
  }

  static std::string act(Rng& rng) {
    const std::string at = "{at: " + number(rng, 1, 2900) + " ms, ";
    static constexpr const char* kParts[] = {"A", "B", "s"};
    switch (rng.below(6)) {
      case 0: return at + "clear: " + number(rng, 1, 4) + "}";
      case 1: return at + "kill: " + pick(rng, kParts) + "}";
      case 2: return at + "restart: " + pick(rng, kParts) + "}";
      case 3: return at + "call: t.told, args: {n: " + number(rng, 100, 200) + "}}";
      case 4: return at + "call: s.ask, args: {n: " + number(rng, 100, 200) + "}}";
      default: return fault(rng, 2900);
    }
  }

  const TemporaryFolder folder_{"noisy"};
};

std::string first_error(const Diagnostics& found) {
  for (const Diagnostic& each : found) {
    if (each.severity == Severity::kError) return to_string(each);
  }
  return "";
}

class RealTime : public ::testing::Test {
 protected:
  // Why there is no recording; empty: there is one.
  std::string record(const fs::path& file, const runtime::Stream::Listener& listener, bool durable = false) {
    const text::ReadLog log;
    auto scenario = project::load_scenario(file);
    if (!scenario.value) return first_error(scenario.diagnostics);
    scenario.value->virtual_time = false;
    scenario.value->factor = kFactor;
    const auto plan = project::prepare(std::move(*scenario.value));
    if (!plan.value) return first_error(plan.diagnostics);
    runtime::RunOptions options;
    options.listeners.push_back(listener);
    RecordingOptions recording;
    if (durable) {
      recording.facts.emplace_back("durable", "true");
      options.durable =
          runtime::DurableOptions{.journal = folder_.path() / "run.journal", .sync = project::JournalSync::kNever};
    }
    RunRecorder recorder(*plan.value, log.files(), std::move(*record::FileSink::create(recording_)),
                         std::move(recording));
    recorder.install(options);
    const runtime::RunReport report = runtime::Run(*plan.value, std::move(options)).execute();
    recorder.finish(report);
    return report.error;
  }

  Result<ReplayReport> replay_again(ReplayOptions options) {
    auto recorded = RecordedRun::open(recording_);
    if (!recorded) return tl::unexpected(recorded.error());
    auto scenario = recorded->scenario();
    if (!scenario.value) return tl::unexpected(scenario.diagnostics.front());
    auto plan = project::prepare(std::move(*scenario.value));
    if (!plan.value) return tl::unexpected(plan.diagnostics.front());
    return replay(*recorded, std::move(*plan.value), std::move(options));
  }

  // Where leaves did something else now; empty: nowhere.
  static std::string difference(Deliveries& then, Deliveries& now) {
    for (const auto& [leaf, all] : then) {
      const auto [a, b] = std::mismatch(all.begin(), all.end(), now[leaf].begin(), now[leaf].end());
      if (a == all.end()) continue;
      return leaf + ", number " + std::to_string(a - all.begin()) + ": " + *a +
             "\nnow: " + (b != now[leaf].end() ? *b : "nothing more") +
             "\nbefore: " + (a != all.begin() ? *(a - 1) : "nothing");
    }
    return "";
  }

  // What is different; empty: nothing.
  std::string judge(const fs::path& file) {
    Deliveries then;
    Deliveries now;
    const std::string error = record(file, [&](const Message& message) {
      if (message.time < kCompared) note(then, message);
    });
    if (!error.empty()) return error;
    ReplayOptions options;
    options.run.listeners.push_back([&](const Message& message) { note(now, message); });
    const auto report = replay_again(std::move(options));
    if (!report) return to_string(report.error());
    if (const std::string found = difference(then, now); !found.empty()) return found;
    differences_ = report->differences;
    if (!report->unrecorded.empty() && report->unrecorded_at < kCompared)
      return report->unrecorded + ", which was not recorded";
    return "";
  }

  // The same from the last moment before `moment` at which the run was at rest, or from the beginning.
  std::string judge_at(TimePoint moment, const std::vector<Message>& messages) {
    Deliveries then;
    Deliveries now;
    std::uint64_t first = 0;
    ReplayOptions options;
    options.at = moment;
    options.run.listeners.push_back([&](const Message& message) {
      if (first == 0) first = message.sequence;
      note(now, message);
    });
    const auto report = replay_again(std::move(options));
    if (!report) return to_string(report.error());
    restored_ += report->restored.has_value();
    EXPECT_TRUE(report->moment.has_value());
    // What the machine has done by then takes no time in a replay.
    for (const Message& message : messages) {
      if (message.sequence >= first && message.time < moment) note(then, message);
    }
    if (const std::string found = difference(then, now); !found.empty()) return found;
    return report->unrecorded;
  }

  void judge_moments(bool durable) {
    NoisyProject project;
    std::size_t moments = 0;
    for (const std::uint64_t seed : seeds(kScenarios / 2)) {
      std::vector<Message> messages;
      const auto listener = [&](const Message& message) { messages.push_back(message); };
      const std::string error = record(project.make(seed, "13 s"), listener, durable);
      // Where all is executed in one thread, time does not pass while a skill and a component talk.
      if (durable && error.find("answer each other for ever") != std::string::npos) continue;
      ASSERT_EQ(error, "");
      Rng rng(seed);
      const auto expect_same = [&](std::uint64_t from_ms, std::uint64_t ms) {
        const TimePoint moment(std::chrono::milliseconds(from_ms + rng.below(ms)));
        EXPECT_EQ(judge_at(moment, messages), "")
            << "seed " << seed << ", at " << moment.time_since_epoch().count() << " ns";
      };
      for (int i = 0; i < 4; ++i, ++moments) expect_same(6000, 6800);
      // From the beginning: of durable runs it is not recorded when a leaf took what a fault has held back.
      if (durable) continue;
      const std::size_t later = restored_;
      expect_same(500, 3000);
      EXPECT_EQ(restored_, later) << "there is a snapshot before";
    }
    // Of some something is always on its way.
    EXPECT_GT(restored_, moments / 2);
  }

  const TemporaryFolder folder_{"real-time"};
  const std::string recording_ = (folder_.path() / "run.mcap").string();
  std::vector<Difference> differences_;  // in the replay that was judged last
  std::size_t restored_ = 0;             // moments that were gone to from a snapshot
};

TEST_F(RealTime, ALeafThatNeverAnswersAgainIsPastItsBudgetInAReplayToo) {
  NoisyProject project;
  EXPECT_EQ(judge(project.make_late()), "");
  for (const Difference& one : differences_)
    ADD_FAILURE() << one.who << ' ' << one.recorded << "; now " << one.replayed;
}

TEST_F(RealTime, FaultsThatStandTogetherAreReplayedAsTheyRan) {
  NoisyProject project;
  for (const std::uint64_t seed : seeds(kScenarios)) {
    const fs::path file = project.make(seed);
    EXPECT_EQ(judge(file), "") << "seed " << seed;
  }
}

TEST_F(RealTime, TheOnlyTimerOfASkillThatWasNeverTakenDoesNotRing) {
  NoisyProject project;
  Deliveries then;
  Deliveries now;
  ASSERT_EQ(record(project.make_busy(), [&](const Message& message) { note(then, message); }), "");
  ReplayOptions options;
  options.run.listeners.push_back([&](const Message& message) { note(now, message); });
  ASSERT_TRUE(replay_again(std::move(options)));
  EXPECT_FALSE(then["A"].empty());
  EXPECT_EQ(difference(then, now), "");
}

// A publication that was late overtook it in that scenario, and the chart took it back.
TEST_F(RealTime, ATimerThatWasDueAndNotTakenDoesNotRing) {
  NoisyProject project;
  EXPECT_EQ(judge(project.make(75)), "");
}

TEST_F(RealTime, AMomentIsTheSameFromTheLastSnapshotAtRest) { judge_moments(false); }

TEST_F(RealTime, AMomentOfADurableRunToo) { judge_moments(true); }

}  // namespace
}  // namespace sentree::replay
