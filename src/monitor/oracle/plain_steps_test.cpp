// Plain steps beside the algorithm of the recommendation.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <map>

#include "sentree/monitor/detail/model.h"
#include "sentree/monitor/monitor_set.h"
#include "sentree/monitor/oracle/random.h"
#include "sentree/monitor/quick.h"

namespace sentree::monitor::oracle {
namespace {

std::uint64_t given_seed() {
  const char* given = std::getenv("SENTREE_SEED");
  return given != nullptr ? std::strtoull(given, nullptr, 10) : 20'261'124;
}

struct Counts {
  int observed = 0;
  int plain = 0;
  int told = 0;  // what they would enable
};

// The same observations, one way and the other: sessions, verdicts and timers are equal after each. False: they differ.
bool steps_alike(const Model& model, const std::vector<Message>& trace, Counts& counts) {
  const auto& plans = Access::parts(model).plain;
  Core quick = begin(model, TimePoint{});
  Core whole = quick;
  std::map<std::string, Listeners> listeners;
  for (const Message& message : trace) {
    const Stepped timed = step_timers(model, quick, message.time - Duration(1));
    if (timed.verdict != step_timers(model, whole, message.time - Duration(1)).verdict) return false;
    if (!whole.session.running() || !model.listens_to(message.name)) continue;
    ++counts.observed;
    std::array<scxml::PlainValue, kPlainMembersMax> members;
    PlainWay plainly;
    if (const auto known = plans.find(message.name); known != plans.end()) {
      known->second.reader.read(message, members.data());
      plainly = {&known->second.plan, members.data()};
    }
    Listeners& listener = listeners.try_emplace(message.name, std::vector<Model>{model}, message.name).first->second;
    listener.hear(message);
    if (const auto told = listener.enabled(0, quick)) {
      const scxml::Event event{.name = message.name, .data = Access::parts(model).projection.data(message)};
      if (told != scxml::enabled_by(model.chart(), quick.session, event, message.time)) return false;
      ++counts.told;
    }
    PlainWay never;
    const Stepped one = step(model, quick, message, nullptr, plainly, {}, nullptr);
    const Stepped other = step(model, whole, message, nullptr, never, {}, nullptr);
    if (plainly.taken) ++counts.plain;
    if (one.verdict != other.verdict || one.state != other.state || !(quick.session == whole.session) ||
        quick.since != whole.since || next_timer(model, quick) != next_timer(model, whole))
      return false;
  }
  return true;
}

TEST(PlainSteps, LeaveWhatTheAlgorithmLeaves) {
  const std::uint64_t seed = given_seed();
  constexpr int kRequirements = 1'500;
  constexpr int kTraces = 4;
  std::printf("seed %llu, %d requirements x %d traces\n", static_cast<unsigned long long>(seed), kRequirements,
              kTraces);
  Rng rng(seed);
  Counts counts;
  for (int i = 0; i < kRequirements; ++i) {
    const bool segments = i % 8 == 0;
    const std::string text = segments ? random_owed_between(rng) : random_requirement(rng);
    const auto file = parse_requirements(random_definitions() + text, "r.req");
    ASSERT_TRUE(file.ok()) << text;
    const auto model = Model::make(file.value->requirements.at(0));
    ASSERT_TRUE(model.ok()) << text;
    for (int t = 0; t < kTraces; ++t) {
      const std::vector<Message> trace = segments ? random_segments(rng) : random_trace(rng);
      ASSERT_TRUE(steps_alike(*model.value, trace, counts)) << text << "\n"
                                                            << show(trace) << model.value->chart().source();
    }
  }
  std::printf("%d of %d steps were plain, of %d it was told plainly what they enable\n", counts.plain, counts.observed,
              counts.told);
  EXPECT_GT(counts.plain, counts.observed / 4);
  EXPECT_GT(counts.told, counts.observed / 4);
}

// What people draw: data of every kind, texts that are kept, things raised, timers, content on entry and exit.
constexpr const char* kDrawn[] = {
    R"(<datamodel><data id="kept"/><data id="n" expr="0"/><data id="flag" expr="false"/></datamodel>
<state id="a"><onexit><assign location="n" expr="n + 1"/></onexit>
<transition event="battery.level.reply" cond="_event.data.result &lt; 30 &amp;&amp; !flag" target="b"><assign location="kept" expr="_event.data.result"/></transition>
<transition event="s.text.reply"><assign location="kept" expr="_event.data.result"/><raise event="noted"/></transition>
<transition event="noted" cond="typeof kept === 'string'"><assign location="flag" expr="kept === 'x'"/></transition>
<transition event="s.ok.reply" cond="_event.data.result == null"/>
<transition event="s.ok.reply" target="c"/></state>
<state id="b" initial="b1"><onentry><send event="late" id="late" delay="100ms"/></onentry><onexit><cancel sendid="late"/></onexit>
<state id="b1"><transition event="battery" target="b2"/></state><state id="b2"><transition event="battery" cond="n % 2 == 1" target="b1"/></state>
<transition event="late" target="a"/><transition event="s" target="a"/></state>
<state id="c"><transition cond="n &gt; 3" target="a"/><transition event="*" target="a"><if cond="kept"><assign location="kept" expr="undefined"/><elseif cond="flag"/><assign location="kept" expr="null"/><else/><assign location="kept" expr="n"/></if></transition></state>)",
    R"(<datamodel><data id="level" expr="50"/><data id="text" expr="'none'"/></datamodel>
<parallel id="p"><state id="l"><transition event="battery.level.reply"><assign location="level" expr="_event.data.result"/><raise event="changed"/></transition></state>
<state id="r"><state id="r1"><transition event="changed" cond="level &lt; 30"><assign location="text" expr="'low'"/></transition></state></state>
<transition event="s.ask.reply" cond="In('r1') &amp;&amp; text === 'low'"><assign location="text" expr="text + '!'"/></transition></parallel>)",
    R"(<datamodel><data id="count" expr="0"/></datamodel>
<state id="away"><transition event="s.place.reply" cond="_event.data.result === 'x' &amp;&amp; count &gt;= 2" target="much"/>
<transition event="s.place.reply" target="there"><assign location="count" expr="count + 1"/><send event="forget" delay="50ms"/></transition>
<transition event="forget"><assign location="count" expr="count - 1"/></transition></state>
<state id="there"><transition event="battery battery.level" target="away"/><transition event="forget"><assign location="count" expr="count - 1"/></transition></state>
<state id="much"><transition event="forget" cond="--count == 0" target="away"/></state>)",
    R"(<datamodel><data id="n" expr="0"/><data id="kept"/></datamodel>
<state id="a"><transition event="s.text.reply" cond="typeof _event.data.result === 'object'"><assign location="n" expr="n + 1"/></transition>
<transition event="s.text.reply" cond="typeof _event.data.result != 'number' &amp;&amp; typeof _event.data.result !== 'undefined'">
<assign location="n" expr="typeof _event.data.result == 'boolean' ? n + 10 : typeof _event.data.result === 'string' ? n + 100 : n + 1000"/></transition>
<transition event="s.ok.reply"><assign location="kept" expr="_event.data.result &amp;&amp; typeof _event.data.result.x === 'number' ? _event.data.result.x : undefined"/></transition>
<transition event="s.ask.reply" cond="typeof kept === 'undefined'" target="b"/></state>
<state id="b"><transition event="*" cond="typeof kept !== 'function'" target="a"/></state>)"};

// Results of each kind, missing ones and times that meet deadlines.
std::vector<Message> drawn_trace(Rng& rng) {
  static constexpr const char* kNames[] = {"battery.level.reply", "s.text.reply",  "s.ok.reply",
                                           "s.ask.reply",         "s.place.reply", "other"};
  std::vector<Message> trace;
  TimePoint now{};
  for (int i = 0; i < 60; ++i) {
    now += Duration(std::chrono::milliseconds(10 * rng.below(4)));
    Message message;
    message.name = kNames[rng.below(std::size(kNames))];
    message.source = rng.below(2) == 0 ? "one" : "two";
    message.time = now;
    message.sequence = static_cast<std::uint64_t>(i + 1);
    switch (rng.below(8)) {
      case 0: message.data = Map{{"result", true}}; break;
      case 1: message.data = Map{{"result", "x"}}; break;
      case 2: message.data = Map{{"result", ""}}; break;
      case 3: message.data = Map{{"result", Value()}}; break;
      case 4: message.data = Map{{"result", Map{{"x", 1}}}}; break;
      case 5: break;
      default: message.data = Map{{"result", static_cast<std::int64_t>(rng.below(60))}}; break;
    }
    trace.push_back(std::move(message));
  }
  return trace;
}

TEST(PlainSteps, LeaveWhatTheAlgorithmLeavesInChartsThatAreDrawn) {
  const std::uint64_t seed = given_seed();
  std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  Rng rng(seed);
  for (const char* inside : kDrawn) {
    auto chart =
        scxml::load("<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\">" +
                        std::string(inside) + "<final id=\"violated\"/></scxml>",
                    "drawn.scxml");
    ASSERT_TRUE(chart.ok()) << to_string(chart.diagnostics.front());
    const auto model = Model::make({.name = "drawn", .chart = *std::move(chart.value)});
    ASSERT_TRUE(model.ok()) << to_string(model.diagnostics.front());
    Counts counts;
    for (int t = 0; t < 2'000; ++t) {
      const std::vector<Message> trace = drawn_trace(rng);
      ASSERT_TRUE(steps_alike(*model.value, trace, counts)) << inside << "\n" << show(trace);
    }
    EXPECT_GT(counts.plain, 0) << inside;
  }
}

// Content that is plain and content that is not, on ways that meet: states that several transitions enter and leave.
std::string random_ways(Rng& rng) {
  const auto action = [&]() -> std::string {
    switch (rng.below(7)) {
      case 0: return "<send event=\"bad\"/>";  // not plain: it comes at once
      case 1: return "<raise event=\"noted\"/>";
      case 2: return "<send event=\"late\" delay=\"50ms\"/>";
      case 3: return "<log expr=\"n\"/>";
      default: return "<assign location=\"n\" expr=\"(n + 1) % 5\"/>";
    }
  };
  const auto block = [&](const char* element) {
    std::string all;
    for (auto left = rng.below(3); left > 0; --left) all += action();
    return all.empty() ? all : fmt::format("<{}>{}</{}>", element, all, element);
  };
  const auto transition = [&] {
    static constexpr const char* kEvents[] = {"battery", "s.text.reply", "s.ok s.ask", "s", "bad", "late"};
    const std::string cond = rng.below(2) == 0 ? "" : fmt::format(" cond=\"n % 2 == {}\"", rng.below(2));
    return fmt::format("<transition event=\"{}\"{} target=\"s{}\"/>", kEvents[rng.below(std::size(kEvents))], cond,
                       rng.below(6));
  };
  std::string text = "<datamodel><data id=\"n\" expr=\"0\"/></datamodel>";
  for (int i = 0; i < 6; ++i) {
    if (i % 3 == 0) text += fmt::format("<state id=\"w{}\">{}{}", i, block("onentry"), block("onexit"));
    text += fmt::format("<state id=\"s{}\">{}{}", i, block("onentry"), block("onexit"));
    for (auto left = rng.below(3); left > 0; --left) text += transition();
    text += "</state>";
    if (i % 3 != 2) continue;
    text += transition() + "<transition event=\"noted\"><assign location=\"n\" expr=\"n * 2\"/></transition></state>";
  }
  return text;
}

TEST(PlainSteps, LeaveWhatTheAlgorithmLeavesWhereWaysMeet) {
  const std::uint64_t seed = given_seed();
  std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  Rng rng(seed);
  Counts counts;
  for (int i = 0; i < 500; ++i) {
    const std::string inside = random_ways(rng);
    auto chart =
        scxml::load("<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\">" +
                        inside + "<final id=\"violated\"/></scxml>",
                    "ways.scxml");
    ASSERT_TRUE(chart.ok()) << inside << to_string(chart.diagnostics.front());
    const auto model = Model::make({.name = "ways", .chart = *std::move(chart.value)});
    ASSERT_TRUE(model.ok()) << to_string(model.diagnostics.front());
    for (int t = 0; t < 4; ++t) {
      const std::vector<Message> trace = drawn_trace(rng);
      ASSERT_TRUE(steps_alike(*model.value, trace, counts)) << inside << "\n" << show(trace);
    }
  }
  EXPECT_GT(counts.plain, counts.observed / 50);
}

// A set steps each of its monitors as that one alone, whatever the others read of the same observation.
TEST(PlainSteps, AreThoseOfEachMonitorInASet) {
  const std::uint64_t seed = given_seed();
  std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  Rng rng(seed);
  for (int round = 0; round < 200; ++round) {
    std::vector<Model> models;
    for (int i = 0; i < 5; ++i) {
      const auto file = parse_requirements(random_definitions() + random_requirement(rng), "r.req");
      ASSERT_TRUE(file.ok());
      auto model = Model::make(file.value->requirements.at(0));
      ASSERT_TRUE(model.ok());
      models.push_back(*std::move(model.value));
    }
    const std::vector<Message> trace = random_trace(rng);
    if (trace.empty()) continue;
    MonitorSet set(models, TimePoint{});
    std::vector<MonitorSet::Decided> decided;
    for (const Message& message : trace) set.observe(std::make_shared<const Message>(message), decided);
    for (std::size_t i = 0; i < models.size(); ++i) {
      State alone = start(models[i], TimePoint{});
      for (const Message& message : trace) {
        advance(models[i], alone, message.time - Duration(1));
        observe(models[i], alone, message);
      }
      ASSERT_TRUE(set.state(i).session == alone.session) << show(trace) << models[i].chart().source();
    }
  }
}

}  // namespace
}  // namespace sentree::monitor::oracle
