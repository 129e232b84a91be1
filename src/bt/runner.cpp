#include "sentree/bt/runner.h"

#include <fmt/format.h>

#include <exception>
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
  if (stepping_) [[unlikely]]
    return asked_within(input);
  now_ = now;
  stepping_ = true;
  try {
    const StepResult result = step(tree_, state_, input, now, effects_);
    if (result.done() && state_.outstanding_halts().empty() && asked_ == 0) [[likely]] {
      stepping_ = false;
      return result.status;
    }
    return end(result, now);
  } catch (...) {
    return threw(now);
  }
}

Status Runner::asked_within(const Input& input) {
  const bool is_tick = input.kind == Input::Kind::kTick;
  asked_ |= is_tick ? kTick : kHalt;
  return is_tick ? Status::kFailure : Status::kIdle;
}

Status Runner::end(StepResult result, TimePoint now) {
  Status status = settle(result, now);
  if (asked_ != 0) {
    if ((asked_ & kTick) != 0 && !effects_.error) {
      effects_.error =
          Diagnostic{Severity::kError,
                     "bt.nested-tick",
                     "the tree was ticked from within its tick, by a node, an observer, a hook or on_leaf; "
                     "ask for another tick by Context::wake",
                     {}};
    }
    give_up(now, effects_.observer);
    if (effects_.error) {
      status = Status::kFailure;
    } else if (status == Status::kRunning) {
      status = Status::kIdle;
    }
    asked_ = 0;
  }
  stepping_ = false;
  return status;
}

Status Runner::threw(TimePoint now) {
  std::string what = "something that is no std::exception";
  try {
    throw;
  } catch (const std::exception& thrown) {
    what = thrown.what();
  } catch (...) {  // as said above
  }
  if (!effects_.error) {
    effects_.error =
        Diagnostic{Severity::kError, "bt.callback-threw", "an observer, a hook or another callback threw " + what, {}};
  }
  try {
    give_up(now, nullptr);
  } catch (...) {
    state_ = State(tree_);
  }
  asked_ = 0;
  stepping_ = false;
  return Status::kFailure;
}

void Runner::give_up(TimePoint now, Observer* observer) {
  Effects quiet;
  quiet.observer = observer;
  step(tree_, state_, Input::halt(), now, quiet);
  // Nobody else answers them.
  while (!state_.outstanding_halts().empty())
    step(tree_, state_, Input::leaf_halted(state_.outstanding_halts().front()), now, quiet);
  effects_.wake = false;
}

void Runner::fail(NodeId leaf, const char* code, const std::string& message) {
  effects_.error =
      Diagnostic{Severity::kError, code,
                 fmt::format("{} \"{}\": {}", tree_.registration(leaf), tree_.path(leaf), message), tree_.span(leaf)};
}

bool Runner::ask(NodeId leaf, std::pair<Status, Map>& answer) {
  if (!on_leaf) {
    fail(
        leaf, "bt.unregistered",
        fmt::format("is declared, and nothing here executes it; register \"{}\" in the Registry with which the tree is "
                    "loaded, or answer it by Runner::on_leaf",
                    tree_.registration(leaf)));
    return false;
  }
  if (effects_.list.empty()) return true;
  try {
    answer = on_leaf(leaf, effects_.list.back().inputs);
    return true;
  } catch (const std::exception& thrown) {
    fail(leaf, "bt.callback-threw", fmt::format("on_leaf threw {}", thrown.what()));
  } catch (...) {
    fail(leaf, "bt.callback-threw", "on_leaf threw something that is no std::exception");
  }
  return false;
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
    if (!ask(result.leaf, answer)) {
      result.kind = StepResult::Kind::kFailed;
      break;
    }
    result = step(tree_, state_, Input::answer(result.leaf, answer.first, std::move(answer.second)), now, effects_);
    wake = wake || effects_.wake;
  }
  effects_.wake = wake;
  if (result.kind == StepResult::Kind::kFailed) {
    give_up(now, effects_.observer);
    return Status::kFailure;
  }
  return result.status;
}

Status Runner::tick() {
  if (clock_ != nullptr) return run(a_tick(), clock_->now());
  if (!timed_ && !stepping_ && state_.next_timer() != kNever) [[unlikely]]
    return time_stands();
  return run(a_tick(), now_);
}

Status Runner::tick(TimePoint now) {
  timed_ = true;
  return run(a_tick(), now);
}

Status Runner::time_stands() {
  const NodeId waiting = state_.next_to_ring();
  give_up(now_, effects_.observer);
  fail(waiting, "bt.no-clock",
       "waits for time to pass, and none does: give the Runner a clock, or the time of each tick by tick(now)");
  return Status::kFailure;
}

Status Runner::tick_until_waiting(int ticks_max) {
  Status status = tick();
  for (int i = 1; i < ticks_max && effects_.wake && status == Status::kRunning; ++i) status = tick();
  return status;
}

void Runner::halt() { run(Input::halt(), clock_ != nullptr ? clock_->now() : now_); }

}  // namespace sentree::bt
