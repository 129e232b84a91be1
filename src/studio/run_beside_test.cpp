#include "sentree/studio/detail/run_beside.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/studio/recorded.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::studio {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

// The recharge mission goes on beside its project, held after some 20 s, on the way to the kitchen.
class Beside : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"before", "after"})
      fs::copy(SENTREE_SOURCE_DIR "/examples/recharge", folder_.path() / name, fs::copy_options::recursive);
  }

  void edit(const std::string& file, const std::string& from, const std::string& to,
            const std::string& of = "after") const {
    const fs::path path = folder_.path() / of / file;
    std::string text = *text::read_file(path);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << file << " has no " << from;
    ASSERT_TRUE(text::write_file(path, text.replace(at, from.size(), to)));
  }

  [[nodiscard]] project::Plan plan(const std::string& name, std::vector<text::ReadFile>& files) const {
    const text::ReadLog log;
    auto loaded = project::load_scenario(folder_.path() / name / "scenarios" / "recharge.yaml");
    EXPECT_TRUE(loaded.ok());
    loaded.value->virtual_time = virtual_time_;
    if (!virtual_time_) loaded.value->factor = kFactor;
    auto plan = project::prepare(std::move(*loaded.value));
    EXPECT_TRUE(plan.ok());
    files = log.files();
    return std::move(*plan.value);
  }

  void begin() {
    std::vector<text::ReadFile> files;
    auto to_run = plan("before", files);
    auto begun = RunBeside::begin(
        std::move(to_run), files,
        {.folder = runs(), .factor = 1.0, .library = "sentree", .story = {}, .on_end = [this] { ended_.set_value(); }});
    ASSERT_TRUE(begun.has_value()) << to_string(begun.error());
    run_ = std::move(*begun);
  }

  // It may not have begun yet.
  Result<Value> steer(const std::string& op, const std::string& request = "{}") {
    for (;;) {
      auto done = run_->access()->steer(op, *text::parse_json(request));
      if (done || done.error().message != "the run has not begun yet") return done;
      std::this_thread::yield();
    }
  }

  // Two hundred ticks later; fewer in real time.
  void hold() {
    ASSERT_TRUE(steer("pause"));
    if (virtual_time_) {
      ASSERT_TRUE(steer("factor", R"({"value":1000})"));
    }
    ASSERT_TRUE(steer("step", virtual_time_ ? R"({"ticks":200})" : R"({"ticks":30})"));
    wait_paused();
  }

  // However busy the machine is, the mission is late and does not fail.
  void in_real_time() {
    virtual_time_ = false;
    for (const char* of : {"before", "after"})
      edit("sentree.yaml", "mission:",
           "deadlines: {script: 100 ms, call: 20 s, condition: 30 s, budget: 60 s, unresponsive: 60 s}\nmission:", of);
  }

  void wait_paused() {
    while (run_->access()->facts().state == "running") std::this_thread::yield();
    ASSERT_EQ(run_->access()->facts().state, "paused");
  }

  // It may not have begun yet.
  Loaded<std::vector<std::string>> replace() {
    for (;;) {
      std::vector<text::ReadFile> files;
      auto next = plan("after", files);
      auto replaced = run_->replace(std::move(next), std::move(files));
      if (replaced.ok() || replaced.diagnostics.front().code != "run.busy") return replaced;
      std::this_thread::yield();
    }
  }

  // Held at a moment, the run goes on with one leaf more. @param first  The recording until then.
  void begin_and_add_a_leaf(std::string& first) {
    edit("mission.xml", R"(<ReactiveSequence name="Root">)",
         R"(<ReactiveSequence name="Root"><AlwaysSuccess/><BatteryLevelAbove name="NotEmpty" threshold="1"/>)");
    begin();
    hold();
    first = run_->file();
    const auto replaced = replace();
    ASSERT_TRUE(replaced.ok()) << to_string(replaced.diagnostics.front());
    EXPECT_THAT(*replaced.value, testing::Contains("leaf NotEmpty is new"));
  }

  [[nodiscard]] fs::path runs() const { return folder_.path() / "runs"; }

  static constexpr double kFactor = 4.0;

  TemporaryFolder folder_{"beside-test"};
  bool virtual_time_ = true;
  std::promise<void> ended_;
  std::shared_ptr<RunBeside> run_;
};

TEST_F(Beside, GoesOnWithTheEditedProjectFromWhereItIsAndBothRecordingsAreWhole) {
  std::string first;
  ASSERT_NO_FATAL_FAILURE(begin_and_add_a_leaf(first));
  const std::string second = run_->file();
  EXPECT_NE(first, second);
  // As it was held it is held.
  wait_paused();
  const auto shown = run_->shown();
  ASSERT_TRUE(steer("resume"));
  ended_.get_future().wait();
  EXPECT_EQ(run_->problem(), "");
  EXPECT_EQ(run_->access()->facts().state, "ended");

  auto before = replay::RecordedRun::open((runs() / first).string());
  auto after = replay::RecordedRun::open((runs() / second).string());
  ASSERT_TRUE(before.has_value() && after.has_value());
  EXPECT_EQ(before->fact("ended_by"), "interrupt");
  EXPECT_EQ(after->fact("continues"), first);
  EXPECT_EQ(after->fact("mission"), "SUCCESS");
  // Each observation once, and the goal that it had is followed: kitchen, station, kitchen.
  std::vector<std::uint64_t> sequences;
  std::vector<std::string> names;
  std::uint64_t of_reload = 0;
  for (auto* part : {&*before, &*after}) {
    ASSERT_TRUE(part->each([&](const Message& message) {
      sequences.push_back(message.sequence);
      names.push_back(message.name);
      const Value* what = message.data.find("what");
      if (message.name == "scenario.injection" && what != nullptr && what->text() == "reload")
        of_reload = message.sequence;
      return true;
    }));
    if (part == &*after) continue;
    EXPECT_EQ(of_reload, 0U);
    EXPECT_GT(sequences.size(), 1000U);
  }
  EXPECT_GT(of_reload, 0U);
  for (std::size_t i = 0; i < sequences.size(); ++i) ASSERT_EQ(sequences[i], i + 1);
  EXPECT_THAT(names, Contains("NotEmpty.tick.reply"));
  EXPECT_EQ(std::count(names.begin(), names.end(), "navigation.gotoTargetByLocationName.request"), 3);

  // Who looks at the second recording only sees what was at work where it begins, as the page of the run does.
  Diagnostics diagnostics;
  auto opened = Recorded::read((runs() / second).string(), replay::RecordedCode::kRefused, diagnostics);
  ASSERT_TRUE(opened.has_value()) << to_string(opened.error());
  shown.update();
  const Nanoseconds held = std::stoll(after->fact("continues_at_ns"));
  for (const History* history : {&(*opened)->history(), shown.history.get()}) {
    EXPECT_EQ(history->begin(), held);
    std::string state;
    for (const History::PartId& part : history->parts()) history->append(state += '\n', part, held + 1);
    EXPECT_THAT(state,
                AllOf(HasSubstr("\"RUNNING\"\n{\"status\":[1,"), HasSubstr("\"data\":{\"destination\":\"kitchen\"")));
  }
}

TEST_F(Beside, IsRefusedWithAllReasonsAndGoesOnAsItDid) {
  edit("mission.xml", R"(<GoToLocation name="GoToKitchen")", R"(<GoToLocation name="DriveToKitchen")");
  begin();
  hold();
  const std::string first = run_->file();
  const auto refused = replace();
  ASSERT_FALSE(refused.ok());
  std::string all;
  for (const Diagnostic& why : refused.diagnostics) all += to_string(why) + "\n";
  EXPECT_THAT(all, AllOf(HasSubstr("\"GoToKitchen\" (GoToLocation) is at work"),
                         HasSubstr("the skill of GoToKitchen is at work, and its leaf is gone")));
  EXPECT_EQ(run_->file(), first);
  ASSERT_TRUE(steer("resume"));
  ended_.get_future().wait();
  EXPECT_EQ(std::distance(fs::directory_iterator(runs()), fs::directory_iterator()), 1);
  auto whole = replay::RecordedRun::open((runs() / first).string());
  ASSERT_TRUE(whole.has_value());
  EXPECT_EQ(whole->fact("mission"), "SUCCESS");
  // Nothing is replaced once it is over.
  const auto late = replace();
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.diagnostics.front().code, "run.ended");
}

// Of all observations of the recordings, in their order.
struct Seen {
  std::vector<std::uint64_t> sequences;
  std::vector<Nanoseconds> times;
  std::vector<std::string> names;
};

Seen seen_in(std::initializer_list<replay::RecordedRun*> parts) {
  Seen seen;
  for (auto* part : parts) {
    EXPECT_TRUE(part->each([&](const Message& message) {
      seen.sequences.push_back(message.sequence);
      seen.times.push_back(message.time.time_since_epoch().count());
      seen.names.push_back(message.name);
      return true;
    }));
  }
  return seen;
}

TEST_F(Beside, InRealTimeItGoesOnFromWhereItIsPausedOrNot) {
  in_real_time();
  std::string first;
  ASSERT_NO_FATAL_FAILURE(begin_and_add_a_leaf(first));
  const std::string second = run_->file();
  wait_paused();
  ASSERT_TRUE(steer("resume"));
  // Once more, in the midst of it.
  const auto again = replace();
  ASSERT_TRUE(again.ok()) << to_string(again.diagnostics.front());
  EXPECT_THAT(*again.value, testing::IsEmpty());
  EXPECT_EQ(run_->access()->facts().state, "running");
  const std::string third = run_->file();
  hold();
  run_->end();
  EXPECT_EQ(run_->problem(), "");

  auto before = replay::RecordedRun::open((runs() / first).string());
  auto then = replay::RecordedRun::open((runs() / second).string());
  auto after = replay::RecordedRun::open((runs() / third).string());
  ASSERT_TRUE(before.has_value() && then.has_value() && after.has_value());
  EXPECT_EQ(before->fact("clock"), "real");
  EXPECT_EQ(after->fact("clock"), "real");
  EXPECT_EQ(then->fact("continues"), first);
  EXPECT_EQ(after->fact("continues"), second);
  const Seen seen = seen_in({&*before, &*then, &*after});
  for (std::size_t i = 0; i < seen.sequences.size(); ++i) ASSERT_EQ(seen.sequences[i], i + 1);
  EXPECT_TRUE(std::is_sorted(seen.times.begin(), seen.times.end()));
  const auto count = [&](const char* name) { return std::count(seen.names.begin(), seen.names.end(), name); };
  EXPECT_GT(count("NotEmpty.tick.reply"), 20);
  // Each tick is one, and the goal that it had is followed.
  EXPECT_EQ(count("GoToKitchen.tick.request"), count("AtKitchen.tick.reply"));
  EXPECT_GE(count("GoToKitchen.tick.request"), 60);
  EXPECT_EQ(count("navigation.gotoTargetByLocationName.request"), 1);
}

TEST_F(Beside, InRealTimeItIsRefusedWithAllReasonsAndGoesOnAsItDid) {
  in_real_time();
  edit("mission.xml", R"(<GoToLocation name="GoToKitchen")", R"(<GoToLocation name="DriveToKitchen")");
  begin();
  hold();
  ASSERT_TRUE(steer("resume"));
  const std::string file = run_->file();
  const auto refused = replace();
  ASSERT_FALSE(refused.ok());
  std::string all;
  for (const Diagnostic& why : refused.diagnostics) all += to_string(why) + "\n";
  EXPECT_THAT(all, HasSubstr("the skill of GoToKitchen is at work, and its leaf is gone"));
  EXPECT_EQ(run_->access()->facts().state, "running");
  hold();
  EXPECT_EQ(run_->file(), file);
  run_->end();
  auto whole = replay::RecordedRun::open((runs() / file).string());
  ASSERT_TRUE(whole.has_value());
  EXPECT_GE(seen_in({&*whole}).sequences.size(), 1000U);
}

TEST_F(Beside, InRealTimeWhatAScriptThatDoesNotEndHasBegunIsNotTakenOver) {
  in_real_time();
  for (const char* of : {"before", "after"}) {
    edit("mission.xml", R"(<ReactiveSequence name="Root">)",
         R"(<ReactiveSequence name="Root"><ForceSuccess><Action ID="Stuck"/></ForceSuccess>)", of);
    ASSERT_TRUE(text::write_file(
        folder_.path() / of / "skills" / "Stuck.scxml",
        "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='ecmascript'>"
        "<state id='a'><transition event='tick'><script>while (true) {}</script></transition>"
        "<transition event='halt' target='failure'/><transition event='never' target='success'/></state>"
        "<final id='success'/><final id='failure'/></scxml>"));
  }
  begin();
  // Whether it is at work at that moment, was left behind before, or begins only then.
  const auto refused = replace();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.diagnostics.front().code, "run.cannot-carry");
  EXPECT_THAT(refused.diagnostics.front().message, HasSubstr("Stuck"));
  EXPECT_EQ(run_->access()->facts().state, "running");
  run_->end();
}

}  // namespace
}  // namespace sentree::studio
