#include "sentree/campaign/campaign.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <set>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/campaign/check.h"
#include "sentree/campaign/detail/pool.h"
#include "sentree/campaign/detail/shrink.h"
#include "sentree/project/scenario_text.h"
#include "sentree/text/file.h"

namespace sentree::campaign {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

const std::string kHead = "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" ";

// A mission that looks at a counter at each tick, which timelines change, until it is high.
class Campaign : public ::testing::Test {
 protected:
  void SetUp() override {
    write("interfaces/counter.thrift", "service Counter { i32 value()  i32 add(1: i32 by)  i32 mark(1: i32 flag) }\n");
    write("skills/IsHigh.scxml", kHead + R"(initial="asking"><state id="asking">
  <onentry><send type="thrift" target="counter" event="value"/></onentry>
  <transition event="counter.value.reply" cond="_event.data.result &gt;= 50" target="success"/>
  <transition event="counter.value.reply" target="failure"/><transition event="error" target="failure"/>
</state><final id="success"/><final id="failure"/></scxml>)");
    write("models/counter.scxml",
          kHead + R"(initial="there"><datamodel><data id="x" expr="0"/><data id="marks" expr="0"/></datamodel>
<state id="there">
 <transition event="counter.value.request"><send type="thrift" target="counter" event="value.reply"><param name="result" expr="x"/></send></transition>
 <transition event="counter.add.request"><assign location="x" expr="x + _event.data.args.by"/>
  <send type="thrift" target="counter" event="add.reply"><param name="result" expr="x"/></send></transition>
 <transition event="counter.mark.request">
  <if cond="_event.data.args.flag === marks + 1"><assign location="marks" expr="marks + 1"/><else/><assign location="marks" expr="0"/></if>
  <if cond="marks === 2"><assign location="x" expr="-1"/></if>
  <send type="thrift" target="counter" event="mark.reply"><param name="result" expr="marks"/></send></transition>
</state></scxml>)");
    write("mission.xml",
          "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><RetryUntilSuccessful num_attempts=\"-1\"><Delay "
          "delay_msec=\"100\">"
          "<Condition ID=\"IsHigh\"/></Delay></RetryUntilSuccessful></BehaviorTree></root>");
    write("r.req",
          "let x = reply(counter.value)\nsmall \"It stays small.\":\n  always x < 90.\npositive \"It stays "
          "positive.\":\n  always x >= 0.\n");
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {counter: {interface: counter.thrift/Counter, at: "
          "model}}\n"
          "models: [{file: models/counter.scxml, name: keeper, serves: [counter]}]\nmonitors: [{file: r.req}]\n");
  }

  void write(const std::string& name, const std::string& text) {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    ASSERT_TRUE(text::write_file(path, text));
  }
  std::string read(const std::filesystem::path& path) { return text::read_file(path).value_or("(nothing)"); }
  void vary(const std::string& text) { write("campaign.yaml", text); }
  void usual() {
    vary(
        "duration: 4 s\ntimeline:\n"
        "  - {name: one, at: {uniform: [0 s, 3 s]}, call: counter.add, args: {by: {integer: [0, 60]}}}\n"
        "  - {name: two, at: {uniform: [0 s, 3 s]}, call: counter.add, args: {by: {choice: [0, 45, -50], weights: [5, "
        "4, 1]}}, "
        "probability: 60 %}\n"
        "faults: {any_of: [{name: killed, kill: IsHigh}]}\n");
  }
  std::unique_ptr<Runner> runner() {
    auto loaded = Runner::load(folder_.path(), folder_.path() / "campaign.yaml");
    for (const auto& diagnostic : loaded.diagnostics) ADD_FAILURE() << to_string(diagnostic);
    return loaded.ok() ? std::move(*loaded.value) : nullptr;
  }
  std::string problem() {
    auto loaded = Runner::load(folder_.path(), folder_.path() / "campaign.yaml");
    std::string all;
    for (const auto& diagnostic : loaded.diagnostics) all += to_string(diagnostic) + "\n";
    return loaded.ok() ? "" : all;
  }
  std::filesystem::path out(const std::string& name) {
    std::filesystem::create_directories(folder_.path() / name);
    return folder_.path() / name;
  }
  Settings settings(const Runner& runner, std::uint64_t runs) {
    Settings made;
    made.project = folder_.path().string();
    made.vary = (folder_.path() / "campaign.yaml").string();
    made.asked.runs = runs;
    made.identity = runner.identity();
    return made;
  }

  TemporaryFolder folder_{"campaign"};
};

TEST_F(Campaign, AnEventIsCalledAfterWhatItDoes) {
  vary(
      "duration: 1 s\ntimeline:\n"
      "  - {at: 100 ms, unreachable: counter.add}\n  - {at: 200 ms, late: counter.value}\n"
      "  - {at: 300 ms, late: counter.value}\n  - {at: 0 s, delay: {message: IsHigh.tick, by: 1 ms}}\n"
      "faults: {any_of: [{kill: IsHigh}, {unreachable: counter.*}]}\n");
  const auto loaded = runner();
  ASSERT_TRUE(loaded);
  std::vector<std::string> names;
  for (const Event& event : loaded->vary().events) names.push_back(event.name);
  EXPECT_THAT(names, ElementsAre("unreachable counter.add", "late counter.value", "late counter.value #2",
                                 "delay IsHigh.tick", "kill IsHigh", "unreachable counter.*"));
}

TEST_F(Campaign, IsTheSameWhateverTheNumberOfProcesses) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  const Settings asked = settings(*one, 60);
  std::vector<std::string> tables;
  std::vector<std::string> results;
  for (const std::size_t jobs : {1, 2, 5}) {
    const auto folder = out("jobs" + std::to_string(jobs));
    const auto summary = run_campaign(*one, asked, {.jobs = jobs, .folder = folder});
    ASSERT_TRUE(summary) << to_string(summary.error());
    tables.push_back(read(folder / kTableName));
    results.push_back(to_json(summary->to_value()) + to_page(*summary, "t", "a", {}));
    EXPECT_EQ(summary->runs(), 60U);
    EXPECT_GT(summary->ended(Outcome::kSuccess), 5U);
    EXPECT_GT(summary->ended(Outcome::kRunning), 5U);
    EXPECT_GT(summary->requirements()[0].violated, 0U);
  }
  EXPECT_EQ(tables[0], tables[1]);
  EXPECT_EQ(tables[0], tables[2]);
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST_F(Campaign, IsCheckedWithItsProject) {
  usual();
  EXPECT_THAT(check_project(folder_.path()), testing::IsEmpty());
  vary("parameters: {}\nfaults: {any_of: [{kill: IsHgh}]}\n");
  write("old/elsewhere.yaml", "override: {missoin: {repeat: true}}\n");
  write("old/broken.yaml", "override: {}\nexpect: {\n");
  write("old/no_scenario.yaml", "missoin: none\n");
  std::string all;
  for (const auto& diagnostic : check_project(folder_.path())) all += to_string(diagnostic) + "\n";
  EXPECT_THAT(all, HasSubstr("did you mean \"IsHigh\"?"));
  EXPECT_THAT(all, HasSubstr("elsewhere.yaml:1:12: "));
  EXPECT_THAT(all, HasSubstr("broken.yaml:"));
  EXPECT_THAT(all, testing::Not(HasSubstr("no_scenario")));
}

// A requirement that is gone leaves its counterexample behind.
TEST_F(Campaign, IsNoErrorOfAProjectThatABehaviourIsOutdated) {
  usual();
  const std::string expects = "expect:\n  monitors: {gone: violated}\n";
  const auto found = [&](const std::string& text) {
    write("verify/gone.yaml", text);
    return check_project(folder_.path());
  };
  const auto outdated = found(std::string(project::kFoundByVerify) + "\n" + expects);
  ASSERT_EQ(outdated.size(), 1U);
  EXPECT_EQ(outdated.front().severity, Severity::kWarning);
  EXPECT_THAT(to_string(outdated.front()),
              testing::AllOf(HasSubstr("gone.yaml:3:"), HasSubstr("the project has no monitor \"gone\""),
                             HasSubstr("verify it again, or delete this file")));
  // Written by hand it is a source like any other.
  EXPECT_TRUE(has_errors(found(expects)));
}

TEST_F(Campaign, OfShardsThatAreMergedIsTheSameAsInOne) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  Settings asked = settings(*one, 400);
  asked.asked.precision = 0.08;
  const auto whole = run_campaign(*one, asked, {.jobs = 2, .folder = out("whole")});
  ASSERT_TRUE(whole);
  EXPECT_LT(whole->runs(), 400U);  // it ended early
  EXPECT_EQ(whole->runs() % Summary::kLook, 0U);
  std::vector<std::filesystem::path> parts;
  for (std::uint64_t i = 1; i <= 4; ++i) {
    Settings part = asked;
    part.shard = {i, 4};
    parts.push_back(out("part" + std::to_string(i)));
    ASSERT_TRUE(run_campaign(*one, part, {.jobs = 1, .folder = parts.back()}));
    // Where another shard's runs are they are not written over.
    part.shard.index = i % 4 + 1;
    const auto other = run_campaign(*one, part, {.jobs = 1, .folder = parts.back()});
    ASSERT_FALSE(other);
    EXPECT_EQ(other.error().code, "campaign.other-shard");
  }
  const auto merged = merge_campaign(*one, asked, parts, out("merged"));
  ASSERT_TRUE(merged) << to_string(merged.error());
  EXPECT_EQ(to_json(merged->to_value()), to_json(whole->to_value()));
  EXPECT_EQ(read(folder_.path() / "merged" / kTableName), read(folder_.path() / "whole" / kTableName));

  // A shard's folder is not written over, nor is a table that was there before all shards are read.
  const std::string shard = read(parts.front() / kTableName);
  const auto into = merge_campaign(*one, asked, parts, parts.front() / ".");
  ASSERT_FALSE(into);
  EXPECT_THAT(into.error().message, HasSubstr("--out names another folder"));
  EXPECT_EQ(read(parts.front() / kTableName), shard);
  ASSERT_TRUE(text::write_file(parts.front() / kTableName, shard.substr(0, shard.size() / 2) + "\n1,2\n"));
  const auto half = merge_campaign(*one, asked, parts, out("merged"));
  ASSERT_FALSE(half);
  EXPECT_THAT(to_string(half.error()), testing::MatchesRegex(".*part1/runs.csv:[0-9]+: .*leave out the rows.*"));
  EXPECT_EQ(read(folder_.path() / "merged" / kTableName), read(folder_.path() / "whole" / kTableName));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "merged" / "runs.csv.part"));
  ASSERT_TRUE(text::write_file(parts.front() / kTableName, shard));

  // Without one part its runs are lost, and told, and no others.
  parts.pop_back();
  const auto less = merge_campaign(*one, asked, parts, out("less"));
  ASSERT_TRUE(less);
  EXPECT_EQ(less->ended(Outcome::kLost), less->runs() / 4);
  EXPECT_EQ(less->lost().front().run, 4U);
  // Nor are others lost if it was killed as it began.
  parts.push_back(folder_.path() / "part4");
  for (const char* begun : {"", "ru"}) {
    ASSERT_TRUE(text::write_file(parts.back() / kTableName, begun));
    const auto torn = merge_campaign(*one, asked, parts, out("torn"));
    ASSERT_TRUE(torn) << to_string(torn.error());
    EXPECT_EQ(to_json(torn->to_value()), to_json(less->to_value()));
  }
}

TEST_F(Campaign, SettingsAreReadFromAnyFolder) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  Settings asked = settings(*one, 1);
  asked.project = ".";
  asked.vary = "campaign.yaml";
  const bool ran = run_campaign(*one, asked, {.jobs = 1, .folder = out("there")}).has_value();
  std::filesystem::create_directories("else/where");
  std::filesystem::current_path("else/where");
  const auto read = read_settings("../../there");
  const Settings absolute = settings(*one, 1);
  const bool ran_again = run_campaign(*one, absolute, {.jobs = 1, .folder = out("again")}).has_value();
  const auto again = read_settings("../../again");
  std::filesystem::rename("../../there", "moved");
  const auto moved = read_settings("moved");
  std::filesystem::current_path(before);
  ASSERT_TRUE(ran && read && moved && ran_again && again);
  EXPECT_EQ(again->vary, absolute.vary);
  EXPECT_THAT((std::vector{read->project, read->vary}), ElementsAre("../..", "../../campaign.yaml"));
  EXPECT_THAT((std::vector{moved->project, moved->vary}), ElementsAre(".", "campaign.yaml"));
}

TEST_F(Campaign, TakesAwayLeastScenariosOfAnEarlierOneOnly) {
  const auto folder = out("campaign");
  const auto path = [&](const char* name) { return folder / name; };
  for (const char* name : {"gone.yaml", "kept.yaml", "edited.yaml", "unlisted.yaml"})
    ASSERT_TRUE(text::write_file(path(name), "description: \"x is violated: the least of run 3 (seed 4)\"\n"));
  ASSERT_TRUE(text::write_file(path("mine.yaml"), "description: mine\n"));
  ASSERT_TRUE(text::write_file(path(kResultName),
                               R"({"least": {"gone": "gone.yaml", "kept": "kept.yaml", "edited": "edited.yaml",
                                   "mine": "mine.yaml", "unlisted": "../campaign/unlisted.yaml"}})"));
  std::filesystem::last_write_time(path("edited.yaml"),
                                   std::filesystem::last_write_time(path(kResultName)) + std::chrono::seconds(1));
  ASSERT_TRUE(take_away_least(folder, {{"kept", "kept.yaml"}}));
  for (const char* name : {"kept.yaml", "edited.yaml", "unlisted.yaml", "mine.yaml"})
    EXPECT_TRUE(std::filesystem::exists(path(name))) << name;
  EXPECT_FALSE(std::filesystem::exists(path("gone.yaml")));
}

TEST_F(Campaign, ThatLastsNoTimeIsRefused) {
  vary("duration: 0 s\n");
  EXPECT_THAT(problem(), HasSubstr("campaign.yaml:1:11: "));
  EXPECT_THAT(problem(), HasSubstr("give more than 0 s"));
}

TEST_F(Campaign, OfAFullDiskSaysWhyAndHowToGoOn) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  const auto folder = out("full");
  std::filesystem::create_symlink("/dev/full", folder / kTableName);
  const auto full = run_campaign(*one, settings(*one, 3), {.jobs = 1, .folder = folder});
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().code, "file.unwritable");
  EXPECT_THAT(full.error().message, HasSubstr("No space left on device"));
  EXPECT_THAT(full.error().message, HasSubstr("--resume goes on"));
}

TEST_F(Campaign, GoesOnFromATableThatEndsAnywhere) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  const Settings asked = settings(*one, 30);
  const auto folder = out("whole");
  const auto whole = run_campaign(*one, asked, {.jobs = 1, .folder = folder});
  ASSERT_TRUE(whole);
  const std::string table = read(folder / kTableName);
  constexpr std::uint64_t kSeed = 3;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  const std::size_t header = table.find('\n') + 1;
  std::vector<std::size_t> cuts{0, 1, header - 1, header};
  for (int i = 0; i < 8; ++i) cuts.push_back(header + rng.below(table.size() - header));
  for (const std::size_t cut : cuts) {
    ASSERT_TRUE(text::write_file(folder / kTableName, table.substr(0, cut)));
    const auto again = run_campaign(*one, asked, {.jobs = 1, .folder = folder, .resume = true});
    ASSERT_TRUE(again) << to_string(again.error());
    EXPECT_EQ(read(folder / kTableName), table) << "cut at " << cut;
    EXPECT_EQ(to_json(again->to_value()), to_json(whole->to_value()));
  }
  Settings other = asked;
  other.asked.seed = 2;
  const auto refused = run_campaign(*one, other, {.jobs = 1, .folder = folder, .resume = true});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "campaign.changed");
}

TEST_F(Campaign, IsGoneOnWithAsItWasAskedForAfterItWasKilled) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  Settings settings = this->settings(*one, 60);
  settings.asked.seed = 5;
  settings.asked.confidence = 0.999;
  settings.asked.precision = 0.001;
  const auto expectation = parse_expectation("small violated < 2.7 %", one->requirements());
  ASSERT_TRUE(expectation);
  settings.asked.expectations = {*expectation};
  const auto folder = out("killed");
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    CampaignOptions options{.jobs = 1, .folder = folder};
    options.on_progress = [](const Progress& progress) {
      if (progress.done >= 5) raise(SIGKILL);
    };
    (void)run_campaign(*one, settings, options);
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  const auto before = read_settings(folder);
  ASSERT_TRUE(before) << to_string(before.error());

  const auto said = [&](const AskedAgain& again) {
    const auto asked = ask_again(before->asked, again, folder);
    return asked ? std::string() : asked.error().code + ": " + asked.error().message;
  };
  EXPECT_THAT(said({.seed = 1}), HasSubstr("campaign.changed: "));
  EXPECT_THAT(said({.seed = 1}), HasSubstr("asked for with --seed 5, not 1"));
  EXPECT_THAT(said({.runs = 59}), HasSubstr("asked for with -n 60, not 59"));
  EXPECT_THAT(said({.confidence = 0.95}), HasSubstr("asked for with --confidence 99.9%, not 95%"));
  EXPECT_THAT(said({.precision = 0.01}), HasSubstr("asked for with --precision 0.1%, not 1%"));
  EXPECT_THAT(said({.expectations = {"small violated < 3%"}}),
              HasSubstr("--expect \"small violated < 2.7 %\", not --expect \"small violated < 3%\""));
  EXPECT_EQ(
      said({.seed = 5, .runs = 60, .confidence = 0.999, .precision = 0.001, .expectations = {"small violated < 2.7%"}}),
      "");
  Settings again = settings;
  auto asked = ask_again(before->asked, {}, folder);
  ASSERT_TRUE(asked);
  again.asked = *asked;
  EXPECT_EQ(to_json(to_value(again)), to_json(to_value(settings)));
  again.asked.expectations = settings.asked.expectations;
  const auto rest = run_campaign(*one, again, {.jobs = 1, .folder = folder, .resume = true});
  ASSERT_TRUE(rest) << to_string(rest.error());
  const auto whole = run_campaign(*one, settings, {.jobs = 1, .folder = out("whole")});
  ASSERT_TRUE(whole);
  EXPECT_EQ(to_json(rest->to_value()), to_json(whole->to_value()));
  EXPECT_EQ(read(folder / kTableName), read(folder_.path() / "whole" / kTableName));

  // It may have more runs than were asked for.
  asked = ask_again(before->asked, {.runs = 70}, folder);
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->runs, 70U);
}

TEST_F(Campaign, OfShardsWithLessThanTheOthersTellsWhatTheyLack) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  Settings part = settings(*one, 20);
  part.shard = {1, 2};
  ASSERT_TRUE(run_campaign(*one, part, {.jobs = 1, .folder = out("less")}));
  part.asked.runs = 24;
  part.shard = {2, 2};
  ASSERT_TRUE(run_campaign(*one, part, {.jobs = 1, .folder = out("more")}));
  const std::filesystem::path less = folder_.path() / "less";
  const std::filesystem::path more = folder_.path() / "more";
  for (const auto& shards : {std::vector{less, more}, std::vector{more, less}}) {
    const auto merged = merge_campaign(*one, settings(*one, 20), shards, out("merged"));
    ASSERT_TRUE(merged) << to_string(merged.error());
    EXPECT_EQ(merged->runs(), 24U);
    ASSERT_THAT(merged->lost(), SizeIs(2));
    EXPECT_EQ(merged->lost()[0].run, 21U);
    EXPECT_EQ(merged->lost()[0].why, less.string() + " was asked for 20 runs only");
  }
  part.asked.confidence = 0.99;
  ASSERT_TRUE(run_campaign(*one, part, {.jobs = 1, .folder = more}));
  const auto refused = merge_campaign(*one, settings(*one, 20), {less, more}, out("merged"));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("--confidence, --precision or --expect are not those of "));
}

TEST_F(Campaign, TellsWhatComesBehindItsEnd) {
  write("scenarios/base.yaml", "duration: 9 s\ntimeline: [{at: 8 s, kill: IsHigh}]\n");
  vary(
      "scenario: scenarios/base.yaml\nduration: 1 s\ntimeline:\n"
      "  - {name: late, at: {normal: [2 s, 1 s], min: 1.5 s}, call: counter.add, args: {by: 1}}\n"
      "  - {name: perhaps, at: {uniform: [500 ms, 5000 ms]}, call: counter.add, args: {by: 1}}\n"
      "faults: {any_of: [{kill: IsHigh, at: 5 s}, {name: then, kill: counter}]}\n");
  const auto loaded = Runner::load(folder_.path(), folder_.path() / "campaign.yaml");
  std::vector<std::string> all;
  for (const auto& diagnostic : loaded.diagnostics) all.push_back(diagnostic.message);
  EXPECT_TRUE(loaded.ok());
  EXPECT_THAT(all, ElementsAre("\"late\" is behind the duration of a run, 1.0 s, and never comes",
                               "\"kill IsHigh\" is behind the duration of a run, 1.0 s, and never comes",
                               "this is behind the duration of a run, 1.0 s, and never comes"));
}

TEST_F(Campaign, KeepsTheRunsBeforeAnInterrupt) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  const Settings asked = settings(*one, 500);
  std::uint64_t done = 0;
  CampaignOptions options{.jobs = 2, .folder = out("cut")};
  options.on_progress = [&](const Progress& progress) { done = progress.done; };
  options.is_interrupted = [&] { return done >= 20; };
  const auto summary = run_campaign(*one, asked, options);
  ASSERT_TRUE(summary);
  EXPECT_GE(summary->runs(), 20U);
  EXPECT_LT(summary->runs(), 500U);
  const std::string table = read(options.folder / kTableName);
  EXPECT_EQ(static_cast<std::uint64_t>(std::count(table.begin(), table.end(), '\n')), summary->runs() + 1);
}

// A run's row is that of the scenario file that is written for its seed.
TEST_F(Campaign, RunsAgainFromTheScenarioOfItsSeed) {
  usual();
  const auto one = runner();
  ASSERT_TRUE(one);
  for (std::uint64_t run = 1; run <= 10; ++run) {
    const std::uint64_t seed = seed_of(7, run);
    const Row row = one->row(run, seed);
    auto drawn = load_drawn(folder_.path(), folder_.path() / "campaign.yaml", seed);
    ASSERT_TRUE(drawn.ok());
    auto plan = project::prepare(std::move(*drawn.value));
    ASSERT_TRUE(plan.ok());
    const auto report = runtime::Run(*plan.value, {}).execute();
    EXPECT_EQ(seconds(report.ended), row.time_s);
    EXPECT_EQ(to_string(report.mission), row.outcome == Outcome::kSuccess ? "SUCCESS" : "RUNNING");
    for (std::size_t i = 0; i < 2; ++i)
      EXPECT_EQ(report.monitors[i].verdict == monitor::Verdict::kViolated,
                row.requirements[i].verdict == Verdict::kViolated);
  }
}

TEST_F(Campaign, SaysWhatMatters) {
  vary(
      "duration: 2 s\ntimeline:\n"
      "  - {name: much, at: 500 ms, call: counter.add, args: {by: {uniform: [0, 100]}}}\n"
      "  - {name: little, at: 1 s, call: counter.mark, args: {flag: {integer: [0, 90]}}, probability: 50 %}\n");
  // A whole number is what the interface wants.
  write("interfaces/counter.thrift",
        "service Counter { double value()  double add(1: double by)  i32 mark(1: i32 flag) }\n");
  const auto one = runner();
  ASSERT_TRUE(one);
  const auto summary = run_campaign(*one, settings(*one, 200), {.jobs = 2, .folder = out("out")});
  ASSERT_TRUE(summary);
  const auto causes = summary->causes(0);
  ASSERT_THAT(causes, SizeIs(1));
  EXPECT_EQ(summary->factors()[causes[0].factor].name, "much.args.by");
  EXPECT_GT(causes[0].influence.share, 0.8);
  EXPECT_NEAR(static_cast<double>(summary->ended(Outcome::kSuccess)) / 200, 0.5, 0.12);
}

TEST_F(Campaign, ShrinksAViolationToWhatItNeeds) {
  vary(
      "duration: 30 s\ntimeline:\n"
      "  - {name: noise, at: {uniform: [0 s, 9 s]}, call: counter.add, args: {by: {integer: [0, 40]}}}\n"
      "  - {name: first, at: {uniform: [1.5 s, 9 s]}, call: counter.mark, args: {flag: 1}, probability: 70 %}\n"
      "  - {name: second, at: {uniform: [1.5 s, 9 s]}, call: counter.mark, args: {flag: 2}, probability: 70 %}\n"
      "  - {name: more, at: {uniform: [12 s, 20 s]}, call: counter.add, args: {by: 3}}\n"
      "parameters: {deadlines.call: {uniform: [20 ms, 40 ms]}}\n");
  const auto one = runner();
  ASSERT_TRUE(one);
  const auto folder = out("out");
  const CampaignOptions options{.jobs = 2, .folder = folder};
  const auto summary = run_campaign(*one, settings(*one, 40), options);
  ASSERT_TRUE(summary);
  ASSERT_GT(summary->requirements()[1].violated, 0U);
  const auto files = write_least(*one, *summary, options);
  ASSERT_TRUE(files) << to_string(files.error());
  ASSERT_TRUE(files->contains("positive"));
  const auto scenario = project::load_scenario(files->at("positive"));
  for (const auto& diagnostic : scenario.diagnostics) ADD_FAILURE() << to_string(diagnostic);
  ASSERT_TRUE(scenario.ok());
  EXPECT_THAT(scenario.value->timeline, SizeIs(2)) << read(files->at("positive"));
  EXPECT_LT(scenario.value->duration, std::chrono::seconds(11));
  EXPECT_EQ(scenario.value->seed, 1U);
  EXPECT_THAT(read(files->at("positive")), Not(HasSubstr("override")));
  auto plan = project::prepare(*scenario.value);
  ASSERT_TRUE(plan.ok());
  const auto report = runtime::Run(*plan.value, {}).execute();
  EXPECT_THAT(report.unmet, SizeIs(0));
  EXPECT_EQ(scenario.value->verdicts.at("positive"), "violated");
}

TEST_F(Campaign, RefusesWhatCannotBeDrawn) {
  const auto says = [&](const std::string& text, const std::string& message) {
    vary(text);
    EXPECT_THAT(problem(), HasSubstr(message)) << text;
  };
  says("parameters: {deadline.call: {uniform: [1 s, 2 s]}}\n", "did you mean \"deadlines\"");
  says("parameters: {deadlines.call: {unifrm: [1 s, 2 s]}}\n", "campaign.yaml:1:30");
  says("parameters: {deadlines.call: {uniform: [1 s, 2000 ms]}}\n", "mixes the units \"s\" and \"ms\"");
  says("parameters: {deadlines.call: {uniform: [2 s, 1 s]}}\n", "the first bound is above the second");
  says("parameters: {deadlines.call: {normal: [2 s, 0 s]}}\n", "a standard deviation is above 0");
  says("parameters: {deadlines.call: {normal: [2 s, 1 s], mn: 0 s}}\n", "did you mean \"min\"");
  says("parameters: {deadlines.call: {choice: []}}\n", "needs a list of alternatives");
  says("parameters: {deadlines.call: {choice: [1 s, 2 s], weights: [1]}}\n", "as many numbers");
  for (const char* far :
       {"normal: [2 s, 0.01 s], min: 3 s", "normal: [2 s, 0.01 s], max: 1 s", "exponential: 1 ms, min: 1000 ms",
        "lognormal: [40 ms, 1.01], min: 60 ms", "lognormal: [40 ms, 1.5], max: 0 ms"})
    says(fmt::format("parameters: {{deadlines.call: {{{}}}}}\n", far), "nothing of that distribution lies between");
  says("parameters: {deadlines.call: {uniform: [1 s, 2 s]}, deadlines: {choice: [{call: 1 s}]}}\n", "names no place");
  says("parameters: {world.battery.initial: {uniform: [1 %, 2 %]}, world.battery: {choice: [{initial: 1 %}]}}\n",
       "campaign.yaml:1:60: parameter \"world.battery\" writes over \"world.battery.initial\"");
  says("parameters: {world.battery: {choice: [{initial: 1 %}]}, world.battery.initial: {uniform: [1 %, 2 %]}}\n",
       "parameter \"world.battery.initial\" writes over \"world.battery\"");
  says("parameters: {world.start: {pose: anywhere}}\n", "the project has no world");
  says("timeline: [{call: counter.ad, args: {by: 1}}]\n", "has no method \"ad\"");
  says("timeline: [{call: counter.add, args: {by: 1}, probability: 120 %}]\n", "a probability is from 0 to 1");
  says("faults: {at_most: 1}\n", "faults needs \"any_of\"");
  says("runs: 0\n", "runs are from 1");
  says("rums: 5\n", "did you mean \"runs\"");
  says("parameters: {deadlines.cal: {uniform: [1 s, 2 s]}}\n", "campaign.yaml:1:14: deadlines has no key \"cal\"");
  says("parameters: {deadlines.call: {choice: [10 ms, 20 ms, soon]}}\n", "campaign.yaml:1:54: ");
  says("scenario: nowhere.yaml\n", "campaign.yaml:1:11: the scenario ");
  // Ends that are drawn too, but not those that have probability 0.
  says("parameters: {deadlines.call: {uniform: [-0.1 s, 0.07 s]}}\n", "campaign.yaml:1:");
  says("parameters: {deadlines.call: {normal: [0.04 s, 0.01 s], max: 0.2 s}}\n", "campaign.yaml:1:");
  says("timeline: [{call: counter.add, args: {by: {integer: [0, 5000000000]}}}]\n", "campaign.yaml:1:");
  vary("parameters: {deadlines.call: {uniform: [0 s, 0.07 s]}}\ntimeline: [{call: counter.add, args: {by: 1}}]\n");
  EXPECT_EQ(problem(), "");
}

TEST_F(Campaign, RefusesPartsWithAClockOfTheirOwn) {
  vary("runs: 5\n");
  write("sentree.yaml",
        "mission: {file: mission.xml, rate: 10 Hz}\nservices: {counter: {interface: counter.thrift/Counter, at: "
        "\"tcp://h:1\"}}\n");
  EXPECT_THAT(problem(), HasSubstr("has no virtual time"));
}

TEST(Distribution, DrawsWhatItSays) {
  constexpr int kDraws = 4000;
  Vary vary;
  const auto add = [&](const char* name, Distribution::Kind kind, double a, double b) -> Distribution& {
    Distribution from;
    from.kind = kind;
    from.a = a;
    from.b = b;
    from.unit = "s";
    vary.parameters.push_back({name, from});
    return vary.parameters.back().from;
  };
  add("uniform", Distribution::Kind::kUniform, 2, 6);
  add("integer", Distribution::Kind::kInteger, 1, 3);
  add("normal", Distribution::Kind::kNormal, 10, 2);
  add("lognormal", Distribution::Kind::kLogNormal, 4, 2);
  add("exponential", Distribution::Kind::kExponential, 5, 0);
  auto& truncated = add("truncated", Distribution::Kind::kNormal, 0, 1);
  truncated.min = 0.5;
  truncated.max = 1.0;
  const Drawing drawing(vary, nullptr, std::chrono::seconds(10));
  std::vector<double> sums(6);
  std::vector<std::vector<int>> bins(6, std::vector<int>(kTenths));
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    const Draw draw = drawing.draw(seed);
    const auto levels = drawing.levels(seed);
    for (std::size_t i = 0; i < 6; ++i) {
      const double value = std::stod(draw.parameters[i]->scalar);
      EXPECT_TRUE(draw.parameters[i]->scalar.ends_with(" s"));
      EXPECT_EQ(levels[i].text, draw.parameters[i]->scalar);
      sums[i] += i == 3 ? std::log(value) : value;
      ++bins[i][levels[i].bin];
      if (i == 0) {
        EXPECT_TRUE(value >= 2 && value <= 6);
      }
      if (i == 1) {
        EXPECT_TRUE(value == 1 || value == 2 || value == 3);
      }
      if (i == 5) {
        EXPECT_TRUE(value >= 0.5 && value <= 1.0);
      }
    }
  }
  const std::vector<double> means{4, 2, 10, std::log(4), 5, 0.7354};
  const std::vector<double> sigmas{1.155, 0.816, 2, std::log(2), 5, 0.145};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(sums[i] / kDraws, means[i], 4 * sigmas[i] / std::sqrt(kDraws)) << i;
  // Tenths are tenths.
  for (const std::size_t i : {0, 2, 3, 4, 5}) {
    for (const int count : bins[i]) EXPECT_NEAR(count, kDraws / 10, 4 * std::sqrt(kDraws * 0.09)) << i;
  }
}

// Truncated at z standard deviations, it exceeds them by an exponential of about 1/z; the exact means are by the ratio
// of Mills.
TEST(Distribution, IsDrawnInItsTail) {
  constexpr int kDraws = 2000;
  using Kind = Distribution::Kind;
  struct Tail {
    Distribution from;
    double mean;
    double sigma;
  };
  const auto tail = [](Kind kind, double a, double b, std::optional<double> min, std::optional<double> max, double mean,
                       double sigma) {
    Distribution from;
    from.kind = kind;
    from.a = a;
    from.b = b;
    from.min = min;
    from.max = max;
    return Tail{from, mean, sigma};
  };
  // φ(8)/Q(8) = 8.121368 and φ(30)/Q(30) = 30.033260.
  const std::vector<Tail> tails{
      tail(Kind::kNormal, 50, 1, 58, {}, 58.121368, 0.12), tail(Kind::kNormal, 50, 1, {}, 42, 41.878632, 0.12),
      tail(Kind::kNormal, 0, 1, 30, {}, 30.033260, 0.034), tail(Kind::kNormal, 0, 1, 30, 30.01, 30.00475, 0.0029),
      tail(Kind::kExponential, 1, 0, 40, {}, 41, 1),       tail(Kind::kExponential, 1, 0, 600, {}, 601, 1)};
  for (const Tail& one : tails) {
    Vary vary;
    vary.parameters.push_back({"x", one.from});
    SCOPED_TRACE(testing::Message() << one.from.a << " " << one.mean);
    const Drawing drawing(vary, nullptr, Duration(1));
    const std::vector<std::string>& bounds = drawing.factors()[0].bins;
    EXPECT_EQ(std::set<std::string>(bounds.begin(), bounds.end()).size(), bounds.size());
    double sum = 0;
    for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
      const double value = std::stod(drawing.draw(seed).parameters[0]->scalar);
      EXPECT_TRUE(value >= one.from.min.value_or(-1e9) && value <= one.from.max.value_or(1e9)) << value;
      sum += value;
    }
    EXPECT_NEAR(sum / kDraws, one.mean, 4 * one.sigma / std::sqrt(kDraws));
  }
  // The logarithm of a lognormal is normal.
  Vary vary;
  vary.parameters.push_back({"x", tail(Kind::kLogNormal, 10, 1.1, 30, {}, 0, 0).from});
  const Drawing drawing(vary, nullptr, Duration(1));
  std::set<std::string> values;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) values.insert(drawing.draw(seed).parameters[0]->scalar);
  EXPECT_GT(values.size(), 90U);
  EXPECT_GE(std::stod(*values.begin()), 30);
}

// A seed means the same run for ever.
TEST(Distribution, DrawsTheSameAsEver) {
  Vary vary;
  const auto add = [&](const char* name, Distribution::Kind kind, double a, double b, std::optional<double> min,
                       std::optional<double> max) {
    Distribution from;
    from.kind = kind;
    from.a = a;
    from.b = b;
    from.min = min;
    from.max = max;
    vary.parameters.push_back({name, from});
  };
  add("world.battery.initial", Distribution::Kind::kNormal, 50, 10, 60, 90);
  add("world.motion.speed", Distribution::Kind::kNormal, 0.3, 0.05, {}, {});
  add("deadlines.call", Distribution::Kind::kLogNormal, 40, 1.5, {}, 100);
  add("world.people.anna.after", Distribution::Kind::kExponential, 60, 0, {}, 400);
  const Draw draw = Drawing(vary, nullptr, Duration(1)).draw(1'000'001);
  std::vector<std::string> drawn;
  for (const auto& parameter : draw.parameters) drawn.push_back(parameter->scalar);
  EXPECT_THAT(drawn, ElementsAre("62.8444", "0.296758", "34.7569", "4.55675"));
}

TEST(Drawing, DoesNotChangeOtherFactorsWhenOneIsAdded) {
  Vary vary;
  Distribution from;
  from.b = 1;
  vary.parameters.push_back({"a", from});
  const Draw before = Drawing(vary, nullptr, Duration(1)).draw(42);
  vary.parameters.insert(vary.parameters.begin(), {"b", from});
  const Draw after = Drawing(vary, nullptr, Duration(1)).draw(42);
  EXPECT_EQ(before.parameters[0]->scalar, after.parameters[1]->scalar);
  EXPECT_NE(after.parameters[0]->scalar, after.parameters[1]->scalar);
}

TEST(Drawing, TakesAtMostSoManyFaults) {
  Vary vary;
  vary.faults_at_most = 2;
  for (const char* name : {"a", "b", "c", "d"})
    vary.events.push_back({.name = name, .entry = {}, .is_fault = true, .parts = {}});
  const Drawing drawing(vary, nullptr, Duration(1));
  std::map<std::size_t, int> counts;
  std::vector<int> times(4);
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    std::size_t count = 0;
    const Draw draw = drawing.draw(seed);
    for (std::size_t i = 0; i < 4; ++i) {
      count += draw.events[i] ? 1 : 0;
      times[i] += draw.events[i] ? 1 : 0;
    }
    ++counts[count];
  }
  EXPECT_THAT(counts, SizeIs(3));
  for (const auto& [count, runs] : counts) EXPECT_NEAR(runs, 1000, 120) << count;
  for (const int count : times) EXPECT_NEAR(count, 750, 100);
}

TEST(Rows, AreReadAsTheyWereWritten) {
  constexpr std::uint64_t kSeed = 77;
  SCOPED_TRACE(kSeed);
  Rng rng(kSeed);
  for (int i = 0; i < 300; ++i) {
    Row row;
    row.run = rng.next();
    row.seed = rng.next();
    row.outcome = static_cast<Outcome>(rng.below(5));
    static const std::string kLetters = "ab,\"; é";
    for (std::uint64_t n = rng.below(12); n > 0; --n) row.reason += kLetters[rng.below(kLetters.size())];
    row.time_s = rng.uniform() * 1e3;
    if (rng.below(2) == 0) row.battery_least = rng.uniform();
    for (std::uint64_t n = rng.below(4); n > 0; --n) {
      row.requirements.push_back({static_cast<Verdict>(rng.below(4)), std::nullopt});
      if (rng.below(2) == 0) row.requirements.back().at_s = rng.uniform();
    }
    std::string line = csv_line(row, {"x", "a,b"});
    ASSERT_EQ(line.back(), '\n');
    line.pop_back();
    const auto read = parse_csv_line(line, row.requirements.size());
    ASSERT_TRUE(read) << line;
    EXPECT_EQ(csv_line(*read, {"x", "a,b"}), line + "\n");
    EXPECT_EQ(read->reason, row.reason);
  }
}

// Children that die lose what they were at, and nothing else.
TEST(Pool, LosesOnlyWhatAChildDiedOf) {
  std::uint64_t next = 0;
  std::set<std::uint64_t> done;
  std::map<std::uint64_t, std::string> lost;
  PoolTask task;
  task.jobs = 3;
  task.next = [&]() -> std::optional<std::uint64_t> { return next < 60 ? std::optional(next++) : std::nullopt; };
  task.work = [](std::uint64_t what) {
    if (what % 10 == 7) raise(SIGKILL);
    if (what % 10 == 3) _exit(5);
    return "did " + std::to_string(what);
  };
  task.done = [&](std::uint64_t what, const std::string& text) {
    EXPECT_EQ(text, "did " + std::to_string(what));
    EXPECT_TRUE(done.insert(what).second);
  };
  task.lost = [&](std::uint64_t what, std::string why) { lost[what] = std::move(why); };
  task.goes_on = [] { return true; };
  ASSERT_TRUE(run_pool(task));
  EXPECT_EQ(done.size(), 48U);
  ASSERT_EQ(lost.size(), 12U);
  for (const auto& [what, why] : lost)
    EXPECT_THAT(why, HasSubstr(what % 10 == 7 ? "ended with signal 9 (Killed)" : "ended with exit code 5"));
}

TEST(Pool, EndsAChildThatIsStoppedAndThatNobodyLetsGoOn) {
  std::uint64_t next = 0;
  std::vector<std::uint64_t> done;
  std::map<std::uint64_t, std::string> lost;
  PoolTask task;
  task.jobs = 2;
  task.stopped_max = std::chrono::milliseconds(1);
  task.next = [&]() -> std::optional<std::uint64_t> { return next < 9 ? std::optional(next++) : std::nullopt; };
  task.work = [](std::uint64_t what) {
    if (what == 4) raise(SIGSTOP);
    return std::string();
  };
  task.done = [&](std::uint64_t what, const std::string&) { done.push_back(what); };
  task.lost = [&](std::uint64_t what, std::string why) { lost[what] = std::move(why); };
  task.goes_on = [] { return true; };
  ASSERT_TRUE(run_pool(task));
  EXPECT_THAT(done, testing::UnorderedElementsAre(0, 1, 2, 3, 5, 6, 7, 8));
  ASSERT_THAT(lost, SizeIs(1));
  EXPECT_THAT(lost[4], HasSubstr("was stopped for 0.001 s"));
}

TEST(Pool, GivesTheRestToAnotherWhenAChildIsSpoilt) {
  std::uint64_t next = 0;
  std::vector<std::uint64_t> done;
  bool is_spoilt = false;
  PoolTask task;
  task.next = [&]() -> std::optional<std::uint64_t> { return next < 9 ? std::optional(next++) : std::nullopt; };
  task.work = [&](std::uint64_t what) {
    is_spoilt = what % 3 == 1;
    return std::string(what * 50'000, 'x');
  };
  task.spoilt = [&] { return is_spoilt; };
  task.done = [&](std::uint64_t what, const std::string& text) {
    EXPECT_EQ(text.size(), what * 50'000);
    done.push_back(what);
  };
  task.lost = [](std::uint64_t, const std::string& why) { ADD_FAILURE() << why; };
  task.goes_on = [] { return true; };
  ASSERT_TRUE(run_pool(task));
  EXPECT_THAT(done, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8));
}

}  // namespace
}  // namespace sentree::campaign
