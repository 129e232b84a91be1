#include <array>

#include "sentree/mission/skill.h"

namespace sentree::mission {

namespace {

constexpr SkillEdge kSkillEdges[] = {
    // A run begins, goes on, is answered, or ends within its tick.
    {SkillPhase::kIdle, "tick", SkillPhase::kIdle},
    {SkillPhase::kIdle, "tick", SkillPhase::kRunning},
    {SkillPhase::kIdle, "tick", SkillPhase::kOwing},
    {SkillPhase::kRunning, "tick", SkillPhase::kRunning},
    {SkillPhase::kRunning, "tick", SkillPhase::kIdle},
    {SkillPhase::kOwing, "tick", SkillPhase::kOwing},
    {SkillPhase::kOwing, "tick", SkillPhase::kIdle},
    {SkillPhase::kHalting, "tick", SkillPhase::kHalting},
    {SkillPhase::kEnded, "tick", SkillPhase::kIdle},
    {SkillPhase::kEnded, "tick", SkillPhase::kRunning},
    {SkillPhase::kKilled, "tick", SkillPhase::kKilled},
    // Outcomes and timers reach a living chart only.
    {SkillPhase::kRunning, "outcome", SkillPhase::kRunning},
    {SkillPhase::kRunning, "outcome", SkillPhase::kEnded},
    {SkillPhase::kOwing, "outcome", SkillPhase::kOwing},
    {SkillPhase::kOwing, "outcome", SkillPhase::kIdle},
    {SkillPhase::kHalting, "outcome", SkillPhase::kHalting},
    {SkillPhase::kHalting, "outcome", SkillPhase::kIdle},
    {SkillPhase::kRunning, "timer", SkillPhase::kRunning},
    {SkillPhase::kRunning, "timer", SkillPhase::kEnded},
    {SkillPhase::kOwing, "timer", SkillPhase::kOwing},
    {SkillPhase::kOwing, "timer", SkillPhase::kIdle},
    {SkillPhase::kHalting, "timer", SkillPhase::kHalting},
    {SkillPhase::kHalting, "timer", SkillPhase::kIdle},
    // A halt takes its time; a cancelled run is gone at once.
    {SkillPhase::kIdle, "halt", SkillPhase::kIdle},
    {SkillPhase::kRunning, "halt", SkillPhase::kHalting},
    {SkillPhase::kRunning, "halt", SkillPhase::kIdle},
    {SkillPhase::kOwing, "halt", SkillPhase::kHalting},
    {SkillPhase::kOwing, "halt", SkillPhase::kIdle},
    {SkillPhase::kHalting, "halt", SkillPhase::kHalting},
    {SkillPhase::kHalting, "halt", SkillPhase::kIdle},
    {SkillPhase::kEnded, "halt", SkillPhase::kIdle},
    {SkillPhase::kKilled, "halt", SkillPhase::kKilled},
    {SkillPhase::kIdle, "cancel", SkillPhase::kIdle},
    {SkillPhase::kRunning, "cancel", SkillPhase::kIdle},
    {SkillPhase::kOwing, "cancel", SkillPhase::kIdle},
    {SkillPhase::kHalting, "cancel", SkillPhase::kIdle},
    {SkillPhase::kEnded, "cancel", SkillPhase::kIdle},
    {SkillPhase::kKilled, "cancel", SkillPhase::kKilled},
    {SkillPhase::kIdle, "kill", SkillPhase::kKilled},
    {SkillPhase::kRunning, "kill", SkillPhase::kKilled},
    {SkillPhase::kOwing, "kill", SkillPhase::kKilled},
    {SkillPhase::kHalting, "kill", SkillPhase::kKilled},
    {SkillPhase::kEnded, "kill", SkillPhase::kKilled},
    {SkillPhase::kKilled, "kill", SkillPhase::kKilled},
    {SkillPhase::kKilled, "restart", SkillPhase::kIdle},
    // Charts that live on answer in any phase, and may end in each.
    {SkillPhase::kIdle, "tick", SkillPhase::kResting},
    {SkillPhase::kRunning, "tick", SkillPhase::kResting},
    {SkillPhase::kRunning, "tick", SkillPhase::kOwing},
    {SkillPhase::kOwing, "tick", SkillPhase::kResting},
    {SkillPhase::kOwing, "tick", SkillPhase::kRunning},
    {SkillPhase::kEnded, "tick", SkillPhase::kResting},
    {SkillPhase::kEnded, "tick", SkillPhase::kOwing},
    {SkillPhase::kResting, "tick", SkillPhase::kResting},
    {SkillPhase::kResting, "tick", SkillPhase::kRunning},
    {SkillPhase::kResting, "tick", SkillPhase::kOwing},
    {SkillPhase::kResting, "tick", SkillPhase::kIdle},
    {SkillPhase::kReady, "tick", SkillPhase::kResting},
    {SkillPhase::kReady, "tick", SkillPhase::kRunning},
    {SkillPhase::kReady, "tick", SkillPhase::kOwing},
    {SkillPhase::kReady, "tick", SkillPhase::kIdle},
    {SkillPhase::kRunning, "outcome", SkillPhase::kReady},
    {SkillPhase::kOwing, "outcome", SkillPhase::kResting},
    {SkillPhase::kOwing, "outcome", SkillPhase::kRunning},
    {SkillPhase::kHalting, "outcome", SkillPhase::kResting},
    {SkillPhase::kResting, "outcome", SkillPhase::kResting},
    {SkillPhase::kResting, "outcome", SkillPhase::kIdle},
    {SkillPhase::kReady, "outcome", SkillPhase::kReady},
    {SkillPhase::kReady, "outcome", SkillPhase::kEnded},
    {SkillPhase::kRunning, "timer", SkillPhase::kReady},
    {SkillPhase::kOwing, "timer", SkillPhase::kResting},
    {SkillPhase::kOwing, "timer", SkillPhase::kRunning},
    {SkillPhase::kHalting, "timer", SkillPhase::kResting},
    {SkillPhase::kResting, "timer", SkillPhase::kResting},
    {SkillPhase::kResting, "timer", SkillPhase::kIdle},
    {SkillPhase::kReady, "timer", SkillPhase::kReady},
    {SkillPhase::kReady, "timer", SkillPhase::kEnded},
    {SkillPhase::kRunning, "halt", SkillPhase::kResting},
    {SkillPhase::kOwing, "halt", SkillPhase::kResting},
    {SkillPhase::kHalting, "halt", SkillPhase::kResting},
    {SkillPhase::kResting, "halt", SkillPhase::kResting},
    {SkillPhase::kReady, "halt", SkillPhase::kHalting},
    {SkillPhase::kReady, "halt", SkillPhase::kResting},
    {SkillPhase::kReady, "halt", SkillPhase::kIdle},
    {SkillPhase::kResting, "cancel", SkillPhase::kResting},
    {SkillPhase::kReady, "cancel", SkillPhase::kIdle},
    {SkillPhase::kResting, "kill", SkillPhase::kKilled},
    {SkillPhase::kReady, "kill", SkillPhase::kKilled},
    // So do topics, which also begin a chart that lives on.
    {SkillPhase::kIdle, "topic", SkillPhase::kResting},
    {SkillPhase::kRunning, "topic", SkillPhase::kRunning},
    {SkillPhase::kRunning, "topic", SkillPhase::kEnded},
    {SkillPhase::kRunning, "topic", SkillPhase::kReady},
    {SkillPhase::kOwing, "topic", SkillPhase::kOwing},
    {SkillPhase::kOwing, "topic", SkillPhase::kIdle},
    {SkillPhase::kOwing, "topic", SkillPhase::kResting},
    {SkillPhase::kOwing, "topic", SkillPhase::kRunning},
    {SkillPhase::kHalting, "topic", SkillPhase::kHalting},
    {SkillPhase::kHalting, "topic", SkillPhase::kIdle},
    {SkillPhase::kHalting, "topic", SkillPhase::kResting},
    {SkillPhase::kResting, "topic", SkillPhase::kResting},
    {SkillPhase::kResting, "topic", SkillPhase::kIdle},
    {SkillPhase::kReady, "topic", SkillPhase::kReady},
    {SkillPhase::kReady, "topic", SkillPhase::kEnded},
};

struct SkillDeliveryKind {
  std::string_view operator()(const TickSkill&) const { return "tick"; }
  std::string_view operator()(const HaltSkill&) const { return "halt"; }
  std::string_view operator()(const CancelSkill&) const { return "cancel"; }
  std::string_view operator()(const KillSkill&) const { return "kill"; }
  std::string_view operator()(const RestartSkill&) const { return "restart"; }
  std::string_view operator()(const SkillTimer&) const { return "timer"; }
  std::string_view operator()(const Outcome&) const { return "outcome"; }
  std::string_view operator()(const Finish&) const { return "outcome"; }
  std::string_view operator()(const Admitted&) const { return ""; }
  std::string_view operator()(const Send&) const { return ""; }
  std::string_view operator()(const Published&) const { return "topic"; }
};

}  // namespace

std::string_view to_string(SkillPhase phase) {
  constexpr std::array<std::string_view, 8> kNames{"idle",  "running", "owing", "halting",
                                                   "ended", "resting", "ready", "killed"};
  return kNames[static_cast<std::size_t>(phase)];
}

std::span<const SkillEdge> skill_edges() { return kSkillEdges; }

std::string_view kind_of(const SkillDelivery& delivery) { return std::visit(SkillDeliveryKind(), delivery); }

}  // namespace sentree::mission
