#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/mission/parts.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"
#include "sentree/text/file.h"

namespace sentree::runtime {
namespace {

namespace fs = std::filesystem;

// Of each scenario; a thousand and more in all.
constexpr std::size_t kMoments = 40;

// Scenarios whose runs are no values, and why.
const std::map<std::string, std::string> kLeftOut{
    {"recharge/scenarios/distributed.yaml", "runs in another process, which has no virtual time"}};

// Every scenario of every example but those, below examples/.
std::vector<std::string> scenarios() {
  const fs::path examples = fs::path(SENTREE_SOURCE_DIR) / "examples";
  std::vector<std::string> found;
  for (const auto& example : fs::directory_iterator(examples)) {
    const fs::path folder = example.path() / "scenarios";
    if (!fs::is_directory(folder)) continue;
    for (const auto& file : fs::directory_iterator(folder)) {
      const std::string name = fs::relative(file.path(), examples).generic_string();
      if (file.path().extension() == ".yaml" && !kLeftOut.contains(name)) found.push_back(name);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

Loaded<project::Plan> plan_to_fork(const std::string& name) {
  auto loaded = project::load_scenario(fs::path(SENTREE_SOURCE_DIR) / "examples" / name);
  if (!loaded.ok()) return {.value = {}, .diagnostics = std::move(loaded.diagnostics)};
  loaded.value->virtual_time = true;
  // Of inspection: built here instead of where its users build it.
  for (project::FileRef& plugin : loaded.value->project.plugins)
    plugin.path = SENTREE_BINARY_DIR "/src/runtime/plugins/" + fs::path(plugin.path).filename().string();
  return project::prepare(std::move(*loaded.value));
}

project::Plan forked_plan(const std::string& scenario) {
  auto plan = plan_to_fork(scenario);
  EXPECT_TRUE(plan.ok()) << to_string(plan.diagnostics.front());
  return std::move(*plan.value);
}

// How long the copy of a moment goes on: some to the end (0); most for two seconds, in which everything that was in
// flight has come down.
Duration span_of(std::size_t moment) { return moment % (kMoments / 2) == 0 ? Duration(0) : std::chrono::seconds(2); }

// What a run says, from a moment on, a line each.
std::string observed(const project::Plan& plan, const mission::State& from, Duration for_so_long) {
  std::string said;
  RunOptions options;
  options.from = &from;
  options.listeners.push_back([&](const Message& message) { said += to_json(message) + "\n"; });
  options.on_begin = [&](RunInside& inside) {
    mission::State same = inside.capture();
    same.order = from.order;  // what the run itself waits for has its place in the order too
    EXPECT_TRUE(same == from) << "a part forgets some of what it goes on from";
    if (for_so_long == Duration(0)) return;
    inside.scheduler().at(inside.director(), from.now + for_so_long, mission::Rank::kInjection,
                          [&inside] { inside.end(); });
  };
  Run run(plan, std::move(options));
  EXPECT_EQ(run.execute().error, "");
  return said;
}

// The other process: goes on from each state of a folder that another one has saved.
TEST(Restored, DISABLED_InAnotherProcess) {
  const char* given = std::getenv("SENTREE_TEST_FOLDER");
  const char* scenario = std::getenv("SENTREE_TEST_SCENARIO");
  ASSERT_TRUE(given != nullptr && scenario != nullptr);
  const fs::path folder = given;
  const project::Plan plan = forked_plan(scenario);
  for (std::size_t i = 0; fs::exists(folder / std::to_string(i)); ++i) {
    const auto saved = text::read_file(folder / std::to_string(i));
    ASSERT_TRUE(saved.has_value());
    const auto state = mission::restore(plan, *saved);
    ASSERT_TRUE(state.has_value()) << to_string(state.error());
    ASSERT_TRUE(text::write_file(folder / (std::to_string(i) + ".said"), observed(plan, *state, span_of(i))));
  }
}

// Lets it.
void go_on_elsewhere(const fs::path& folder, const std::string& scenario) {
  const std::string command =
      "SENTREE_TEST_FOLDER='" + folder.string() + "' SENTREE_TEST_SCENARIO='" + scenario + "' '" +
      fs::read_symlink("/proc/self/exe").string() +
      "' --gtest_also_run_disabled_tests --gtest_filter=Restored.DISABLED_InAnotherProcess > '" +
      (folder / "log").string() + "' 2>&1 < /dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0) << text::read_file(folder / "log").value_or("");
}

bool has_call_in_flight(const mission::State& state) {
  return std::any_of(state.models.begin(), state.models.end(), [](const auto& model) { return !model.open.empty(); }) ||
         std::any_of(state.skills.begin(), state.skills.end(),
                     [](const auto& skill) {
                       return std::any_of(skill.lines.begin(), skill.lines.end(),
                                          [](const auto& line) { return !line.waiting.empty(); });
                     }) ||
         std::any_of(state.queue.begin(), state.queue.end(),
                     [](const auto& waiting) { return mission::numbered_call(waiting.what).has_value(); });
}

bool has_halt_in_flight(const mission::State& state) {
  return std::any_of(state.tree.leaves.begin(), state.tree.leaves.end(),
                     [](const auto& leaf) { return leaf.second.halt_call != 0; });
}

// What a run says, and where in it what is rare.
struct Whole {
  TimePoint end;
  std::vector<std::string> lines;
  std::vector<std::size_t> halts;  // lines
  std::vector<std::size_t> calls;
};

Whole whole_run(const project::Plan& plan) {
  Whole whole;
  RunOptions options;
  std::map<std::uint64_t, std::size_t> asked;  // lines, by call
  options.listeners.push_back([&](const Message& message) {
    const bool is_request = message.kind == MessageKind::kRequest;
    if (is_request && message.name.ends_with(".halt.request")) whole.halts.push_back(whole.lines.size());
    if (is_request && message.source != "mission") asked[message.call] = whole.lines.size();
    // What is told on a topic is not answered.
    if (message.kind == MessageKind::kReply && asked.contains(message.call)) whole.calls.push_back(asked[message.call]);
    whole.lines.push_back(to_json(message) + "\n");
  });
  Run run(plan, std::move(options));
  const RunReport report = run.execute();
  EXPECT_EQ(report.error, "");
  whole.end = report.ended;
  return whole;
}

// The run again, copied at moments of all kinds: at any time, right behind a tick, and amid an instant, between two
// deliveries, most of them while a call or a halt is on its way.
std::vector<mission::State> copies(const project::Plan& plan, const Whole& whole, Rng& rng) {
  std::vector<mission::State> states;
  std::multimap<std::size_t, int> amid;  // by line
  RunOptions options;
  RunInside* inside = nullptr;
  const auto copy = [&] { states.push_back(inside->capture()); };
  std::size_t line = 0;
  options.listeners.push_back([&](const Message&) {
    for (std::size_t i = amid.count(line++); i > 0; --i) inside->scheduler().post(inside->director(), copy);
  });
  const auto any_of = [&](const std::vector<std::size_t>& lines) { return lines[rng.below(lines.size())]; };
  options.on_begin = [&](RunInside& of) {
    inside = &of;
    for (std::size_t i = 0; i < kMoments; ++i) {
      const Duration any(
          static_cast<std::int64_t>(rng.below(static_cast<std::uint64_t>(whole.end.time_since_epoch().count()))));
      const Duration period = plan.scenario.project.period;
      const TimePoint time(i % 4 == 0 ? any : std::min(any, any / period * period + Duration(1)));
      if (i % 4 < 2)
        inside->scheduler().at(inside->director(), time, mission::Rank::kInjection, copy);
      else if (i % 4 == 2 && !whole.halts.empty())
        amid.emplace(any_of(whole.halts), 0);
      else if (!whole.calls.empty())
        amid.emplace(any_of(whole.calls), 0);
      else
        amid.emplace(rng.below(whole.lines.size() / 2), 0);
    }
  };
  Run run(plan, std::move(options));
  EXPECT_EQ(run.execute().error, "");
  return states;
}

class Forked : public testing::TestWithParam<std::string> {};

// From each moment a copy goes on here, and what was saved and restored in another process.
TEST_P(Forked, AtAnyMomentACopyAndASavedRunGoOnAlike) {
  const std::uint64_t seed = hash_bytes(GetParam());
  SCOPED_TRACE("seed " + std::to_string(seed));
  Rng rng(seed);
  const project::Plan plan = forked_plan(GetParam());
  const Whole whole = whole_run(plan);
  const std::vector<mission::State> states = copies(plan, whole, rng);
  ASSERT_EQ(states.size(), kMoments);
  const TemporaryFolder folder("fork");
  for (std::size_t i = 0; i < kMoments; ++i) {
    const auto saved = mission::save(plan, states[i]);
    ASSERT_TRUE(saved.has_value()) << to_string(saved.error());
    const auto restored = mission::restore(plan, *saved);
    ASSERT_TRUE(restored.has_value()) << to_string(restored.error());
    ASSERT_TRUE(*restored == states[i]) << "saved at " << seconds(states[i].now) << " s";
    ASSERT_EQ(mission::save(plan, *restored), saved);
    ASSERT_TRUE(text::write_file(folder.path() / std::to_string(i), *saved));
  }
  go_on_elsewhere(folder.path(), GetParam());
  std::size_t calls = 0;
  std::size_t halts = 0;
  std::size_t faults = 0;
  for (std::size_t i = 0; i < kMoments; ++i) {
    const mission::State& state = states[i];
    SCOPED_TRACE("forked at " + std::to_string(seconds(state.now)) + " s, behind " + std::to_string(state.published));
    const std::string again = observed(plan, state, span_of(i));
    std::string then;
    for (std::size_t k = state.published;
         k < whole.lines.size() && (span_of(i) == Duration(0) || then.size() < again.size()); ++k)
      then += whole.lines[k];
    ASSERT_EQ(again, then);
    EXPECT_EQ(again.empty(), state.published == whole.lines.size());
    ASSERT_EQ(text::read_file(folder.path() / (std::to_string(i) + ".said")).value_or("nothing"), again);
    calls += has_call_in_flight(state) ? 1U : 0U;
    halts += has_halt_in_flight(state) ? 1U : 0U;
    faults += state.faults.empty() && state.down.empty() ? 0U : 1U;
  }
  std::cout << kMoments << " moments, with calls in flight " << calls << ", halts " << halts << ", faults " << faults
            << "\n";
  if (!whole.calls.empty()) EXPECT_GT(calls, 0U);
  if (!whole.halts.empty()) EXPECT_GT(halts, 0U);
}

INSTANTIATE_TEST_SUITE_P(Run, Forked, testing::ValuesIn(scenarios()), [](const auto& tested) {
  std::string name = tested.param.substr(0, tested.param.find('/')) + "_" + fs::path(tested.param).stem().string();
  std::erase_if(name, [](char c) { return c == '-'; });
  return name;
});

TEST(ForkedScenarios, AreAllThatAreValues) {
  EXPECT_GE(scenarios().size() * kMoments, 1000U);
  for (const auto& [name, why] : kLeftOut) {
    const auto plan = plan_to_fork(name);
    ASSERT_FALSE(plan.ok()) << name;
    EXPECT_THAT(plan.diagnostics.front().message, testing::HasSubstr(why));
  }
}

}  // namespace
}  // namespace sentree::runtime
