#include "sentree/mission/virtual_host.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/assert.h"
#include "sentree/mission/choice.h"
#include "sentree/mission/due.h"
#include "sentree/mission/effect.h"

namespace sentree::mission {

Diagnostics VirtualHost::obstacles(const project::Plan& plan) {
  Diagnostics out;
  const auto add = [&](std::string code, std::string message, SourceSpan span = {}) {
    out.push_back({Severity::kError, std::move(code), std::move(message), std::move(span)});
  };
  const std::string& file = plan.scenario.project.file;
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (!leaf.at.empty() || !leaf.chart)
      add("verify.elsewhere",
          fmt::format("skill {} runs in another process, where its inside cannot be seen", leaf.name),
          SourceSpan{file});
  }
  for (const auto& [name, service] : plan.services) {
    if (service.at != "model" && service.at != "topics") {
      add("verify.no-model",
          fmt::format("service \"{}\" has no model; give it a chart: models: [{{file: models/{}.scxml, serves: [{}]}}]",
                      name, name, name),
          SourceSpan{file});
    }
  }
  for (const project::ObserverPlan& observer : plan.observers) {
    add("verify.elsewhere",
        fmt::format("\"{}\" observes in another process, where its inside cannot be seen", observer.name),
        SourceSpan{file});
  }
  return out;
}

State VirtualHost::begin() {
  State state;
  state.tree = parts_.initial_tree();
  state.skills.resize(parts_.skills());
  state.models.resize(parts_.models());
  state.faults = Faults(plan().scenario.delays);
  state_ = &state;
  for (std::size_t i = 0; i < parts_.models(); ++i) put({}, Rank::kSimulator, {i, ModelDelivery(StartModel{})});
  parts_.start(state.tree, *this);
  state_ = nullptr;
  return state;
}

void VirtualHost::put(TimePoint when, Rank rank, Delivery&& what) {
  Waiting waiting{std::max(when, state_->now), rank, state_->order++, std::move(what)};
  auto& queue = state_->queue;
  if (is_answer_due(waiting.what)) {
    // There is at most one, in whose place it comes.
    std::size_t old = 0;
    while (old < queue.size() && (old == room_ || !is_answer_due(queue[old].what))) ++old;
    if (old < queue.size() && room_ == kNoRoom) {
      room_ = old;
    } else if (old < queue.size()) {
      queue.erase(queue.begin() + static_cast<std::ptrdiff_t>(old));
      if (old < room_) --room_;
    }
  }
  // What stood where there is room has its time and its rank still.
  const auto later = std::upper_bound(queue.begin(), queue.end(), waiting, [](const Waiting& a, const Waiting& b) {
    return a.when != b.when ? a.when < b.when : a.rank < b.rank;
  });
  if (room_ == kNoRoom) {
    queue.insert(later, std::move(waiting));
    return;
  }
  const auto room = queue.begin() + static_cast<std::ptrdiff_t>(std::exchange(room_, kNoRoom));
  if (room < later)
    *std::move(room + 1, later, room) = std::move(waiting);
  else
    *(std::move_backward(later, room, room + 1) - 1) = std::move(waiting);
}

template <class Is>
bool VirtualHost::waits(const Is& is) const {
  const auto& queue = state_->queue;
  for (std::size_t i = 0; i < queue.size(); ++i) {
    if (i != room_ && is(queue[i].what)) return true;
  }
  return false;
}

void VirtualHost::show(Message& message) {
  message.sequence = ++state_->published;
  message.stamp = state_->stamp = std::max(state_->stamp, message.stamp) + 1;
  message.time = state_->now;
  message.tick = state_->tick;
  surroundings_->observed(message);
  if (!parts_.subscriptions().empty()) deliver_topic(message);
}

std::optional<Veto> VirtualHost::judge(Message& request) {
  request.time = state_->now;
  request.tick = state_->tick;
  return surroundings_->judge(request);
}

// A call of a one-way method reaches whoever subscribes to it; a delayed one holds back the later ones.
void VirtualHost::deliver_topic(const Message& message) {
  const Subscriptions::Told told = parts_.subscriptions().told_of(message);
  if (!told.problem.empty()) return surroundings_->problem(told.problem);
  if (told.takers == nullptr) return;
  const Duration delay = state_->faults.empty() ? Duration(0) : state_->faults.delay_of(told.topic);
  for (const auto& taker : *told.takers) {
    TimePoint& not_before =
        taker.is_model ? state_->models[taker.index].topics_not_before : state_->skills[taker.index].topics_not_before;
    put(Subscriptions::time_of(not_before, state_->now, delay), Rank::kMessage,
        taker.is_model ? Delivery{taker.index, ModelDelivery(Published{told.what})}
                       : Delivery{taker.index, SkillDelivery(Published{told.what})});
  }
}

// A delayed tick or halt holds back the later ones.
void VirtualHost::tell_skill(std::size_t leaf, std::string_view message, SkillDelivery what) {
  TimePoint& not_before = state_->skills[leaf].not_before;
  const TimePoint now = state_->now;
  not_before = std::max(not_before, now);
  if (!state_->faults.empty())
    not_before =
        std::max(not_before, now + state_->faults.delay_of(fmt::format("{}.{}", plan().leaves[leaf].name, message)));
  put(not_before, Rank::kMessage, {leaf, std::move(what)});
}

void VirtualHost::call(std::size_t leaf, const Shared<Call>& call) {
  put(now(), Rank::kMessage,
      state_->down.contains(call->service) ? Delivery{leaf, Parts::unreachable(call)} : parts_.delivery_of(leaf, call));
}

void VirtualHost::serve(std::size_t model, ServeCall what) {
  parts_.step(model, state_->models[model], std::move(what), *this);
}

std::uint64_t VirtualHost::tick_number(std::size_t leaf, std::uint64_t next) {
  if (!reuses_numbers_) return next;
  const SkillState& skill = state_->skills[leaf];
  const auto is_used = [&](std::uint64_t number) {
    if (skill.answered != skill.tick && skill.tick == number) return true;
    return waits([&](const Delivery& what) { return numbered_tick(what) == std::pair(leaf, number); });
  };
  std::uint64_t number = 1;
  while (is_used(number)) ++number;
  return number;
}

std::uint64_t VirtualHost::run_number(std::size_t leaf, std::uint64_t next) {
  if (!reuses_numbers_) return next;
  const auto is_used = [&](std::uint64_t number) {
    for (const SkillState::Line& line : state_->skills[leaf].lines) {
      for (const auto& call : line.waiting) {
        if (call->run == number) return true;
      }
    }
    for (const ModelState& model : state_->models) {
      for (const ModelState::OpenCall& open : model.open) {
        if (open.leaf == leaf && open.call->run == number) return true;
      }
    }
    return waits([&](const Delivery& what) { return numbered_call(what) == std::pair(leaf, number); });
  };
  std::uint64_t number = 1;
  while (is_used(number)) ++number;
  return number;
}

void VirtualHost::step(State& state, Surroundings& surroundings) {
  SENTREE_ASSERT(!state.queue.empty());
  state_ = &state;
  surroundings_ = &surroundings;
  auto& queue = state.queue;
  const auto wake = [&](bool is_model, std::size_t part) {
    return is_model ? state.models[part].wake : state.skills[part].wake;
  };
  due(
      queue, [&](std::size_t i) { return part_number(queue[i].what); },
      [&](std::size_t i) { return has_effect(queue[i].what, state.tree, wake); }, due_);
  std::size_t which = 0;
  if (!due_.empty()) {
    first_.clear();
    for (const std::size_t i : due_) first_.push_back(&queue[i].what);
    which = due_[surroundings.order(++state.orders, first_)];
  }
  state.now = queue[which].when;
  Delivery what = std::move(queue[which].what);
  room_ = which;
  if (auto* tree = std::get_if<TreeDelivery>(&what.what)) {
    parts_.step(state.tree, std::move(*tree), *this);
  } else if (auto* skill = std::get_if<SkillDelivery>(&what.what)) {
    parts_.step(what.leaf, state.skills[what.leaf], std::move(*skill), *this);
  } else {
    parts_.step(what.leaf, state.models[what.leaf], std::move(std::get<ModelDelivery>(what.what)), *this);
  }
  if (room_ != kNoRoom) queue.erase(queue.begin() + static_cast<std::ptrdiff_t>(std::exchange(room_, kNoRoom)));
  state_ = nullptr;
}

Result<void> VirtualHost::inject(State& state, const project::Intervention& what, Surroundings& surroundings,
                                 std::optional<std::uint64_t> number) {
  state_ = &state;
  surroundings_ = &surroundings;
  const auto killed = [&](std::size_t leaf) { return is_killed(state, leaf); };
  return mission::inject(parts_, state.faults, state.down, killed, what, *this, number);
}

}  // namespace sentree::mission
