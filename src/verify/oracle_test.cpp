// Exploration against brute force: every list of decisions is executed from the beginning, without a memory, canonical
// forms, reused numbers or anything left out. What can be observed in so many ticks must be the same, and so must what
// is violated.
//
// SENTREE_SEEDS=N tries N random projects instead of the usual ones, SENTREE_SEED=S only that of seed S.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/detail/test_seeds.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/mission/virtual_host.h"
#include "sentree/project/intervention.h"
#include "sentree/verify/detail/period.h"
#include "sentree/verify/detail/test_random_project.h"
#include "sentree/verify/monitor_memory.h"
#include "sentree/verify/statistics.h"
#include "sentree/verify/verify.h"

namespace sentree::verify {
namespace {

constexpr std::uint64_t kOracleSeeds = 30;
constexpr std::uint64_t kLoopSeeds = 30;
// As many as are few enough ways.
constexpr std::uint64_t kTicks[] = {6, 4};
// Of a project that can go in more ways nothing is said.
constexpr std::size_t kRunsMax = 1'500;

// What can be observed in some ticks: one text for each behaviour; and which monitors some behaviour violates, and puts
// to the test.
struct Behaviours {
  std::set<std::string> all;
  std::set<std::string> violated;
  std::set<std::string> tested;
  bool all_end = true;
  bool too_many = false;
};

class BruteForce final : public mission::Surroundings {
 public:
  BruteForce(const project::Plan& plan, const Options& options)
      : plan_(plan), options_(options), dispatch_(plan.monitors) {}

  Behaviours operator()() {
    for (std::size_t runs = 0;; ++runs) {
      out_.too_many = runs >= kRunsMax;
      if (out_.too_many) return std::move(out_);
      run();
      while (!made_.empty() && made_.back().first + 1 >= made_.back().second) made_.pop_back();
      if (made_.empty()) return std::move(out_);
      script_.clear();
      for (const auto& [taken, count] : made_) script_.push_back(taken);
      ++script_.back();
    }
  }

 private:
  void run() {
    made_.clear();
    text_.clear();
    monitors_.emplace(plan_.monitors, TimePoint{});
    mission::VirtualHost host(plan_);
    mission::State state = host.begin();
    for (std::uint64_t tick = 0; tick < options_.ticks && !mission::VirtualHost::ended(state); ++tick) {
      begin_ = state.now;
      text_ += '\n';
      const auto done = period(host, state, *this, [&] { return fault(host, state); });
      ASSERT_TRUE(done) << to_string(done.error());
      decided_.clear();
      monitors_->advance(state.now, decided_);
      note();
    }
    out_.all.insert(text_);
    const bool ended = mission::VirtualHost::ended(state);
    out_.all_end = out_.all_end && ended;
    for (std::size_t i = 0; i < plan_.monitors.size(); ++i) {
      const monitor::Model& model = plan_.monitors[i];
      if (ended && owes_without_bound(model, monitors_->state(i))) out_.violated.insert(model.name());
      if (monitor::vacuity(model, monitors_->state(i)).empty()) out_.tested.insert(model.name());
    }
  }

  std::size_t decide(std::size_t count) {
    const std::size_t taken = made_.size() < script_.size() ? script_[made_.size()] : 0;
    made_.emplace_back(taken, count);
    return taken;
  }

  // Before a tick faults may go, in their order, and then others come.
  Result<void> fault(mission::VirtualHost& host, mission::State& state) {
    using namespace project::intervention;
    const std::size_t count = options_.faults.size();
    for (std::size_t from = 0;;) {
      std::vector<std::pair<std::size_t, project::Intervention>> possible;
      std::size_t stand = 0;
      for (std::size_t number = 0; number < 2 * count; ++number) {
        const bool ends = number < count;
        const project::Intervention& one = options_.faults[number % count];
        project::Intervention end;
        bool stands = false;
        if (const auto* kill = std::get_if<Kill>(&one)) {
          stands = state.down.contains(kill->part);
          for (std::size_t leaf = 0; leaf < plan_.leaves.size(); ++leaf)
            stands = stands || (plan_.leaves[leaf].name == kill->part && mission::VirtualHost::is_killed(state, leaf));
          end = Restart{kill->part};
        } else {
          for (const auto& standing : state.faults.list()) {
            if (!(standing.what == one)) continue;
            stands = true;
            end = Clear{standing.id};
          }
        }
        if (ends && stands) ++stand;
        if (number < from || stands != ends || (!ends && stand >= options_.faults_at_most)) continue;
        possible.emplace_back(number, ends ? end : one);
      }
      if (possible.empty()) return {};
      const std::size_t taken = decide(possible.size() + 1);
      if (taken == 0) return {};
      if (auto done = host.inject(state, possible[taken - 1].second, *this); !done) return done;
      from = possible[taken - 1].first + 1;
    }
  }

  void observed(const Message& message) override {
    decided_.clear();
    monitors_->observe(std::make_shared<const Message>(message), decided_);
    note();
    const auto& targets = dispatch_.route(message.name).of(message.source);
    if (targets.monitors.empty()) return;
    text_ += std::to_string((message.time - begin_).count()) + ' ' + message.name + ' ' + message.source;
    // Names of the data come in the order of the projection.
    Value data = targets.projection.data(message);
    for (const auto& [name, value] : *data.as_map()) {
      if (name != "source" && name != "target") text_ += ' ' + name + to_json(value);
    }
    text_ += ';';
  }
  std::optional<std::uint64_t> choose(const mission::Choice& choice) override { return decide(choice.count); }
  std::size_t order(std::uint64_t, std::span<const mission::Delivery* const> due) override {
    return options_.order == Order::kAny ? decide(due.size()) : 0;
  }
  std::optional<mission::Veto> judge(const Message& request) override {
    const std::string call = request.name.substr(0, request.name.size() - std::string(".request").size());
    decided_.clear();
    monitors_->advance(request.time - Duration(1), decided_);
    note();
    for (const project::GatePlan& gate : plan_.gates) {
      const bool is_asked = std::any_of(gate.requests.begin(), gate.requests.end(), [&](const std::string& pattern) {
        return project::matches_pattern(pattern, call);
      });
      if (!is_asked) continue;
      const monitor::Model& model = plan_.monitors[gate.monitor];
      if (auto reason = monitor::veto(model, monitors_->state(gate.monitor), request))
        return mission::Veto{model.name(), *reason};
    }
    return std::nullopt;
  }

  void note() {
    for (const auto& [monitor, decision, leaf] : decided_) {
      if (decision.verdict == monitor::Verdict::kViolated) out_.violated.insert(plan_.monitors[monitor].name());
    }
  }

  const project::Plan& plan_;
  const Options& options_;
  monitor::Dispatch dispatch_;
  Behaviours out_;
  std::vector<std::size_t> script_;
  std::vector<std::pair<std::size_t, std::size_t>> made_;
  std::string text_;
  TimePoint begin_{};
  std::optional<monitor::MonitorSet> monitors_;
  std::vector<monitor::MonitorSet::Decided> decided_;
};

// Requirements of any pattern; those that are refused by themselves are left out.
void say_more(const std::filesystem::path& folder, std::uint64_t seed) {
  const auto own = text::read_file(folder / "r.req");
  ASSERT_TRUE(own);
  const auto with = [&](const std::string& more) {
    EXPECT_TRUE(text::write_file(folder / "r.req", *own + more));
    auto project = project::load_project(folder);
    return project.ok() && project::prepare(with_models(project::plain_scenario(std::move(*project.value)))).ok();
  };
  if (!with("")) return;
  for (std::uint64_t again = 0; again < 10; ++again) {
    if (with(RandomRequirements(seed * 10 + again)(4))) return;
  }
  (void)with("");
}

// Every way through a graph.
void walk(const Graph& graph, std::uint32_t at, std::uint64_t ticks, const std::string& text, Behaviours& out) {
  if (out.all.size() > 2 * kRunsMax) out.too_many = true;
  if (out.too_many) return;
  const Graph::Node& node = graph.nodes[at];
  if (node.ended || ticks == 0) {
    out.all.insert(text);
    return;
  }
  for (std::uint32_t e = node.first_edge; e < node.first_edge + node.edges; ++e) {
    std::string more = text + '\n';
    for (const Seen& seen : graph.sequences[graph.edges[e].seen]) {
      const Message& message = graph.observations[seen.observation];
      more += std::to_string(seen.after.count()) + ' ' + message.name + ' ' + message.source;
      for (const auto& [name, value] : *message.data.as_map()) more += ' ' + name + to_json(value);
      more += ';';
    }
    walk(graph, graph.edges[e].to, ticks - 1, more, out);
  }
}

TEST(Exploration, FindsWhatBruteForceFinds) {
  std::size_t compared = 0;
  std::size_t deep = 0;
  std::size_t behaviours = 0;
  std::size_t violated = 0;
  std::size_t vacuous = 0;
  for (const std::uint64_t seed : seeds(kOracleSeeds)) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const TemporaryFolder folder("oracle");
    RandomProject(seed).write(folder.path());
    say_more(folder.path(), seed);
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    const auto prepared = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!prepared.ok() || has_errors(obstacles(*prepared.value))) continue;
    const project::Plan& plan = *prepared.value;
    Asked asked;
    asked.explore.order = seed % 3 == 0 ? Order::kAny : Order::kVirtual;
    if (seed % 2 == 0) asked.explore.faults = plan.scenario.project.verify.faults;
    asked.explore.faults_at_most = plan.scenario.project.verify.faults_at_most;
    asked.judge.probabilities = false;
    asked.explore.reduce_orders = false;
    Behaviours naive;
    for (const std::uint64_t ticks : kTicks) {
      asked.explore.ticks = ticks;
      naive = BruteForce(plan, asked.explore)();
      if (!naive.too_many) break;
    }
    if (naive.too_many) continue;
    deep += asked.explore.ticks == kTicks[0] ? 1U : 0U;
    const Verification found = verify(plan, asked);
    ASSERT_THAT(found.errors, testing::IsEmpty());
    Behaviours explored;
    walk(found.graph, 0, asked.explore.ticks, "", explored);
    ASSERT_EQ(explored.all, naive.all);
    const auto compare = [&](const Verification& with) {
      for (const Judgement& judgement : with.judgements) {
        ASSERT_EQ(judgement.error, "") << judgement.requirement;
        const bool is_violated = naive.violated.contains(judgement.requirement);
        // States that come again lead further than so many ticks, and what is owed for ever shows in no number of them.
        const bool is_later = judgement.path && !is_violated &&
                              (judgement.path->loop || judgement.path->edges.size() > asked.explore.ticks);
        if (!is_later) {
          ASSERT_EQ(judgement.finding == Finding::kRefuted, is_violated) << judgement.requirement;
        }
        violated += is_violated ? 1U : 0U;
        if (judgement.finding != Finding::kHolds) continue;
        const bool is_tested = naive.tested.contains(judgement.requirement);
        if (is_tested || naive.all_end) {
          ASSERT_EQ(judgement.vacuous.empty(), is_tested) << judgement.requirement;
        }
        vacuous += judgement.vacuous.empty() ? 0U : 1U;
      }
    };
    ASSERT_NO_FATAL_FAILURE(compare(found));
    // Orders that nobody tells apart change no verdict.
    asked.explore.reduce_orders = true;
    ASSERT_NO_FATAL_FAILURE(compare(verify(plan, asked)));
    asked.explore.reduce_orders = false;
    // Compared state by state it is the same again.
    asked.explore.exact = true;
    const auto exact = explore(plan, asked.explore);
    ASSERT_TRUE(exact);
    EXPECT_EQ(exact->nodes, found.graph.nodes);
    EXPECT_EQ(exact->edges.size(), found.graph.edges.size());
    ++compared;
    behaviours += naive.all.size();
  }
  std::cout << compared << " projects, " << deep << " of them to tick " << kTicks[0] << ", " << behaviours
            << " behaviours, " << violated << " violations, " << vacuous << " vacuous\n";
  if (is_one_seed()) return;
  EXPECT_GT(vacuous, compared / 4);
  EXPECT_GT(compared, seeds(kOracleSeeds).size() / 4) << "hardly any project is small enough";
  EXPECT_GT(deep, seeds(kOracleSeeds).size() / 8) << "hardly any to tick " << kTicks[0];
  EXPECT_GT(behaviours, compared);
  EXPECT_GT(violated, 0U);
}

// Whether a run that does a refuting behaviour again violates the requirement, and when.
TimePoint violated_at(const Verification& found, const Judgement& judgement, const project::Plan& of) {
  auto prepared = project::prepare(counterexample(found.graph, judgement, of.scenario));
  if (!prepared.ok()) {
    ADD_FAILURE() << to_string(prepared.diagnostics.front());
    return kNever;
  }
  const auto told = retell(*prepared.value);
  if (!told) {
    ADD_FAILURE() << to_string(told.error());
    return kNever;
  }
  const auto& models = prepared.value->monitors;
  const auto which = std::find_if(models.begin(), models.end(),
                                  [&](const monitor::Model& model) { return model.name() == judgement.requirement; });
  monitor::MonitorSet monitors(models, TimePoint{});
  std::vector<monitor::MonitorSet::Decided> decided;
  for (const Told& tick : *told) {
    for (const Message& message : tick.messages) monitors.observe(message, decided);
  }
  monitors.advance(judgement.at, decided);
  const auto index = static_cast<std::size_t>(which - models.begin());
  const auto violation = std::find_if(decided.begin(), decided.end(), [&](const monitor::MonitorSet::Decided& one) {
    return one.monitor == index && one.decision.verdict == monitor::Verdict::kViolated;
  });
  return violation != decided.end() ? violation->decision.at : kNever;
}

// Whether a run that does a loop again owes something in the end, however often it goes round.
bool is_owed_in_a_run(const Verification& found, const Judgement& judgement, const project::Plan& of) {
  for (const std::int64_t rounds : {0, 1, 10}) {
    project::Scenario example = counterexample(found.graph, judgement, of.scenario);
    const auto ticks = static_cast<std::int64_t>(example.loop->ticks.last - example.loop->ticks.first + 1);
    example.duration += found.graph.period * ticks * rounds;
    const auto prepared = project::prepare(std::move(example));
    if (!prepared.ok()) return false;
    const auto told = retell(*prepared.value);
    if (!told || told->empty()) return false;
    const auto& models = prepared.value->monitors;
    monitor::MonitorSet monitors(models, TimePoint{});
    std::vector<monitor::MonitorSet::Decided> decided;
    for (const Told& tick : *told) {
      for (const Message& message : tick.messages) monitors.observe(message, decided);
    }
    monitors.advance(told->back().at, decided);
    const auto which = std::find_if(models.begin(), models.end(),
                                    [&](const monitor::Model& model) { return model.name() == judgement.requirement; });
    const monitor::State state = monitors.state(static_cast<std::size_t>(which - models.begin()));
    if (state.verdict != monitor::Verdict::kUndecided || !monitor::standing(*which, state).pending) return false;
  }
  return true;
}

TEST(Verdicts, ComeOutSoInRuns) {
  constexpr std::uint64_t kRuns = 200;
  std::size_t held = 0;
  std::size_t refuted = 0;
  for (const std::uint64_t seed : seeds(kOracleSeeds)) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const TemporaryFolder folder("verdicts");
    RandomProject(seed).write(folder.path());
    say_more(folder.path(), seed + 1'000'000);
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!plan.ok() || has_errors(obstacles(*plan.value))) continue;
    Asked asked;
    asked.explore.states = 2'000;
    const Verification found = verify(*plan.value, asked);
    if (!found.errors.empty()) continue;
    std::vector<std::size_t> violated(found.judgements.size());
    Sampling sampling;
    sampling.runs = kRuns;
    sampling.seed = seed;
    sampling.length = std::chrono::seconds(3);
    sampling.told = [&](const std::vector<Came>& run) {
      for (std::size_t i = 0; i < run.size(); ++i) violated[i] += run[i] == Came::kViolated ? 1U : 0U;
      return true;
    };
    ASSERT_EQ(sample(*plan.value, sampling), kRuns);
    for (std::size_t i = 0; i < found.judgements.size(); ++i) {
      const Judgement& judgement = found.judgements[i];
      if (judgement.finding == Finding::kHolds) {
        EXPECT_EQ(violated[i], 0U) << judgement.requirement << " holds";
        ++held;
      } else if (judgement.finding == Finding::kRefuted && !judgement.path->loop &&
                 judgement.state != "the mission ends") {
        EXPECT_EQ(violated_at(found, judgement, *plan.value), judgement.at) << judgement.requirement << " is refuted";
        ++refuted;
      }
    }
  }
  std::cout << held << " that hold, " << refuted << " that are refuted\n";
  if (is_one_seed()) return;
  EXPECT_GT(held, seeds(kOracleSeeds).size() / 10);
  EXPECT_GT(refuted, seeds(kOracleSeeds).size() / 10);
}

// Faults that come on a path.
std::vector<project::Intervention> faults_of(const Verification& found, const Judgement& judgement,
                                             const std::vector<project::Intervention>& all) {
  std::set<std::string> come;
  for (const std::uint32_t edge : judgement.path->edges) {
    for (const Made& made : found.graph.decisions[found.graph.edges[edge].made]) {
      if (made.kind == Made::Kind::kFault && made.alternative > 0 && found.graph.choices[made.what].function == "fault")
        come.insert(found.graph.choices[made.what].value);
    }
  }
  std::vector<project::Intervention> out;
  for (const project::Intervention& one : all) {
    if (come.contains(to_json(Value(project::to_entry(one))))) out.push_back(one);
  }
  EXPECT_EQ(out.size(), come.size());
  return out;
}

// If any fault of a loop never comes there is none, as is found by exploring anew without it, and neither in the order
// of virtual time if the loop lists others; and a run goes round.
TEST(LoopsThatRefute, NeedEachOfTheirFaultsAndOrders) {
  std::size_t loops = 0;
  std::size_t reordered = 0;
  std::size_t needed = 0;
  for (const std::uint64_t seed : seeds(kLoopSeeds)) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const TemporaryFolder folder("loops");
    RandomProject(seed).write(folder.path());
    ASSERT_TRUE(text::write_file(folder.path() / "r.req",
                                 "let said = reply(device.ask)\nsome: eventually said = 2.\n"
                                 "again: whenever said = 1, robot shall said = 0 eventually.\n"
                                 "answered: whenever event(request(device.ask)), robot shall event(reply(device.ask)) "
                                 "eventually.\n"));
    auto project = project::load_project(folder.path());
    ASSERT_TRUE(project.ok()) << to_string(project.diagnostics.front());
    const auto plan = project::prepare(with_models(project::plain_scenario(std::move(*project.value))));
    if (!plan.ok() || has_errors(obstacles(*plan.value))) continue;
    Asked asked;
    asked.explore.states = 500;
    asked.explore.order = seed % 3 == 0 ? Order::kVirtual : Order::kAny;
    asked.explore.faults = plan.value->scenario.project.verify.faults;
    asked.explore.faults_at_most = plan.value->scenario.project.verify.faults_at_most;
    asked.judge.probabilities = false;
    asked.judge.all_fair = seed % 2 == 0;
    const Verification found = verify(*plan.value, asked);
    if (!found.errors.empty() || !found.graph.complete) continue;
    for (const Judgement& judgement : found.judgements) {
      if (judgement.finding != Finding::kRefuted || !judgement.path->loop) continue;
      SCOPED_TRACE(judgement.requirement);
      ++loops;
      EXPECT_TRUE(is_owed_in_a_run(found, judgement, *plan.value));
      const auto faults = faults_of(found, judgement, asked.explore.faults);
      if (!counterexample(found.graph, judgement, plan.value->scenario).orders.empty()) {
        Asked in_order = asked;
        in_order.only = {judgement.requirement};
        in_order.explore.faults = faults;
        in_order.explore.order = Order::kVirtual;
        EXPECT_NE(verify(*plan.value, in_order).judgements.front().finding, Finding::kRefuted);
        ++reordered;
      }
      for (std::size_t i = 0; i < faults.size(); ++i) {
        Asked fewer = asked;
        fewer.only = {judgement.requirement};
        fewer.explore.faults = faults;
        fewer.explore.faults.erase(fewer.explore.faults.begin() + static_cast<std::ptrdiff_t>(i));
        const Verification without = verify(*plan.value, fewer);
        ASSERT_THAT(without.errors, testing::IsEmpty());
        EXPECT_EQ(without.judgements.front().finding, Finding::kHolds) << project::describe(faults[i]);
        ++needed;
      }
    }
  }
  std::cout << loops << " loops with " << needed << " faults, " << reordered << " in other orders\n";
  if (is_one_seed()) return;
  EXPECT_GT(loops, seeds(kLoopSeeds).size() / 4);
  EXPECT_GT(needed, 0U);
}

}  // namespace
}  // namespace sentree::verify
