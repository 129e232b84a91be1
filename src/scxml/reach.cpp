#include "sentree/scxml/reach.h"

#include "sentree/scxml/model.h"

namespace sentree::scxml {

std::vector<bool> reachable_states(const Chart& chart) {
  const Model& model = chart.model();
  std::vector<bool> reached(model.states.size(), false);
  std::vector<StateIndex> work;
  const auto reach = [&](StateIndex s) {
    if (!reached[s]) work.push_back(s);
    reached[s] = true;
  };
  reach(0);
  while (!work.empty()) {
    const StateIndex s = work.back();
    work.pop_back();
    const State& state = model.states[s];
    if (state.parent != kNoState) reach(state.parent);
    const TransitionIndex initial = model.state_code[s].initial;
    // A compound state's initial states count even where every transition names a child: being entered by default is
    // what <initial> is for, and it cannot be known who targets the state from outside.
    if (initial != kNoTransition) {
      for (const StateIndex target : model.transitions[initial].targets) reach(target);
    }
    if (state.kind == StateKind::kParallel) {
      for (const StateIndex child : state.children) {
        if (!model.states[child].is_history()) reach(child);
      }
    }
    for (const TransitionIndex t : state.transitions) {
      for (const StateIndex target : model.transitions[t].targets) reach(target);
    }
  }
  return reached;
}

}  // namespace sentree::scxml
