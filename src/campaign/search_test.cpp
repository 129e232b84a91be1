#include "sentree/campaign/search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "sentree/base/temporary_folder.h"
#include "sentree/campaign/campaign.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::campaign {
namespace {

const std::string kLockHead =
    "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" ";

// A lock whose mission looks at each tick how many of its digits are right: it opens after 1, 2, 3 in this order, and
// a wrong digit begins anew. Opening it is what must not happen.
class CampaignSearch : public ::testing::Test {
 protected:
  void SetUp() override {
    write("interfaces/lock.thrift", "service Lock { i32 right()  i32 press(1: i32 digit) }\n");
    write("models/lock.scxml",
          kLockHead + R"(initial="there"><datamodel><data id="right" expr="0"/></datamodel><state id="there">
 <transition event="lock.right.request"><send type="thrift" target="lock" event="right.reply"><param name="result" expr="right"/></send></transition>
 <transition event="lock.press.request"><assign location="right" expr="_event.data.args.digit === right + 1 ? right + 1 : 0"/>
  <send type="thrift" target="lock" event="press.reply"><param name="result" expr="right"/></send></transition>
</state></scxml>)");
    write("skills/IsOpen.scxml", kLockHead + R"(initial="asking"><state id="asking">
  <onentry><send type="thrift" target="lock" event="right"/></onentry>
  <transition event="lock.right.reply" cond="_event.data.result === 3" target="success"/>
  <transition event="lock.right.reply" cond="_event.data.result === 2" target="failure"/>
  <transition event="lock.right.reply" cond="_event.data.result === 1" target="failure"/>
  <transition event="lock.right.reply" target="failure"/><transition event="error" target="failure"/>
</state><final id="success"/><final id="failure"/></scxml>)");
    write("mission.xml",
          "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><RetryUntilSuccessful num_attempts=\"-1\"><Delay "
          "delay_msec=\"100\"><Condition ID=\"IsOpen\"/></Delay></RetryUntilSuccessful></BehaviorTree></root>");
    write("r.req", "let right = reply(lock.right)\nclosed \"It stays closed.\":\n  always right < 3.\n");
    write("sentree.yaml",
          "mission: {file: mission.xml, rate: 10 Hz}\nservices: {lock: {interface: lock.thrift/Lock, at: model}}\n"
          "models: [{file: models/lock.scxml, name: keeper, serves: [lock]}]\nmonitors: [{file: r.req}]\n");
    // One run in 12³ is right.
    std::string vary = "duration: 3 s\ntimeline:\n";
    for (const char* name : {"a", "b", "c"})
      vary += std::string("  - {name: ") + name +
              ", at: {uniform: [0 s, 2.9 s]}, call: lock.press, args: {digit: {integer: [1, 12]}}}\n";
    write("campaign.yaml", vary);
    auto loaded = Runner::load(folder_.path(), folder_.path() / "campaign.yaml");
    for (const auto& diagnostic : loaded.diagnostics) ADD_FAILURE() << to_string(diagnostic);
    ASSERT_TRUE(loaded.ok());
    runner_ = std::move(*loaded.value);
  }

  void write(const std::string& name, const std::string& text) {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    ASSERT_TRUE(text::write_file(path, text));
  }
  std::string read(const std::filesystem::path& path) { return text::read_file(path).value_or("(nothing)"); }
  std::filesystem::path out(const std::string& name) {
    std::filesystem::create_directories(folder_.path() / name);
    return folder_.path() / name;
  }
  Settings settings(std::uint64_t seed, std::uint64_t runs) {
    Settings made;
    made.project = folder_.path().string();
    made.asked.seed = seed;
    made.asked.runs = runs;
    made.identity = runner_->identity();
    return made;
  }
  Search search(std::uint64_t seed) {
    Coverage coverage;
    coverage.add(runner_->plan());
    return {runner_->drawing(), coverage, seed};
  }

  TemporaryFolder folder_{"search"};
  std::unique_ptr<Runner> runner_;
};

// The run in which the lock opens first, over a few seeds: of a search, and of runs that are drawn blindly.
TEST_F(CampaignSearch, FindsThreeEventsInOrderSoonerThanBlindRuns) {
  constexpr std::uint64_t kRunsMax = 3000;
  constexpr std::array<std::uint64_t, 5> kSeeds{1, 2, 3, 4, 5};
  std::vector<std::uint64_t> blind;
  std::vector<std::uint64_t> searched;
  for (const std::uint64_t seed : kSeeds) {
    // Blindly: what would be run is looked at, which is as good and needs no run.
    std::uint64_t run = 1;
    const auto opens = [&](std::uint64_t of) {
      const Draw draw = runner_->drawing().draw(seed_of(seed, of));
      std::vector<std::pair<double, std::string>> pressed;
      for (const auto& event : draw.events) {
        const std::string at = event->find("at")->scalar;
        pressed.emplace_back(std::stod(at), event->find("args")->find("digit")->scalar);
      }
      std::sort(pressed.begin(), pressed.end());
      return pressed[0].second == "1" && pressed[1].second == "2" && pressed[2].second == "3";
    };
    while (run < kRunsMax && !opens(run)) ++run;
    blind.push_back(run);
    const auto verdict = [&](std::uint64_t of) { return runner_->row(of, seed_of(seed, of)).requirements[0].verdict; };
    if (opens(run)) {
      EXPECT_EQ(verdict(run), Verdict::kViolated);
    }
    EXPECT_NE(verdict(run - 1), Verdict::kViolated);
    Search looking = search(seed);
    CampaignOptions options{.jobs = 2, .folder = out("seed" + std::to_string(seed))};
    options.search = &looking;
    std::uint64_t first = 0;
    options.on_progress = [&](const Progress& progress) { first = progress.summary->requirements()[0].first_run; };
    options.is_interrupted = [&] { return first != 0; };
    const auto summary = run_campaign(*runner_, settings(seed, kRunsMax), options);
    ASSERT_TRUE(summary) << to_string(summary.error());
    searched.push_back(first != 0 ? first : kRunsMax);
  }
  const auto told = [](const std::vector<std::uint64_t>& runs) { return testing::PrintToString(runs); };
  SCOPED_TRACE("blind " + told(blind) + ", searched " + told(searched));
  RecordProperty("blind", told(blind));
  RecordProperty("searched", told(searched));
  const auto median = [](std::vector<std::uint64_t> runs) {
    std::nth_element(runs.begin(), runs.begin() + static_cast<std::ptrdiff_t>(runs.size() / 2), runs.end());
    return runs[runs.size() / 2];
  };
  EXPECT_LT(median(searched) * 4, median(blind));
  EXPECT_LT(*std::max_element(searched.begin(), searched.end()), kRunsMax);
}

TEST_F(CampaignSearch, IsTheSameWhateverTheNumberOfProcesses) {
  std::vector<std::string> tables;
  std::vector<std::string> results;
  for (const std::size_t jobs : {1, 3}) {
    Search looking = search(7);
    CampaignOptions options{.jobs = jobs, .folder = out("jobs" + std::to_string(jobs))};
    options.search = &looking;
    const auto summary = run_campaign(*runner_, settings(7, 150), options);
    ASSERT_TRUE(summary);
    EXPECT_EQ(summary->runs(), 150U);
    tables.push_back(read(options.folder / kTableName));
    results.push_back(to_json(to_value(looking, *summary)) + to_text(looking, *summary, {}));
    EXPECT_GT(looking.corpus().size(), 2U);
  }
  EXPECT_EQ(tables[0], tables[1]);
  EXPECT_EQ(results[0], results[1]);
}

// What it reached first, each run of the corpus reaches again from the file that is written of it.
TEST_F(CampaignSearch, WritesACorpusThatReachesWhatItDid) {
  Search looking = search(1);
  CampaignOptions options{.jobs = 2, .folder = out("found")};
  options.search = &looking;
  const auto summary = run_campaign(*runner_, settings(1, 200), options);
  ASSERT_TRUE(summary);
  ASSERT_TRUE(write_corpus(*runner_, looking, options.folder / "corpus"));
  Coverage again;
  again.add(runner_->plan());
  for (const Search::Entry& entry : looking.corpus()) {
    const auto file = options.folder / "corpus" / ("run-" + std::to_string(entry.run) + ".yaml");
    auto scenario = project::load_scenario(file);
    for (const auto& diagnostic : scenario.diagnostics) ADD_FAILURE() << to_string(diagnostic);
    ASSERT_TRUE(scenario.ok()) << file;
    auto plan = project::prepare(std::move(*scenario.value));
    ASSERT_TRUE(plan.ok());
    Coverage reached;
    runtime::RunOptions run_options;
    CoverageWatch watch(*plan.value, reached, run_options);
    watch.finish(runtime::Run(*plan.value, std::move(run_options)).execute());
    EXPECT_EQ(reached.all().reached, entry.reached.size()) << file;
    again.reach(reached.reached_of(again));
  }
  EXPECT_GT(again.all().reached, 10U);
  EXPECT_EQ(again.all().reached, looking.coverage().all().reached);
}

TEST_F(CampaignSearch, TakesOverWhatItsCorpusHas) {
  Search looking = search(3);
  const Seeds blind = looking.seeds(1);
  EXPECT_EQ(blind, runner_->drawing().seeds(seed_of(3, 1)));
  looking.take(1, {0, 2});
  EXPECT_TRUE(looking.corpus().empty());  // not before the generation is over
  looking.take(2, {0});
  looking.end_generation();
  ASSERT_EQ(looking.corpus().size(), 1U);
  EXPECT_EQ(looking.corpus()[0].fresh, 2U);
  EXPECT_EQ(looking.coverage().all().reached, 2U);
  std::size_t from_corpus = 0;
  for (std::uint64_t run = 3; run < 103; ++run) {
    const Seeds seeds = looking.seeds(run);
    EXPECT_EQ(seeds, looking.seeds(run));
    for (const std::uint64_t seed : seeds) EXPECT_TRUE(seed == seed_of(3, 1) || seed == seed_of(3, run));
    from_corpus += std::count(seeds.begin(), seeds.end(), seed_of(3, 1)) > 0 ? 1 : 0;
    EXPECT_NE(seeds, blind);
  }
  EXPECT_GT(from_corpus, 60U);
  EXPECT_LT(from_corpus, 95U);
}

}  // namespace
}  // namespace sentree::campaign
