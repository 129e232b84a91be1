#include "sentree/replay/detail/snapshot.h"

#include <memory>
#include <mutex>

#include "sentree/runtime/local_skill.h"
#include "sentree/runtime/monitors.h"
#include "sentree/sim/state.h"

namespace sentree::replay {

namespace {

struct Snapshot {
  std::function<void(TimePoint, const Map&)> done;
  std::mutex mutex;
  std::size_t missing = 0;
  TimePoint time{};
  Map values;
  Map skills;
  Map monitors;

  // With the lock held.
  void arrived() {
    if (--missing > 0) return;
    values["skills"] = std::move(skills);
    values["monitors"] = std::move(monitors);
    done(time, values);
  }
};

void save_monitor(const monitor::Model& model, const monitor::State* state, Map& into) {
  if (state == nullptr) return;
  Map saved{{"verdict", monitor::to_string(state->verdict)}};
  // How many observations still matter. Which ones follows from those before the snapshot, and they are many.
  if (!state->trail.history->empty()) saved["history"] = static_cast<std::int64_t>(state->trail.history->size());
  if (!state->trail.history_complete) saved["history_complete"] = false;
  if (auto session = scxml::save(model.chart(), state->session)) saved["session"] = std::move(*session);
  into[model.name()] = std::move(saved);
}

void save_tree(const runtime::RunInside& inside, const project::Plan& plan, Map& into) {
  const auto saved = bt::save(plan.tree, inside.mission().state().tree);
  if (!saved) return;
  const auto* octets = reinterpret_cast<const std::byte*>(saved->data());
  into["tree"] = Bytes{{octets, octets + saved->size()}};
}

Value save_skill(const mission::SkillModel& model, const mission::SkillState& state) {
  auto saved = mission::save(model, state);
  return saved ? std::move(*saved) : Map{{"unsaved", saved.error().message}};
}

}  // namespace

void take_snapshot(runtime::RunInside& inside, const project::Plan& plan,
                   std::function<void(TimePoint, const Map&)> done) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->done = std::move(done);
  snapshot->time = inside.scheduler().now();
  snapshot->values["sequence"] = static_cast<std::int64_t>(inside.published());
  if (inside.sim() != nullptr)
    inside.sim()->inspect([&](const sim::State& state) { snapshot->values["world"] = sim::save(state); });
  snapshot->missing = 2;
  for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) {
    if (inside.skill(leaf) != nullptr) ++snapshot->missing;
  }
  inside.scheduler().post(inside.mission().actor(), [&inside, &plan, snapshot] {
    const std::lock_guard lock(snapshot->mutex);
    save_tree(inside, plan, snapshot->values);
    snapshot->arrived();
  });
  inside.scheduler().post(inside.observer(), [&inside, &plan, snapshot] {
    const std::lock_guard lock(snapshot->mutex);
    for (std::size_t i = 0; i < plan.monitors.size(); ++i)
      save_monitor(plan.monitors[i], inside.monitors().state(i), snapshot->monitors);
    snapshot->arrived();
  });
  for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) {
    if (inside.skill(leaf) == nullptr) continue;
    inside.skill(leaf)->inspect([&plan, leaf, snapshot](const runtime::Skill* skill) {
      Value saved =
          skill != nullptr ? save_skill(skill->model, skill->state) : Value(Map{{"unsaved", "the skill was given up"}});
      const std::lock_guard lock(snapshot->mutex);
      snapshot->skills[plan.leaves[leaf].name] = std::move(saved);
      snapshot->arrived();
    });
  }
}

Map snapshot_of_end(runtime::RunInside& inside, const project::Plan& plan) {
  Map values{{"sequence", static_cast<std::int64_t>(inside.published())}};
  if (inside.sim() != nullptr)
    inside.sim()->inspect([&](const sim::State& state) { values["world"] = sim::save(state); });
  save_tree(inside, plan, values);
  Map skills;
  for (std::size_t leaf = 0; leaf < plan.leaves.size(); ++leaf) {
    if (runtime::SkillActor* const skill = inside.skill(leaf))
      skills[plan.leaves[leaf].name] = save_skill(mission::skill_model(plan, leaf), skill->state());
  }
  Map monitors;
  for (std::size_t i = 0; i < plan.monitors.size(); ++i)
    save_monitor(plan.monitors[i], inside.monitors().state(i), monitors);
  values["skills"] = std::move(skills);
  values["monitors"] = std::move(monitors);
  return values;
}

}  // namespace sentree::replay
