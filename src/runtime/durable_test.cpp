#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <future>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/bt/load.h"
#include "sentree/bt/registry.h"
#include "sentree/project/plan.h"
#include "sentree/project/requirements.h"
#include "sentree/runtime/durable.h"
#include "sentree/runtime/run.h"
#include "sentree/runtime/steering.h"
#include "sentree/text/file.h"

namespace sentree::runtime {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

project::Plan plan_of(const std::string& scenario, bool virtual_time = true) {
  auto loaded = project::load_scenario(fs::path(SENTREE_SOURCE_DIR) / "examples" / scenario);
  EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  loaded.value->virtual_time = virtual_time;
  auto plan = project::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  return std::move(*plan.value);
}

TEST(Durability, NamesTheLeavesOfPluginsThatAreExecutedAgain) {
  project::Plan plan = plan_of("recharge/scenarios/normal.yaml");
  EXPECT_EQ(Durability::done_again(plan), "");
  bt::Registry registry;
  registry.action("Knock", [](bt::Context&) { return bt::Status::kSuccess; });
  auto tree = bt::load("<root BTCPP_format=\"4\"><BehaviorTree ID=\"M\"><Knock/></BehaviorTree></root>",
                       {.registry = &registry});
  ASSERT_TRUE(tree.ok());
  plan.tree = std::move(*tree.value);
  plan.scenario.project.plugins.emplace_back();
  EXPECT_THAT(Durability::done_again(plan), HasSubstr("nodes in C++ (Knock) are no part of the journal"));
}

// What an observation says, but for its number: that a run was resumed is an observation too.
std::string said(Message message) {
  message.sequence = 0;
  message.stamp = 0;
  return to_json(message);
}

// What a run says, and what its journal was at some of its moments.
struct Told {
  std::vector<std::string> all;
  RunReport report;
  struct Death {
    TimePoint at;
    std::size_t observations = 0;
    fs::path journal;
  };
  std::vector<Death> deaths;
};

std::string verdicts(const RunReport& report) {
  std::string all;
  for (const MonitorReport& monitor : report.monitors) {
    all += monitor.name + " " + std::string(to_string(monitor.verdict)) + " " + std::to_string(monitor.violations) +
           " " + monitor.failure + "\n";
  }
  return all + std::string(to_string(report.mission)) + " " + std::to_string(report.ended.time_since_epoch().count());
}

Told tell(const project::Plan& plan, const fs::path& folder, const std::vector<TimePoint>& deaths,
          const std::function<void(RunInside&)>& begun = {}, RunOptions options = {},
          std::function<WallTime()> clock = wall_time) {
  Told told;
  options.durable = DurableOptions{
      .journal = folder / "run.journal", .sync = project::JournalSync::kNever, .clock = std::move(clock)};
  options.listeners.push_back([&](const Message& message) { told.all.push_back(said(message)); });
  options.on_begin = [&](RunInside& inside) {
    for (const TimePoint at : deaths) {
      inside.scheduler().at(inside.director(), at, mission::Rank::kInjection, [&told, &folder, at] {
        const fs::path copy = folder / (std::to_string(told.deaths.size()) + ".journal");
        fs::copy_file(folder / "run.journal", copy);
        told.deaths.push_back({at, told.all.size(), copy});
      });
    }
    if (begun) begun(inside);
  };
  runtime::Run run(plan, std::move(options));
  told.report = run.execute();
  run.forget();
  EXPECT_EQ(told.report.error, "");
  EXPECT_FALSE(fs::exists(folder / "run.journal"));
  return told;
}

struct Resumed {
  std::vector<std::string> all;
  RunReport report;
};

Resumed resume(const project::Plan& plan, const fs::path& journal, std::size_t known,
               std::function<WallTime()> clock = wall_time, const std::function<void(const Message&)>& heard = {}) {
  Resumed resumed;
  const auto journaled = read_journal(journal);
  EXPECT_TRUE(journaled.has_value()) << to_string(journaled.error());
  if (!journaled) return resumed;
  RunOptions options;
  options.durable = DurableOptions{.journal = journal.string() + ".next",
                                   .sync = project::JournalSync::kNever,
                                   .known = known,
                                   .clock = std::move(clock)};
  options.resume = &*journaled;
  options.listeners.push_back([&](const Message& message) {
    if (message.name != "mission.resumed") resumed.all.push_back(said(message));
    if (heard) heard(message);
  });
  runtime::Run run(plan, std::move(options));
  resumed.report = run.execute();
  run.forget();
  EXPECT_EQ(resumed.report.error, "");
  return resumed;
}

// Where what was resumed does not end as the run that nobody killed; empty: it does.
std::string difference(const std::vector<std::string>& resumed, const std::vector<std::string>& whole) {
  if (resumed.size() > whole.size()) return std::to_string(resumed.size() - whole.size()) + " observations too many";
  const std::size_t skipped = whole.size() - resumed.size();
  for (std::size_t i = 0; i < resumed.size(); ++i) {
    if (resumed[i] != whole[skipped + i]) return "said " + resumed[i] + "\ninstead of " + whole[skipped + i];
  }
  return {};
}

std::vector<TimePoint> random_times(Rng& rng, TimePoint end, int count) {
  std::vector<TimePoint> times;
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::int64_t>(rng.below(static_cast<std::uint64_t>(end.time_since_epoch().count())));
    // Half of them right behind a tick, where most is on its way.
    times.push_back(TimePoint(Duration(i % 2 == 0 ? at : at / 100'000'000 * 100'000'000 + 1)));
  }
  std::sort(times.begin(), times.end());
  return times;
}

class Killed : public testing::TestWithParam<const char*> {};

// In virtual time nobody misses anything: what was and what follows are the run that nobody killed.
TEST_P(Killed, GoesOnWhereItWas) {
  const std::uint64_t seed = hash_bytes(GetParam());
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  const project::Plan plan = plan_of(GetParam());
  const TimePoint end = [&] {
    runtime::Run run(plan, {});
    return run.execute().ended;
  }();
  const TemporaryFolder folder("test");
  const Told told = tell(plan, folder.path(), random_times(rng, end, 5));
  ASSERT_EQ(told.deaths.size(), 5U);
  for (const Told::Death& death : told.deaths) {
    SCOPED_TRACE("killed at " + std::to_string(death.at.time_since_epoch().count()) + " ns");
    const Resumed resumed = resume(plan, death.journal, death.observations);
    ASSERT_EQ(resumed.all.size(), told.all.size() - death.observations);
    ASSERT_EQ(difference(resumed.all, told.all), "");
    EXPECT_EQ(verdicts(resumed.report), verdicts(told.report));
    ASSERT_EQ(resumed.report.gaps.size(), 1U);
    // It was resumed once, and is not resumed again.
    const auto again = read_journal(death.journal);
    ASSERT_FALSE(again.has_value());
    EXPECT_EQ(again.error().code, "journal.continued");
  }
}

INSTANTIATE_TEST_SUITE_P(Scenarios, Killed,
                         testing::Values("recharge/scenarios/recharge.yaml", "recharge/scenarios/experiment1.yaml",
                                         "recharge/scenarios/shield.yaml", "minimal/scenarios/visit.yaml"));

TEST(Durable, DoesAgainWhatAPersonDid) {
  const project::Plan plan = plan_of("recharge/scenarios/normal.yaml");
  const TemporaryFolder folder("test");
  std::promise<RunInside*> begun;
  RunOptions options;
  options.paused = true;
  auto telling = std::async(std::launch::async, [&] {
    return tell(
        plan, folder.path(), {TimePoint(std::chrono::seconds(12)), TimePoint(std::chrono::seconds(60))},
        [&](RunInside& inside) { begun.set_value(&inside); }, std::move(options));
  });
  Steering& steering = begun.get_future().get()->steering();
  ASSERT_TRUE(steering.run_until(TimePoint(std::chrono::seconds(10))).has_value());
  (void)steering.wait_paused();
  const project::intervention::Call drain{.method = "simulation.setBatteryCharge", .args = Map{{"percent", 25.0}}};
  const auto applied = steering.apply_for(drain, "a person");
  ASSERT_TRUE(applied.has_value()) << to_string(applied.error());
  ASSERT_TRUE(steering.resume().has_value());
  const Told told = telling.get();
  ASSERT_EQ(told.deaths.size(), 2U);
  for (const Told::Death& death : told.deaths) {
    const Resumed resumed = resume(plan, death.journal, death.observations);
    ASSERT_EQ(resumed.all.size(), told.all.size() - death.observations);
    EXPECT_EQ(difference(resumed.all, told.all), "");
    EXPECT_EQ(verdicts(resumed.report), verdicts(told.report));
  }
}

// What a damaged record said is not known, and what stands behind it cannot be done again in good faith.
TEST(Durable, RefusesAJournalThatIsDamagedInTheMiddle) {
  const project::Plan plan = plan_of("recharge/scenarios/experiment1.yaml");
  const TemporaryFolder folder("test");
  const Told told = tell(plan, folder.path(), {TimePoint(std::chrono::milliseconds(23'450))});
  const fs::path journal = told.deaths.front().journal;
  EXPECT_TRUE(waits_to_be_resumed(journal));
  const std::string whole = *text::read_file(journal);
  for (const std::size_t behind : {std::size_t{300}, std::size_t{900}}) {
    SCOPED_TRACE(behind);
    std::string damaged = whole;
    damaged[whole.size() - behind] ^= 4;
    ASSERT_TRUE(text::write_file(journal, damaged));
    const auto refused = read_journal(journal);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, "journal.damaged");
    // The way out that it tells.
    const std::string& said = refused.error().message;
    const std::string mark = "truncate --size=";
    const std::size_t size = std::strtoull(said.c_str() + said.find(mark) + mark.size(), nullptr, 10);
    ASSERT_LT(size, whole.size() - behind + 1);
    ASSERT_TRUE(text::write_file(journal, damaged.substr(0, size)));
    EXPECT_TRUE(read_journal(journal));
  }
}

TEST(Durable, GoesOnBehindAWriteThatWasTorn) {
  const project::Plan plan = plan_of("recharge/scenarios/experiment1.yaml");
  const TemporaryFolder folder("test");
  const Told told = tell(plan, folder.path(), {TimePoint(std::chrono::milliseconds(23'450))});
  const fs::path journal = told.deaths.front().journal;
  const std::string whole = *text::read_file(journal);
  // In the middle of each of the last octets: a record or two is lost, and nothing but those.
  for (std::size_t lost = 1; lost < 60; lost += 19) {
    SCOPED_TRACE(lost);
    ASSERT_TRUE(text::write_file(journal, whole.substr(0, whole.size() - lost)).has_value());
    ASSERT_TRUE(read_journal(journal)->torn || lost > 40);
    const Resumed resumed = resume(plan, journal, told.deaths.front().observations);
    // What happened at the last instants happens again, alike.
    const std::size_t rest = told.all.size() - told.deaths.front().observations;
    EXPECT_GE(resumed.all.size(), rest);
    EXPECT_LT(resumed.all.size(), rest + 100);
    EXPECT_EQ(difference(resumed.all, told.all), "");
    EXPECT_EQ(verdicts(resumed.report), verdicts(told.report));
  }
}

TEST(Durable, RefusesAJournalThatIsDamagedOrOfAnotherPlan) {
  const project::Plan plan = plan_of("recharge/scenarios/experiment1.yaml");
  const TemporaryFolder folder("test");
  const Told told = tell(plan, folder.path(), {TimePoint(std::chrono::seconds(7))});
  const fs::path journal = told.deaths.front().journal;
  std::string octets = *text::read_file(journal);
  octets[600] = static_cast<char>(octets[600] ^ 1);
  ASSERT_TRUE(text::write_file(folder.path() / "damaged", octets).has_value());
  EXPECT_EQ(read_journal(folder.path() / "damaged").error().code, "journal.damaged");
  ASSERT_TRUE(text::write_file(folder.path() / "other", "no journal").has_value());
  EXPECT_EQ(read_journal(folder.path() / "other").error().code, "journal.damaged");
  EXPECT_EQ(read_journal(folder.path() / "none").error().code, "journal.none");

  const project::Plan other = plan_of("recharge/scenarios/experiment2.yaml");
  const auto journaled = read_journal(journal);
  ASSERT_TRUE(journaled.has_value());
  EXPECT_EQ(read_journal(journal).error().code, "journal.in-use");
  RunOptions options;
  options.durable = DurableOptions{.journal = folder.path() / "next"};
  options.resume = &*journaled;
  runtime::Run run(other, std::move(options));
  EXPECT_THAT(run.execute().error, HasSubstr("saved with other files"));
}

TEST(Durable, SaysThatTheDiskIsFullAndGoesOn) {
  const project::Plan plan = plan_of("recharge/scenarios/experiment1.yaml");
  const TemporaryFolder folder("test");
  std::string told;
  RunOptions options;
  options.durable = DurableOptions{.journal = folder.path() / "run.journal",
                                   .sync = project::JournalSync::kEach,
                                   .on_failure = [&](const std::string& why) { told += why; }};
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_IGN);
  options.on_begin = [&](RunInside& inside) {
    inside.scheduler().at(inside.director(), TimePoint(std::chrono::milliseconds(8'050)), mission::Rank::kInjection,
                          [&] {
                            // What is there may be written over, and nothing be added.
                            const rlimit full{512, before.rlim_max};
                            setrlimit(RLIMIT_FSIZE, &full);
                          });
  };
  runtime::Run run(plan, std::move(options));
  const RunReport report = run.execute();
  run.forget();
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(report.error, "");
  EXPECT_EQ(report.ended, TimePoint(std::chrono::seconds(120)));
  EXPECT_THAT(told, HasSubstr("File too large"));
  ASSERT_TRUE(report.journal.has_value());
  EXPECT_EQ(report.journal->given_up, told);
  const auto journaled = read_journal(folder.path() / "run.journal");
  ASSERT_FALSE(journaled.has_value());
  EXPECT_EQ(journaled.error().code, "journal.given-up");
  EXPECT_THAT(journaled.error().message, HasSubstr("File too large"));
}

// A clock of the machine that stood at `start` when it died.
std::function<WallTime()> clock_at(std::string boot, std::chrono::nanoseconds up, std::chrono::nanoseconds date) {
  return [=] { return WallTime{boot, up.count(), date.count()}; };
}

// The recharge mission in real time, watched by one requirement.
project::Plan watched(const fs::path& requirement) {
  project::Scenario scenario = std::move(
      *project::load_scenario(fs::path(SENTREE_SOURCE_DIR) / "examples/recharge/scenarios/normal.yaml").value);
  scenario.virtual_time = false;
  scenario.factor = 100;
  scenario.duration = std::chrono::minutes(20);
  scenario.project.monitors.clear();
  scenario.verdicts.clear();
  EXPECT_TRUE(text::write_file(requirement,
                               "let destination = request(navigation.gotoTargetByLocationName).name\n"
                               "let at(place) = reply(navigation.checkNearToLocation where args.name = place)\n"
                               "arrives: whenever destination = kitchen, robot shall at(kitchen) within 300 s.\n")
                  .has_value());
  project::MonitorEntry entry;
  entry.file.path = requirement.string();
  scenario.project.monitors = project::expand_requirements(scenario.project, std::move(entry));
  auto plan = project::prepare(std::move(scenario));
  EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  return std::move(*plan.value);
}

TEST(Durable, DoesWhatATimelineSaysForTheTimeInWhichNobodyWasThereWhoeverDiesBehindIt) {
  using std::chrono::seconds;
  const TemporaryFolder folder("test");
  const fs::path file = folder.path() / "s.yaml";
  ASSERT_TRUE(text::write_file(file, "project: " SENTREE_SOURCE_DIR
                                     "/examples/recharge\nclock: {real: 100}\nduration: 450 s\ntimeline:\n"
                                     "  - {at: 40 s, call: simulation.setBatteryCharge, args: {percent: 10}}\n"));
  const auto loaded = project::prepare(std::move(*project::load_scenario(file).value));
  ASSERT_TRUE(loaded.ok());
  const project::Plan& plan = *loaded.value;
  const Told told =
      tell(plan, folder.path(), {TimePoint(seconds(30))}, {}, {}, clock_at("one", seconds(100), seconds(5000)));
  const Told::Death& death = told.deaths.at(0);

  // It goes on at 430 s, and is killed again two ticks behind what falls into the gap.
  const fs::path copy = folder.path() / "second.journal";
  std::size_t ticks = 0;
  std::size_t observations = death.observations;
  bool injected = false;
  const Resumed first = resume(plan, death.journal, death.observations, clock_at("one", seconds(104), seconds(17)),
                               [&](const Message& message) {
                                 if (!fs::exists(copy)) ++observations;
                                 injected = injected || message.name == "scenario.injection";
                                 if (injected && message.name == "mission.tick" && ++ticks == 2)
                                   fs::copy_file(death.journal.string() + ".next", copy);
                               });
  const auto violated = [](const Resumed& resumed) {
    const auto& all = resumed.report.monitors;
    return std::any_of(all.begin(), all.end(), [](const auto& one) { return one.violations > 0; });
  };
  ASSERT_TRUE(violated(first));
  ASSERT_TRUE(fs::exists(copy));
  const Resumed second = resume(plan, copy, observations, clock_at("one", seconds(104), seconds(17)));
  EXPECT_TRUE(violated(second)) << "the battery was emptied only in the run between";
}

TEST(Durable, LetsTheTimeInWhichNobodyWasTherePassAsSilence) {
  using std::chrono::seconds;
  const TemporaryFolder folder("test");
  const project::Plan plan = watched(folder.path() / "arrives.req");
  const Told told =
      tell(plan, folder.path(), {TimePoint(seconds(30))}, {}, {}, clock_at("one", seconds(100), seconds(5000)));
  ASSERT_EQ(told.report.mission, bt::Status::kSuccess);
  ASSERT_EQ(told.report.monitors.front().violations, 0U);
  const Told::Death& death = told.deaths.at(0);
  fs::copy_file(death.journal, folder.path() / "again.journal");

  // Four seconds later, which are 400 of the run: the robot has arrived in time, and nobody saw it.
  const Resumed late = resume(plan, death.journal, death.observations, clock_at("one", seconds(104), seconds(17)));
  EXPECT_EQ(late.report.mission, bt::Status::kSuccess);
  ASSERT_EQ(late.report.gaps.size(), 1U);
  EXPECT_EQ(late.report.gaps.front().wall, Duration(seconds(4)));
  EXPECT_EQ(late.report.gaps.front().to - late.report.gaps.front().from, Duration(seconds(400)));
  const MonitorReport& arrives = late.report.monitors.front();
  EXPECT_EQ(arrives.violations, 1U);
  ASSERT_TRUE(arrives.decision.has_value());
  EXPECT_LT(arrives.decision->at, TimePoint(seconds(302)));
  ASSERT_EQ(arrives.gaps.size(), 1U);
  EXPECT_EQ(arrives.gaps.front().to, late.report.gaps.front().to);

  // The machine was started again, and its clock set back: nobody knows how late it is.
  const Resumed unknown =
      resume(plan, folder.path() / "again.journal", death.observations, clock_at("two", seconds(3), seconds(4000)));
  EXPECT_EQ(unknown.report.mission, bt::Status::kSuccess);
  EXPECT_EQ(unknown.report.monitors.front().violations, 0U);
  EXPECT_THAT(unknown.report.problems, testing::Contains(HasSubstr("set back")));
}

TEST(Durable, SaysWhatItWaitedFor) {
  using std::chrono::milliseconds;
  EXPECT_EQ(
      behind_the_clock(milliseconds(1'960), milliseconds(1'240), milliseconds(40)),
      "the run was held up, and is 1.9 s behind the clock; services elsewhere went on meanwhile. Since it began it has "
      "waited 1.2 s for processes of skills and 0.0 s for the disk");
}

TEST(Durable, KnowsHowLongNobodyWasThere) {
  using std::chrono::seconds;
  const WallTime died = clock_at("one", seconds(100), seconds(5000))();
  EXPECT_EQ(between(died, clock_at("one", seconds(107), seconds(5007))()), Duration(seconds(7)));
  // The date was set back, or on, and the machine has counted.
  EXPECT_EQ(between(died, clock_at("one", seconds(107), seconds(10))()), Duration(seconds(7)));
  EXPECT_EQ(between(died, clock_at("one", seconds(107), seconds(90'000))()), Duration(seconds(7)));
  // It was started again.
  EXPECT_EQ(between(died, clock_at("two", seconds(3), seconds(5060))()), Duration(seconds(60)));
  EXPECT_EQ(between(died, clock_at("two", seconds(3), seconds(4000))()), std::nullopt);
}

}  // namespace
}  // namespace sentree::runtime
