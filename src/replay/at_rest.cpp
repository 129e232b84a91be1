#include "sentree/replay/detail/at_rest.h"

#include <set>
#include <utility>

#include "sentree/runtime/publisher.h"

namespace sentree::replay {

namespace {

constexpr int kSnapshotsTriedMax = 4;

}  // namespace

Result<std::optional<AtRest>> at_rest_before(RecordedRun& recorded, const project::Plan& plan, TimePoint moment,
                                             TimePoint known) {
  TimePoint before = moment;
  for (int tries = 0; tries < kSnapshotsTriedMax; ++tries) {
    const auto snapshot = recorded.snapshot(before);
    if (!snapshot || !*snapshot) break;
    before = (*snapshot)->time - Duration(1);
    auto state = mission::restore(plan, (*snapshot)->state);
    if (!state || !mission::is_at_rest(*state)) continue;
    std::optional<AtRest> from(AtRest{std::move(*state), {}});
    bool is_answer_due = false;
    std::set<std::uint64_t> asked;  // since then, by skills elsewhere
    auto read = recorded.each(
        [&](Message message) {
          if (message.sequence <= from->state.published) return true;
          const bool is_answer = message.kind == MessageKind::kReply || message.kind == MessageKind::kError;
          const bool is_elsewhere = message.call >= runtime::kCallsElsewhere;
          if (is_elsewhere && message.kind == MessageKind::kRequest) asked.insert(message.call);
          if (is_answer && is_elsewhere)  // what was vetoed was never observed to be asked
            is_answer_due = asked.erase(message.call) == 0 && message.data.find("vetoed_by") == nullptr;
          else
            is_answer_due = is_answer && message.call != 0 && message.call <= from->state.calls;
          from->messages.push_back(std::move(message));
          return !is_answer_due;
        },
        from->state.now, known);
    if (!read) return tl::unexpected(read.error());
    if (!is_answer_due) return from;
  }
  return std::nullopt;
}

void prepare_for_replay(mission::State& state, const std::vector<TimePoint>& ticks) {
  state.models.clear();
  std::erase_if(state.queue, [](const mission::Waiting& waiting) {
    return std::holds_alternative<mission::ModelDelivery>(waiting.what.what);
  });
  state.tree.given_tick = 0;
  for (mission::Waiting& waiting : state.queue) {
    const auto* const what = std::get_if<mission::TreeDelivery>(&waiting.what.what);
    if (what == nullptr || !std::holds_alternative<mission::Period>(*what) || ticks.empty()) continue;
    waiting.when = state.tree.planned = ticks.front();
    state.tree.given_tick = 1;
  }
}

}  // namespace sentree::replay
