#include "sentree/verify/explore.h"

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "sentree/base/flat_map.h"
#include "sentree/base/hash128.h"
#include "sentree/project/intervention.h"
#include "sentree/verify/frontier.h"

namespace sentree::verify {

namespace {

using SteadyClock = std::chrono::steady_clock;

class Explorer final : public mission::Surroundings, public mission::PartMemory::Outside {
 public:
  Explorer(const project::Plan& plan, const Options& options)
      : plan_(plan), options_(options), dispatch_(plan.monitors) {
    graph_.period = plan.scenario.project.period;
    for (const project::LeafPlan& leaf : plan.leaves) {
      graph_.taken.emplace_back(leaf.chart->transitions().size());
      graph_.statuses.emplace_back(3);
      leaf_of_.emplace(leaf.name + ".tick.reply", graph_.statuses.size() - 1);
      graph_.parts.push_back(leaf.name);
    }
    for (const project::ModelPlan& model : plan.models) graph_.parts.push_back(model.name);
    graph_.parts.emplace_back("mission");
    frontier_ = options.memory_of_steps && mission::PartMemory::remembers(plan)
                    ? remembering(plan, !options.faults.empty(), *this)
                    : executing(plan, *this);
  }

  Result<Graph> operator()() {
    if (auto begun = frontier_->begin(); !begun) return tl::unexpected(begun.error());
    add(frontier_->key(), 0);
    started_ = SteadyClock::now();
    for (std::size_t at = 0; at < graph_.nodes.size(); ++at) {
      graph_.limit = limit(at);
      if (!graph_.limit.empty()) break;
      graph_.nodes[at].first_edge = static_cast<std::uint32_t>(graph_.edges.size());
      if (graph_.nodes[at].ended) continue;
      if (auto done = expand(at); !done) return tl::unexpected(done.error());
      graph_.nodes[at].edges = static_cast<std::uint32_t>(graph_.edges.size()) - graph_.nodes[at].first_edge;
      if (!graph_.limit.empty()) break;
      graph_.complete_to = graph_.nodes[at].depth + 1;
      frontier_->drop();
      if (options_.progress && at % 1024 == 0) options_.progress(graph_.nodes.size(), graph_.edges.size());
    }
    graph_.complete = graph_.limit.empty();
    return std::move(graph_);
  }

 private:
  // The run is new. One that has ended is not kept: nothing follows.
  void add(Hash128 key, std::uint32_t depth) {
    known_.try_emplace(key, static_cast<std::uint32_t>(graph_.nodes.size()));
    const bool ended = frontier_->ended();
    graph_.nodes.push_back({.depth = depth, .at = frontier_->now(), .ended = ended, .first_edge = 0, .edges = 0});
    if (!ended) frontier_->keep();
  }

  [[nodiscard]] std::size_t memory() const {
    return graph_.nodes.size() * sizeof(Graph::Node) + known_.bytes() + graph_.edges.size() * sizeof(Edge) +
           frontier_->bytes() + kept_bytes_;
  }

  std::string limit(std::size_t at) const {
    if (graph_.nodes[at].depth >= options_.ticks) return "the limit of " + std::to_string(options_.ticks) + " ticks";
    if (graph_.nodes.size() > options_.states) return "the limit of " + std::to_string(options_.states) + " states";
    return limit_now();
  }
  // What can also be reached between two ways of one state.
  std::string limit_now() const {
    if (options_.interrupted && options_.interrupted()) return "interrupted";
    if (options_.time && SteadyClock::now() - started_ > *options_.time) return "the limit of time";
    if (memory() > options_.memory) return "the limit of memory";
    return {};
  }

  // Every way in which the next period of a state can go.
  Result<void> expand(std::size_t at) {
    const std::uint32_t depth = graph_.nodes[at].depth;
    begin_ = graph_.nodes[at].at;
    script_.clear();
    for (std::size_t ways = 0;; ++ways) {
      if (ways >= kWaysMax) {
        return fail("verify.choice", "tick " + std::to_string(depth + 1) + " can go on in more than " +
                                         std::to_string(kWaysMax) + " ways; leave less open at one instant");
      }
      if (ways % 64 == 63) graph_.limit = limit_now();
      if (!graph_.limit.empty()) return {};
      made_.clear();
      seen_.clear();
      frontier_->again(begin_);
      if (auto done = frontier_->go_on([this] { return fault(); }); !done) return done;
      if (error_) return tl::unexpected(*error_);
      const Hash128 key = frontier_->key();
      std::uint32_t to = known_.find(key);
      if (to == known_.kNone) {
        to = static_cast<std::uint32_t>(graph_.nodes.size());
        add(key, depth + 1);
      }
      graph_.edges.push_back({static_cast<std::uint32_t>(at), to, keep_seen(), keep_made()});
      // The next: the last decision that has an alternative left takes it.
      while (!made_.empty() && made_.back().alternative + 1 >= made_.back().count) made_.pop_back();
      if (made_.empty()) return {};
      script_.clear();
      for (const Made& made : made_) script_.push_back(made.alternative);
      ++script_.back();
    }
  }

  // Before the tick of a period: what the timeline does then, and a fault that comes or goes.
  Result<void> fault() {
    if (options_.faults.empty()) return {};
    struct Possible {
      project::Intervention what;
      ChoicePoint point;
    };
    const auto standing = frontier_->faults().list();
    std::vector<Possible> possible;
    std::size_t stand = 0;
    using Kind = project::Intervention::Kind;
    for (const project::Intervention& fault : options_.faults) {
      const auto found = std::find_if(standing.begin(), standing.end(), [&](const auto& s) { return s.what == fault; });
      const bool kills = fault.kind == Kind::kKill;
      if (kills ? !frontier_->is_down(fault.target) : found == standing.end()) continue;
      ++stand;
      project::Intervention end;
      end.kind = kills ? Kind::kRestart : Kind::kClear;
      end.target = fault.target;
      end.id = kills ? 0 : found->id;
      possible.push_back({std::move(end), {"", "end of fault", describe(fault), to_json(Value(to_entry(fault)))}});
    }
    for (const project::Intervention& fault : options_.faults) {
      if (stand >= options_.faults_at_most) break;
      const bool stands = std::any_of(standing.begin(), standing.end(), [&](const auto& s) { return s.what == fault; });
      if (stands || (fault.kind == Kind::kKill && frontier_->is_down(fault.target))) continue;
      possible.push_back({fault, {"", "fault", describe(fault), to_json(Value(to_entry(fault)))}});
    }
    if (possible.empty()) return {};
    graph_.nondeterministic = true;
    const std::uint32_t taken = decide(Made::Kind::kFault, possible.size() + 1, 0, -1);
    if (taken == 0) return {};
    made_.back().what = intern_choice(std::move(possible[taken - 1].point));
    return frontier_->inject(possible[taken - 1].what);
  }

  std::uint32_t intern_choice(ChoicePoint point) {
    std::string key = point.model + '\n' + point.function + '\n' + point.name + '\n' + point.value;
    const auto [found, is_new] = choice_of_.emplace(std::move(key), static_cast<std::uint32_t>(graph_.choices.size()));
    if (is_new) graph_.choices.push_back(std::move(point));
    return found->second;
  }

  std::uint32_t decide(Made::Kind kind, std::uint64_t count, std::uint32_t what, double probability) {
    const std::uint32_t alternative = made_.size() < script_.size() ? script_[made_.size()] : 0;
    made_.push_back({kind, alternative, static_cast<std::uint32_t>(count), what, probability});
    return alternative;
  }

  // ---- Surroundings of a run that is executed

  void observed(const Message& message) override { see(hear(message), message.time); }
  std::optional<std::uint64_t> choose(const mission::Choice& choice) override {
    const std::uint64_t alternative = decide_choice(choice);
    if (!error_) note(choice, alternative);
    return alternative;
  }
  std::size_t order(std::uint64_t, std::span<const mission::Delivery* const> due) override {
    parts_.clear();
    for (const mission::Delivery* what : due) parts_.push_back(part(*what));
    return order(parts_);
  }
  std::optional<mission::Veto> judge(const Message&) override { return std::nullopt; }

  // ---- and of one that is remembered

  void observed(std::uint32_t number, TimePoint now, const Message& message) override {
    while (heard_.size() <= number) heard_.push_back(kUnheard);
    if (heard_[number] == kUnheard) heard_[number] = hear(message);
    see(heard_[number], now);
  }
  std::uint64_t choose(std::uint32_t number, const mission::Choice& choice) override {
    const std::uint64_t alternative = decide_choice(choice);
    if (error_) return alternative;
    if (noted_.size() <= number) noted_.resize(number + 1);
    auto& of = noted_[number];
    if (of.empty()) of.assign(choice.count, kUnheard);
    if (of[alternative] == kUnheard) {
      note(choice, alternative);
      of[alternative] = made_.back().what;
    } else {
      made_.back().what = of[alternative];
      if (choice.probability) made_.back().probability = choice.probability(alternative);
    }
    return alternative;
  }
  std::size_t order(std::span<const std::uint32_t> parts) override {
    if (options_.order == Order::kVirtual) return 0;
    graph_.nondeterministic = true;
    const std::uint32_t which = decide(Made::Kind::kOrder, parts.size(), 0, -1);
    made_.back().what = parts[which];
    return which;
  }

  // What of it somebody looks at: the number of an observation, or nothing.
  std::uint32_t hear(const Message& message) {
    if (const auto leaf = leaf_of_.find(message.name); leaf != leaf_of_.end() && message.kind == MessageKind::kReply) {
      const std::string_view status = message.data.find("status")->text();
      graph_.statuses[leaf->second][status == "RUNNING" ? 0 : status == "SUCCESS" ? 1 : 2] = true;
    }
    const auto& targets = dispatch_.route(message.name).of(message.source);
    if (targets.monitors.empty()) return kNobody;
    // Numbers and times would make each period another one.
    Value looked_at = targets.projection.data(message);
    Message seen;
    seen.kind = message.kind;
    seen.source = message.source;
    seen.target = message.target;
    seen.name = message.name;
    Map data;
    if (Map* members = looked_at.as_map()) {
      for (auto& [name, value] : *members) {
        if (name == "time" || name == "tick" || name == "call") {
          refuse_clock(message, name);
          return kNobody;
        }
        if (name != "source" && name != "target") data.append(name, std::move(value));
      }
    }
    seen.data = std::move(data);
    std::string key = std::to_string(static_cast<int>(seen.kind)) + '|' + seen.source + '|' + seen.target + '|' +
                      seen.name + '|' + to_json(seen.data);
    const auto [found, is_new] =
        observation_of_.emplace(std::move(key), static_cast<std::uint32_t>(graph_.observations.size()));
    if (is_new) graph_.observations.push_back(std::move(seen));
    return found->second;
  }

  void see(std::uint32_t observation, TimePoint now) {
    if (observation != kNobody) seen_.push_back({now - begin_, observation});
  }

  void refuse_clock(const Message& message, const std::string& member) {
    if (error_) return;
    for (const monitor::Model& model : plan_.monitors) {
      monitor::Dispatch alone(std::span<const monitor::Model>(&model, 1));
      const auto& targets = alone.route(message.name).of(message.source);
      if (targets.monitors.empty() || targets.projection.data(message).find(member) == nullptr) continue;
      error_ =
          Diagnostic{Severity::kError, "verify.clock",
                     "monitor " + model.name() + " looks at the " + member + " of " + message.name +
                         (targets.projection.is_whole() ? ", since it uses _event.data as a whole; name its members"
                                                        : "; count ticks, or wait by delayed <send>s, instead"),
                     SourceSpan{model.chart().name()}};
      return;
    }
  }

  std::uint64_t decide_choice(const mission::Choice& choice) {
    if (choice.count > kAlternativesMax) {
      if (!error_) {
        error_ = Diagnostic{Severity::kError,
                            "verify.choice",
                            choice.model + ": " + choice.function + "() leaves " + std::to_string(choice.count) +
                                " alternatives open; at most " + std::to_string(kAlternativesMax) + " can be tried",
                            {}};
      }
      return 0;
    }
    const bool is_drawn = static_cast<bool>(choice.probability);
    if (choice.count > 1) (is_drawn ? graph_.probabilistic : graph_.nondeterministic) = true;
    return decide(Made::Kind::kChoice, choice.count, 0, -1);
  }
  // Which alternative the last decision took.
  void note(const mission::Choice& choice, std::uint64_t alternative) {
    const std::string value = to_json(choice.alternative(alternative));
    made_.back().what = intern_choice({choice.model, choice.function, choice.name, value});
    if (choice.probability) made_.back().probability = choice.probability(alternative);
    if (!choice.name.empty()) graph_.values[choice.model + "." + choice.name].insert(value);
  }

  // Leaves, then models, then the mission, as `Graph::parts` has them.
  std::uint32_t part(const mission::Delivery& delivery) const {
    if (std::holds_alternative<mission::TreeDelivery>(delivery.what))
      return static_cast<std::uint32_t>(graph_.parts.size() - 1);
    const bool is_model = std::holds_alternative<mission::ModelDelivery>(delivery.what);
    return static_cast<std::uint32_t>(is_model ? plan_.leaves.size() + delivery.leaf : delivery.leaf);
  }

  void taken(std::size_t leaf, scxml::TransitionIndex transition) override { graph_.taken[leaf][transition] = true; }

  void refused(const Diagnostic& why) override {
    if (error_) return;
    error_ = why;
    error_->code = "verify.reply";
  }

  void problem(const std::string& what) override {
    if (graph_.problems.size() < Graph::kProblemsMax && told_.insert(what).second) graph_.problems.push_back(what);
  }

  // ---- what is kept once

  // @param key  Of the numbers that it is made of.
  template <class Known, class All, class One>
  std::uint32_t keep(Known& known, const std::vector<std::uint32_t>& key, All& all, const One& one) {
    const Hash128 hash = hash128({reinterpret_cast<const char*>(key.data()), key.size() * sizeof(std::uint32_t)});
    const auto [found, is_new] = known.emplace(hash, static_cast<std::uint32_t>(all.size()));
    if (is_new) {
      kept_bytes_ += 64 + key.size() * 8;
      all.push_back(one);
    }
    return found->second;
  }

  std::uint32_t keep_seen() {
    words_.clear();
    for (const Seen& seen : seen_) {
      const auto after = static_cast<std::uint64_t>(seen.after.count());
      words_.insert(words_.end(),
                    {static_cast<std::uint32_t>(after), static_cast<std::uint32_t>(after >> 32U), seen.observation});
    }
    return keep(sequence_of_, words_, graph_.sequences, seen_);
  }

  std::uint32_t keep_made() {
    words_.clear();
    for (const Made& made : made_)
      words_.insert(words_.end(), {static_cast<std::uint32_t>(made.kind), made.alternative, made.count, made.what});
    return keep(decisions_of_, words_, graph_.decisions, made_);
  }

  static constexpr std::uint32_t kNobody = UINT32_MAX;
  static constexpr std::uint32_t kUnheard = UINT32_MAX - 1;

  const project::Plan& plan_;
  const Options& options_;
  std::unique_ptr<Frontier> frontier_;
  monitor::Dispatch dispatch_;
  Graph graph_;
  FlatMap<Hash128, Hash128Hash> known_;
  std::unordered_map<Hash128, std::uint32_t, Hash128Hash> sequence_of_;
  std::unordered_map<Hash128, std::uint32_t, Hash128Hash> decisions_of_;
  std::unordered_map<std::string, std::uint32_t> choice_of_;
  std::unordered_map<std::string, std::uint32_t> observation_of_;
  std::vector<std::uint32_t> heard_;               // observations by the numbers of the memory
  std::vector<std::vector<std::uint32_t>> noted_;  // alternatives of choices, likewise
  std::unordered_map<std::string, std::size_t> leaf_of_;
  std::set<std::string> told_;
  std::size_t kept_bytes_ = 0;
  // Of the period that is being tried.
  std::vector<std::uint32_t> script_;
  std::vector<Made> made_;
  std::vector<Seen> seen_;
  std::optional<Diagnostic> error_;
  TimePoint begin_{};
  SteadyClock::time_point started_;
  std::vector<std::uint32_t> words_;
  std::vector<std::uint32_t> parts_;
};

}  // namespace

Diagnostics obstacles(const project::Plan& plan) {
  Diagnostics out = mission::VirtualHost::obstacles(plan);
  const auto look = [&](const scxml::Chart& chart, const std::string& whose) {
    for (const scxml::AmbientUse& use : chart.ambient()) {
      if (use.what == scxml::Ambient::kIds) continue;
      out.push_back({Severity::kError, "verify.clock",
                     whose + " asks for " + use.name +
                         ", so that no state of it ever comes again; let a model decide (chance, choose), or wait by "
                         "delayed <send>s",
                     use.span});
    }
  };
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (leaf.chart) look(*leaf.chart, "skill " + leaf.name);
  }
  for (const project::ModelPlan& model : plan.models) look(model.chart, "model " + model.name);
  for (const monitor::Model& model : plan.monitors) look(model.chart(), "monitor " + model.name());
  for (const project::Injection& injection : plan.scenario.timeline) {
    const auto kind = injection.what.kind;
    if (kind == project::Intervention::Kind::kCall || kind == project::Intervention::Kind::kBreakpoint) {
      out.push_back({Severity::kError, "verify.fault",
                     "a timeline cannot call services or break here; what a person may do is a choice of the model",
                     injection.span});
    }
  }
  return out;
}

Result<Graph> explore(const project::Plan& plan, const Options& options) { return Explorer(plan, options)(); }

}  // namespace sentree::verify
