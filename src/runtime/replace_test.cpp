#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/runtime/durable.h"
#include "sentree/runtime/run.h"
#include "sentree/text/file.h"

namespace sentree::runtime {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

project::Plan replaced_plan(const fs::path& project) {
  auto loaded = project::load_scenario(project / "scenarios" / "recharge.yaml");
  EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  auto plan = project::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  return std::move(*plan.value);
}

std::string told(const Diagnostics& diagnostics) {
  std::string all;
  for (const Diagnostic& diagnostic : diagnostics) all += to_string(diagnostic) + "\n";
  return all;
}

// The recharge mission is killed while the robot drives to the kitchen; another project takes its place.
class Replace : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"before", "after"})
      fs::copy(SENTREE_SOURCE_DIR "/examples/recharge", folder_.path() / name, fs::copy_options::recursive);
  }

  void edit(const std::string& file, const std::string& from, const std::string& to) const {
    const fs::path path = folder_.path() / "after" / file;
    std::string text = *text::read_file(path);
    std::size_t changed = 0;
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()), ++changed)
      text.replace(at, from.size(), to);
    ASSERT_GT(changed, 0U) << file << " has no " << from;
    ASSERT_TRUE(text::write_file(path, text));
  }

  // Until it is killed at `at`.
  Journaled killed(const project::Plan& plan, TimePoint at) {
    RunOptions options;
    const fs::path journal = folder_.path() / "run.journal";
    options.durable = DurableOptions{.journal = journal, .sync = project::JournalSync::kNever};
    options.listeners.emplace_back([this](const Message& message) { heard_ = message.sequence; });
    options.on_begin = [&](RunInside& inside) {
      inside.scheduler().at(inside.director(), at, mission::Rank::kInjection, [this, &inside, journal] {
        fs::copy_file(journal, folder_.path() / "killed.journal");
        known_ = heard_;
        inside.end();
      });
    };
    EXPECT_EQ(runtime::Run(plan, std::move(options)).execute().error, "");
    auto journaled = read_journal(folder_.path() / "killed.journal");
    EXPECT_TRUE(journaled.has_value());
    return std::move(*journaled);
  }

  struct GoneOn {
    RunReport report;
    std::vector<std::uint64_t> sequences;
    std::vector<std::string> names;
  };
  GoneOn go_on(const project::Plan& plan, const Replaced& replaced) {
    GoneOn out;
    RunOptions options;
    options.durable = DurableOptions{.journal = folder_.path() / "next.journal",
                                     .sync = project::JournalSync::kNever,
                                     .known = replaced.journaled.reached > TimePoint{} ? kAll : 0};
    options.resume = &replaced.journaled;
    options.listeners.emplace_back([&](const Message& message) {
      out.sequences.push_back(message.sequence);
      out.names.push_back(message.name);
    });
    for (const auto& tell : replaced.untold) tell(options);
    out.report = runtime::Run(plan, std::move(options)).execute();
    EXPECT_EQ(out.report.error, "");
    return out;
  }

  static constexpr std::uint64_t kAll = ~std::uint64_t{0};
  TemporaryFolder folder_{"replace-test"};
  std::uint64_t heard_ = 0;
  std::uint64_t known_ = 0;
};

TEST_F(Replace, AMissionGoesOnWithANewLeafAChangedGuardAndANewRequirement) {
  edit("mission.xml", R"(<ReactiveSequence name="Root">)",
       R"(<ReactiveSequence name="Root"><AlwaysSuccess/><BatteryLevelAbove name="NotEmpty" threshold="1"/>)");
  edit("skills/GoToLocation.scxml", "cond=\"_event.data.result.status === 'GOAL_REACHED'\"",
       "cond=\"_event.data.result.status !== 'MOVING' &amp;&amp; _event.data.result.status === 'GOAL_REACHED'\"");
  edit("mission.xml", R"(threshold="30")", R"(threshold="31")");
  for (const char* file : {"requirements/recharge.req", "scenarios/recharge.yaml"})
    edit(file, "never_empty", "never_flat");
  const project::Plan before = replaced_plan(folder_.path() / "before");
  const project::Plan after = replaced_plan(folder_.path() / "after");
  const Journaled journaled = killed(before, TimePoint(std::chrono::milliseconds(20'050)));
  // Some of what it said was not in its recording.
  const std::uint64_t recorded = known_ - 40;
  const auto replaced = replace_plan(before, journaled, recorded, after);
  ASSERT_TRUE(replaced.ok()) << told(replaced.diagnostics);
  EXPECT_THAT(
      replaced.value->changes,
      AllOf(Contains("leaf NotEmpty is new"), Contains(testing::MatchesRegex("threshold of .* is \"31\", not \"30\"")),
            Contains(testing::MatchesRegex("node .*AlwaysSuccess.* is new")),
            Contains("the chart of GoToKitchen is another one"), Contains("monitor never_flat is new, and begins now"),
            Contains("monitor never_empty is gone")));
  const GoneOn on = go_on(after, *replaced.value);
  EXPECT_EQ(on.report.mission, bt::Status::kSuccess);
  EXPECT_THAT(on.names, Contains("NotEmpty.tick.reply"));
  // Each observation once, those that were not recorded first.
  ASSERT_FALSE(on.sequences.empty());
  for (std::size_t i = 0; i < on.sequences.size(); ++i) ASSERT_EQ(on.sequences[i], recorded + 1 + i);
  // The goal that it has is followed: to the kitchen once more only behind the station.
  EXPECT_EQ(std::count(on.names.begin(), on.names.end(), "navigation.gotoTargetByLocationName.request"), 2);
}

TEST_F(Replace, ARenamedStateOfAChartAtWorkIsRefusedBeforeAnythingIsResumed) {
  edit("skills/GoToLocation.scxml", "\"moving\"", "\"driving\"");
  edit("mission.xml", R"(<GoToLocation name="GoToStation" destination="station"/>)",
       R"(<GoToLocation name="GoToDock" destination="station"/>)");
  const project::Plan before = replaced_plan(folder_.path() / "before");
  const project::Plan after = replaced_plan(folder_.path() / "after");
  const Journaled journaled = killed(before, TimePoint(std::chrono::milliseconds(20'050)));
  const auto file = *text::read_file(journaled.file);
  const auto refused = replace_plan(before, journaled, known_, after);
  ASSERT_EQ(refused.diagnostics.size(), 1U) << told(refused.diagnostics);
  EXPECT_EQ(refused.diagnostics[0].code, "scxml.cannot-carry");
  EXPECT_THAT(refused.diagnostics[0].message,
              AllOf(HasSubstr("the skill of GoToKitchen"), HasSubstr("state \"moving\" is active")));
  // As it was: it goes on with its own project.
  EXPECT_EQ(*text::read_file(journaled.file), file);
  const GoneOn on = go_on(before, {journaled, {}, {}});
  EXPECT_EQ(on.report.mission, bt::Status::kSuccess);
}

TEST_F(Replace, ALeafAtWorkThatIsGoneIsRefusedAndEachReasonTold) {
  edit("mission.xml", R"(<GoToLocation name="GoToKitchen")", R"(<GoToLocation name="DriveToKitchen")");
  const project::Plan before = replaced_plan(folder_.path() / "before");
  const project::Plan after = replaced_plan(folder_.path() / "after");
  const auto refused =
      replace_plan(before, killed(before, TimePoint(std::chrono::milliseconds(20'050))), known_, after);
  ASSERT_FALSE(refused.ok());
  const std::string all = told(refused.diagnostics);
  EXPECT_THAT(all, AllOf(HasSubstr("\"GoToKitchen\" (GoToLocation) is at work"),
                         HasSubstr("the skill of GoToKitchen is at work, and its leaf is gone")));
}

}  // namespace
}  // namespace sentree::runtime
