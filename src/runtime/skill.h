#pragma once

#include "sentree/mission/skill.h"

namespace sentree::runtime {

/// A skill, to be looked at where it is executed.
struct Skill {
  const mission::SkillModel& model;
  const mission::SkillState& state;

  [[nodiscard]] const scxml::Chart& chart() const { return model.chart; }
  [[nodiscard]] const scxml::Session& session() const { return state.session; }
  [[nodiscard]] bool running() const { return state.running(); }
  [[nodiscard]] const mission::SkillState::Latest& latest() const { return state.latest; }
};

}  // namespace sentree::runtime
