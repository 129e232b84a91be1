#include "sentree/scxml/host.h"

#include "sentree/scxml/model.h"

namespace sentree::scxml {

void ExecutionWatch::begin_evaluation(const Model& model, const Place& place) {
  model_.store(&model, std::memory_order_relaxed);
  // Without a place of its own, an evaluation belongs to the one before.
  if (place.line > 0) {
    line_.store(place.line, std::memory_order_relaxed);
    column_.store(place.column, std::memory_order_relaxed);
  }
  // An evaluation inside another, as those of a <foreach>, does not change who evaluates.
  if (state_.load(std::memory_order_relaxed) == State::kEvaluating) return;
  for (State expected = State::kOutside;
       !state_.compare_exchange_strong(expected, State::kEvaluating, std::memory_order_acq_rel);
       expected = State::kOutside) {
    if (expected == State::kEvaluating) return;
    state_.wait(State::kGivenUp);
  }
}

void ExecutionWatch::end_evaluation() {
  for (State expected = State::kEvaluating;
       !state_.compare_exchange_strong(expected, State::kOutside, std::memory_order_acq_rel);
       expected = State::kEvaluating) {
    if (expected == State::kOutside) return;
    state_.wait(State::kGivenUp);
  }
}

SourceSpan ExecutionWatch::place() const {
  if (state_.load(std::memory_order_relaxed) == State::kOutside) return {};
  const Model* model = model_.load(std::memory_order_relaxed);
  return {model->file, line_.load(std::memory_order_relaxed), column_.load(std::memory_order_relaxed), 0};
}

std::optional<SourceSpan> ExecutionWatch::give_up(std::uint64_t number) {
  State expected = State::kEvaluating;
  if (!state_.compare_exchange_strong(expected, State::kGivenUp, std::memory_order_acq_rel)) return std::nullopt;
  if (step() != number) {
    // A later step has begun between the look and the grip: let it go on.
    state_.store(State::kEvaluating, std::memory_order_release);
    state_.notify_all();
    return std::nullopt;
  }
  // The thread cannot leave its evaluation any more, so the chart that it works on stays.
  return place();
}

}  // namespace sentree::scxml
