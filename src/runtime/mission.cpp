#include "sentree/runtime/mission.h"

#include <algorithm>
#include <utility>

#include "sentree/base/assert.h"

namespace sentree::runtime {

// Publishes node statuses as observations.
struct Mission::StatusEvents final : bt::Observer {
  explicit StatusEvents(Mission& owner) : mission(owner) {}
  void status_changed(bt::NodeId node, bt::Status from, bt::Status to, TimePoint) override {
    mission.publish(MessageKind::kEvent, mission.plan_.tree.path(node), "", "node.status",
                    Map{{"node", static_cast<std::int64_t>(node)}, {"from", to_string(from)}, {"to", to_string(to)}});
  }
  Mission& mission;
};

Mission::Mission(const project::Plan& plan, MissionOptions options, Scheduler& scheduler, Stream& stream,
                 std::vector<std::unique_ptr<LeafDriver>> drivers)
    : plan_(plan),
      options_(std::move(options)),
      scheduler_(scheduler),
      stream_(stream),
      actor_(scheduler.add_actor("mission")),
      state_(plan.tree),
      leaf_of_node_(plan.tree.size(), plan.leaves.size()),
      observer_(std::make_shared<StatusEvents>(*this)) {
  SENTREE_ASSERT(drivers.size() == plan.leaves.size());
  for (std::size_t i = 0; i < drivers.size(); ++i) {
    Leaf& leaf = leaves_.emplace_back();
    leaf.plan = &plan.leaves[i];
    leaf.driver = std::move(drivers[i]);
    leaf_of_node_[plan.leaves[i].node] = i;
  }
  effects_.observer = observer_.get();
}

void Mission::start(std::function<void()> ended) {
  ended_ = std::move(ended);
  plan_next_tick(TimePoint{});
}

void Mission::stop() {
  scheduler_.post(actor_, [this] {
    if (over_ || stopping_) return;
    stopping_ = true;
    run(bt::Input::halt());
    over_ = true;
    // A leaf whose machine is gone will not answer; the run ends all the same.
    scheduler_.at(actor_, add_saturating(scheduler_.now(), 2 * stretched(options_.deadlines.halt)), Rank::kTimer,
                  [this] {
                    if (done_) return;
                    problem("the run ended while leaves were still halting");
                    done_ = true;
                    ended_();
                  });
    check_end();
  });
}

Duration Mission::stretched(Duration wall) const {
  return Duration(static_cast<std::int64_t>(static_cast<double>(wall.count()) * options_.factor));
}

std::size_t Mission::index_of(bt::NodeId node) const {
  const std::size_t index = leaf_of_node_[node];
  SENTREE_ASSERT(index < leaves_.size());
  return index;
}

void Mission::problem(std::string what) {
  if (problems_.size() < kProblemsMax) problems_.push_back(std::move(what));
}

void Mission::publish(MessageKind kind, std::string source, std::string target, std::string name, Value data,
                      std::uint64_t call) {
  Message message;
  message.kind = kind;
  message.source = std::move(source);
  message.target = std::move(target);
  message.name = std::move(name);
  message.call = call;
  message.data = std::move(data);
  stream_.publish(std::move(message));
}

void Mission::on_period() {
  if (over_ || stopping_) return;
  const TimePoint now = scheduler_.now();
  if (state_.waiting_leaf() != bt::kNoNode) {
    // The last tick is not over: this period is missed, not queued.
    ++missed_;
  } else {
    if (lateness_.size() >= kTimingsMax) lateness_.erase(lateness_.begin(), lateness_.begin() + kTimingsMax / 2);
    lateness_.push_back(now - planned_);
    began_ = now;
    stream_.set_tick(++ticks_);
    publish(MessageKind::kEvent, "mission", "", "mission.tick", Map{{"tick", static_cast<std::int64_t>(ticks_)}});
    run(bt::Input::tick());
  }
  if (over_) return;
  TimePoint next = planned_ + options_.period;
  // Periods that have passed altogether are missed as well.
  while (next + options_.period <= scheduler_.now()) {
    next += options_.period;
    ++missed_;
  }
  plan_next_tick(next);
}

void Mission::plan_next_tick(TimePoint by_rate) {
  planned_ = given_tick_ < options_.tick_times.size() ? options_.tick_times[given_tick_++] : by_rate;
  scheduler_.at(actor_, planned_, Rank::kTick, [this] { on_period(); });
}

void Mission::run(bt::Input input) {
  // Each answer known at once is the next input: a loop, so that a long tick does not recurse.
  std::optional<bt::Input> next = std::move(input);
  while (next) {
    const bt::StepResult result = bt::step(plan_.tree, state_, *next, scheduler_.now(), effects_);
    next.reset();
    const std::vector<bt::Effect> effects = effects_.list;
    if (effects_.next_timer < timer_at_) {
      timer_at_ = effects_.next_timer;
      scheduler_.at(actor_, timer_at_, Rank::kTimer, [this] {
        timer_at_ = kNever;
        if (!over_) run(bt::Input::timer());
      });
    }
    follow(effects);
    if (result.waiting()) {
      Leaf& leaf = leaves_[index_of(result.leaf)];
      if (leaf.late) {
        // What the leaf said too late for its own tick answers this one.
        next = std::exchange(leaf.late, std::nullopt);
      }
    } else if (result.done()) {
      finish_tick(result.status);
    } else if (result.kind == bt::StepResult::Kind::kFailed) {
      const std::string why = effects_.error ? to_string(*effects_.error) : "the tree failed";
      problem(why);
      reason_ = why;
      run(bt::Input::halt());
      finish_tick(bt::Status::kFailure);
    }
  }
}

void Mission::follow(const std::vector<bt::Effect>& effects) {
  for (const bt::Effect& effect : effects) {
    Leaf& leaf = leaves_[index_of(effect.leaf)];
    switch (effect.kind) {
      case bt::Effect::Kind::kTickLeaf: tick_leaf(effect); break;
      case bt::Effect::Kind::kHaltLeaf:
        leaf.late.reset();
        leaf.held.reset();
        leaf.outstanding = 0;
        leaf.halt_call = stream_.next_call();
        publish(MessageKind::kRequest, "mission", leaf.plan->name, leaf.plan->name + ".halt.request", Map(),
                leaf.halt_call);
        leaf.driver->halt();
        break;
      case bt::Effect::Kind::kCancelLeaf:
        leaf.late.reset();
        leaf.held.reset();
        leaf.outstanding = 0;
        publish(MessageKind::kEvent, "mission", leaf.plan->name, leaf.plan->name + ".cancel", Map());
        leaf.driver->cancel();
        break;
    }
  }
}

void Mission::tick_leaf(const bt::Effect& effect) {
  const std::size_t index = index_of(effect.leaf);
  Leaf& leaf = leaves_[index];
  if (leaf.late) return;  // answered already, see `run`
  const TimePoint now = scheduler_.now();
  if (leaf.outstanding == 0) {
    leaf.outstanding = ++next_tick_;
    leaf.asked = now;
    leaf.call = stream_.next_call();
    publish(MessageKind::kRequest, "mission", leaf.plan->name, leaf.plan->name + ".tick.request",
            Map{{"inputs", effect.inputs}}, leaf.call);
    if (effect.started) leaf.held.reset();
    if (leaf.held)
      answered(index, leaf.outstanding, leaf.held->status, leaf.held->outputs);
    else
      leaf.driver->tick(leaf.outstanding, effect.started, effect.inputs);
  }
  // One that has an older tick outstanding gets no second one, but the same time to answer.
  const Duration patience = leaf.plan->condition ? options_.deadlines.condition : options_.deadlines.budget;
  const TimePoint told = options_.due ? options_.due(index) : TimePoint{};
  if (told == kNever) return;
  deadline_ = {index, leaf.outstanding, told > now ? told : add_saturating(now, stretched(patience))};
  watch_deadline();
}

void Mission::watch_deadline() {
  // In real time one timer at a time is enough; each that rings for nothing would wake a processor. In virtual time it
  // costs nothing, and keeps its place among the timers of its instant.
  if (!scheduler_.is_virtual() && deadline_timer_ <= deadline_.when) return;
  deadline_timer_ = deadline_.when;
  scheduler_.at(actor_, deadline_.when, Rank::kTimer, [this, rings = deadline_] {
    deadline_timer_ = kNever;
    if (scheduler_.is_virtual() || deadline_.when <= scheduler_.now())
      on_deadline(scheduler_.is_virtual() ? rings : deadline_);
    else if (leaves_[deadline_.leaf].outstanding == deadline_.tick)
      watch_deadline();
  });
}

void Mission::on_deadline(AnswerDeadline deadline) {
  Leaf& leaf = leaves_[deadline.leaf];
  if (leaf.outstanding != deadline.tick || state_.waiting_leaf() != leaf.plan->node) return;
  const TimePoint now = scheduler_.now();
  const bool unresponsive = now - leaf.asked >= stretched(options_.deadlines.unresponsive);
  if (leaf.plan->condition || unresponsive) {
    const char* why = leaf.plan->condition ? "past the condition deadline" : "unresponsive";
    publish(MessageKind::kError, leaf.plan->name, "mission", leaf.plan->name + ".tick.error",
            Map{{"kind", "late"}, {"message", why}}, leaf.call);
    tell_late(leaf, bt::Status::kFailure, why);
    leaf.outstanding = 0;
    leaf.driver->cancel();
    run(bt::Input::answer(leaf.plan->node, bt::Status::kFailure));
  } else {
    tell_late(leaf, bt::Status::kRunning, "past its budget");
    run(bt::Input::answer(leaf.plan->node, bt::Status::kRunning));
  }
}

// Whoever ticks ten times a second need not read it ten times a second.
void Mission::tell_late(Leaf& leaf, bt::Status counts_as, const std::string& why) {
  if (leaf.lateness_told == counts_as) return;
  leaf.lateness_told = counts_as;
  problem(leaf.plan->name + " did not answer tick " + std::to_string(ticks_) + " (" + why + ") and counts as " +
          std::string(to_string(counts_as)) + " until it answers");
}

void Mission::answered(std::size_t index, std::uint64_t tick, bt::Status status, Map outputs) {
  scheduler_.hand_over(actor_, [this, index, tick, status, outputs = std::move(outputs)]() mutable {
    Leaf& leaf = leaves_[index];
    if (leaf.outstanding != tick) return;  // halted or cancelled meanwhile
    leaf.outstanding = 0;
    leaf.lateness_told.reset();
    const bt::Status truth = status;
    const bool forced = force(leaf, status, outputs);
    Map data{{"status", to_string(status)}};
    if (forced) data["forced"] = true;
    if (!outputs.empty()) data["outputs"] = outputs;
    publish(MessageKind::kReply, leaf.plan->name, "mission", leaf.plan->name + ".tick.reply", std::move(data),
            leaf.call);
    if (forced && bt::is_completed(status) && !bt::is_completed(truth)) {
      // The tree has done with the leaf, so its skill must have done too.
      publish(MessageKind::kEvent, "mission", leaf.plan->name, leaf.plan->name + ".cancel", Map());
      leaf.driver->cancel();
    }
    bt::Input answer = bt::Input::answer(leaf.plan->node, status, std::move(outputs));
    if (status == bt::Status::kFailure) {
      if (const Value* reason = answer.outputs.find("reason"))
        reason_ = leaf.plan->name + ": " + std::string(reason->text());
    }
    if (state_.waiting_leaf() == leaf.plan->node)
      run(std::move(answer));
    else if (bt::is_completed(status))
      leaf.late = std::move(answer);
  });
}

bool Mission::force(Leaf& leaf, bt::Status& status, Map& outputs) {
  std::optional<bt::Status> forced;
  if (options_.standing != nullptr && options_.standing->any(project::Intervention::Kind::kForce))
    forced = options_.standing->forced(leaf.plan->name);
  if (!forced) {
    leaf.held.reset();
    return false;
  }
  if (*forced != bt::Status::kRunning)
    leaf.held.reset();
  else if (bt::is_completed(status))
    leaf.held = bt::Input::answer(leaf.plan->node, status, outputs);
  if (*forced != status) outputs = Map();
  status = *forced;
  return true;
}

void Mission::halted(std::size_t index) {
  scheduler_.hand_over(actor_, [this, index] {
    Leaf& leaf = leaves_[index];
    if (leaf.halt_call == 0) return;
    publish(MessageKind::kReply, leaf.plan->name, "mission", leaf.plan->name + ".halt.reply", Map(),
            std::exchange(leaf.halt_call, 0));
    run(bt::Input::leaf_halted(leaf.plan->node));
    check_end();
  });
}

void Mission::finish_tick(bt::Status status) {
  if (durations_.size() >= kTimingsMax) durations_.erase(durations_.begin(), durations_.begin() + kTimingsMax / 2);
  durations_.push_back(scheduler_.now() - began_);
  if (status != root_)
    publish(MessageKind::kEvent, "mission", "", "mission.status", Map{{"status", to_string(status)}});
  root_ = status;
  if (options_.tick_done) options_.tick_done(ticks_);
  if (bt::is_completed(status) && !options_.repeat) over_ = true;
  check_end();
}

void Mission::check_end() {
  if (!over_ || done_) return;
  if (!state_.outstanding_halts().empty()) return;
  done_ = true;
  ended_();
}

TickTiming Mission::timing() const {
  const auto wall = [&](Duration run_time) {
    return Duration(static_cast<std::int64_t>(static_cast<double>(run_time.count()) / options_.factor));
  };
  const auto quantile = [&](std::vector<Duration> values, double q) {
    if (values.empty()) return Duration(0);
    std::sort(values.begin(), values.end());
    return wall(values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))]);
  };
  return {ticks_,
          missed_,
          quantile(lateness_, 0.5),
          quantile(lateness_, 0.99),
          quantile(lateness_, 1.0),
          quantile(durations_, 0.5)};
}

}  // namespace sentree::runtime
