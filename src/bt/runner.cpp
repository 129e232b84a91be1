#include "sentree/bt/runner.h"

#include <utility>

namespace sentree::bt {

namespace {

const Input& a_tick() {
  static const Input kTick = Input::tick();
  return kTick;
}

}  // namespace

Runner::Runner(Tree tree, const Clock* clock) : tree_(std::move(tree)), state_(tree_), clock_(clock) {}

[[gnu::always_inline]] inline Status Runner::run(const Input& input, TimePoint now) {
  now_ = now;
  const StepResult result = step(tree_, state_, input, now, effects_);
  if (result.done() && state_.outstanding_halts().empty()) [[likely]]
    return result.status;
  return settle(result, now);
}

Status Runner::settle(StepResult result, TimePoint now) {
  bool wake = effects_.wake;
  for (;;) {
    // Halts are answered at once: nobody else is there to do it.
    while (!state_.outstanding_halts().empty() && !result.waiting()) {
      Effects quiet;
      step(tree_, state_, Input::leaf_halted(state_.outstanding_halts().front()), now, quiet);
    }
    if (!result.waiting()) break;
    std::pair<Status, Map> answer{Status::kFailure, {}};
    if (on_leaf && !effects_.list.empty()) answer = on_leaf(result.leaf, effects_.list.back().inputs);
    result = step(tree_, state_, Input::answer(result.leaf, answer.first, std::move(answer.second)), now, effects_);
    wake = wake || effects_.wake;
  }
  effects_.wake = wake;
  if (result.kind == StepResult::Kind::kFailed) {
    Effects quiet;
    quiet.observer = effects_.observer;
    step(tree_, state_, Input::halt(), now, quiet);
    return Status::kFailure;
  }
  return result.status;
}

Status Runner::tick() { return run(a_tick(), clock_ != nullptr ? clock_->now() : now_); }
Status Runner::tick(TimePoint now) { return run(a_tick(), now); }

Status Runner::tick_until_waiting(int ticks_max) {
  Status status = tick();
  for (int i = 1; i < ticks_max && effects_.wake && status == Status::kRunning; ++i) status = tick();
  return status;
}

void Runner::halt() { run(Input::halt(), clock_ != nullptr ? clock_->now() : now_); }

}  // namespace sentree::bt
