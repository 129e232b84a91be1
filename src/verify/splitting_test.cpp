#include "sentree/verify/splitting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/text/file.h"
#include "sentree/verify/detail/test_in_folder.h"
#include "sentree/verify/statistics.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

using ::testing::HasSubstr;

const std::string kSplitHead =
    "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" ";

// Each in a thread of its own, the last one first.
void backwards(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::vector<std::thread> threads;
  for (std::size_t i = count; i-- > 0;) threads.emplace_back([&work, i] { work(i); });
  for (std::thread& thread : threads) thread.join();
}

// A walker on a line of cells who is asked each tick where he is. He begins at 1, steps up with probability 1/3, else
// down, and stays at the ends.
class Splits : public InFolder {
 protected:
  Splits() : InFolder("splits") {}

  project::Plan plan(int top, const std::string& requirement) {
    write("interfaces/walker.thrift", "service Walker { i32 ask() }\n");
    write("skills/Ask.scxml", kSplitHead + R"(initial="asking"><state id="asking">
  <onentry><send type="thrift" target="walker" event="ask"/></onentry>
  <transition event="walker.ask.reply" cond="_event.data.result === 0" target="success"/>
  <transition event="walker.ask.reply" target="waiting"/><transition event="error" target="failure"/></state>
<state id="waiting"><transition event="tick" target="asking"/><transition event="halt" target="failure"/></state>
<final id="success"/><final id="failure"/></scxml>)");
    tree("<Action ID=\"Ask\"/>");
    write("models/walker.scxml",
          kSplitHead + R"(initial="there"><datamodel><data id="x" expr="1"/><data id="name" expr="'w'"/></datamodel>
<state id="there"><onentry><send event="step" delay="100ms"/></onentry>
  <transition event="step" target="there"><if cond="x !== 0 &amp;&amp; x !== )" +
              std::to_string(top) + R"(">
    <assign location="x" expr="chance(1 / 3) ? x + 1 : x - 1"/></if></transition>
  <transition event="walker.ask.request"><send type="thrift" target="walker" event="ask.reply">
    <param name="result" expr="x"/></send></transition></state></scxml>)");
    write("r.req", "let at = reply(walker.ask)\n" + requirement);
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {walker: {interface: walker.thrift/Walker, at: "
          "model}}\nmodels: [{file: models/walker.scxml, name: man, serves: [walker]}]\nmonitors: [{file: r.req}]\n");
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    for (const Diagnostic& one : prepared.diagnostics) EXPECT_NE(one.severity, Severity::kError) << to_string(one);
    return std::move(prepared.value.value());
  }
  static Splitting splitting(const std::string& score) {
    Splitting one;
    one.score = score;
    one.order = Order::kVirtual;
    one.length = std::chrono::seconds(60);
    return one;
  }
};

// Student's interval for a mean.
// @param quantile  Of the distribution with so many degrees of freedom as there are values, but one.
std::pair<double, double> interval_of(const std::vector<double>& values, double quantile) {
  const auto n = static_cast<double>(values.size());
  double mean = 0;
  for (const double value : values) mean += value / n;
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const double off = quantile * std::sqrt(squares / (n - 1) / n);
  return {mean - off, mean + off};
}

const std::string kNeverUp = "low \"He does not get up.\": always at < ";

TEST_F(Splits, FindWhatHappensOnceInAMillionRuns) {
  // The gambler's ruin: (q/p - 1) / ((q/p)^20 - 1) with q/p = 2.
  const double exact = 1 / (std::pow(2.0, 20) - 1);
  const project::Plan of = plan(20, kNeverUp + "20.\n");
  Asked asked;
  asked.explore.order = Order::kVirtual;
  const Verification found = verify(of, asked);
  ASSERT_TRUE(found.judgements.front().least);
  EXPECT_NEAR(found.judgements.front().least->low, exact, exact * 1e-6);

  constexpr int kSeeds = 40;
  constexpr double kQuantile = 2.093;  // 95 %, 19 degrees of freedom
  int inside = 0;
  double sum = 0;
  double squares = 0;
  std::uint64_t runs = 0;
  std::uint64_t violated = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    Splitting one = splitting("man.x");
    one.walkers = 100;
    one.repetitions = 20;
    one.seed = static_cast<std::uint64_t>(seed);
    const auto splits = split(of, 0, one);
    ASSERT_TRUE(splits) << to_string(splits.error());
    const auto [low, high] = interval_of(splits->estimates, kQuantile);
    inside += low <= exact && exact <= high ? 1 : 0;
    for (const double estimate : splits->estimates) {
      sum += estimate;
      squares += estimate * estimate;
    }
    runs += splits->runs;
    violated += splits->violated;
  }
  EXPECT_GE(inside, kSeeds * 85 / 100) << "of " << kSeeds;
  // Without bias: what is left of the error is chance.
  const double n = kSeeds * 20;
  const double mean = sum / n;
  const double error = std::sqrt((squares / n - mean * mean) / n);
  EXPECT_NEAR(mean, exact, 4 * error);
  EXPECT_LT(error, exact / 10);
  EXPECT_LE(violated, 2U) << "so many of " << runs << " runs saw it without being split";
}

TEST_F(Splits, GoByWhatAMonitorOwes) {
  // It owes that he comes down to 0; each tick without that uses up its bound.
  for (const char* const bound : {"60 ticks", "6 s"}) {
    SCOPED_TRACE(bound);
    const project::Plan of =
        plan(70, std::string("down \"He comes down.\": eventually at = 0 within ") + bound + ".\n");
    Asked asked;
    asked.explore.order = Order::kVirtual;
    const Verification found = verify(of, asked);
    ASSERT_TRUE(found.errors.empty()) << to_string(found.errors.front());
    ASSERT_TRUE(found.judgements.front().least);
    const double exact = found.judgements.front().least->low;
    EXPECT_LT(exact, 1e-2);
    EXPECT_GT(exact, 0);
    const auto splits = split(of, 0, splitting(kOwed));
    ASSERT_TRUE(splits) << to_string(splits.error());
    const auto [low, high] = interval_of(splits->estimates, 3.659);  // 99.9 %, 29 degrees of freedom
    EXPECT_LE(low, exact);
    EXPECT_GE(high, exact);
    EXPECT_GT(low, 0);
  }
}

TEST_F(Splits, LeaveOpenWhatIsDueBehindTheEndOfARun) {
  const project::Plan of = plan(70, "down \"He comes down.\": eventually at = 0 within 400 ms.\n");
  const Verification found = verify(of, {});
  ASSERT_TRUE(found.judgements.front().least);
  const double exact = found.judgements.front().least->low;
  EXPECT_GT(exact, 0.05);
  const auto runs = [&](std::uint64_t count, bool memory, Duration length) {
    std::vector<Came> all;
    Sampling sampling;
    sampling.runs = count;
    sampling.length = length;
    sampling.memory_of_periods = memory;
    sampling.told = [&](const std::vector<Came>& came) {
      all.push_back(came.front());
      return true;
    };
    EXPECT_TRUE(sample(of, sampling));
    return all;
  };
  const auto share = [](const std::vector<Came>& all, Came came) {
    return static_cast<double>(std::count(all.begin(), all.end(), came)) / static_cast<double>(all.size());
  };
  const Duration short_run = std::chrono::milliseconds(300);
  const auto all = runs(4'000, true, short_run);
  EXPECT_EQ(runs(20, false, short_run), std::vector(all.begin(), all.begin() + 20));
  EXPECT_EQ(share(all, Came::kViolated), 0);
  const double open = share(all, Came::kStillOwed);
  EXPECT_GT(open, exact);
  EXPECT_LT(open, 1);
  const auto long_ones = runs(4'000, true, std::chrono::seconds(60));
  EXPECT_EQ(share(long_ones, Came::kStillOwed), 0);
  EXPECT_NEAR(share(long_ones, Came::kViolated), exact, 4 * std::sqrt(exact / 4'000));

  // By splitting likewise, whatever is given up on the way.
  for (const char* const score : {kOwed, "man.x"}) {
    Splitting one = splitting(score);
    one.order = Order::kAny;
    one.length = short_run;
    const auto splits = split(of, 0, one);
    ASSERT_TRUE(splits) << to_string(splits.error());
    EXPECT_EQ(splits->estimates, std::vector<double>(splits->estimates.size())) << score;
    const auto [low, high] = interval_of(splits->with_open, 3.659);
    EXPECT_LE(low, open + 0.03) << score;
    EXPECT_GE(high, open - 0.03) << score;
    one.length = std::chrono::seconds(60);
    const auto decided = split(of, 0, one);
    ASSERT_TRUE(decided) << to_string(decided.error());
    EXPECT_EQ(decided->with_open, decided->estimates) << score;
  }
}

TEST_F(Splits, AreTheSameHoweverManyWorkersThereAre) {
  const project::Plan of = plan(12, kNeverUp + "12.\n");
  Splitting one = splitting("man.x");
  one.repetitions = 7;
  const auto alone = split(of, 0, one);
  one.workers = 3;
  one.each = backwards;
  const auto shared = split(of, 0, one);
  ASSERT_TRUE(alone && shared);
  EXPECT_EQ(alone->estimates, shared->estimates);
  EXPECT_EQ(alone->branches, shared->branches);
}

TEST_F(Splits, NeedAScoreThatIsANumber) {
  const project::Plan of = plan(12, kNeverUp + "12.\n");
  const auto unknown = split(of, 0, splitting("man.y"));
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("no model has data called \"man.y\""));
  const auto text = split(of, 0, splitting("man.name"));
  ASSERT_FALSE(text);
  EXPECT_THAT(text.error().message, HasSubstr("man.name is not always a number"));
}

TEST_F(Splits, RunsAndJudgementsAreTheSameHoweverManyWorkersThereAre) {
  const project::Plan of = plan(4, kNeverUp + "4.\n" + "far \"He does not go far.\": always at < 3.\n");
  const auto told = [&](std::size_t workers) {
    Sampling sampling;
    sampling.runs = 500;
    sampling.length = std::chrono::seconds(10);
    sampling.workers = workers;
    if (workers > 1) sampling.each = backwards;
    std::vector<std::vector<Came>> all;
    sampling.told = [&](const std::vector<Came>& of_run) {
      all.push_back(of_run);
      return all.size() < 400;
    };
    EXPECT_EQ(sample(of, sampling).value_or(0), 400U);
    return all;
  };
  EXPECT_EQ(told(1), told(3));
  Asked asked;
  const Verification one = verify(of, asked);
  asked.each = backwards;
  const Verification many = verify(of, asked);
  ASSERT_EQ(one.judgements.size(), many.judgements.size());
  for (std::size_t i = 0; i < one.judgements.size(); ++i) {
    EXPECT_EQ(one.judgements[i].requirement, many.judgements[i].requirement);
    EXPECT_EQ(one.judgements[i].path->edges, many.judgements[i].path->edges);
    EXPECT_EQ(one.judgements[i].greatest->high, many.judgements[i].greatest->high);
  }
}

// A model that says something every 50 ms, so and so often, under a mission that never ends.
class EndOfARun : public InFolder {
 protected:
  EndOfARun() : InFolder("end") {}

  project::Plan plan(int times, const std::string& requirements) {
    write("interfaces/d.thrift", "service D { oneway void note(1: i32 x) }\n");
    tree("<KeepRunningUntilFailure><AlwaysSuccess/></KeepRunningUntilFailure>");
    write("m.scxml", R"(<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript"><datamodel>
<data id="n" expr="0"/></datamodel><state><onentry><send event="time" delay="50ms"/></onentry><transition event="time" cond="n &lt; )" +
                         std::to_string(times) +
                         R"("><assign location="n" expr="n + 1"/><send type="thrift" target="d" event="note">
<param name="x" expr="1"/></send><send event="time" delay="50ms"/></transition></state></scxml>)");
    write("r.req", requirements);
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {d: {interface: d.thrift/D, at: model}}\n"
          "models: [{file: m.scxml, serves: [d]}]\nmonitors: [{file: r.req}]\n");
    auto project = project::load_project(folder_.path());
    EXPECT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    for (const Diagnostic& one : prepared.diagnostics) EXPECT_NE(one.severity, Severity::kError) << to_string(one);
    return std::move(prepared.value.value());
  }
  // What comes of the first requirement in a run of that length; however it is made.
  static Came came_of(const project::Plan& of, Duration length) {
    std::vector<Came> all;
    Sampling sampling;
    sampling.runs = 1;
    sampling.length = length;
    sampling.told = [&](const std::vector<Came>& came) {
      all.push_back(came.front());
      return true;
    };
    for (const bool remembers : {true, false}) {
      sampling.memory_of_periods = remembers;
      EXPECT_TRUE(sample(of, sampling));
    }
    Splitting splitting;
    splitting.length = length;
    splitting.walkers = 10;
    splitting.repetitions = 1;
    const auto splits = split(of, 0, splitting);
    EXPECT_TRUE(splits) << to_string(splits.error());
    all.push_back(splits->estimates.front() == 1   ? Came::kViolated
                  : splits->with_open.front() == 1 ? Came::kStillOwed
                                                   : Came::kKept);
    EXPECT_EQ(all, std::vector<Came>(3, all.front()));
    return all.front();
  }
  static bool is_violated(const project::Plan& of, Duration length) { return came_of(of, length) == Came::kViolated; }
};

TEST_F(EndOfARun, IsComeToByWhateverIsDueBeforeIt) {
  using std::chrono::milliseconds;
  for (const char* requirement :
       {"event(request(d.note)) at least every 60 ms", "event(request(d.note)) at least every 50 ms",
        "whenever event(request(d.note)), event(request(d.note)) within 50 ms"}) {
    const project::Plan goes_on = plan(1000, std::string("r: ") + requirement + ".\n");
    for (const int length : {950, 999, 1000, 1001, 1050})
      EXPECT_FALSE(is_violated(goes_on, milliseconds(length))) << requirement << ", " << length;
  }
  // It comes again wherever a run ends; only what no run can come to the end of is open.
  for (const char* const bound : {"60 ms", "999 ms", "9 ticks", "1 s", "10 ticks"}) {
    const project::Plan again = plan(1000, std::string("r: event(request(d.note)) at least every ") + bound + ".\n");
    EXPECT_EQ(came_of(again, milliseconds(1000)) == Came::kStillOwed, bound[0] == '1') << bound;
  }
  // The last one is at 900 ms; what is due at the end is kept.
  const project::Plan stops = plan(18, "r: event(request(d.note)) at least every 60 ms.\n");
  for (const int length : {910, 960}) EXPECT_FALSE(is_violated(stops, milliseconds(length))) << length;
  for (const int length : {961, 1000, 1200}) EXPECT_TRUE(is_violated(stops, milliseconds(length))) << length;
}

}  // namespace
}  // namespace sentree::verify
