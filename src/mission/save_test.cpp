#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeinfo>
#include <variant>
#include <vector>

#include "sentree/base/encoder.h"
#include "sentree/base/packed.h"
#include "sentree/base/rng.h"
#include "sentree/mission/detail/members.h"
#include "sentree/mission/state.h"
#include "sentree/project/plan.h"

namespace sentree::mission {
namespace {

using testing::HasSubstr;

project::Plan plan_of(const std::string& scenario, std::uint64_t seed = 1) {
  auto loaded = project::load_scenario(std::filesystem::path(SENTREE_SOURCE_DIR) / "examples" / scenario);
  EXPECT_TRUE(loaded.ok());
  loaded.value->seed = seed;
  auto plan = project::prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok());
  return std::move(*plan.value);
}

// Before its first delivery, with something of each kind on its way.
State state_of(const project::Plan& plan) {
  State state;
  state.now = TimePoint(std::chrono::seconds(3));
  state.tree.tree = bt::State(plan.tree);
  state.tree.leaves[0].late = {bt::Status::kSuccess, Map{{"reason", "x"}}};
  state.skills.resize(plan.leaves.size());
  state.skills[0].latest = {.transition = 0, .event = "TICK", .transitions = 7};
  const Shared<Call> call(
      Call{.run = 1, .id = 2, .service = "battery", .method = "getBatteryState", .args = Map(), .sendid = "s"});
  state.skills[0].lines.push_back({.service = "battery", .waiting = {call}, .not_before = {}});
  const TimePoint when(std::chrono::seconds(4));
  state.queue = {{when, Rank::kTick, 3, {Delivery::kTree, TreeDelivery(Period{})}},
                 {when, Rank::kTimer, 4, {Delivery::kTree, TreeDelivery(AnswerDue{1, 9, when})}},
                 {when, Rank::kMessage, 5, {1, SkillDelivery(TickSkill{9, true, Map{{"to", 1.5}}})}},
                 {when, Rank::kMessage, 6, {0, SkillDelivery(Finish{call, {.ok = true, .result = 1}, "gate"})}},
                 {when, Rank::kMessage, 7, {0, SkillDelivery(Admitted{call, {Veto{"gate", "why"}}})}}};
  state.faults.add(*state.faults.next_id(),
                   project::intervention::Delay{.message = "battery.*", .by = std::chrono::milliseconds(3)});
  state.down = {"battery", "sim"};
  state.monitors = monitor::MonitorSet(plan.monitors, TimePoint{}).memory();
  return state;
}

constexpr const char* kScenario = "recharge/scenarios/experiment1.yaml";

// How many members a struct has: so many can be initialized, by what turns into anything. An optional takes what turns
// into its content as well, so it gets something of its own.
template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};
struct AnOptional {
  template <class T>
  requires(IsOptional<T>::value) operator T() const;
};
struct Another {
  template <class T>
  requires(!IsOptional<T>::value) operator T() const;
};
template <class T, class... Of>
constexpr std::size_t members_of() {
  if constexpr (requires { T{Of()..., Another()}; })
    return members_of<T, Of..., Another>();
  else if constexpr (requires { T{Of()..., AnOptional()}; })
    return members_of<T, Of..., AnOptional>();
  else
    return sizeof...(Of);
}

// Lists of members that are not whole, of a type and of all that it is made of.
struct Lists {
  std::set<std::string> seen;
  std::set<std::string> broken;

  template <class T>
  void look(const T& object) {
    if constexpr (requires { visit_members(object, *this); }) {
      if (!seen.insert(typeid(T).name()).second) return;
      std::size_t listed = 0;
      visit_members(object, [&](std::string_view, const auto& member) {
        ++listed;
        look(member);
      });
      if constexpr (std::is_aggregate_v<T>) {
        if (listed != members_of<T>()) broken.insert(typeid(T).name());
      }
    }
  }
  template <class T>
  void look(const std::vector<T>&) {
    look(T{});
  }
  template <class T>
  void look(const std::deque<T>&) {
    look(T{});
  }
  template <class T>
  void look(const std::optional<T>&) {
    look(T{});
  }
  template <class... T>
  void look(const std::variant<T...>&) {
    (look(T{}), ...);
  }
  template <class T>
  void look(const Shared<T>&) {
    look(T{});
  }
  void operator()(std::string_view, const auto&) {}
};

TEST(SavedRun, HasEveryMember) {
  Lists lists;
  lists.look(State{});
  EXPECT_TRUE(lists.broken.empty()) << testing::PrintToString(lists.broken);
  EXPECT_GT(lists.seen.size(), 30U);
}

TEST(SavedIntervention, IsOneTableForEveryKindAndComesBack) {
  using namespace project::intervention;
  const std::vector<project::Intervention> every{
      project::intervention::Call{.method = "simulation.setDoor", .args = Map{{"id", "d"}}},
      project::intervention::Stop{},
      Kill{"battery"},
      Restart{"battery"},
      Delay{.message = "battery.*", .by = std::chrono::milliseconds(3), .count = 2},
      Falsify{.call = "battery.level", .path = "a.b", .value = 1.5, .count = 1},
      Force{.leaf = "GoTo", .status = "FAILURE", .count = 4},
      Breakpoint{.point = Breakpoint::Point::kState, .target = "skill:GoTo", .state = "driving"},
      Clear{7},
      Unreachable{"battery.level"},
      Late{"battery.level"}};
  ASSERT_EQ(every.size(), std::variant_size_v<project::Intervention>);
  for (std::size_t kind = 0; kind < every.size(); ++kind) {
    ASSERT_EQ(every[kind].index(), kind);
    const Value saved = save(every[kind]);
    EXPECT_EQ(saved.as_map()->size(), 11U);
    EXPECT_EQ(*saved.find("kind")->as_int(), static_cast<std::int64_t>(kind));
    const auto restored = restore_intervention(saved);
    ASSERT_TRUE(restored.has_value()) << to_string(restored.error());
    EXPECT_EQ(*restored, every[kind]);
  }
  // As states of before have it.
  const Value delay = save(every[4]);
  EXPECT_EQ(delay.find("target")->text(), "battery.*");
  EXPECT_EQ(*delay.find("by")->as_int(), 3'000'000);
  EXPECT_EQ(*delay.find("point")->as_int(), 2);
  EXPECT_TRUE(delay.find("args")->is_null());
  Map unknown = *delay.as_map();
  unknown["kind"] = 11;
  EXPECT_FALSE(restore_intervention(unknown).has_value());
}

TEST(SavedRun, ComesBackEqual) {
  const project::Plan plan = plan_of(kScenario);
  const State state = state_of(plan);
  const auto saved = save(plan, state);
  ASSERT_TRUE(saved.has_value()) << to_string(saved.error());
  const auto restored = restore(plan, *saved);
  ASSERT_TRUE(restored.has_value()) << to_string(restored.error());
  EXPECT_TRUE(*restored == state);
  EXPECT_EQ(save(plan, *restored), saved);
}

// Of format 2 skills had no goals.
TEST(SavedRun, OfTheFormatBeforeComesBackToo) {
  const project::Plan plan = plan_of(kScenario);
  const State state = state_of(plan);
  constexpr std::size_t kHeader = 4 + 3 * 8;
  Value parts = *unpack(save(plan, state)->substr(kHeader));
  std::size_t skills = 0;
  for (Value& skill : *parts.as_map()->find("skills")->as_list()) {
    Map* const members = skill.as_map();
    if (members == nullptr) continue;
    members->erase("heard");
    skills += members->erase("goals") ? 1 : 0;
  }
  ASSERT_GT(skills, 0U);
  const std::string packed = pack(parts);
  std::string saved = "SRUN";
  Encoder header(saved);
  header.word(2);
  header.word(plan.identity);
  header.word(hash_bytes(packed));
  const auto restored = restore(plan, saved + packed);
  ASSERT_TRUE(restored.has_value()) << to_string(restored.error());
  EXPECT_TRUE(*restored == state);
}

TEST(SavedRun, IsRefusedByAnotherPlan) {
  const project::Plan plan = plan_of(kScenario);
  const auto saved = save(plan, state_of(plan));
  ASSERT_TRUE(saved.has_value());
  EXPECT_EQ(plan_of(kScenario).identity, plan.identity);
  EXPECT_EQ(restore(plan_of(kScenario, 2), *saved).error().code, "mission.other-plan");
  EXPECT_EQ(restore(plan_of("recharge/scenarios/normal.yaml"), *saved).error().code, "mission.other-plan");
}

TEST(SavedRun, IsRefusedIfAnyOctetOfItIsWrong) {
  const project::Plan plan = plan_of(kScenario);
  const std::string saved = *save(plan, state_of(plan));
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  Rng rng(kSeed);
  for (int i = 0; i < 200; ++i) {
    std::string damaged = saved;
    damaged[rng.below(damaged.size())] ^= static_cast<char>(1 + rng.below(255));
    EXPECT_FALSE(restore(plan, damaged).has_value());
    EXPECT_FALSE(restore(plan, saved.substr(0, rng.below(saved.size()))).has_value());
  }
  EXPECT_EQ(restore(plan, "").error().code, "mission.bad-state");
}

TEST(SavedRun, IsRefusedIfSomethingOfItIsForNobody) {
  const project::Plan plan = plan_of(kScenario);
  const State sound = state_of(plan);
  const auto refusal = [&](const State& state) {
    const auto restored = restore(plan, *save(plan, state));
    return restored ? std::string("none") : restored.error().message;
  };
  EXPECT_EQ(refusal(sound), "none");
  State state = sound;
  state.queue[1].what.what = TreeDelivery(AnswerDue{99, 9, {}});
  EXPECT_THAT(refusal(state), HasSubstr("for nobody"));
  state = sound;
  state.queue[2].what.leaf = 99;
  EXPECT_THAT(refusal(state), HasSubstr("for nobody"));
  state = sound;
  state.queue[3].what.what = SkillDelivery(Send{});
  EXPECT_THAT(refusal(state), HasSubstr("for nobody"));
  state = sound;
  state.skills[0].phase = SkillPhase::kRunning;
  EXPECT_THAT(refusal(state), HasSubstr("phase"));
  state = sound;
  state.tree.phase = TreePhase::kWaiting;
  EXPECT_THAT(refusal(state), HasSubstr("phase"));
  state = sound;
  state.skills[0].phase = static_cast<SkillPhase>(77);
  EXPECT_THAT(refusal(state), HasSubstr("phase is out of range"));
}

TEST(Packed, GivesBackEveryBit) {
  const Value value = Map{{"a", List{0, 239, 240, -1, INT64_MIN, INT64_MAX, -0.0, 1.0, nullptr, true, false, "a", "a"}},
                          {"nan", std::numeric_limits<double>::quiet_NaN()},
                          {"bytes", Bytes{{std::byte{0}, std::byte{255}}}},
                          {"", Map{{"a", "b"}}}};
  EXPECT_EQ(unpack(pack(value)), value);
}

TEST(Packed, RefusesWhatWouldTakeTooMuch) {
  EXPECT_FALSE(unpack("").has_value());
  EXPECT_FALSE(unpack(pack(Value(1)) + "x").has_value());
  Value deep;
  for (int i = 0; i < kPackedDepthMax; ++i) deep = List{std::move(deep)};
  EXPECT_EQ(unpack(pack(deep)), deep);
  EXPECT_FALSE(unpack(pack(List{List{std::move(deep)}})).has_value());
  // One long text, many times: a few octets each.
  EXPECT_FALSE(unpack(pack(List(1000, Value(std::string(1U << 20U, 'x'))))).has_value());
}

}  // namespace
}  // namespace sentree::mission
