#include "sentree/mission/part_memory.h"

#include <fmt/format.h>

#include <algorithm>

#include "sentree/base/assert.h"
#include "sentree/base/encoder.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/due.h"
#include "sentree/mission/encode.h"
#include "sentree/project/intervention.h"

namespace sentree::mission {

namespace {

// Alternatives of more are not kept: who decides refuses such a choice anyway.
constexpr std::uint64_t kAlternativesMax = 10'000;

constexpr std::int64_t kNeverDue = INT64_MAX;

void append(std::string& out, const Value& value) {
  Encoder to(out);
  to.value(value, [&to](std::string_view text) {
    to.byte(Encoder::kString);
    to.text(text);
  });
}

std::uint32_t number_in(std::unordered_map<std::string, std::uint32_t>& numbers, std::string&& key, std::size_t next) {
  return numbers.emplace(std::move(key), static_cast<std::uint32_t>(next)).first->second;
}

constexpr std::string_view kTold[] = {"tick", "halt", "cancel"};

}  // namespace

bool PartMemory::remembers(const project::Plan& plan) {
  const auto asks = [](const scxml::Chart& chart) { return asks_for_ids(chart); };
  return std::none_of(plan.leaves.begin(), plan.leaves.end(),
                      [&](const project::LeafPlan& leaf) { return leaf.chart && asks(*leaf.chart); }) &&
         std::none_of(plan.models.begin(), plan.models.end(),
                      [&](const project::ModelPlan& model) { return asks(model.chart); });
}

PartMemory::Tables::Tables(const project::Plan& plan, FaultsFrom from, bt::Times times)
    : parts(plan),
      faults(from == FaultsFrom::kAnywhere || !plan.scenario.delays.empty() ||
             (from == FaultsFrom::kTimeline && !plan.scenario.timeline.empty())),
      gates(!plan.gates.empty()),
      states(parts, times) {
  parts.remember_steps();
  for (std::size_t leaf = 0; leaf < parts.skills(); ++leaf) looks.emplace_back(parts.skill(leaf).model().chart);
}

PartMemory::PartMemory(const project::Plan& plan, FaultsFrom faults, bt::Times times)
    : tables_(std::make_shared<Tables>(plan, faults, times)) {}

PartMemory::Run PartMemory::begin() {
  Run run;
  const std::size_t skills = tables_->parts.skills();
  const std::size_t models = tables_->parts.models();
  for (std::uint32_t i = 0; i < skills; ++i) run.parts.push_back(tables_->states.number(i, SkillState(), {}));
  for (std::uint32_t i = 0; i < models; ++i)
    run.parts.push_back(tables_->states.number(static_cast<std::uint32_t>(skills) + i, ModelState(), {}));
  run.parts.push_back(kNone);
  run.as_of.assign(run.parts.size(), TimePoint{});
  run.not_before.assign(2 * skills + models, TimePoint{});
  run.standing = intern_standing({Faults(plan().scenario.delays), {}});
  run_ = &run;
  frame_ = {};
  node_ = kNone;
  for (std::size_t i = 0; i < models; ++i) put({}, Rank::kSimulator, {i, ModelDelivery(StartModel{})});
  TreeState tree = tables_->parts.initial_tree();
  tables_->parts.start(tree, *this);
  run.parts.back() = tables_->states.number(static_cast<std::uint32_t>(skills + models), std::move(tree), {});
  run_ = nullptr;
  return run;
}

// ---- runs

void PartMemory::step(Run& run, Outside& outside) {
  SENTREE_ASSERT(!run.queue.empty());
  run_ = &run;
  outside_ = &outside;
  auto& queue = run.queue;
  const auto part_at = [&](std::size_t i) { return tables_->deliveries[queue[i].what].part; };
  due(
      queue, part_at, [&](std::size_t i) { return has_effect(run, queue[i]); }, due_);
  std::size_t which = 0;
  if (!due_.empty()) {
    first_.clear();
    for (const std::size_t i : due_) first_.push_back(part_at(i));
    which = due_[outside.order(first_)];
  }
  const Run::Waiting next = queue[which];
  run.now = next.when;
  queue.erase(queue.begin() + static_cast<std::ptrdiff_t>(which));
  const std::uint32_t part = tables_->deliveries[next.what].part;
  if (trace_ != nullptr)
    trace_->steps.push_back({.part = part, .when = next.when, .rank = next.rank, .put_by = next.put_by});
  steps_one_ = trace_ != nullptr;
  take(part, tables_->deliveries[next.what].served ? arrived(next.what) : next.what);
  if (result_) outside.served(*answered_, std::move(*result_));
  result_.reset();
  if (steps_one_) {
    trace_->steps.back().puts = static_cast<std::uint32_t>(trace_->puts.size());
    trace_->steps.back().observed = static_cast<std::uint32_t>(trace_->observed.size());
  }
  steps_one_ = false;
  run_ = nullptr;
  if (missed_) run.queue.clear();  // nothing that follows is right
}

// What is delivered for an outcome from outside.
std::uint32_t PartMemory::arrived(std::uint32_t what) {
  SENTREE_ASSERT(!reads_);  // whoever reads has no robot
  CallOutcome outcome = std::move(run_->served.front());
  run_->served.erase(run_->served.begin());
  const std::size_t leaf = tables_->deliveries[what].part;
  const auto call = std::get<Outcome>(std::get<SkillDelivery>(tables_->deliveries[what].what.what)).call;
  answered_ = &*call;
  const auto exactly = [&] { return intern({leaf, SkillDelivery(Outcome{call, outcome})}, run_->now); };
  if (!outcome.ok) return exactly();
  const std::uint32_t state = aged(run_->parts[leaf], run_->now - run_->as_of[leaf]);
  const auto [place, is_new] = tables_->number_of_stand_ins.try_emplace(
      std::uint64_t{state} << 32U | what, static_cast<std::uint32_t>(tables_->stand_ins.size()));
  auto& known = is_new ? tables_->stand_ins.emplace_back() : tables_->stand_ins[*place];
  for (const StandIn& one : known) {
    if (!one.enabled && one.result == outcome.result) {
      result_ = std::move(outcome.result);
      return one.delivery;
    }
  }
  // Of what has few values, each is known by itself.
  const bool is_one_of_few = outcome.result.is_null() || outcome.result.as_bool() != nullptr;
  const SkillState& skill = tables_->states.skill(state);
  const SkillModel& model = tables_->parts.skill(leaf).model();
  std::optional<std::vector<scxml::TransitionIndex>> enabled;
  // Which goal was accepted is remembered, whatever the chart does with it.
  const bool is_goal = call->method == kSendGoal;
  if (!is_goal && !is_one_of_few && !model.protocol && skill.is_current(call->run))
    enabled = tables_->looks[leaf].enabled(*call, outcome.result, skill.session, tables_->states[state].at);
  const auto delivered = [&] {
    if (!enabled && !is_one_of_few) return exactly();
    for (const StandIn& one : known) {
      if (one.enabled && one.enabled == enabled) return one.delivery;
    }
    known.push_back({outcome.result, std::move(enabled), exactly()});
    return known.back().delivery;
  }();
  result_ = std::move(outcome.result);
  return delivered;
}

void PartMemory::take(std::uint32_t part, std::uint32_t what) {
  Tables& tables = *tables_;
  Run& run = *run_;
  const std::uint32_t before = run.parts[part];
  const std::uint32_t state = tables.states[before].timeless ? before : aged(before, run.now - run.as_of[part]);
  run.parts[part] = state;
  run.as_of[part] = run.now;
  const std::uint64_t key = std::uint64_t{state} << 32U | what;
  std::uint32_t place = tables.steps.find(key);
  if (place == kNone) {
    if (reads_) return void(miss());
    tables.steps.try_emplace(key, place = new_node());
  }
  script_.clear();
  const bool only_observed = !steps_one_ && tables.parts.subscriptions().empty();
  for (;;) {
    // Nothing that is done makes nodes.
    const Node& node = tables.nodes[place];
    for (const Op& op : node.ops) {
      // Most of what is done is observed, and by nobody else.
      if (op.kind == Op::Kind::kObserve && only_observed)
        outside_->observed(op.a, run.now, tables.messages[op.a].message);
      else
        perform(op);
    }
    if (missed_) return;
    if (node.result != kNone) {
      if (!reads_) ++tables.looked_up;
      run.parts[part] = node.result;
      return;
    }
    if (node.query.kind == Query::Kind::kNothing) break;
    const std::int64_t answer = ask(node.query);
    script_.push_back(answer);
    const auto& next = node.next;
    const auto known = std::find_if(next.begin(), next.end(), [&](const auto& one) { return one.first == answer; });
    if (known != next.end()) {
      place = known->second;
      continue;
    }
    if (reads_) break;
    const std::uint32_t to = new_node();
    tables.nodes[place].next.emplace_back(answer, to);
    place = to;
    break;
  }
  if (reads_) return void(miss());
  execute(state, what, place);
}

// From where what is known ends. What was done and answered before is done and answered already.
void PartMemory::execute(std::uint32_t state, std::uint32_t what, std::uint32_t node) {
  ++tables_->executed;
  const std::uint32_t part = tables_->states[state].part;
  frame_ = tables_->states[state].at;
  node_ = node;
  replayed_ = 0;
  PartState stepped = tables_->states.whole(state);
  Delivery delivery = tables_->deliveries[what].what;
  if (const auto timer = tables_->deliveries[what].timer) {
    const TimePoint rings = add_saturating(frame_, *timer);
    if (auto* skill = std::get_if<SkillDelivery>(&delivery.what))
      std::get<SkillTimer>(*skill).when = rings;
    else
      std::get<ModelTimer>(std::get<ModelDelivery>(delivery.what)).when = rings;
  }
  if (auto* tree = std::get_if<TreeDelivery>(&delivery.what)) {
    tables_->parts.step(std::get<TreeState>(stepped), std::move(*tree), *this);
  } else if (auto* skill = std::get_if<SkillDelivery>(&delivery.what)) {
    tables_->parts.step(delivery.leaf, std::get<SkillState>(stepped), std::move(*skill), *this);
  } else {
    tables_->parts.step(delivery.leaf, std::get<ModelState>(stepped), std::move(std::get<ModelDelivery>(delivery.what)),
                        *this);
  }
  SENTREE_ASSERT(replayed_ == script_.size());
  const std::uint32_t result = tables_->states.number(part, std::move(stepped), frame_, state);
  tables_->nodes[node_].result = result;
  run_->parts[part] = result;
  node_ = kNone;
}

Result<void> PartMemory::inject(Run& run, const project::Intervention& what, Outside& outside,
                                std::optional<std::uint64_t> number) {
  run_ = &run;
  outside_ = &outside;
  auto done = inject(what, number);
  if (missed_) run.queue.clear();
  run_ = nullptr;
  return done;
}

Result<void> PartMemory::inject(const project::Intervention& what, std::optional<std::uint64_t> number) {
  const auto is_dead = [this](std::size_t leaf) { return is_killed(*run_, leaf); };
  // A call changes nothing of what stands, so it is remembered as a step of its model.
  const bool is_call = std::holds_alternative<project::intervention::Call>(what);
  std::string key;
  Encoder to(key);
  to.number(run_->standing);
  to.text(to_json(Value(project::to_entry(what))));
  to.number(number.value_or(0));
  for (std::size_t leaf = 0; leaf < tables_->parts.skills(); ++leaf) {
    if (is_dead(leaf)) to.number(leaf);
  }
  if (const auto known = tables_->injections.find(key); known != tables_->injections.end()) {
    const std::uint32_t node = known->second;
    for (std::size_t i = 0; i < tables_->nodes[node].ops.size(); ++i) perform(tables_->nodes[node].ops[i]);
    run_->standing = tables_->nodes[node].result;
    return {};
  }
  if (reads_) {
    (void)miss();
    return {};
  }
  frame_ = run_->now;
  node_ = is_call ? kNone : new_node();
  const std::uint32_t node = node_;
  script_.clear();
  replayed_ = 0;
  Stands stands = *tables_->standing[run_->standing];
  auto done = mission::inject(tables_->parts, stands.faults, stands.down, is_dead, what, *this, number);
  node_ = kNone;
  if (is_call) return done;
  if (!done) {
    tables_->nodes.pop_back();
  } else {
    run_->standing = tables_->nodes[node].result = intern_standing(std::move(stands));
    tables_->injections.emplace(std::move(key), node);
  }
  return done;
}

bool PartMemory::has_effect(const Run& run, const Run::Waiting& waiting) const {
  const OnItsWay& delivery = tables_->deliveries[waiting.what];
  if (delivery.timer) {
    const auto& wake = tables_->states[run.parts[delivery.part]].wake;
    return wake && run.as_of[delivery.part] + *wake == add_saturating(waiting.when, *delivery.timer);
  }
  if (!delivery.is_answer_due) return true;
  const auto& due = std::get<AnswerDue>(std::get<TreeDelivery>(delivery.what.what));
  return tables_->states.tree(run.parts.back()).outstanding(due.leaf) == due.tick;
}

void PartMemory::settle(Run& run) {
  for (std::size_t part = 0; part < run.parts.size(); ++part) {
    run.parts[part] = aged(run.parts[part], run.now - run.as_of[part]);
    run.as_of[part] = run.now;
  }
  first_.clear();  // parts whose timer has been seen
  std::erase_if(run.queue, [&](const Run::Waiting& waiting) {
    if (!has_effect(run, waiting)) return true;
    const OnItsWay& delivery = tables_->deliveries[waiting.what];
    if (!delivery.timer) return false;
    if (std::find(first_.begin(), first_.end(), delivery.part) != first_.end()) return true;
    first_.push_back(delivery.part);
    return false;
  });
  for (TimePoint& time : run.not_before) {
    if (time <= run.now) time = {};
  }
}

std::uint32_t PartMemory::number_of(Duration duration) {
  if (reads_) {
    const auto known = tables_->number_of_duration.find(duration.count());
    return known != tables_->number_of_duration.end() ? known->second : miss();
  }
  const auto [found, is_new] =
      tables_->number_of_duration.try_emplace(duration.count(), static_cast<std::uint32_t>(tables_->durations.size()));
  if (is_new) tables_->durations.push_back(duration);
  return found->second;
}

void PartMemory::pack(const Run& run, std::vector<std::uint32_t>& out) {
  out.insert(out.end(), run.parts.begin(), run.parts.end());
  out.push_back(run.standing);
  out.push_back(static_cast<std::uint32_t>(run.queue.size()));
  for (const Run::Waiting& waiting : run.queue) {
    out.push_back(number_of(waiting.when == kNever ? Duration::max() : waiting.when - run.now) << 3U |
                  static_cast<std::uint32_t>(waiting.rank));
    out.push_back(waiting.what);
  }
  for (std::uint32_t i = 0; i < run.not_before.size(); ++i) {
    if (run.not_before[i] <= run.now) continue;
    out.push_back(i);
    out.push_back(number_of(run.not_before[i] - run.now));
  }
}

void PartMemory::unpack(std::span<const std::uint32_t> packed, TimePoint now, Run& run) const {
  const std::size_t parts = tables_->parts.skills() + tables_->parts.models() + 1;
  std::size_t at = 0;
  run.now = now;
  run.parts.assign(packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(parts));
  run.as_of.assign(parts, now);
  at = parts;
  run.standing = packed[at++];
  run.served.clear();
  run.queue.resize(packed[at++]);
  for (Run::Waiting& waiting : run.queue) {
    waiting.when = add_saturating(now, tables_->durations[packed[at] >> 3U]);
    waiting.rank = static_cast<Rank>(packed[at] & 7U);
    waiting.what = packed[at + 1];
    waiting.put_by = kNone;
    at += 2;
  }
  run.not_before.assign(2 * tables_->parts.skills() + tables_->parts.models(), TimePoint{});
  for (; at < packed.size(); at += 2) run.not_before[packed[at]] = now + tables_->durations[packed[at + 1]];
}

std::uint64_t PartMemory::bytes() const {
  return tables_->states.bytes() + tables_->nodes.size() * (sizeof(Node) + 2 * sizeof(Op) + 64) +
         tables_->messages.size() * 600 + tables_->deliveries.size() * 600;
}

// ---- the ground of a step

std::uint32_t PartMemory::new_node() {
  tables_->nodes.emplace_back();
  return static_cast<std::uint32_t>(tables_->nodes.size() - 1);
}

void PartMemory::add(Op op) {
  if (node_ != kNone) tables_->nodes[node_].ops.push_back(op);
  perform(op);
}

// Asks where what is known ends.
std::int64_t PartMemory::answer(Query query) {
  const std::int64_t answer = ask(query);
  const std::uint32_t to = new_node();
  tables_->nodes[node_].query = query;
  tables_->nodes[node_].next.emplace_back(answer, to);
  node_ = to;
  return answer;
}

void PartMemory::publish(Message message) {
  if (is_told()) return;
  add({.kind = Op::Kind::kObserve, .a = intern(std::move(message))});
}

void PartMemory::put(TimePoint when, Rank rank, Delivery&& what) {
  if (is_told()) return;
  when = std::max(when, frame_);
  const std::uint32_t number = intern(what, when);
  add({.kind = Op::Kind::kPut, .rank = rank, .a = number, .c = when == kNever ? kNeverDue : (when - frame_).count()});
}

void PartMemory::tell_skill(std::size_t leaf, std::string_view message, SkillDelivery what) {
  if (is_told()) return;
  const auto name = std::find(std::begin(kTold), std::end(kTold), message) - std::begin(kTold);
  add({.kind = Op::Kind::kTell,
       .a = intern({leaf, std::move(what)}, frame_),
       .b = static_cast<std::uint32_t>(leaf),
       .c = name});
}

void PartMemory::call(std::size_t leaf, const Shared<Call>& call) {
  if (is_told()) return;
  if (!tables_->parts.model_of(call->service)) {
    const std::uint32_t number = intern({leaf, SkillDelivery(Outcome{call, {}})}, frame_);
    tables_->deliveries[number].served = true;
    add({.kind = Op::Kind::kServe, .a = number});
    return;
  }
  Op op{.kind = Op::Kind::kCall, .a = intern(tables_->parts.delivery_of(leaf, call), frame_)};
  if (tables_->faults) {
    op.b = intern({leaf, Parts::unreachable(call)}, frame_);
    op.c = intern_text(call->service);
  }
  add(op);
}

void PartMemory::serve(std::size_t model, ServeCall what) {
  const Delivery delivery{model, ModelDelivery(std::move(what))};
  take(part_of(delivery), intern(delivery, run_->now));
}

void PartMemory::taken(std::size_t leaf, scxml::TransitionIndex transition) {
  if (is_told()) return;
  add({.kind = Op::Kind::kTaken, .a = static_cast<std::uint32_t>(leaf), .b = static_cast<std::uint32_t>(transition)});
}

void PartMemory::problem(const std::string& what) {
  if (is_told()) return;
  add({.kind = Op::Kind::kProblem, .a = intern_text(what)});
}

void PartMemory::refused(const Diagnostic& why) {
  if (is_told()) return;
  tables_->refusals.push_back(why);
  add({.kind = Op::Kind::kRefused, .a = static_cast<std::uint32_t>(tables_->refusals.size() - 1)});
}

std::uint64_t PartMemory::tick_number(std::size_t leaf, std::uint64_t) {
  if (is_told()) return static_cast<std::uint64_t>(script_[replayed_++]);
  return static_cast<std::uint64_t>(answer({.kind = Query::Kind::kTick, .a = static_cast<std::uint32_t>(leaf)}));
}

std::uint64_t PartMemory::run_number(std::size_t leaf, std::uint64_t) {
  if (is_told()) return static_cast<std::uint64_t>(script_[replayed_++]);
  return static_cast<std::uint64_t>(answer({.kind = Query::Kind::kRun, .a = static_cast<std::uint32_t>(leaf)}));
}

std::optional<bt::Status> PartMemory::forced(std::string_view leaf) {
  if (!tables_->faults) return std::nullopt;
  const std::int64_t status =
      is_told() ? script_[replayed_++] : answer({.kind = Query::Kind::kForced, .a = intern_text(leaf)});
  return status == 0 ? std::nullopt : std::optional(static_cast<bt::Status>(status - 1));
}

Duration PartMemory::delay_of(std::string_view message) {
  if (!tables_->faults) return Duration(0);
  return Duration(is_told() ? script_[replayed_++] : answer({.kind = Query::Kind::kDelay, .a = intern_text(message)}));
}

void PartMemory::falsify(std::string_view call, const idl::Method& method, Value& result) {
  if (!tables_->faults) return;
  const std::int64_t said =
      is_told()
          ? script_[replayed_++]
          : answer(
                {.kind = Query::Kind::kFalsify, .a = intern_text(call), .b = intern_value(result), .method = &method});
  result = tables_->values[static_cast<std::size_t>(said)];
}

bool PartMemory::fails(Failing how, std::string_view call) {
  if (!tables_->faults) return false;
  if (is_told()) return script_[replayed_++] != 0;
  return answer({.kind = Query::Kind::kFails, .a = intern_text(call), .b = static_cast<std::uint32_t>(how)}) != 0;
}

std::optional<Veto> PartMemory::judge(Message& request) {
  if (!tables_->gates) return std::nullopt;
  const std::int64_t veto =
      is_told() ? script_[replayed_++] : answer({.kind = Query::Kind::kJudge, .a = intern(Message(request))});
  return veto == 0 ? std::nullopt : std::optional(tables_->vetoes[static_cast<std::size_t>(veto - 1)]);
}

std::optional<std::uint64_t> PartMemory::choose(const Choice& choice) {
  if (is_told()) return static_cast<std::uint64_t>(script_[replayed_++]);
  Asked asked{.model = choice.model,
              .function = choice.function,
              .name = choice.name,
              .place = choice.place,
              .count = choice.count};
  for (std::uint64_t i = 0; i < std::min(choice.count, kAlternativesMax); ++i) {
    asked.alternatives.push_back(choice.alternative(i));
    if (choice.probability) asked.probabilities.push_back(choice.probability(i));
  }
  tables_->choices.push_back(std::move(asked));
  return static_cast<std::uint64_t>(
      answer({.kind = Query::Kind::kChoose, .a = static_cast<std::uint32_t>(tables_->choices.size() - 1)}));
}

// ---- what is done and asked, whether it was known or not

// What stands counts how often it was used.
template <class Change>
auto PartMemory::change_standing(const Change& change) {
  const Stands& present = *tables_->standing[run_->standing];
  if (steps_one_ && !present.faults.empty()) trace_->steps.back().asks_faults = true;
  Stands stands = present.faults.empty() ? Stands{} : present;
  const auto result = change(stands);
  if (!present.faults.empty()) run_->standing = intern_standing(std::move(stands));
  return result;
}

void PartMemory::insert(TimePoint when, Rank rank, std::uint32_t what, bool is_topic) {
  auto& queue = run_->queue;
  std::uint32_t put_by = kNone;
  if (steps_one_) {
    trace_->puts.push_back({tables_->deliveries[what].part, when, rank, is_topic});
    put_by = static_cast<std::uint32_t>(trace_->steps.size() - 1);
  }
  if (tables_->deliveries[what].is_answer_due)
    std::erase_if(queue, [&](const Run::Waiting& w) { return tables_->deliveries[w.what].is_answer_due; });
  const Run::Waiting waiting{when, rank, what, put_by};
  const auto later = std::upper_bound(queue.begin(), queue.end(), waiting, [](const auto& a, const auto& b) {
    return a.when != b.when ? a.when < b.when : a.rank < b.rank;
  });
  queue.insert(later, waiting);
}

void PartMemory::perform(const Op& op) {
  const TimePoint now = run_->now;
  switch (op.kind) {
    case Op::Kind::kObserve: {
      outside_->observed(op.a, now, tables_->messages[op.a].message);
      if (steps_one_) trace_->observed.push_back(op.a);
      if (!tables_->parts.subscriptions().empty() && tables_->messages[op.a].message.kind == MessageKind::kRequest)
        deliver_topic(op.a);
      return;
    }
    case Op::Kind::kPut: return insert(op.c == kNeverDue ? kNever : now + Duration(op.c), op.rank, op.a);
    case Op::Kind::kTell: {
      // A delayed tick or halt holds back the later ones.
      Duration delay{0};
      if (tables_->faults) {
        const std::string name = fmt::format("{}.{}", plan().leaves[op.b].name, kTold[op.c]);
        delay = change_standing([&](Stands& stands) { return stands.faults.delay_of(name); });
      }
      TimePoint& not_before = run_->not_before[op.b];
      not_before = std::max(not_before, now + delay);
      return insert(not_before, Rank::kMessage, op.a);
    }
    case Op::Kind::kCall: {
      const bool is_down = tables_->faults && tables_->standing[run_->standing]->down.contains(
                                                  tables_->texts[static_cast<std::size_t>(op.c)]);
      return insert(now, Rank::kMessage, is_down ? op.b : op.a);
    }
    case Op::Kind::kServe: {
      const OnItsWay& one = tables_->deliveries[op.a];
      const auto& outcome = std::get<Outcome>(std::get<SkillDelivery>(one.what.what));
      run_->served.push_back(outside_->serve(one.part, *outcome.call));
      return insert(now, Rank::kMessage, op.a);
    }
    case Op::Kind::kTaken: return outside_->taken(op.a, op.b);
    case Op::Kind::kProblem: return outside_->problem(tables_->texts[op.a]);
    case Op::Kind::kRefused: return outside_->refused(tables_->refusals[op.a]);
  }
}

std::int64_t PartMemory::ask(const Query& query) {
  switch (query.kind) {
    case Query::Kind::kNothing: break;
    case Query::Kind::kTick: return static_cast<std::int64_t>(unused_tick(query.a));
    case Query::Kind::kRun: return static_cast<std::int64_t>(unused_run(query.a));
    case Query::Kind::kForced: {
      const auto status =
          change_standing([&](Stands& stands) { return stands.faults.forced(tables_->texts[query.a]); });
      return status ? static_cast<std::int64_t>(*status) + 1 : 0;
    }
    case Query::Kind::kDelay:
      return change_standing([&](Stands& stands) { return stands.faults.delay_of(tables_->texts[query.a]); }).count();
    case Query::Kind::kFalsify: {
      if (!tables_->standing[run_->standing]->faults.any<project::intervention::Falsify>()) return query.b;
      Value result = tables_->values[query.b];
      change_standing([&](Stands& stands) {
        stands.faults.falsify(tables_->texts[query.a], *query.method, result);
        return 0;
      });
      return intern_value(result);
    }
    case Query::Kind::kFails: {
      const auto how = static_cast<Failing>(query.b);
      return change_standing([&](Stands& stands) { return stands.faults.fails(how, tables_->texts[query.a]); }) ? 1 : 0;
    }
    case Query::Kind::kJudge: {
      if (reads_) return miss();
      auto veto = outside_->judge(tables_->messages[query.a].message);
      if (!veto) return 0;
      auto known = std::find(tables_->vetoes.begin(), tables_->vetoes.end(), *veto);
      if (known == tables_->vetoes.end()) known = tables_->vetoes.insert(known, std::move(*veto));
      return known - tables_->vetoes.begin() + 1;
    }
    case Query::Kind::kChoose: {
      const Asked& asked = tables_->choices[query.a];
      Choice choice{.model = asked.model,
                    .function = asked.function,
                    .name = asked.name,
                    .place = asked.place,
                    .count = asked.count};
      choice.alternative = [&asked](std::uint64_t i) { return asked.alternatives[i]; };
      if (!asked.probabilities.empty())
        choice.probability = [&asked](std::uint64_t i) { return asked.probabilities[i]; };
      return static_cast<std::int64_t>(outside_->choose(query.a, choice));
    }
  }
  return 0;
}

std::uint64_t PartMemory::unused_tick(std::size_t leaf) const {
  std::uint64_t number = 1;
  const auto is_used = [&] {
    if (tables_->states[run_->parts[leaf]].unanswered == number) return true;
    return std::any_of(run_->queue.begin(), run_->queue.end(), [&](const Run::Waiting& waiting) {
      return tables_->deliveries[waiting.what].tick == std::pair(leaf, number);
    });
  };
  while (is_used()) ++number;
  return number;
}

std::uint64_t PartMemory::unused_run(std::size_t leaf) const {
  std::uint64_t number = 1;
  const auto is_used = [&] {
    for (const SkillState::Line& line : tables_->states.skill(run_->parts[leaf]).lines) {
      for (const auto& call : line.waiting) {
        if (call->run == number) return true;
      }
    }
    for (std::size_t i = 0; i < tables_->parts.models(); ++i) {
      for (const auto& open : tables_->states.model(run_->parts[tables_->parts.skills() + i]).open) {
        if (open.leaf == leaf && open.call->run == number) return true;
      }
    }
    return std::any_of(run_->queue.begin(), run_->queue.end(), [&](const Run::Waiting& waiting) {
      return tables_->deliveries[waiting.what].call == std::pair(leaf, number);
    });
  };
  while (is_used()) ++number;
  return number;
}

// A call of a one-way method reaches whoever subscribes to it; a delayed one holds back the later ones.
void PartMemory::deliver_topic(std::uint32_t message) {
  if (!tables_->messages[message].told) {
    if (reads_) return void(miss());
    tables_->messages[message].told = true;
    const Subscriptions::Told told = tables_->parts.subscriptions().told_of(tables_->messages[message].message);
    if (!told.problem.empty()) {
      tables_->messages[message].told = false;  // it is said each time
      return outside_->problem(told.problem);
    }
    if (told.takers != nullptr) {
      tables_->messages[message].topic = intern_text(told.topic);
      for (const auto& taker : *told.takers) {
        const Delivery what = taker.is_model ? Delivery{taker.index, ModelDelivery(Published{told.what})}
                                             : Delivery{taker.index, SkillDelivery(Published{told.what})};
        tables_->messages[message].takers.emplace_back(taker, intern(what, frame_));
      }
    }
  }
  const Known& known = tables_->messages[message];
  if (known.takers.empty()) return;
  Duration delay{0};
  if (tables_->faults)
    delay = change_standing([&](Stands& stands) { return stands.faults.delay_of(tables_->texts[known.topic]); });
  for (const auto& [taker, what] : known.takers) {
    TimePoint& not_before =
        run_->not_before[tables_->parts.skills() + (taker.is_model ? tables_->parts.skills() : 0) + taker.index];
    insert(Subscriptions::time_of(not_before, run_->now, delay), Rank::kMessage, what, true);
  }
}

// ---- numbers

std::uint32_t PartMemory::aged(std::uint32_t state, Duration by) {
  if (!reads_) return tables_->states.aged(state, by);
  const auto known = tables_->states.known_aged(state, by);
  return known ? *known : (miss(), state);
}

std::uint32_t PartMemory::part_of(const Delivery& what) const {
  if (std::holds_alternative<TreeDelivery>(what.what))
    return static_cast<std::uint32_t>(tables_->parts.skills() + tables_->parts.models());
  const bool is_model = std::holds_alternative<ModelDelivery>(what.what);
  return static_cast<std::uint32_t>(is_model ? tables_->parts.skills() + what.leaf : what.leaf);
}

std::uint32_t PartMemory::intern(const Delivery& what, TimePoint when) {
  std::string key;
  encode(tables_->parts, what, when, key);
  const std::uint32_t number = number_in(tables_->number_of_delivery, std::move(key), tables_->deliveries.size());
  if (number < tables_->deliveries.size()) return number;
  OnItsWay one{.what = what,
               .part = part_of(what),
               .tick = numbered_tick(what),
               .call = numbered_call(what),
               .timer = {},
               .is_answer_due = is_answer_due(what)};
  if (const auto* skill = std::get_if<SkillDelivery>(&what.what)) {
    if (const auto* timer = std::get_if<SkillTimer>(skill)) one.timer = timer->when - when;
  } else if (const auto* model = std::get_if<ModelDelivery>(&what.what)) {
    if (const auto* timer = std::get_if<ModelTimer>(model)) one.timer = timer->when - when;
  }
  tables_->deliveries.push_back(std::move(one));
  return number;
}

std::uint32_t PartMemory::intern(Message&& message) {
  message.call = 0;
  std::string key;
  Encoder to(key);
  to.byte(static_cast<std::uint8_t>(message.kind));
  to.text(message.source);
  to.text(message.target);
  to.text(message.name);
  append(key, message.data);
  const std::uint32_t number = number_in(tables_->number_of_message, std::move(key), tables_->messages.size());
  if (number == tables_->messages.size()) {
    const bool is_answer = message.kind == MessageKind::kReply && message.data.find("result") != nullptr;
    tables_->messages.push_back({.message = std::move(message), .is_answer = is_answer, .takers = {}});
  }
  return number;
}

std::uint32_t PartMemory::intern_text(std::string_view text) {
  const std::uint32_t number = number_in(tables_->number_of_text, std::string(text), tables_->texts.size());
  if (number == tables_->texts.size()) tables_->texts.emplace_back(text);
  return number;
}

std::uint32_t PartMemory::intern_value(const Value& value) {
  std::string key;
  append(key, value);
  if (reads_) {
    const auto known = tables_->number_of_value.find(key);
    return known != tables_->number_of_value.end() ? known->second : miss();
  }
  const std::uint32_t number = number_in(tables_->number_of_value, std::move(key), tables_->values.size());
  if (number == tables_->values.size()) tables_->values.push_back(value);
  return number;
}

std::uint32_t PartMemory::intern_standing(Stands&& stands) {
  std::string key;
  encode(stands.faults, stands.down, key);
  if (reads_) {
    const auto known = tables_->number_of_standing.find(key);
    return known != tables_->number_of_standing.end() ? known->second : miss();
  }
  const std::uint32_t number = number_in(tables_->number_of_standing, std::move(key), tables_->standing.size());
  if (number == tables_->standing.size())
    tables_->standing.push_back(std::make_unique<const Stands>(std::move(stands)));
  return number;
}

}  // namespace sentree::mission
