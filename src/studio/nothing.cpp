#include "sentree/studio/detail/nothing.h"

#include "sentree/bt/load.h"

namespace sentree::studio {

namespace {

constexpr const char* kNothing =
    "<root BTCPP_format=\"4\"><BehaviorTree ID=\"Main\"><AlwaysSuccess/></BehaviorTree></root>";

project::Plan nothing_to_run() {
  project::Plan plan{.scenario = {}, .tree = std::move(*bt::load(kNothing).value)};
  plan.scenario.virtual_time = true;
  return plan;
}

}  // namespace

Nothing::Nothing() : plan(nothing_to_run()), subject(plan), history(subject) {}

}  // namespace sentree::studio
