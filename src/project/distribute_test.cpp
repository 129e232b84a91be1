#include "sentree/project/distribute.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

namespace sentree::project {
namespace {

Plan plan_of(const std::string& scenario) {
  auto loaded = load_scenario(SENTREE_SOURCE_DIR "/examples/recharge/scenarios/" + scenario);
  EXPECT_TRUE(loaded.value.has_value());
  auto plan = prepare(std::move(*loaded.value));
  EXPECT_TRUE(plan.ok());
  return std::move(*plan.value);
}

TEST(Places, NameEachPartWhereItRuns) {
  EXPECT_EQ(shown_places(plan_of("distributed.yaml")),
            "in processes of their own: the simulator (robot), skills GoToStation, GoToKitchen; in this one: the "
            "mission, skills BatteryLevelAbove30, BatteryNotRecharging, AtStation, WaitForUser, AtKitchen, monitors "
            "battery, recharge, never_empty, turns_to_station");
}

TEST(Places, AreNotToldWhereAllPartsRunTogether) { EXPECT_EQ(shown_places(plan_of("experiment1.yaml")), ""); }

TEST(Places, OfAMissionInProcessesAreThoseOfTheSkills) {
  const Plan together = plan_of("experiment1.yaml");
  const auto apart = prepare(in_processes(together));
  ASSERT_TRUE(apart.ok());
  EXPECT_EQ(shown_places(*apart.value),
            "in processes of their own: the simulator (sim), skills BatteryLevelAbove30, BatteryNotRecharging, "
            "AtStation, GoToStation, WaitForUser, AtKitchen, GoToKitchen; in this one: the mission, monitors battery, "
            "recharge, never_empty, turns_to_station");
}

}  // namespace
}  // namespace sentree::project
