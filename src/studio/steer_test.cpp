// What pages ask of a run that is steered.
#include "sentree/studio/detail/steer.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "sentree/studio/detail/test_support.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::studio {
namespace {

using namespace project::intervention;

// Keeps what it is asked for.
class FakeSteering final : public runtime::Steering {
 public:
  std::vector<project::Intervention> asked;
  std::string refusal;  // of a call

  Status status() const override { return {}; }
  Status wait_paused() override { return {}; }
  TimePoint time() const override { return {}; }
  Result<void> pause() override { return {}; }
  Result<void> resume() override { return {}; }
  Result<void> step(std::uint64_t) override { return {}; }
  Result<void> run_until(TimePoint) override { return {}; }
  Result<void> set_factor(double) override { return {}; }
  Result<Applied> apply_for(const project::Intervention& what, const std::string&) override {
    asked.push_back(what);
    return Applied{.id = project::stands(what) ? asked.size() : 0,
                   .outcome = {.ok = refusal.empty(), .result = 7, .kind = {}, .message = refusal}};
  }
  std::vector<mission::StandingIntervention> standing() const override {
    std::vector<mission::StandingIntervention> list;
    for (std::size_t i = 0; i < asked.size(); ++i) {
      if (project::stands(asked[i])) list.push_back({i + 1, asked[i], 3});
    }
    return list;
  }
  std::vector<project::SteeredPart> parts() const override { return {}; }
  Result<std::string> scenario() const override { return ""; }
};

class Intervene : public testing::Test {
 protected:
  Result<Value> ask(const std::string& op, const std::string& members) {
    return steer(steering_, subject_, op, *text::parse_json(R"({"op":")" + op + R"(","id":1)" + members + "}"));
  }
  FakeSteering steering_;
  project::Plan plan_ = recharge_plan("normal", std::chrono::seconds(1));
  Subject subject_{plan_};
};

TEST_F(Intervene, TakesAndGivesEachKindAsATimelineSpellsIt) {
  const std::vector<project::Intervention> each{
      Call{.method = "simulation.setDoor", .args = Map{{"id", "d"}}},
      Stop{},
      Kill{"battery"},
      Restart{"battery"},
      Delay{"battery.*", std::chrono::milliseconds(30), 2},
      Falsify{"battery.level", "a.b", 1.5, 1},
      Force{"GoTo", "FAILURE", 4},
      Breakpoint{.point = Breakpoint::Point::kState, .target = "skill:GoTo", .state = "driving"},
      Clear{7},
      Unreachable{"battery.level"},
      Late{"battery.level"}};
  ASSERT_EQ(each.size(), project::every_kind().size());
  for (const project::Intervention& what : each) {
    const std::string entry = to_json(Value(project::to_entry(what)));
    const auto answer = ask("intervene", "," + entry.substr(1, entry.size() - 2));
    ASSERT_TRUE(answer.has_value()) << entry << ": " << to_string(answer.error());
    EXPECT_EQ(steering_.asked.back(), what) << entry;
    EXPECT_EQ(answer->find("id") != nullptr, project::stands(what)) << entry;
    EXPECT_EQ(answer->find("result") != nullptr, std::holds_alternative<Call>(what)) << entry;
  }
  const auto standing = ask("interventions", "");
  ASSERT_TRUE(standing.has_value());
  EXPECT_EQ(standing->as_list()->size(), 6U);
  EXPECT_EQ(to_json(standing->as_list()->front()),
            R"({"delay":{"message":"battery.*","by":"0.03 s","count":2},"id":5,"used":3,)"
            R"("text":"delay battery.* by 0.03 s, 2 times"})");
}

TEST_F(Intervene, RefusesWhatNoTimelineSays) {
  EXPECT_EQ(ask("intervene", "").error().code, "studio.request");
  EXPECT_THAT(ask("intervene", R"(,"kill":"a","stop":"mission")").error().message, testing::HasSubstr("needs one of"));
  EXPECT_THAT(ask("intervene", R"(,"delay":{"message":"a.b"})").error().message, testing::HasSubstr("needs \"by\""));
  EXPECT_THAT(ask("intervene", R"(,"kill":"a","by":1)").error().message, testing::HasSubstr("no key \"by\""));
  EXPECT_TRUE(steering_.asked.empty());
  steering_.refusal = "nobody is there";
  EXPECT_EQ(ask("intervene", R"(,"call":"a.b")").error().message, "a.b: nobody is there");
}

// The page's own list, by the same words.
TEST(Page, KnowsEachKindAndItsMembers) {
  const auto text_of = [](const char* file) {
    return *text::read_file(std::filesystem::path(SENTREE_SOURCE_DIR) / "web/src/protocol" / file);
  };
  const std::string protocol = text_of("protocol.ts");
  const std::string kinds = text_of("interventions.ts");
  for (const project::Intervention& kind : project::every_kind()) {
    const auto& [word, does, stands, fault] = project::kind_of(kind);
    EXPECT_THAT(protocol, testing::HasSubstr(fmt::format("\n  {0}: object({{ {0}: ", word)));
    EXPECT_THAT(kinds,
                testing::HasSubstr(fmt::format("\n  {}: {{ does: \"{}\"{}", word, does, stands ? ", sign: " : " }")));
    const std::vector<std::string> keys = project::keys_of(kind);
    if (!stands || keys.size() == 1) continue;
    EXPECT_THAT(kinds, testing::HasSubstr(fmt::format("members: [\"{}\"] }}", fmt::join(keys, "\", \""))));
  }
}

}  // namespace
}  // namespace sentree::studio
