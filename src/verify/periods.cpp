#include "sentree/verify/periods.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <utility>

#include "sentree/base/encoder.h"
#include "sentree/monitor/projection.h"
#include "sentree/project/intervention.h"
#include "sentree/scxml/model.h"
#include "sentree/verify/detail/growth.h"
#include "sentree/verify/detail/period.h"

namespace sentree::verify {

namespace {

bool counts(std::string_view member) { return member == "time" || member == "tick" || member == "call"; }

// Faults of a run have numbers of their own.
bool counts_in(const Message& message, std::string_view member) {
  return counts(member) || (member == "id" && message.name == "scenario.injection");
}

// Where a monitor looks at a member of what it is told: its requirement, or the expression that names it.
SourceSpan place_of_look(const monitor::Model& model, const std::string& member) {
  if (model.origin() != nullptr) return model.origin()->requirement.span;
  const scxml::Chart& chart = model.chart();
  for (const std::string& name : {"_event.data." + member, std::string("_event.data"), std::string("_event")}) {
    for (const scxml::Expression& expression : chart.model().expressions) {
      if (expression.text.find(name) != std::string::npos) return chart.span(expression.place);
    }
  }
  return SourceSpan{chart.file()};
}

// Of a message, but for what counts, and for where a choice stands, which may be a file made for the purpose. Nothing
// of statuses of nodes: skills answer theirs, and who changes a tree changes its nodes.
Hash128 all_of(const Message& message) {
  if (message.name == "node.status") return {};
  Map data;
  if (const Map* const members = message.data.as_map()) {
    const bool is_choice = message.name.ends_with(".choice");
    for (const auto& [name, value] : *members) {
      if (!counts(name) && !(is_choice && name == "place")) data.append(name, value);
    }
  }
  return hash128(fmt::format("{}|{}|{}|{}|{}", static_cast<int>(message.kind), message.source, message.target,
                             message.name, to_json(Value(std::move(data)))));
}

}  // namespace

std::string recipient(const project::Plan& plan, const mission::Delivery& what) {
  if (std::holds_alternative<mission::TreeDelivery>(what.what)) return "mission";
  const bool is_model = std::holds_alternative<mission::ModelDelivery>(what.what);
  const std::string& name = is_model ? plan.models[what.leaf].name : plan.leaves[what.leaf].name;
  const scxml::Chart& chart = is_model ? plan.models[what.leaf].chart : *plan.leaves[what.leaf].chart;
  return fmt::format("{} ({})", name, chart.file());
}

Periods::Periods(const project::Plan& plan, const Options& options)
    : plan_(plan), options_(options), gates_(plan), dispatch_(plan.monitors), orders_(plan.monitors.size()) {
  graph_.period = plan.scenario.project.period;
  for (const project::LeafPlan& leaf : plan.leaves) {
    graph_.taken.emplace_back(leaf.chart->transitions().size());
    graph_.statuses.emplace_back(3);
    graph_.entered.emplace_back(leaf.chart->states().size());
    graph_.guards.emplace_back(leaf.chart->transitions().size());
    graph_.parts.push_back(leaf.name);
    leaf_of_chart_.emplace(&leaf.chart->model(), graph_.statuses.size() - 1);
  }
  for (const project::ModelPlan& model : plan.models) {
    graph_.models_entered.emplace_back(model.chart.states().size());
    graph_.models_taken.emplace_back(model.chart.transitions().size());
    graph_.parts.push_back(model.name);
  }
  graph_.nodes_had.resize(plan.tree.size());
  graph_.parts.emplace_back("mission");
  // A state that is remembered is a few numbers, behind which there are hashes again.
  graph_.times_apart = options.times == bt::Times::kAbsolute;
  frontier_ = options.memory_of_steps && !options.exact && mission::PartMemory::remembers(plan)
                  ? remembering(plan,
                                options.faults.empty() ? mission::PartMemory::FaultsFrom::kTimeline
                                                       : mission::PartMemory::FaultsFrom::kAnywhere,
                                *this, options.times)
                  : executing(plan, *this, options.times);
  tells_orders_ = options.reduce_orders && options.order == Order::kAny && gates_.empty() && frontier_->trace(trace_);
}

Result<void> Periods::begin() {
  if (auto begun = frontier_->begin(); !begun) return begun;
  gates_.begin();
  gates_now_.clear();
  if (auto kept = gates_.keep(TimePoint{}, gates_now_); !kept) return kept;
  (void)find();
  add(0);
  return {};
}

Result<Periods::Way> Periods::go_on(std::uint32_t from, std::span<const std::uint32_t> script, const Decider& rest) {
  const scxml::ObserveGuards observes(this);
  begin_ = graph_.nodes[from].at;
  script_ = script;
  rest_ = rest ? &rest : nullptr;
  made_.clear();
  seen_.clear();
  said_ = {};
  trace_.clear();
  ordered_.clear();
  due_.clear();
  frontier_->again(places_[from], begin_);
  if (!gates_.empty()) {
    const std::size_t gates = plan_.gates.size();
    gates_.again(std::span(gates_of_).subspan(from * gates, gates), begin_);
  }
  const auto before_tick = [this] { return faults_come_ ? fault() : Result<void>(); };
  const auto on_the_way = [this]() -> Result<void> {
    if (error_) return tl::unexpected(*error_);
    return on_the_way_ ? on_the_way_() : Result<void>();
  };
  if (auto done = frontier_->go_on(before_tick, on_the_way); !done) return tl::unexpected(done.error());
  if (error_) return tl::unexpected(*error_);
  gates_now_.clear();
  if (auto kept = gates_.keep(frontier_->now(), gates_now_); !kept) return tl::unexpected(kept.error());
  ended_ = frontier_->ended();
  const TimePoint now = frontier_->now();
  Way way{.to = find(),
          .over = frontier_->over(),
          .took = now - begin_,
          .judged = std::max(Duration(0), now - begin_ - Duration(is_cut_off(*frontier_) ? 1 : 0)),
          .until_planned = frontier_->planned() - now};
  way.is_new = way.to == graph_.nodes.size();
  if (way.is_new) add(graph_.nodes[from].depth + 1);
  return way;
}

// The number of the state that the run is in; that of the next one, if it is new.
std::uint32_t Periods::find() {
  const auto next = static_cast<std::uint32_t>(graph_.nodes.size());
  if (!options_.exact && gates_.empty()) return *known_.try_emplace(frontier_->key(), next).first;
  form_ = frontier_->form();
  form_.append(reinterpret_cast<const char*>(gates_now_.data()), gates_now_.size() * sizeof(std::uint32_t));
  if (!options_.exact) return *known_.try_emplace(hash128(form_), next).first;
  const auto [found, is_new] = known_forms_.try_emplace(form_, next);
  if (is_new) kept_bytes_ += form_.size() + 80;
  return found->second;
}

// The run is in a new state. One that has ended is not kept: nothing follows.
void Periods::add(std::uint32_t depth) {
  const bool ended = frontier_->ended();
  if (look_) look_(*frontier_);
  graph_.nodes.push_back({.at = frontier_->now(),
                          .depth = depth,
                          .first_edge = 0,
                          .edges = 0,
                          .ended = ended,
                          .cut_off = is_cut_off(*frontier_)});
  gates_of_.insert(gates_of_.end(), gates_now_.begin(), gates_now_.end());
  places_.push_back(ended ? 0 : frontier_->keep());
}

std::uint64_t Periods::bytes() const {
  return graph_.nodes.size() * (sizeof(Graph::Node) + sizeof(std::uint64_t)) + known_.bytes() +
         graph_.edges.size() * sizeof(Edge) + gates_of_.size() * sizeof(std::uint32_t) + gates_.bytes() +
         frontier_->bytes() + kept_bytes_;
}

std::string Periods::most_varied(std::size_t count) const { return verify::most_varied(plan_, *frontier_, count); }

// ---- what is decided

std::uint32_t Periods::decide(Made::Kind kind, std::uint64_t count, const mission::Choice* choice) {
  const std::uint32_t alternative = made_.size() < script_.size() ? script_[made_.size()]
                                    : rest_ != nullptr            ? (*rest_)(count, choice)
                                                                  : 0;
  made_.push_back({kind, alternative, static_cast<std::uint32_t>(count), 0, -1, 0});
  return alternative;
}

std::uint64_t Periods::decide_choice(const mission::Choice& choice) {
  if (error_) return 0;
  if (choice.count > kAlternativesMax) {
    error_ = too_many_alternatives(plan_, choice);
    return 0;
  }
  const bool is_drawn = static_cast<bool>(choice.probability);
  if (is_drawn && choice.count > 1) tells_orders_ = false;
  if (choice.count > 1) (is_drawn ? graph_.probabilistic : graph_.nondeterministic) = true;
  return decide(Made::Kind::kChoice, choice.count, &choice);
}

// Before the tick of a period: faults that go, then faults that come, from the one with the number `from` on; those
// that come are numbered behind all that may go.
std::vector<Periods::Possible> Periods::possible_faults(const Options& options, const Frontier& frontier,
                                                        std::size_t from) {
  std::vector<Possible> possible;
  const auto standing = frontier.faults().list();
  const auto stands = [&](std::size_t i) {
    return std::any_of(standing.begin(), standing.end(), [&](const auto& s) { return s.id == kFirstFault + i; });
  };
  std::size_t stand = 0;
  using namespace project::intervention;
  for (std::size_t i = 0; i < options.faults.size(); ++i) {
    const project::Intervention& fault = options.faults[i];
    const auto* kill = std::get_if<Kill>(&fault);
    if (kill != nullptr ? !frontier.is_down(kill->part) : !stands(i)) continue;
    ++stand;
    if (i < from) continue;
    project::Intervention end = kill != nullptr ? project::Intervention(Restart{kill->part}) : Clear{kFirstFault + i};
    possible.push_back({std::move(end), i, true});
  }
  for (std::size_t i = 0; i < options.faults.size() && stand < options.faults_at_most; ++i) {
    if (options.faults.size() + i < from) continue;
    const project::Intervention& fault = options.faults[i];
    const auto* kill = std::get_if<Kill>(&fault);
    if (stands(i) || (kill != nullptr && frontier.is_down(kill->part))) continue;
    possible.push_back({fault, i, false});
  }
  return possible;
}

ChoicePoint Periods::point_of(const Possible& fault) const {
  const project::Intervention& what = options_.faults[fault.fault];
  return {.model = "",
          .function = fault.ends ? "end of fault" : "fault",
          .name = project::describe(what),
          .place = "",
          .value = to_json(Value(project::to_entry(what)))};
}

Result<void> Periods::put_faults(const Options& options, Frontier& frontier,
                                 const std::function<const Possible*(const std::vector<Possible>& possible)>& decide) {
  if (options.faults.empty()) return {};
  for (std::size_t from = 0;;) {
    const std::vector<Possible> possible = possible_faults(options, frontier, from);
    const Possible* const fault = possible.empty() ? nullptr : decide(possible);
    if (fault == nullptr) return {};
    if (auto injected = frontier.inject(fault->what, kFirstFault + fault->fault); !injected) return injected;
    from = fault->number(options) + 1;
  }
}

Result<void> Periods::fault() {
  return put_faults(options_, *frontier_, [this](const std::vector<Possible>& possible) -> const Possible* {
    graph_.nondeterministic = true;
    const std::uint32_t taken = decide(Made::Kind::kFault, possible.size() + 1);
    if (taken == 0) return nullptr;
    made_.back().what = intern_choice(point_of(possible[taken - 1]));
    return &possible[taken - 1];
  });
}

std::string Periods::key_of(const ChoicePoint& point) {
  return point.model + '\n' + point.function + '\n' + point.name + '\n' + point.place + '\n' + point.value;
}

std::uint32_t Periods::intern_choice(ChoicePoint point) {
  const auto [found, is_new] = choice_of_.emplace(key_of(point), static_cast<std::uint32_t>(graph_.choices.size()));
  if (is_new) graph_.choices.push_back(std::move(point));
  return found->second;
}

std::uint32_t Periods::intern_place(const std::string& place) {
  const auto [found, is_new] = place_of_.emplace(place, static_cast<std::uint32_t>(graph_.places.size()));
  if (is_new) graph_.places.push_back(place);
  return found->second;
}

// ---- what happens in a period

void Periods::observed(const Message& message) {
  if (!gates_.empty()) gates_.observed(message, message.time);
  see(hear(message), message.time);
  if (options_.tells_what_is_said) say(all_of(message), message.time);
}

// What monitors and gates look at, and what coverage is told by.
bool Periods::is_heard(mission::ObservationName& name) {
  using Heard = mission::ObservationName::Heard;
  if (name.heard == Heard::kUnknown) {
    const monitor::Dispatch::Route& route = dispatch_.route(name.text);
    const bool heard =
        !gates_.empty() || options_.tells_what_is_said || !route.any.monitors.empty() || !route.by_source.empty();
    // The first reply of each method.
    if (!heard && name.text.ends_with(".reply") && !replies_.contains(name.text)) return true;
    name.heard = heard ? Heard::kYes : Heard::kNo;
  }
  return name.heard == Heard::kYes;
}

void Periods::observed(std::uint32_t number, TimePoint now, const Message& message) {
  if (!gates_.empty()) gates_.observed(message, now);
  while (heard_.size() <= number) heard_.push_back(kUnheard);
  if (heard_[number] == kUnheard) {
    heard_[number] = hear(message);
    const std::size_t words = orders_.words();
    hearers_.resize(std::max(hearers_.size(), (number + std::size_t{1}) * words));
    for (const std::size_t monitor : dispatch_.route(message.name).of(message.source).monitors)
      hearers_[number * words + monitor / 64] |= std::uint64_t{1} << (monitor % 64);
    if (options_.tells_what_is_said) {
      said_of_.resize(heard_.size());
      said_of_[number] = all_of(message);
    }
  }
  see(heard_[number], now);
  if (options_.tells_what_is_said) say(said_of_[number], now);
}

std::optional<std::uint64_t> Periods::choose(const mission::Choice& choice) {
  const std::uint64_t alternative = decide_choice(choice);
  if (!error_) note(choice, alternative);
  return alternative;
}

std::uint64_t Periods::choose(std::uint32_t number, const mission::Choice& choice) {
  const std::uint64_t alternative = decide_choice(choice);
  if (error_) return alternative;
  if (noted_.size() <= number) noted_.resize(number + 1);
  Noted& of = noted_[number];
  if (of.alternatives.empty()) of.alternatives.assign(choice.count, kUnheard);
  if (of.alternatives[alternative] == kUnheard) {
    note(choice, alternative);
    of.alternatives[alternative] = made_.back().what;
    of.place = made_.back().place;
  } else {
    made_.back().what = of.alternatives[alternative];
    made_.back().place = of.place;
    if (choice.probability) made_.back().probability = choice.probability(alternative);
  }
  return alternative;
}

std::size_t Periods::order(std::uint64_t, std::span<const mission::Delivery* const> due) {
  parts_.clear();
  for (const mission::Delivery* what : due) parts_.push_back(part(*what));
  return order(parts_);
}

std::size_t Periods::order(std::span<const std::uint32_t> parts) {
  if (options_.order == Order::kVirtual) return 0;
  graph_.nondeterministic = true;
  const std::uint32_t which = decide(Made::Kind::kOrder, parts.size());
  made_.back().what = parts[which];
  if (tells_orders_) note_order(parts);
  return which;
}

void Periods::note_order(std::span<const std::uint32_t> parts) {
  ordered_.push_back({.step = static_cast<std::uint32_t>(trace_.steps.size()),
                      .decision = static_cast<std::uint32_t>(made_.size() - 1),
                      .due = static_cast<std::uint32_t>(due_.size())});
  due_.insert(due_.end(), parts.begin(), parts.end());
}

void Periods::want_orders(std::vector<OpenDecision>& open) {
  orders_.want({.trace = trace_, .decisions = ordered_, .due = due_, .ended = ended_}, hearers_, open);
}

std::optional<mission::Veto> Periods::judge(const Message& request) {
  if (gates_.empty() || looks_at_clock(request)) return std::nullopt;
  return gates_.judge(request, frontier_->now());
}

void Periods::met(const mission::Met& what) {
  using Kind = mission::Met::Kind;
  switch (what.kind) {
    case Kind::kNode: graph_.nodes_had[what.of] |= static_cast<std::uint8_t>(1U << what.what); return;
    case Kind::kSkillState: graph_.entered[what.of][what.what] = true; return;
    case Kind::kModelState: graph_.models_entered[what.of][what.what] = true; return;
    case Kind::kModelTransition: graph_.models_taken[what.of][what.what] = true; return;
    case Kind::kAnswer: {
      const auto status = static_cast<bt::Status>(what.what);
      graph_.statuses[what.of][status == bt::Status::kRunning ? 0 : status == bt::Status::kSuccess ? 1 : 2] = true;
      return;
    }
  }
}

void Periods::guard(const scxml::Chart& chart, scxml::TransitionIndex of, bool holds) {
  const auto leaf = leaf_of_chart_.find(&chart.model());
  if (leaf != leaf_of_chart_.end()) graph_.guards[leaf->second][of] |= holds ? 2U : 1U;
}

void Periods::note_call(const Message& message) {
  if (message.kind != MessageKind::kReply && message.kind != MessageKind::kError) return;
  // Nearly all are replies that came before.
  if (message.kind == MessageKind::kReply && !replies_.insert(message.name).second) return;
  if (!plan_.services.contains(message.target)) return;
  const Value* const kind = message.kind == MessageKind::kError ? message.data.find("kind") : nullptr;
  const bool is_late = kind != nullptr && kind->text() == "late";
  graph_.calls.emplace(message.name.substr(0, message.name.rfind('.')), message.kind == MessageKind::kReply ? "reply"
                                                                        : is_late                           ? "late"
                                                                                                            : "error");
}

void Periods::refused(const Diagnostic& why) {
  if (error_) return;
  error_ = why;
  error_->code = why.code == "model.choice"     ? "verify.choice"
                 : why.code == "model.given-up" ? "verify.endless"
                                                : "verify.reply";
}

void Periods::problem(const std::string& what) {
  if (graph_.problems.size() < Graph::kProblemsMax && told_.insert(what).second) graph_.problems.push_back(what);
}

void Periods::see(std::uint32_t observation, TimePoint now) {
  if (observation != kNobody) seen_.push_back({now - begin_, observation});
}

void Periods::say(const Hash128& what, TimePoint now) {
  if (what == Hash128{}) return;
  const std::array<std::uint64_t, 5> together{said_.a, said_.b, what.a, what.b,
                                              static_cast<std::uint64_t>((now - begin_).count())};
  said_ = hash128({reinterpret_cast<const char*>(together.data()), sizeof together});
}

// What of it somebody looks at: the number of an observation, or nothing.
std::uint32_t Periods::hear(const Message& message) {
  note_call(message);
  const auto& targets = dispatch_.route(message.name).of(message.source);
  if (targets.monitors.empty()) return kNobody;
  // One that is looked at as a whole has its time, and is refused below.
  if (targets.projection.is_whole()) return kept_observation(message, targets.projection);
  form_.clear();
  Encoder to(form_);
  to.byte(static_cast<std::uint8_t>(message.kind));
  for (const std::string* text : {&message.source, &message.target, &message.name}) to.text(*text);
  targets.projection.encode(message, form_);
  if (const auto found = observation_of_.find(form_); found != observation_of_.end()) return found->second;
  const std::uint32_t number = kept_observation(message, targets.projection);
  if (number != kNobody) observation_of_.emplace(form_, number);
  return number;
}

// Of one that is new. Nothing, and an error: numbers and times would make each period another one.
std::uint32_t Periods::kept_observation(const Message& message, const monitor::Projection& projection) {
  Value looked_at = projection.data(message);
  Map data;
  if (Map* const members = looked_at.as_map()) {
    for (auto& [name, value] : *members) {
      if (counts_in(message, name)) {
        refuse_clock(message, name);
        return kNobody;
      }
      if (name != "source" && name != "target") data.append(name, std::move(value));
    }
  }
  graph_.observations.push_back({.kind = message.kind,
                                 .source = message.source,
                                 .target = message.target,
                                 .name = message.name,
                                 .data = Value(std::move(data))});
  return static_cast<std::uint32_t>(graph_.observations.size() - 1);
}

// Numbers and times would make each period another one.
bool Periods::looks_at_clock(const Message& message) {
  const auto& targets = dispatch_.route(message.name).of(message.source);
  if (targets.monitors.empty()) return false;
  const Value looked_at = targets.projection.data(message);
  for (const char* const member : {"time", "tick", "call", "id"}) {
    if (looked_at.find(member) == nullptr || !counts_in(message, member)) continue;
    refuse_clock(message, member);
    return true;
  }
  return false;
}

void Periods::refuse_clock(const Message& message, const std::string& member) {
  if (error_) return;
  for (const monitor::Model& model : plan_.monitors) {
    monitor::Dispatch alone(std::span<const monitor::Model>(&model, 1));
    const auto& targets = alone.route(message.name).of(message.source);
    if (targets.monitors.empty() || targets.projection.data(message).find(member) == nullptr) continue;
    error_ = Diagnostic{
        Severity::kError, "verify.clock",
        fmt::format("monitor {} looks at the {} of {}{}", model.name(), member, message.name,
                    targets.projection.is_whole() ? ", since it uses _event.data as a whole; name its members"
                                                  : "; count ticks, or wait by delayed <send>s, instead"),
        place_of_look(model, member)};
    return;
  }
}

// Which alternative the last decision took.
void Periods::note(const mission::Choice& choice, std::uint64_t alternative) {
  const std::string value = to_json(choice.alternative(alternative));
  made_.back().what = intern_choice({.model = choice.model,
                                     .function = choice.function,
                                     .name = choice.name,
                                     .place = choice.name.empty() ? choice.place : "",
                                     .value = value});
  made_.back().place = intern_place(choice.place);
  if (choice.probability) made_.back().probability = choice.probability(alternative);
  if (!choice.name.empty()) graph_.values[fmt::format("{}.{}", choice.model, choice.name)].insert(value);
}

// Leaves, then models, then the mission, as `Graph::parts` has them.
std::uint32_t Periods::part(const mission::Delivery& delivery) const {
  if (std::holds_alternative<mission::TreeDelivery>(delivery.what))
    return static_cast<std::uint32_t>(graph_.parts.size() - 1);
  const bool is_model = std::holds_alternative<mission::ModelDelivery>(delivery.what);
  return static_cast<std::uint32_t>(is_model ? plan_.leaves.size() + delivery.leaf : delivery.leaf);
}

// ---- what is kept once

template <class Known, class All, class One>
std::uint32_t Periods::keep(Known& known, All& all, const One& one) {
  const auto [found, is_new] = known.emplace(hash_of(one, words_), static_cast<std::uint32_t>(all.size()));
  if (is_new) {
    kept_bytes_ += 64 + words_.size() * 8;
    all.push_back(one);
  }
  return found->second;
}

Hash128 Periods::hash_of(const std::vector<Seen>& all, std::vector<std::uint32_t>& words) {
  words.clear();
  for (const Seen& seen : all) {
    const auto after = static_cast<std::uint64_t>(seen.after.count());
    words.insert(words.end(),
                 {static_cast<std::uint32_t>(after), static_cast<std::uint32_t>(after >> 32U), seen.observation});
  }
  return hash128({reinterpret_cast<const char*>(words.data()), words.size() * sizeof(std::uint32_t)});
}

Hash128 Periods::hash_of(const std::vector<Made>& all, std::vector<std::uint32_t>& words) {
  words.clear();
  for (const Made& made : all) {
    // What is called alike may be drawn with another probability elsewhere.
    const auto probability = std::bit_cast<std::uint64_t>(made.probability);
    words.insert(words.end(),
                 {static_cast<std::uint32_t>(made.kind), made.alternative, made.count, made.what, made.place,
                  static_cast<std::uint32_t>(probability), static_cast<std::uint32_t>(probability >> 32U)});
  }
  return hash128({reinterpret_cast<const char*>(words.data()), words.size() * sizeof(std::uint32_t)});
}

std::uint32_t Periods::keep_seen() { return keep(sequence_of_, graph_.sequences, seen_); }

std::uint32_t Periods::keep_made() { return keep(decisions_of_, graph_.decisions, made_); }

std::uint32_t Periods::adopt(const Scouted& way, std::uint32_t depth) {
  const auto next = static_cast<std::uint32_t>(graph_.nodes.size());
  const std::uint32_t to = *known_.try_emplace(way.key, next).first;
  if (to != next) return to;
  graph_.nodes.push_back(
      {.at = way.now, .depth = depth, .first_edge = 0, .edges = 0, .ended = way.ended, .cut_off = way.cut_off});
  places_.push_back(way.ended ? 0 : frontier_->keep(way.form));
  return to;
}

// ---- ways

void Ways::open(const std::vector<Made>& made, bool reduces) {
  for (std::size_t i = open_.size(); i < made.size(); ++i) {
    open_.push_back({.taken = made[i].alternative, .count = made[i].count, .all = true, .wanted = {}, .done = {}});
    if (!reduces || made[i].kind != Made::Kind::kOrder) continue;
    open_.back().all = false;
    open_.back().wanted.assign(made[i].count, false);
    open_.back().done.assign(made[i].count, false);
  }
}

// The last decision that has an alternative left takes it.
bool Ways::next() {
  const auto take_another = [](OpenDecision& decision) {
    if (decision.all) return ++decision.taken < decision.count;
    decision.done[decision.taken] = true;
    for (std::uint32_t i = 0; i < decision.count; ++i) {
      if (!decision.wanted[i] || decision.done[i]) continue;
      decision.taken = i;
      return true;
    }
    return false;
  };
  while (!open_.empty() && !take_another(open_.back())) {
    const OpenDecision& last = open_.back();
    leaves_out_ = leaves_out_ || (!last.all && std::find(last.done.begin(), last.done.end(), false) != last.done.end());
    open_.pop_back();
  }
  script_.clear();
  for (const OpenDecision& one : open_) script_.push_back(one.taken);
  return !open_.empty();
}

}  // namespace sentree::verify
