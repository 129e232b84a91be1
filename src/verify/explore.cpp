#include "sentree/verify/explore.h"

#include <algorithm>
#include <cstring>
#include <deque>
#include <span>
#include <utility>

#include "sentree/mission/encode.h"
#include "sentree/project/intervention.h"

namespace sentree::verify {

namespace {

using mission::State;
using SteadyClock = std::chrono::steady_clock;

// 128 bits of hash for a state: with n states the chance that two of them are confused is below n²/2¹²⁹.
struct Key {
  std::uint64_t a = 0;
  std::uint64_t b = 0;
  friend bool operator==(const Key&, const Key&) = default;
};
struct KeyHash {
  std::size_t operator()(const Key& key) const { return static_cast<std::size_t>(key.a); }
};

std::uint64_t hash_with(std::string_view bytes, std::uint64_t seed) {
  // Two multiplications a word, finished as SplitMix64 does.
  std::uint64_t h = seed ^ (bytes.size() * 0x9E3779B97F4A7C15ULL);
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    h = (h ^ word) * 0xBF58476D1CE4E5B9ULL;
    h ^= h >> 29U;
  }
  std::uint64_t rest = 0;
  if (i < bytes.size()) std::memcpy(&rest, bytes.data() + i, bytes.size() - i);
  h = (h ^ rest) * 0x94D049BB133111EBULL;
  h ^= h >> 32U;
  h *= 0xBF58476D1CE4E5B9ULL;
  return h ^ (h >> 31U);
}

Key key_of(std::string_view bytes) {
  return {hash_with(bytes, 0x243F6A8885A308D3ULL), hash_with(bytes, 0x13198A2E03707344ULL)};
}

class Explorer final : public mission::Surroundings {
 public:
  Explorer(const project::Plan& plan, const Options& options)
      : plan_(plan), options_(options), host_(plan), dispatch_(plan.monitors) {
    graph_.period = plan.scenario.project.period;
    for (const project::LeafPlan& leaf : plan.leaves) {
      graph_.taken.emplace_back(leaf.chart->transitions().size());
      graph_.statuses.emplace_back(3);
      leaf_of_.emplace(leaf.name + ".tick.reply", graph_.statuses.size() - 1);
      graph_.parts.push_back(leaf.name);
    }
    if (options.memory_of_steps) host_.remember_steps();
    for (const project::ModelPlan& model : plan.models) graph_.parts.push_back(model.name);
    graph_.parts.emplace_back("mission");
  }

  Result<Graph> operator()() {
    State begin = host_.begin();
    std::string form;
    if (auto encoded = mission::encode(host_, begin, form); !encoded) return tl::unexpected(encoded.error());
    add(key_of(form), std::move(begin), 0);
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
      states_.pop_front();
      if (options_.progress && at % 1024 == 0) options_.progress(graph_.nodes.size(), graph_.edges.size());
    }
    graph_.complete = graph_.limit.empty();
    return std::move(graph_);
  }

 private:
  // A state that has ended is not kept: nothing follows.
  void add(Key key, State&& state, std::uint32_t depth) {
    known_.emplace(key, static_cast<std::uint32_t>(graph_.nodes.size()));
    const bool ended = mission::VirtualHost::ended(state);
    graph_.nodes.push_back({.depth = depth, .at = state.now, .ended = ended, .first_edge = 0, .edges = 0});
    if (!ended) states_.push_back(std::move(state));
  }

  [[nodiscard]] std::size_t memory() const {
    constexpr std::size_t kOfAState = 4'000;  // that waits to be gone on from
    return graph_.nodes.size() * (sizeof(Graph::Node) + sizeof(Key) + 24) + graph_.edges.size() * sizeof(Edge) +
           states_.size() * kOfAState + kept_bytes_;
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
    const State& from = states_.front();
    const std::uint32_t depth = graph_.nodes[at].depth;
    script_.clear();
    for (std::size_t ways = 0;; ++ways) {
      if (ways >= kWaysMax) {
        return fail("verify.choice", "tick " + std::to_string(depth + 1) + " can go on in more than " +
                                         std::to_string(kWaysMax) + " ways; leave less open at one instant");
      }
      if (ways % 64 == 63) graph_.limit = limit_now();
      if (!graph_.limit.empty()) return {};
      State state = from;
      made_.clear();
      seen_.clear();
      error_.reset();
      begin_ = from.now;
      const auto delivered = period(host_, state, *this, [&] { return fault(state); });
      if (!delivered) return tl::unexpected(delivered.error());
      if (error_) return tl::unexpected(*error_);
      mission::prune(state);
      form_.clear();
      if (auto encoded = mission::encode(host_, state, form_); !encoded) return tl::unexpected(encoded.error());
      encode_timeline(state);
      const Key key = key_of(form_);
      const auto known = known_.find(key);
      const std::uint32_t to = known != known_.end() ? known->second : static_cast<std::uint32_t>(graph_.nodes.size());
      if (known == known_.end()) add(key, std::move(state), depth + 1);
      graph_.edges.push_back({static_cast<std::uint32_t>(at), to, keep_seen(), keep_made()});
      // The next: the last decision that has an alternative left takes it.
      while (!made_.empty() && made_.back().alternative + 1 >= made_.back().count) made_.pop_back();
      if (made_.empty()) return {};
      script_.clear();
      for (const Made& made : made_) script_.push_back(made.alternative);
      ++script_.back();
    }
  }

  void encode_timeline(const State& state) {
    for (const project::Injection& injection : plan_.scenario.timeline) {
      if (injection.at > state.now) form_ += std::to_string((injection.at - state.now).count()) + ";";
    }
  }

  // Before the tick of a period: what the timeline does then, and a fault that comes or goes.
  Result<void> fault(State& state) {
    if (options_.faults.empty()) return {};
    struct Possible {
      project::Intervention what;
      ChoicePoint point;
    };
    const auto standing = state.faults.list();
    std::vector<Possible> possible;
    std::size_t stand = 0;
    using Kind = project::Intervention::Kind;
    for (const project::Intervention& fault : options_.faults) {
      const auto found = std::find_if(standing.begin(), standing.end(), [&](const auto& s) { return s.what == fault; });
      const bool kills = fault.kind == Kind::kKill;
      if (kills ? !is_down(state, fault.target) : found == standing.end()) continue;
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
      if (stands || (fault.kind == Kind::kKill && is_down(state, fault.target))) continue;
      possible.push_back({fault, {"", "fault", describe(fault), to_json(Value(to_entry(fault)))}});
    }
    if (possible.empty()) return {};
    graph_.nondeterministic = true;
    const std::uint32_t taken = decide(Made::Kind::kFault, possible.size() + 1, 0, -1);
    if (taken == 0) return {};
    made_.back().what = intern_choice(std::move(possible[taken - 1].point));
    return host_.inject(state, possible[taken - 1].what, *this);
  }

  bool is_down(const State& state, const std::string& part) const {
    if (state.down.contains(part)) return true;
    for (std::size_t leaf = 0; leaf < plan_.leaves.size(); ++leaf) {
      if (plan_.leaves[leaf].name == part) return state.skills[leaf].phase == mission::SkillPhase::kKilled;
    }
    return false;
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

  // ---- Surroundings

  void observed(const Message& message) override {
    if (const auto leaf = leaf_of_.find(message.name); leaf != leaf_of_.end() && message.kind == MessageKind::kReply) {
      const std::string_view status = message.data.find("status")->text();
      graph_.statuses[leaf->second][status == "RUNNING" ? 0 : status == "SUCCESS" ? 1 : 2] = true;
    }
    const auto& targets = dispatch_.route(message.name).of(message.source);
    if (targets.monitors.empty()) return;
    // Only what somebody looks at: numbers and times would make each period another one.
    Value looked_at = targets.projection.data(message);
    Seen seen{message.time - begin_, {}};
    seen.message.kind = message.kind;
    seen.message.source = message.source;
    seen.message.target = message.target;
    seen.message.name = message.name;
    Map data;
    if (Map* members = looked_at.as_map()) {
      for (auto& [name, value] : *members) {
        if (name == "time" || name == "tick" || name == "call") {
          refuse_clock(message, name);
          return;
        }
        if (name != "source" && name != "target") data.append(name, std::move(value));
      }
    }
    seen.message.data = std::move(data);
    seen_.push_back(std::move(seen));
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

  std::optional<std::uint64_t> choose(const mission::Choice& choice) override {
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
    const std::uint32_t alternative = decide(Made::Kind::kChoice, choice.count, 0, -1);
    const std::string value = to_json(choice.alternative(alternative));
    made_.back().what = intern_choice({choice.model, choice.function, choice.name, value});
    if (is_drawn) made_.back().probability = choice.probability(alternative);
    if (!choice.name.empty()) {
      auto& taken = graph_.values[choice.model + "." + choice.name];
      taken.insert(value);
    }
    return alternative;
  }

  // Leaves, then models, then the mission, as `Graph::parts` has them.
  std::uint32_t part(const mission::Delivery& delivery) const {
    if (std::holds_alternative<mission::TreeDelivery>(delivery.what))
      return static_cast<std::uint32_t>(graph_.parts.size() - 1);
    const bool is_model = std::holds_alternative<mission::ModelDelivery>(delivery.what);
    return static_cast<std::uint32_t>(is_model ? plan_.leaves.size() + delivery.leaf : delivery.leaf);
  }

  std::size_t order(std::uint64_t, std::span<const mission::Delivery* const> due) override {
    if (options_.order == Order::kVirtual) return 0;
    graph_.nondeterministic = true;
    const std::uint32_t which = decide(Made::Kind::kOrder, due.size(), 0, -1);
    made_.back().what = part(*due[which]);
    return which;
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

  std::uint32_t keep_seen() {
    std::string key;
    for (const Seen& seen : seen_) {
      key += std::to_string(seen.after.count()) + '|' + std::to_string(static_cast<int>(seen.message.kind)) + '|' +
             seen.message.source + '|' + seen.message.target + '|' + seen.message.name + '|' +
             to_json(seen.message.data) + '\n';
    }
    const auto [found, is_new] =
        sequence_of_.emplace(std::move(key), static_cast<std::uint32_t>(graph_.sequences.size()));
    if (is_new) {
      kept_bytes_ += found->first.size() * 4;
      graph_.sequences.push_back(seen_);
    }
    return found->second;
  }

  std::uint32_t keep_made() {
    std::string key;
    for (const Made& made : made_) {
      key += std::to_string(static_cast<int>(made.kind)) + ':' + std::to_string(made.alternative) + ':' +
             std::to_string(made.count) + ':' + std::to_string(made.what) + ';';
    }
    const auto [found, is_new] =
        decisions_of_.emplace(std::move(key), static_cast<std::uint32_t>(graph_.decisions.size()));
    if (is_new) {
      kept_bytes_ += found->first.size() * 3;
      graph_.decisions.push_back(made_);
    }
    return found->second;
  }

  const project::Plan& plan_;
  const Options& options_;
  mission::VirtualHost host_;
  monitor::Dispatch dispatch_;
  Graph graph_;
  std::deque<State> states_;  // of the nodes that wait to be gone on from
  std::unordered_map<Key, std::uint32_t, KeyHash> known_;
  std::unordered_map<std::string, std::uint32_t> sequence_of_;
  std::unordered_map<std::string, std::uint32_t> decisions_of_;
  std::unordered_map<std::string, std::uint32_t> choice_of_;
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
  std::string form_;
};

}  // namespace

Result<std::size_t> period(mission::VirtualHost& host, State& state, mission::Surroundings& surroundings,
                           const std::function<Result<void>()>& before_tick) {
  const bool ticks = !state.tree.over;
  const TimePoint until = ticks ? state.tree.planned : state.now + host.plan().scenario.project.period;
  const auto& timeline = host.plan().scenario.timeline;
  auto injection = std::find_if(timeline.begin(), timeline.end(), [&](const project::Injection& i) {
    return i.at > state.now || (!state.begun && i.at == state.now);
  });
  state.begun = true;
  bool asked = !ticks;
  std::size_t delivered = 0;
  while (!mission::VirtualHost::ended(state)) {
    const TimePoint next = mission::VirtualHost::next(state);
    if (injection != timeline.end() && injection->at <= until && injection->at <= next) {
      state.now = std::max(state.now, injection->at);
      if (auto done = host.inject(state, injection->what, surroundings); !done) return tl::unexpected(done.error());
      ++injection;
      continue;
    }
    if (!asked && next >= until) {
      asked = true;
      state.now = std::max(state.now, until);
      if (auto done = before_tick(); !done) return tl::unexpected(done.error());
      continue;
    }
    if (next == kNever || next > until) break;
    if (++delivered > kDeliveriesMax) {
      return fail("verify.endless", "more than " + std::to_string(kDeliveriesMax) +
                                        " messages without a tick; two parts answer each other for ever");
    }
    host.step(state, surroundings);
  }
  if (!ticks && !mission::VirtualHost::ended(state)) state.now = until;
  return delivered;
}

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
