#include "sentree/mission/part_memory.h"

#include <algorithm>

#include "sentree/base/assert.h"
#include "sentree/base/encoder.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/detail/due.h"
#include "sentree/mission/encode.h"

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

PartMemory::PartMemory(const project::Plan& plan, bool faults, bool timeline)
    : parts_(plan),
      faults_(faults || !plan.scenario.delays.empty() || (timeline && !plan.scenario.timeline.empty())),
      gates_(!plan.gates.empty()) {
  parts_.remember_steps();
  for (std::size_t leaf = 0; leaf < parts_.skills(); ++leaf) {
    const scxml::Chart& chart = parts_.skill(leaf).model().chart;
    looks_.push_back({scxml::EventReads(chart), monitor::Projection::of(chart)});
    if (const Value facts = looks_.back().members.data(Message()); facts.as_map()->empty()) continue;
    looks_.back().members.make_whole();
  }
}

PartMemory::Run PartMemory::begin() {
  Run run;
  const std::size_t skills = parts_.skills();
  const std::size_t models = parts_.models();
  for (std::uint32_t i = 0; i < skills; ++i) run.parts.push_back(intern(i, SkillState(), {}));
  for (std::uint32_t i = 0; i < models; ++i)
    run.parts.push_back(intern(static_cast<std::uint32_t>(skills) + i, ModelState(), {}));
  run.parts.push_back(kNone);
  run.as_of.assign(run.parts.size(), TimePoint{});
  run.not_before.assign(2 * skills + models, TimePoint{});
  run.standing = intern_standing({Faults(plan().scenario.delays), {}});
  run_ = &run;
  frame_ = {};
  node_ = kNone;
  for (std::size_t i = 0; i < models; ++i) put({}, Rank::kSimulator, {i, ModelDelivery(StartModel{})});
  TreeState tree = parts_.initial_tree();
  parts_.start(tree, *this);
  run.parts.back() = intern(static_cast<std::uint32_t>(skills + models), std::move(tree), {});
  run_ = nullptr;
  return run;
}

// ---- runs

void PartMemory::step(Run& run, Outside& outside) {
  SENTREE_ASSERT(!run.queue.empty());
  run_ = &run;
  outside_ = &outside;
  auto& queue = run.queue;
  const auto part_at = [&](std::size_t i) { return deliveries_[queue[i].what].part; };
  detail::due(
      queue, [&](std::size_t a, std::size_t b) { return part_at(a) == part_at(b); }, due_);
  std::size_t which = 0;
  if (!due_.empty()) {
    first_.clear();
    for (const std::size_t i : due_) first_.push_back(part_at(i));
    which = due_[outside.order(first_)];
  }
  run.now = queue[which].when;
  const std::uint32_t what = queue[which].what;
  queue.erase(queue.begin() + static_cast<std::ptrdiff_t>(which));
  take(deliveries_[what].part, deliveries_[what].served ? arrived(what) : what);
  result_.reset();
  run_ = nullptr;
}

// What is delivered for an outcome from outside.
std::uint32_t PartMemory::arrived(std::uint32_t what) {
  CallOutcome outcome = std::move(run_->served.front());
  run_->served.erase(run_->served.begin());
  const std::size_t leaf = deliveries_[what].part;
  const auto call = std::get<Outcome>(std::get<SkillDelivery>(deliveries_[what].what.what)).call;
  const auto exactly = [&] { return intern({leaf, SkillDelivery(Outcome{call, outcome})}, run_->now); };
  if (!outcome.ok) return exactly();
  const std::uint32_t state = aged(run_->parts[leaf], run_->now - run_->as_of[leaf]);
  auto& known = stand_ins_[std::uint64_t{state} << 32U | what];
  for (const StandIn& one : known) {
    if (!one.enabled && one.result == outcome.result) {
      result_ = std::move(outcome.result);
      return one.delivery;
    }
  }
  // Of what has few values, each is known by itself.
  const bool is_one_of_few = outcome.result.is_null() || outcome.result.as_bool() != nullptr;
  const SkillState& skill = std::get<SkillState>(*kept_[state].state);
  const SkillModel& model = parts_.skill(leaf).model();
  std::optional<std::vector<scxml::TransitionIndex>> enabled;
  if (!is_one_of_few && !model.protocol && skill.is_current(call->run) && !looks_[leaf].at.elsewhere()) {
    scxml::Event event;
    event.name = call->service + "." + call->method + ".reply";
    event.sendid = call->sendid;
    event.origintype = "thrift";
    Message reply;
    Map data;
    data.reserve(2);
    data.append("args", call->args);
    data.append("result", std::move(outcome.result));
    reply.data = std::move(data);
    const monitor::Projection& members = looks_[leaf].members;
    event.data = idl::for_script(members.is_whole() ? reply.data : members.data(reply));
    outcome.result = std::move(*reply.data.as_map()->find("result"));
    enabled = scxml::enabled_by(model.chart, skill.session, event, kept_[state].at);
    if (enabled && std::any_of(enabled->begin(), enabled->end(),
                               [&](scxml::TransitionIndex t) { return looks_[leaf].at.in_content(t); }))
      enabled.reset();
  }
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
  const std::uint32_t state = aged(run_->parts[part], run_->now - run_->as_of[part]);
  run_->parts[part] = state;
  run_->as_of[part] = run_->now;
  const auto [found, is_new] = steps_.try_emplace(std::uint64_t{state} << 32U | what, kNone - 1);
  if (is_new) *found = new_node();
  std::uint32_t node = *found;
  script_.clear();
  for (;;) {
    for (std::size_t i = 0; i < nodes_[node].ops.size(); ++i) perform(nodes_[node].ops[i]);
    if (nodes_[node].result != kNone) {
      ++looked_up_;
      run_->parts[part] = nodes_[node].result;
      return;
    }
    if (nodes_[node].query.kind == Query::Kind::kNothing) break;
    const std::int64_t answer = ask(nodes_[node].query);
    script_.push_back(answer);
    const auto& next = nodes_[node].next;
    const auto known = std::find_if(next.begin(), next.end(), [&](const auto& one) { return one.first == answer; });
    if (known != next.end()) {
      node = known->second;
      continue;
    }
    const std::uint32_t to = new_node();
    nodes_[node].next.emplace_back(answer, to);
    node = to;
    break;
  }
  execute(state, what, node);
}

// From where what is known ends. What was done and answered before is done and answered already.
void PartMemory::execute(std::uint32_t state, std::uint32_t what, std::uint32_t node) {
  ++executed_;
  const std::uint32_t part = kept_[state].part;
  frame_ = kept_[state].at;
  node_ = node;
  replayed_ = 0;
  PartState stepped = *kept_[state].state;
  Delivery delivery = deliveries_[what].what;
  if (const auto timer = deliveries_[what].timer) {
    const TimePoint rings = add_saturating(frame_, *timer);
    if (auto* skill = std::get_if<SkillDelivery>(&delivery.what))
      std::get<SkillTimer>(*skill).when = rings;
    else
      std::get<ModelTimer>(std::get<ModelDelivery>(delivery.what)).when = rings;
  }
  if (auto* tree = std::get_if<TreeDelivery>(&delivery.what)) {
    parts_.step(std::get<TreeState>(stepped), std::move(*tree), *this);
  } else if (auto* skill = std::get_if<SkillDelivery>(&delivery.what)) {
    parts_.step(delivery.leaf, std::get<SkillState>(stepped), std::move(*skill), *this);
  } else {
    parts_.step(delivery.leaf, std::get<ModelState>(stepped), std::move(std::get<ModelDelivery>(delivery.what)), *this);
  }
  SENTREE_ASSERT(replayed_ == script_.size());
  const std::uint32_t result = intern(part, std::move(stepped), frame_);
  nodes_[node_].result = result;
  run_->parts[part] = result;
  node_ = kNone;
}

Result<void> PartMemory::inject(Run& run, const project::Intervention& what, Outside& outside) {
  run_ = &run;
  outside_ = &outside;
  frame_ = run.now;
  node_ = kNone;
  script_.clear();
  replayed_ = 0;
  Stands stands = *standing_[run.standing];
  const auto is_dead = [&](std::size_t leaf) { return is_killed(run, leaf); };
  const auto done = mission::inject(parts_, stands.faults, stands.down, is_dead, what, *this);
  if (done) run.standing = intern_standing(std::move(stands));
  run_ = nullptr;
  return done;
}

void PartMemory::each_session(const std::function<void(std::size_t part, const scxml::Session&)>& visit) const {
  for (const Kept& kept : kept_) {
    if (const auto* const skill = std::get_if<SkillState>(kept.state.get())) visit(kept.part, skill->session);
    if (const auto* const model = std::get_if<ModelState>(kept.state.get())) visit(kept.part, model->session);
  }
}

void PartMemory::settle(Run& run) {
  for (std::size_t part = 0; part < run.parts.size(); ++part) {
    run.parts[part] = aged(run.parts[part], run.now - run.as_of[part]);
    run.as_of[part] = run.now;
  }
  first_.clear();  // parts whose timer has been seen
  std::erase_if(run.queue, [&](const Run::Waiting& waiting) {
    const OnItsWay& delivery = deliveries_[waiting.what];
    if (delivery.timer) {
      const auto& wake = kept_[run.parts[delivery.part]].wake;
      const bool rings = wake && run.now + *wake == add_saturating(waiting.when, *delivery.timer);
      if (!rings || std::find(first_.begin(), first_.end(), delivery.part) != first_.end()) return true;
      first_.push_back(delivery.part);
      return false;
    }
    const auto* tree = std::get_if<TreeDelivery>(&delivery.what.what);
    const auto* due = tree != nullptr ? std::get_if<AnswerDue>(tree) : nullptr;
    if (due == nullptr) return false;
    return std::get<TreeState>(*kept_[run.parts.back()].state).leaves[due->leaf].outstanding != due->tick;
  });
  for (TimePoint& time : run.not_before) {
    if (time <= run.now) time = {};
  }
}

std::uint32_t PartMemory::number_of(Duration duration) {
  const auto [found, is_new] =
      number_of_duration_.try_emplace(duration.count(), static_cast<std::uint32_t>(durations_.size()));
  if (is_new) durations_.push_back(duration);
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
  const std::size_t parts = parts_.skills() + parts_.models() + 1;
  std::size_t at = 0;
  run.now = now;
  run.parts.assign(packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(parts));
  run.as_of.assign(parts, now);
  at = parts;
  run.standing = packed[at++];
  run.served.clear();
  run.queue.resize(packed[at++]);
  for (Run::Waiting& waiting : run.queue) {
    waiting.when = add_saturating(now, durations_[packed[at] >> 3U]);
    waiting.rank = static_cast<Rank>(packed[at] & 7U);
    waiting.what = packed[at + 1];
    at += 2;
  }
  run.not_before.assign(2 * parts_.skills() + parts_.models(), TimePoint{});
  for (; at < packed.size(); at += 2) run.not_before[packed[at]] = now + durations_[packed[at + 1]];
}

std::uint64_t PartMemory::bytes() const {
  return state_bytes_ + nodes_.size() * (sizeof(Node) + 2 * sizeof(Op) + 64) + messages_.size() * 600 +
         deliveries_.size() * 600;
}

// ---- the ground of a step

std::uint32_t PartMemory::new_node() {
  nodes_.emplace_back();
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

void PartMemory::add(Op op) {
  if (node_ != kNone) nodes_[node_].ops.push_back(op);
  perform(op);
}

// Asks where what is known ends.
std::int64_t PartMemory::answer(Query query) {
  const std::int64_t answer = ask(query);
  const std::uint32_t to = new_node();
  nodes_[node_].query = query;
  nodes_[node_].next.emplace_back(answer, to);
  node_ = to;
  return answer;
}

void PartMemory::publish(Message message) {
  if (is_told()) return;
  add({.kind = Op::Kind::kObserve, .a = intern(std::move(message))});
}

void PartMemory::put(TimePoint when, Rank rank, Delivery what) {
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
  if (!parts_.model_of(call->service)) {
    const std::uint32_t number = intern({leaf, SkillDelivery(Outcome{call, {}})}, frame_);
    deliveries_[number].served = true;
    add({.kind = Op::Kind::kServe, .a = number});
    return;
  }
  Op op{.kind = Op::Kind::kCall, .a = intern(parts_.delivery_of(leaf, call), frame_)};
  if (faults_) {
    op.b = intern({leaf, Parts::unreachable(call)}, frame_);
    op.c = intern_text(call->service);
  }
  add(op);
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
  refusals_.push_back(why);
  add({.kind = Op::Kind::kRefused, .a = static_cast<std::uint32_t>(refusals_.size() - 1)});
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
  if (!faults_) return std::nullopt;
  const std::int64_t status =
      is_told() ? script_[replayed_++] : answer({.kind = Query::Kind::kForced, .a = intern_text(leaf)});
  return status == 0 ? std::nullopt : std::optional(static_cast<bt::Status>(status - 1));
}

Duration PartMemory::delay_of(std::string_view message) {
  if (!faults_) return Duration(0);
  return Duration(is_told() ? script_[replayed_++] : answer({.kind = Query::Kind::kDelay, .a = intern_text(message)}));
}

void PartMemory::falsify(std::string_view call, const idl::Method& method, Value& result) {
  if (!faults_) return;
  const std::int64_t said =
      is_told()
          ? script_[replayed_++]
          : answer(
                {.kind = Query::Kind::kFalsify, .a = intern_text(call), .b = intern_value(result), .method = &method});
  result = values_[static_cast<std::size_t>(said)];
}

bool PartMemory::fails(Failing how, std::string_view call) {
  if (!faults_) return false;
  if (is_told()) return script_[replayed_++] != 0;
  return answer({.kind = Query::Kind::kFails, .a = intern_text(call), .b = static_cast<std::uint32_t>(how)}) != 0;
}

std::optional<Veto> PartMemory::judge(const Message& request) {
  if (!gates_) return std::nullopt;
  const std::int64_t veto =
      is_told() ? script_[replayed_++] : answer({.kind = Query::Kind::kJudge, .a = intern(Message(request))});
  return veto == 0 ? std::nullopt : std::optional(vetoes_[static_cast<std::size_t>(veto - 1)]);
}

std::optional<std::uint64_t> PartMemory::choose(const Choice& choice) {
  if (is_told()) return static_cast<std::uint64_t>(script_[replayed_++]);
  Asked asked{.model = choice.model, .function = choice.function, .name = choice.name, .count = choice.count};
  for (std::uint64_t i = 0; i < std::min(choice.count, kAlternativesMax); ++i) {
    asked.alternatives.push_back(choice.alternative(i));
    if (choice.probability) asked.probabilities.push_back(choice.probability(i));
  }
  choices_.push_back(std::move(asked));
  return static_cast<std::uint64_t>(
      answer({.kind = Query::Kind::kChoose, .a = static_cast<std::uint32_t>(choices_.size() - 1)}));
}

// ---- what is done and asked, whether it was known or not

// What stands counts how often it was used.
template <class Change>
auto PartMemory::change_standing(const Change& change) {
  const Stands& present = *standing_[run_->standing];
  Stands stands = present.faults.empty() ? Stands{} : present;
  const auto result = change(stands);
  if (!present.faults.empty()) run_->standing = intern_standing(std::move(stands));
  return result;
}

void PartMemory::insert(TimePoint when, Rank rank, std::uint32_t what) {
  auto& queue = run_->queue;
  const auto later = std::upper_bound(queue.begin(), queue.end(), 0, [&](int, const Run::Waiting& waiting) {
    return when != waiting.when ? when < waiting.when : rank < waiting.rank;
  });
  queue.insert(later, {when, rank, what});
}

void PartMemory::perform(const Op& op) {
  const TimePoint now = run_->now;
  switch (op.kind) {
    case Op::Kind::kObserve: {
      outside_->observed(op.a, now, messages_[op.a].message);
      if (parts_.has_topics() && messages_[op.a].message.kind == MessageKind::kRequest) deliver_topic(op.a);
      return;
    }
    case Op::Kind::kPut: return insert(op.c == kNeverDue ? kNever : now + Duration(op.c), op.rank, op.a);
    case Op::Kind::kTell: {
      // A delayed tick or halt holds back the later ones.
      Duration delay{0};
      if (faults_) {
        const std::string name = plan().leaves[op.b].name + "." + std::string(kTold[op.c]);
        delay = change_standing([&](Stands& stands) { return stands.faults.delay_of(name); });
      }
      TimePoint& not_before = run_->not_before[op.b];
      not_before = std::max(not_before, now + delay);
      return insert(not_before, Rank::kMessage, op.a);
    }
    case Op::Kind::kCall: {
      const bool is_down = faults_ && standing_[run_->standing]->down.contains(texts_[static_cast<std::size_t>(op.c)]);
      return insert(now, Rank::kMessage, is_down ? op.b : op.a);
    }
    case Op::Kind::kServe: {
      const OnItsWay& one = deliveries_[op.a];
      const auto& outcome = std::get<Outcome>(std::get<SkillDelivery>(one.what.what));
      run_->served.push_back(outside_->serve(one.part, *outcome.call));
      return insert(now, Rank::kMessage, op.a);
    }
    case Op::Kind::kTaken: return outside_->taken(op.a, op.b);
    case Op::Kind::kProblem: return outside_->problem(texts_[op.a]);
    case Op::Kind::kRefused: return outside_->refused(refusals_[op.a]);
  }
}

std::int64_t PartMemory::ask(const Query& query) {
  switch (query.kind) {
    case Query::Kind::kNothing: break;
    case Query::Kind::kTick: return static_cast<std::int64_t>(unused_tick(query.a));
    case Query::Kind::kRun: return static_cast<std::int64_t>(unused_run(query.a));
    case Query::Kind::kForced: {
      const auto status = change_standing([&](Stands& stands) { return stands.faults.forced(texts_[query.a]); });
      return status ? static_cast<std::int64_t>(*status) + 1 : 0;
    }
    case Query::Kind::kDelay:
      return change_standing([&](Stands& stands) { return stands.faults.delay_of(texts_[query.a]); }).count();
    case Query::Kind::kFalsify: {
      if (!standing_[run_->standing]->faults.any<project::intervention::Falsify>()) return query.b;
      Value result = values_[query.b];
      change_standing([&](Stands& stands) {
        stands.faults.falsify(texts_[query.a], *query.method, result);
        return 0;
      });
      return intern_value(result);
    }
    case Query::Kind::kFails: {
      const auto how = static_cast<Failing>(query.b);
      return change_standing([&](Stands& stands) { return stands.faults.fails(how, texts_[query.a]); }) ? 1 : 0;
    }
    case Query::Kind::kJudge: {
      auto veto = outside_->judge(messages_[query.a].message);
      if (!veto) return 0;
      auto known = std::find(vetoes_.begin(), vetoes_.end(), *veto);
      if (known == vetoes_.end()) known = vetoes_.insert(known, std::move(*veto));
      return known - vetoes_.begin() + 1;
    }
    case Query::Kind::kChoose: {
      const Asked& asked = choices_[query.a];
      Choice choice{.model = asked.model, .function = asked.function, .name = asked.name, .count = asked.count};
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
    if (kept_[run_->parts[leaf]].unanswered == number) return true;
    return std::any_of(run_->queue.begin(), run_->queue.end(), [&](const Run::Waiting& waiting) {
      return deliveries_[waiting.what].tick == std::pair(leaf, number);
    });
  };
  while (is_used()) ++number;
  return number;
}

std::uint64_t PartMemory::unused_run(std::size_t leaf) const {
  std::uint64_t number = 1;
  const auto is_used = [&] {
    for (const SkillState::Line& line : std::get<SkillState>(*kept_[run_->parts[leaf]].state).lines) {
      for (const auto& call : line.waiting) {
        if (call->run == number) return true;
      }
    }
    for (std::size_t i = 0; i < parts_.models(); ++i) {
      for (const auto& open : std::get<ModelState>(*kept_[run_->parts[parts_.skills() + i]].state).open) {
        if (open.leaf == leaf && open.call->run == number) return true;
      }
    }
    return std::any_of(run_->queue.begin(), run_->queue.end(), [&](const Run::Waiting& waiting) {
      return deliveries_[waiting.what].call == std::pair(leaf, number);
    });
  };
  while (is_used()) ++number;
  return number;
}

// A call of a one-way method reaches whoever subscribes to it; a delayed one holds back the later ones.
void PartMemory::deliver_topic(std::uint32_t message) {
  if (!messages_[message].told) {
    messages_[message].told = true;
    const Parts::Told told = parts_.told_of(messages_[message].message);
    if (!told.problem.empty()) {
      messages_[message].told = false;  // it is said each time
      return outside_->problem(told.problem);
    }
    if (told.takers != nullptr) {
      messages_[message].topic = intern_text(told.topic);
      for (const Parts::Taker& taker : *told.takers) {
        const Delivery what = taker.is_model ? Delivery{taker.index, ModelDelivery(Published{told.what})}
                                             : Delivery{taker.index, SkillDelivery(Published{told.what})};
        messages_[message].takers.emplace_back(taker, intern(what, frame_));
      }
    }
  }
  const Known& known = messages_[message];
  if (known.takers.empty()) return;
  Duration delay{0};
  if (faults_) delay = change_standing([&](Stands& stands) { return stands.faults.delay_of(texts_[known.topic]); });
  for (const auto& [taker, what] : known.takers) {
    TimePoint& not_before = run_->not_before[parts_.skills() + (taker.is_model ? parts_.skills() : 0) + taker.index];
    not_before = std::max(not_before, add_saturating(run_->now, delay));
    insert(not_before, Rank::kMessage, what);
  }
}

// ---- numbers

std::uint32_t PartMemory::intern(std::uint32_t part, PartState&& state, TimePoint at) {
  form_.clear();
  Encoder(form_).number(part);
  const auto encode_at = [&](TimePoint now, std::string& out) -> Result<void> {
    if (const auto* tree = std::get_if<TreeState>(&state)) return encode(parts_, *tree, now, out);
    if (const auto* skill = std::get_if<SkillState>(&state)) return encode(parts_, part, *skill, now, out);
    return encode(parts_, part - parts_.skills(), std::get<ModelState>(state), now, out);
  };
  if (auto encoded = encode_at(at, form_); !encoded && !error_) error_ = encoded.error();
  const auto [found, is_new] = number_of_state_.try_emplace(hash128(form_), static_cast<std::uint32_t>(kept_.size()));
  if (!is_new) return *found;
  Kept kept;
  kept.part = part;
  kept.at = at;
  // What is in the future is nearer a nanosecond later; what is past stays so.
  later_.clear();
  Encoder(later_).number(part);
  kept.timeless = encode_at(at + Duration(1), later_) && later_ == form_;
  if (const auto* tree = std::get_if<TreeState>(&state)) {
    kept.ended = tree->phase == TreePhase::kEnded;
    kept.over = tree->over;
    kept.until_planned = tree->planned - at;
  } else if (const auto* skill = std::get_if<SkillState>(&state)) {
    kept.killed = skill->phase == SkillPhase::kKilled;
    kept.unanswered = skill->answered == skill->tick ? 0 : skill->tick;
    if (skill->wake != kNever) kept.wake = skill->wake - at;
  } else if (const auto& model = std::get<ModelState>(state); model.wake != kNever) {
    kept.wake = model.wake - at;
  }
  kept.state = std::make_unique<const PartState>(std::move(state));
  // A session shares most of what it has in common with the one before.
  state_bytes_ += sizeof(Kept) + sizeof(PartState) + 4 * form_.size() + 64;
  kept_.push_back(std::move(kept));
  return static_cast<std::uint32_t>(kept_.size() - 1);
}

std::uint32_t PartMemory::aged(std::uint32_t state, Duration by) {
  if (by == Duration(0) || kept_[state].timeless) return state;
  if (kept_[state].aged != kNone && kept_[state].aged_by == by) return kept_[state].aged;
  const auto [found, is_new] = number_of_aged_.try_emplace({state, static_cast<std::uint64_t>(by.count())}, kNone);
  if (is_new) found->second = intern(kept_[state].part, PartState(*kept_[state].state), kept_[state].at + by);
  kept_[state].aged_by = by;
  return kept_[state].aged = found->second;
}

std::uint32_t PartMemory::part_of(const Delivery& what) const {
  if (std::holds_alternative<TreeDelivery>(what.what))
    return static_cast<std::uint32_t>(parts_.skills() + parts_.models());
  const bool is_model = std::holds_alternative<ModelDelivery>(what.what);
  return static_cast<std::uint32_t>(is_model ? parts_.skills() + what.leaf : what.leaf);
}

std::uint32_t PartMemory::intern(const Delivery& what, TimePoint when) {
  std::string key;
  encode(parts_, what, when, key);
  const std::uint32_t number = number_in(number_of_delivery_, std::move(key), deliveries_.size());
  if (number < deliveries_.size()) return number;
  OnItsWay one{
      .what = what, .part = part_of(what), .tick = numbered_tick(what), .call = numbered_call(what), .timer = {}};
  if (const auto* skill = std::get_if<SkillDelivery>(&what.what)) {
    if (const auto* timer = std::get_if<SkillTimer>(skill)) one.timer = timer->when - when;
  } else if (const auto* model = std::get_if<ModelDelivery>(&what.what)) {
    if (const auto* timer = std::get_if<ModelTimer>(model)) one.timer = timer->when - when;
  }
  deliveries_.push_back(std::move(one));
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
  const std::uint32_t number = number_in(number_of_message_, std::move(key), messages_.size());
  if (number == messages_.size()) {
    const bool is_answer = message.kind == MessageKind::kReply && message.data.find("result") != nullptr;
    messages_.push_back({.message = std::move(message), .is_answer = is_answer, .takers = {}});
  }
  return number;
}

std::uint32_t PartMemory::intern_text(std::string_view text) {
  const std::uint32_t number = number_in(number_of_text_, std::string(text), texts_.size());
  if (number == texts_.size()) texts_.emplace_back(text);
  return number;
}

std::uint32_t PartMemory::intern_value(const Value& value) {
  std::string key;
  append(key, value);
  const std::uint32_t number = number_in(number_of_value_, std::move(key), values_.size());
  if (number == values_.size()) values_.push_back(value);
  return number;
}

std::uint32_t PartMemory::intern_standing(Stands&& stands) {
  std::string key;
  encode(stands.faults, stands.down, key);
  const std::uint32_t number = number_in(number_of_standing_, std::move(key), standing_.size());
  if (number == standing_.size()) standing_.push_back(std::make_unique<const Stands>(std::move(stands)));
  return number;
}

}  // namespace sentree::mission
