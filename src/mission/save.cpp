// A whole run as octets, and back: magic word, version, plan, checksum, then its parts as one packed value.
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sentree/base/encoder.h"
#include "sentree/base/packed.h"
#include "sentree/mission/detail/members.h"
#include "sentree/mission/memory_elsewhere.h"
#include "sentree/scxml/encode.h"
#include "sentree/sim/simulation.h"

namespace sentree::mission {

namespace {

constexpr std::string_view kMagic = "SRUN";
// From 2 on a skill that was never asked for anything is null.
constexpr std::uint64_t kVersion = 4;
constexpr std::size_t kHeaderSize = 4 + 3 * 8;
/// Periods that a run may have missed in a row: more are no state of a run, and would be counted one by one.
constexpr std::int64_t kMissedMax = 1'000'000;
/// Later no run gets, and what is reckoned from here on does not overflow.
constexpr TimePoint kTimeMax{kNever.time_since_epoch() / 2};

tl::unexpected<Diagnostic> bad(const std::string& what) {
  return fail("mission.bad-state", "this is no saved run, or a damaged one: " + what);
}

struct Header {
  std::uint64_t version = 0;
  std::uint64_t plan = 0;
  std::uint64_t checksum = 0;
};

Result<Header> read_header(std::string_view saved) {
  if (saved.size() < kHeaderSize || !saved.starts_with(kMagic)) return bad("it does not begin as one");
  const auto word = [&](std::size_t index) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 8; ++i)
      value |= std::uint64_t{static_cast<unsigned char>(saved[kMagic.size() + 8 * index + i])} << (8 * i);
    return value;
  };
  const Header header{.version = word(0), .plan = word(1), .checksum = word(2)};
  if (header.version == 0 || header.version > kVersion) {
    return bad(fmt::format("it is of format {}, and this Sentree reads formats up to {}", header.version, kVersion));
  }
  if (header.checksum != hash_bytes(saved.substr(kHeaderSize))) return bad("its checksum is wrong");
  return header;
}

Result<Value> parts_of(std::string_view saved) {
  const auto header = read_header(saved);
  if (!header) return tl::unexpected(header.error());
  auto parts = unpack(saved.substr(kHeaderSize));
  if (!parts) return bad(parts.error().message);
  return parts;
}

// What the engines take for granted of a state; everything else that is well formed is harmless.
class Consistency {
 public:
  Consistency(const project::Plan& plan, const State& state) : plan_(plan), state_(state) {}

  [[nodiscard]] bool takes(const Delivery& delivery) const { return is_delivery(delivery); }
  [[nodiscard]] bool takes(std::size_t leaf, const SkillState& skill) const {
    return is_skill(plan_.leaves[leaf], skill);
  }
  [[nodiscard]] std::string broken() const {
    if (state_.now < TimePoint{} || state_.now > kTimeMax) return "its time is out of range";
    for (std::size_t i = 0; i < state_.skills.size(); ++i) {
      if (!is_skill(plan_.leaves[i], state_.skills[i])) return "a skill is in no phase of its chart";
    }
    for (const ModelState& model : state_.models) {
      if (model.open.size() > kOpenCallsMax) return "a model has too many open calls";
      for (const ModelState::OpenCall& open : model.open) {
        if (!is_caller(open.leaf) || !is_call(open.call)) return "an open call is none of this plan";
      }
    }
    for (const Waiting& waiting : state_.queue) {
      if (!is_delivery(waiting.what)) return "a delivery is for nobody of this plan";
      const auto* to_tree = std::get_if<TreeDelivery>(&waiting.what.what);
      if (to_tree != nullptr && std::holds_alternative<HaltLimit>(*to_tree) && !state_.tree.over)
        return "halts have a limit before they are asked for";
      if (waiting.when < TimePoint{}) return "a delivery's time is negative";
    }
    if (!is_tree()) return "the mission is in no phase of its tree";
    if (state_.faults.list().size() > Faults::kStandingMax) return "too many faults stand";
    return {};
  }

 private:
  [[nodiscard]] bool is_leaf(std::size_t leaf) const { return leaf < plan_.leaves.size(); }
  [[nodiscard]] bool is_caller(std::size_t leaf) const { return leaf == ServeCall::kOutside || is_leaf(leaf); }
  [[nodiscard]] bool is_call(const Shared<Call>& call) const {
    if (call.empty()) return false;
    const auto service = plan_.services.find(call->service);
    return service != plan_.services.end() && service->second.service->find(call->method) != nullptr;
  }
  [[nodiscard]] bool is_skill(const project::LeafPlan& leaf, const SkillState& skill) const {
    const bool lives_on = skill.phase == SkillPhase::kResting || skill.phase == SkillPhase::kReady || skill.asked;
    if ((lives_on && !leaf.protocol) || (skill.running() && !skill.session.running())) return false;
    const std::size_t transitions = leaf.chart ? leaf.chart->transitions().size() : 0;
    if (skill.latest.transition && *skill.latest.transition >= transitions) return false;
    if (skill.goals.size() > kGoalsMax || std::any_of(skill.goals.begin(), skill.goals.end(), [&](const auto& goal) {
          const auto service = plan_.services.find(goal.service);
          return service == plan_.services.end() || !is_action(*service->second.service);
        }))
      return false;
    const bool heard = std::all_of(skill.heard.begin(), skill.heard.end(), [&](const Shared<Publication>& each) {
      return !each.empty() && std::find(leaf.latest.begin(), leaf.latest.end(), each->topic) != leaf.latest.end();
    });
    if (!heard || skill.heard.size() > leaf.latest.size()) return false;
    return std::all_of(skill.lines.begin(), skill.lines.end(), [&](const SkillState::Line& line) {
      return line.waiting.size() <= kGatedCallsMax &&
             std::all_of(line.waiting.begin(), line.waiting.end(),
                         [&](const Shared<Call>& call) { return is_call(call) && call->service == line.service; });
    });
  }
  [[nodiscard]] bool is_tree() const {
    const TreeState& tree = state_.tree;
    const bool waits = tree.tree.waiting_leaf() != bt::kNoNode;
    const bool halts = !tree.tree.outstanding_halts().empty();
    const Duration period = plan_.scenario.project.period;
    const bool in_phase = [&] {
      switch (tree.phase) {
        case TreePhase::kBetween: return !tree.over && !waits;
        case TreePhase::kWaiting: return !tree.over && waits;
        case TreePhase::kHalting: return tree.over && halts;
        case TreePhase::kEnded: return true;
      }
      return false;
    }();
    return in_phase && (tree.deadline.leaf == 0 || is_leaf(tree.deadline.leaf)) && tree.began >= TimePoint{} &&
           tree.planned >= TimePoint{} && tree.planned <= kTimeMax &&
           std::all_of(tree.leaves.begin(), tree.leaves.end(),
                       [](const auto& leaf) { return leaf.second.asked >= TimePoint{}; }) &&
           (state_.now - tree.planned) / period <= kMissedMax;
  }
  [[nodiscard]] bool is_delivery(const Delivery& delivery) const {
    if (const auto* to_tree = std::get_if<TreeDelivery>(&delivery.what)) {
      return delivery.leaf == Delivery::kTree && std::visit(
                                                     [&](const auto& what) {
                                                       if constexpr (requires { what.leaf; })
                                                         return is_leaf(what.leaf);
                                                       else
                                                         return true;
                                                     },
                                                     *to_tree);
    }
    if (const auto* to_skill = std::get_if<SkillDelivery>(&delivery.what)) {
      return is_leaf(delivery.leaf) && std::visit(
                                           [&](const auto& what) {
                                             if constexpr (requires { what.call; })
                                               return is_call(what.call);
                                             else if constexpr (requires { what.what; })
                                               return !what.what.empty();
                                             else
                                               return true;
                                           },
                                           *to_skill);
    }
    const auto& to_model = std::get<ModelDelivery>(delivery.what);
    const auto* published = std::get_if<Published>(&to_model);
    if (published != nullptr && published->what.empty()) return false;
    const auto* serve = std::get_if<ServeCall>(&to_model);
    return delivery.leaf < plan_.models.size() &&
           (serve == nullptr || (is_caller(serve->leaf) && is_call(serve->call)));
  }

  const project::Plan& plan_;
  const State& state_;
};

// Saves members as the archive does, but with its chart what belongs to a session.
class SavingChart {
 public:
  SavingChart(std::optional<Diagnostic>& problem, const scxml::Chart* chart) : problem_(problem), chart_(chart) {}

  template <class Of>
  Value save(const Of& of) {
    visit_members(of, *this);
    return Value(std::move(saver_.map));
  }

  void operator()(std::string_view name, const auto& member) { saver_(name, member); }
  void operator()(std::string_view name, const scxml::Session& session) {
    put(name, checked(scxml::save(*chart_, session)));
  }

 protected:
  void put(std::string_view name, Value value) { saver_.map.append(std::string(name), std::move(value)); }
  template <class Saved>
  Saved checked(Result<Saved> saved) {
    if (saved) return std::move(*saved);
    if (!problem_) problem_ = saved.error();
    return {};
  }

  std::optional<Diagnostic>& problem_;
  const scxml::Chart* chart_;  // of the session
  archive::Saver saver_;
};

// With the plan, what belongs to its charts, its tree and its world.
class Saving : public SavingChart {
 public:
  Saving(const project::Plan& plan, std::optional<Diagnostic>& problem) : SavingChart(problem, nullptr), plan_(plan) {}

  template <class Of>
  Value save(const Of& of) {
    visit_members(of, *this);
    return Value(std::move(saver_.map));
  }

  using SavingChart::operator();
  void operator()(std::string_view name, const TreeState& tree) { put(name, Saving(plan_, problem_).save(tree)); }
  // All of the plan, also those at rest.
  void operator()(std::string_view name, const std::map<std::size_t, TreeState::Leaf>& leaves) {
    std::vector<TreeState::Leaf> all(plan_.leaves.size());
    for (const auto& [index, leaf] : leaves) all.at(index) = leaf;
    saver_(name, all);
  }
  void operator()(std::string_view name, const bt::State& tree) {
    auto saved = checked(bt::save(plan_.tree, tree));
    const auto* octets = reinterpret_cast<const std::byte*>(saved.data());
    put(name, Bytes{{octets, octets + saved.size()}});
  }
  void operator()(std::string_view name, const std::vector<SkillState>& skills) {
    List list;
    for (std::size_t i = 0; i < skills.size(); ++i) {
      // Of thousands of skills most have never been asked for anything.
      const bool is_new = skills[i] == SkillState{};
      list.push_back(is_new ? Value() : SavingChart(problem_, &*plan_.leaves[i].chart).save(skills[i]));
    }
    put(name, std::move(list));
  }
  void operator()(std::string_view name, const std::vector<ModelState>& models) {
    List list;
    for (std::size_t i = 0; i < models.size(); ++i)
      list.push_back(SavingChart(problem_, &plan_.models[i].chart).save(models[i]));
    put(name, std::move(list));
  }
  void operator()(std::string_view name, const std::optional<sim::State>& world) {
    put(name, world ? sim::save(*world) : Value());
  }
  void operator()(std::string_view name, const monitor::MonitorSet::Memory& monitors) {
    put(name, checked(monitor::save(plan_.monitors, monitors)));
  }

 private:
  const project::Plan& plan_;
};

// The other way round.
class RestoringChart {
 public:
  RestoringChart(const Value& saved, std::string path, std::string& problem, const scxml::Chart* chart)
      : members_{&saved, std::move(path), &problem}, chart_(chart) {}

  void operator()(std::string_view name, auto& member) { members_(name, member); }
  void operator()(std::string_view name, scxml::Session& session) {
    if (const Value* const saved = find(name)) take(scxml::restore(*chart_, *saved), session);
  }

 protected:
  void problem(std::string what) {
    if (members_.problem->empty()) *members_.problem = std::move(what);
  }
  // Null: there is none, or something else was wrong before.
  const Value* find(std::string_view name) {
    if (!members_.problem->empty()) return nullptr;
    const Value* const value = members_.from->find(name);
    if (value == nullptr) problem(fmt::format("{} is missing", name));
    return value;
  }
  template <class Restored, class To>
  void take(Result<Restored> restored, To& to) {
    if (restored)
      to = std::move(*restored);
    else
      problem(restored.error().message);
  }

  archive::Restorer members_;
  const scxml::Chart* chart_;
};

// What is wrong with it is told in `problem`.
void restore_skill(Value saved, const scxml::Chart& chart, std::string& problem, SkillState& skill) {
  // Skills have had goals since format 3, and have heard topics later.
  for (const char* later : {"goals", "heard"}) {
    if (saved.as_map() != nullptr && saved.find(later) == nullptr) (*saved.as_map())[later] = List();
  }
  visit_members(skill, RestoringChart(saved, "", problem, &chart));
}

class Restoring : public RestoringChart {
 public:
  Restoring(const project::Plan& plan, const Value& saved, std::string path, std::string& problem)
      : RestoringChart(saved, std::move(path), problem, nullptr), plan_(plan) {}

  using RestoringChart::operator();
  void operator()(std::string_view name, TreeState& tree) {
    const Value* const saved = find(name);
    if (saved == nullptr) return;
    visit_members(tree, Restoring(plan_, *saved, std::string(name), *members_.problem));
  }
  void operator()(std::string_view name, std::map<std::size_t, TreeState::Leaf>& leaves) {
    std::vector<TreeState::Leaf> all;
    members_(name, all);
    if (all.size() != plan_.leaves.size()) return problem("it has another number of leaves");
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!all[i].at_rest()) leaves[i] = std::move(all[i]);
    }
  }
  void operator()(std::string_view name, bt::State& tree) {
    const Value* const saved = find(name);
    const Bytes* const bytes = saved != nullptr ? saved->as_bytes() : nullptr;
    if (bytes == nullptr) return problem("the tree is missing");
    const auto& raw = bytes->octets;
    take(bt::restore(plan_.tree, {reinterpret_cast<const char*>(raw.data()), raw.size()}), tree);
  }
  void operator()(std::string_view name, std::vector<SkillState>& skills) {
    const List* const list = list_of(name, plan_.leaves.size());
    if (list == nullptr) return;
    skills.resize(list->size());
    for (std::size_t i = 0; i < list->size(); ++i) {
      if (!plan_.leaves[i].chart) return problem("a leaf has no chart in this plan");
      if ((*list)[i].is_null()) continue;
      restore_skill((*list)[i], *plan_.leaves[i].chart, *members_.problem, skills[i]);
    }
  }
  void operator()(std::string_view name, std::vector<ModelState>& models) {
    const List* const list = list_of(name, plan_.models.size());
    if (list == nullptr) return;
    models.resize(list->size());
    for (std::size_t i = 0; i < list->size(); ++i)
      visit_members(models[i], RestoringChart((*list)[i], "", *members_.problem, &plan_.models[i].chart));
  }
  void operator()(std::string_view name, std::optional<sim::State>& world) {
    const Value* const saved = find(name);
    if (saved == nullptr || saved->is_null()) return;
    if (plan_.world == nullptr) return problem("this plan has no world");
    take(sim::restore(*plan_.world, *saved), world);
  }
  void operator()(std::string_view name, monitor::MonitorSet::Memory& monitors) {
    if (const Value* const saved = find(name)) take(monitor::restore(plan_.monitors, *saved), monitors);
  }

 private:
  const List* list_of(std::string_view name, std::size_t size) {
    const Value* const value = find(name);
    const List* const list = value != nullptr ? value->as_list() : nullptr;
    if (list != nullptr && list->size() == size) return list;
    problem("it has other parts than this plan");
    return nullptr;
  }

  const project::Plan& plan_;
};

}  // namespace

Result<std::string> save(const project::Plan& plan, const State& state) {
  std::optional<Diagnostic> problem;
  const Value members = Saving(plan, problem).save(state);
  if (problem) return fail("mission.unsavable", "the run cannot be saved: " + problem->message, problem->span);

  const std::string packed = pack(members);
  std::string saved(kMagic);
  Encoder header(saved);
  header.word(kVersion);
  header.word(plan.identity);
  header.word(hash_bytes(packed));
  return saved + packed;
}

Result<State> restore(const project::Plan& plan, std::string_view saved) {
  const auto header = read_header(saved);
  if (!header) return tl::unexpected(header.error());
  if (header->plan != plan.identity) {
    return fail("mission.other-plan",
                "the run was saved with other files, another seed or another speed than this plan has");
  }
  const auto parts = parts_of(saved);
  if (!parts) return tl::unexpected(parts.error());
  State state;
  std::string problem;
  visit_members(state, Restoring(plan, *parts, "", problem));
  if (!problem.empty()) return bad(problem);
  if (const std::string broken = Consistency(plan, state).broken(); !broken.empty()) return bad(broken);
  return state;
}

namespace {

// A timer, of which nobody tells the other parts anything until it rings.
bool is_timer(const Delivery& delivery) {
  return std::visit(
      [](const auto& to) {
        return std::visit(
            [](const auto& what) {
              using What = std::decay_t<decltype(what)>;
              return std::is_same_v<What, Period> || std::is_same_v<What, TreeTimer> ||
                     std::is_same_v<What, AnswerDue> || std::is_same_v<What, HaltLimit> ||
                     std::is_same_v<What, SkillTimer> || std::is_same_v<What, ModelTimer>;
            },
            to);
      },
      delivery.what);
}

bool owes_nothing(const SkillState& skill) {
  return skill.phase != SkillPhase::kOwing && skill.phase != SkillPhase::kHalting && !skill.asked &&
         std::all_of(skill.lines.begin(), skill.lines.end(),
                     [](const SkillState::Line& line) { return line.waiting.empty(); });
}

}  // namespace

bool is_at_rest(const State& state) {
  return state.tree.leaves.empty() && state.tree.phase == TreePhase::kBetween &&
         std::all_of(state.skills.begin(), state.skills.end(), owes_nothing) &&
         std::all_of(state.queue.begin(), state.queue.end(),
                     [](const Waiting& waiting) { return is_timer(waiting.what); });
}

void forget_history(State& state, std::size_t kept) {
  for (monitor::State& monitor : state.monitors.states) monitor.trail.forget_all_but(kept);
}

Value save(const Delivery& delivery) { return archive::save(delivery); }

Result<Delivery> restore_delivery(const project::Plan& plan, const Value& saved) {
  Delivery delivery;
  if (const std::string problem = archive::restore(saved, delivery); !problem.empty()) return bad(problem);
  const State none;
  if (!Consistency(plan, none).takes(delivery)) return bad("a delivery is for nobody of this plan");
  return delivery;
}

Value save(const project::Intervention& what) { return archive::save(project::SavedIntervention{what}); }

Result<project::Intervention> restore_intervention(const Value& saved) {
  project::SavedIntervention what;
  if (const std::string problem = archive::restore(saved, what); !problem.empty()) return bad(problem);
  return std::move(what.what);
}

namespace {

constexpr std::string_view kMemoryMagic = "SMEM1";

std::string told_memory(Value part, TimePoint now) {
  const std::string packed = pack(Map{{"now", now.time_since_epoch().count()}, {"part", std::move(part)}});
  if (packed.size() > kMemoryMax) return {};
  std::string told(kMemoryMagic);
  Encoder(told).word(hash_bytes(packed));
  return told + packed;
}

struct Told {
  Value part;
  Duration later{};  // than on the clock of who told it
};

Result<Told> read_memory(std::string_view memory, TimePoint now) {
  const std::size_t header = kMemoryMagic.size() + 8;
  if (memory.size() < header || memory.size() > kMemoryMax + header || !memory.starts_with(kMemoryMagic))
    return bad("it does not begin as one");
  const std::string_view packed = memory.substr(header);
  std::string checked(kMemoryMagic);
  Encoder(checked).word(hash_bytes(packed));
  if (!memory.starts_with(checked)) return bad("its checksum is wrong");
  auto told = unpack(packed);
  if (!told) return bad(told.error().message);
  const Value* const part = told->find("part");
  const Value* const then = told->find("now");
  const std::int64_t* const ns = then != nullptr ? then->as_int() : nullptr;
  if (part == nullptr || ns == nullptr || *ns < 0 || *ns > kTimeMax.time_since_epoch().count())
    return bad("its time is out of range");
  return Told{*part, now - TimePoint(Duration(*ns))};
}

// No time that a part gives is so early that it comes to lie before the run, nor so late that reckoning overflows.
bool put_off(TimePoint& time, Duration by) {
  if (time == kNever || time == TimePoint{}) return true;
  if (time < TimePoint{} || time > kTimeMax) return false;
  time = std::max(TimePoint(Duration(1)), time + by);
  return true;
}

}  // namespace

std::string remember(const scxml::Chart& chart, const SkillState& skill, TimePoint now) {
  std::optional<Diagnostic> problem;
  Value saved = skill == SkillState{} ? Value() : SavingChart(problem, &chart).save(skill);
  return problem ? std::string() : told_memory(std::move(saved), now);
}

std::string remember(const sim::State& world, TimePoint now) { return told_memory(sim::save(world), now); }

Result<void> recall_skill(const project::Plan& plan, std::size_t leaf, std::string_view memory, TimePoint now,
                          State& state) {
  auto told = read_memory(memory, now);
  if (!told) return tl::unexpected(told.error());
  SkillState skill;
  std::string problem;
  if (!told->part.is_null()) restore_skill(std::move(told->part), *plan.leaves[leaf].chart, problem, skill);
  if (!problem.empty()) return bad(problem);
  if (!Consistency(plan, state).takes(leaf, skill)) return bad("the skill is in no phase of its chart");
  bool in_range = put_off(skill.wake, told->later) && put_off(skill.not_before, told->later) &&
                  put_off(skill.topics_not_before, told->later) &&
                  (!skill.halt_due || put_off(*skill.halt_due, told->later));
  for (SkillState::Line& line : skill.lines) in_range = in_range && put_off(line.not_before, told->later);
  if (!in_range) return bad("a time of the skill is out of range");
  scxml::postpone(skill.session, told->later);
  if (skill.wake != kNever) {
    Waiting timer{skill.wake, Rank::kTimer, state.order++, {leaf, SkillDelivery(SkillTimer{skill.wake})}};
    const auto behind = std::find_if(state.queue.begin(), state.queue.end(), [&](const Waiting& each) {
      return std::tie(each.when, each.rank) > std::tie(timer.when, timer.rank);
    });
    state.queue.insert(behind, std::move(timer));
  }
  state.skills.at(leaf) = std::move(skill);
  return {};
}

Result<void> recall_world(const project::Plan& plan, std::string_view memory, TimePoint now, State& state) {
  const auto told = read_memory(memory, now);
  if (!told) return tl::unexpected(told.error());
  auto world = sim::restore(*plan.world, told->part);
  if (!world) return bad(world.error().message);
  sim::follow(*world, now);
  state.world = std::move(*world);
  return {};
}

Result<Value> saved_world(std::string_view saved) {
  auto parts = parts_of(saved);
  if (!parts) return parts;
  const Value* world = parts->find("world");
  if (world == nullptr) return bad("it has no world");
  return *world;
}

}  // namespace sentree::mission
