#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"
#include "sentree/text/file.h"

namespace sentree::runtime {
namespace {

namespace fs = std::filesystem;

project::Plan forked_plan(const fs::path& scenario) {
  auto loaded = project::load_scenario(scenario);
  EXPECT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.front());
  loaded.value->virtual_time = true;
  auto plan = project::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  return std::move(*plan.value);
}

// What a run says, from a moment on.
std::vector<std::string> observed(const project::Plan& plan, const mission::State* from, Duration for_so_long) {
  std::vector<std::string> said;
  RunOptions options;
  options.from = from;
  options.listeners.push_back([&](const Message& message) { said.push_back(to_json(message)); });
  if (from != nullptr) {
    options.on_begin = [&](RunInside& inside) {
      mission::State same = inside.capture();
      same.order = from->order;  // what the run itself waits for has its place in the order too
      EXPECT_TRUE(same == *from) << "a part forgets some of what it goes on from";
      if (for_so_long == Duration(0)) return;
      inside.scheduler().at(inside.director(), from->now + for_so_long, mission::Rank::kInjection,
                            [&inside] { inside.end(); });
    };
  }
  Run run(plan, std::move(options));
  EXPECT_EQ(run.execute().error, "");
  return said;
}

// What another process says that restores the state.
std::vector<std::string> observed_elsewhere(const std::string& saved, const fs::path& scenario) {
  const TemporaryFolder folder("test");
  EXPECT_TRUE(text::write_file(folder.path() / "state", saved).has_value());
  const std::string command = "SENTREE_TEST_FOLDER='" + folder.path().string() + "' SENTREE_TEST_SCENARIO='" +
                              scenario.string() + "' '" + fs::read_symlink("/proc/self/exe").string() +
                              "' --gtest_also_run_disabled_tests --gtest_filter=Restored.DISABLED_InAnotherProcess"
                              " > '" +
                              (folder.path() / "log").string() + "' 2>&1 < /dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0) << text::read_file(folder.path() / "log").value_or("");
  std::vector<std::string> said;
  std::string text = text::read_file(folder.path() / "said").value_or("");
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    said.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return said;
}

// The other process of `observed_elsewhere`.
TEST(Restored, DISABLED_InAnotherProcess) {
  const char* folder = std::getenv("SENTREE_TEST_FOLDER");
  const char* scenario = std::getenv("SENTREE_TEST_SCENARIO");
  ASSERT_TRUE(folder != nullptr && scenario != nullptr);
  const project::Plan plan = forked_plan(scenario);
  const auto saved = text::read_file(fs::path(folder) / "state");
  ASSERT_TRUE(saved.has_value());
  const auto state = mission::restore(plan, *saved);
  ASSERT_TRUE(state.has_value()) << to_string(state.error());
  std::string text;
  for (const std::string& line : observed(plan, &*state, Duration(0))) text += line + "\n";
  ASSERT_TRUE(text::write_file(fs::path(folder) / "said", text).has_value());
}

class Forked : public testing::TestWithParam<const char*> {};

// 125 moments of fourteen scenarios: with faults that stand, halts and calls in flight among them. From each, a copy
// goes on; what was saved and restored is equal to it, and now and then goes on too, once in another process.
TEST_P(Forked, AtAnyMomentACopyAndASavedRunGoOnAlike) {
  const std::uint64_t seed = hash_bytes(GetParam());
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  const fs::path scenario = fs::path(SENTREE_SOURCE_DIR) / "examples" / GetParam();
  const project::Plan plan = forked_plan(scenario);
  constexpr int kMoments = 125;
  struct Moment {
    TimePoint at;
    mission::State state;
  };
  const TimePoint end = [&] {
    runtime::Run run(plan, {});
    return run.execute().ended;
  }();
  std::vector<TimePoint> times;
  for (int i = 0; i < kMoments; ++i) {
    // Half of them right behind a tick, where most is in flight.
    const Duration any(
        static_cast<std::int64_t>(rng.below(static_cast<std::uint64_t>(end.time_since_epoch().count()) + 1)));
    const Duration period = plan.scenario.project.period;
    times.push_back(TimePoint(i % 2 == 0 ? any : any / period * period + Duration(1)));
  }
  std::sort(times.begin(), times.end());
  std::vector<mission::State> states;
  std::vector<std::string> whole;
  RunOptions options;
  options.listeners.push_back([&](const Message& message) { whole.push_back(to_json(message)); });
  options.on_begin = [&](RunInside& inside) {
    for (const TimePoint time : times) {
      inside.scheduler().at(inside.director(), time, mission::Rank::kInjection,
                            [&inside, &states] { states.push_back(inside.capture()); });
    }
  };
  runtime::Run run(plan, std::move(options));
  EXPECT_EQ(run.execute().error, "");
  ASSERT_GE(states.size(), static_cast<std::size_t>(kMoments) / 2);
  for (std::size_t i = 0; i < states.size(); ++i) {
    // Some to the end; most for two seconds, in which everything that was in flight has come down.
    const Duration span = i % 25 == 0 ? Duration(0) : std::chrono::seconds(2);
    const std::vector<std::string> again = observed(plan, &states[i], span);
    const std::size_t first = states[i].published;
    ASSERT_LE(first + again.size(), whole.size());
    EXPECT_EQ(again.empty(), first == whole.size());
    if (span == Duration(0)) {
      EXPECT_EQ(first + again.size(), whole.size());
    }
    for (std::size_t k = 0; k < again.size(); ++k) {
      ASSERT_EQ(again[k], whole[first + k]) << "forked at " << seconds(states[i].now) << " s";
    }
    const auto saved = mission::save(plan, states[i]);
    ASSERT_TRUE(saved.has_value()) << to_string(saved.error());
    const auto restored = mission::restore(plan, *saved);
    ASSERT_TRUE(restored.has_value()) << to_string(restored.error());
    ASSERT_TRUE(*restored == states[i]) << "saved at " << seconds(states[i].now) << " s";
    ASSERT_EQ(mission::save(plan, *restored), saved);
    if (i % 5 == 0) {
      ASSERT_EQ(observed(plan, &*restored, span), again) << "restored at " << seconds(states[i].now) << " s";
    }
    if (i == states.size() / 2) {
      const auto rest = std::vector<std::string>(whole.begin() + static_cast<std::ptrdiff_t>(first), whole.end());
      EXPECT_EQ(observed_elsewhere(*saved, scenario), rest);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Run, Forked,
                         testing::Values("recharge/scenarios/normal.yaml", "recharge/scenarios/recharge.yaml",
                                         "recharge/scenarios/experiment1.yaml", "recharge/scenarios/experiment2.yaml",
                                         "recharge/scenarios/no-path.yaml", "recharge/scenarios/unshielded.yaml",
                                         "minimal/scenarios/visit.yaml", "two-robots/scenarios/errands.yaml",
                                         "living-skills/scenarios/visits.yaml", "living-skills/scenarios/low.yaml",
                                         "modelled/scenarios/goes-in.yaml", "topics/scenarios/drains.yaml",
                                         "modelled/scenarios/no-door.yaml", "pick-and-place/scenarios/stuck.yaml"),
                         [](const auto& tested) {
                           std::string name = fs::path(tested.param).stem().string();
                           std::erase_if(name, [](char c) { return c == '-'; });
                           return name;
                         });

}  // namespace
}  // namespace sentree::runtime
