// What monitors remember as data, and back.
#include <algorithm>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "sentree/base/message_archive.h"
#include "sentree/monitor/detail/model.h"
#include "sentree/monitor/monitor_set.h"

namespace sentree::monitor {

constexpr Verdict last_enumerator(Verdict) { return Verdict::kSatisfied; }

/// All but sessions, which belong to charts, and observations, which are shared.
struct MemoryMembers {
  template <class S, class V>
  static void visit(S& s, V&& visit) {
    visit("last", s.last);
    visit("verdict", s.verdict);
    visit("since", s.since);
    visit("beginning", s.trail.beginning);
    visit("violations", s.trail.violations);
    visit("history_complete", s.trail.history_complete);
    visit("reduce_at", s.trail.reduce_at);
    visit("seen", s.trail.seen);
    visit("started", s.trail.started);
  }
  template <class S, class V>
  requires archive::MaybeConst<S, LeafTracker>
  static void visit_leaves(S& s, V&& visit) {
    visit("ticked", s.ticked_);
    auto running = s.running();
    visit("running", running);
    if constexpr (!std::is_const_v<S>) {
      s.latest_.clear();
      s.running_.clear();
      for (std::string& leaf : running) s.note_running(std::move(leaf));
    }
  }
};

namespace {

constexpr std::int64_t kNone = -1;

// Each observation once, in the order of first mention. Which of them are the same matters: a trail is reduced by it.
class Pool {
 public:
  Value number(const Observation& observation) {
    if (!observation) return kNone;
    const auto [known, is_new] = numbers_.try_emplace(observation.get(), static_cast<std::int64_t>(messages_.size()));
    if (is_new) messages_.push_back(archive::save(*observation));
    return known->second;
  }
  Value numbers(const std::vector<Observation>& observations) {
    List list;
    list.reserve(observations.size());
    for (const Observation& observation : observations) list.push_back(number(observation));
    return list;
  }
  List take() { return std::move(messages_); }

 private:
  std::unordered_map<const Message*, std::int64_t> numbers_;
  List messages_;
};

using Observations = CopyOnWrite<std::vector<Observation>>;

bool are_same(const Observations& a, const Observations& b) {
  return std::equal(a->begin(), a->end(), b->begin(), b->end(),
                    [](const Observation& x, const Observation& y) { return x == y || (x && y && *x == *y); });
}

tl::unexpected<Diagnostic> bad(const std::string& what) {
  return fail("monitor.bad-state", "this is no saved state of these monitors: " + what);
}

bool take_numbers(const Value* saved, const std::vector<Observation>& pool, bool may_lack,
                  std::vector<Observation>& out) {
  const List* list = saved != nullptr ? saved->as_list() : nullptr;
  if (list == nullptr) return false;
  for (const Value& item : *list) {
    const std::int64_t* number = item.as_int();
    if (number == nullptr) return false;
    if (*number == kNone && may_lack)
      out.emplace_back();
    else if (*number >= 0 && static_cast<std::uint64_t>(*number) < pool.size())
      out.push_back(pool[static_cast<std::size_t>(*number)]);
    else
      return false;
  }
  return true;
}

Result<State> restore_state(const Model& model, const Value& saved, const std::vector<Observation>& pool) {
  const Model::Parts& parts = Access::parts(model);
  const Value* session = saved.find("session");
  const Value* renaming = saved.find("renaming");
  if (session == nullptr || renaming == nullptr || session->is_null() ||
      renaming->is_null() == parts.renaming.has_value())
    return bad("its sessions are missing");
  State state;
  std::string problem;
  MemoryMembers::visit(state, archive::Restorer{&saved, {}, &problem});
  if (!problem.empty()) return bad(problem);
  auto own = scxml::restore(model.chart(), *session);
  if (!own) return tl::unexpected(own.error());
  state.session = std::move(*own);
  if (parts.renaming) {
    auto renames = scxml::restore(*parts.renaming, *renaming);
    if (!renames) return tl::unexpected(renames.error());
    state.renaming = std::move(*renames);
  }
  Trail& trail = state.trail;
  const Value* test = saved.find("test");
  if (test != nullptr && !test->is_null()) {
    if (model.test() == nullptr) return bad("it has a test");
    auto session = scxml::restore(model.test()->chart(), *test);
    if (!session) return tl::unexpected(session.error());
    trail.test.emplace().session = std::move(*session);
  } else if (test == nullptr && model.test() != nullptr) {
    trail.test = begin(*model.test(), trail.started);  // of a format without it
  }
  const std::size_t states = model.chart().states().size();
  if (!take_numbers(saved.find("history"), pool, false, trail.history.edit()) ||
      !take_numbers(saved.find("entered_by"), pool, true, trail.entered_by.edit()))
    return bad("its observations are not there");
  if (state.last.size() != parts.lasts || trail.entered_by->size() != states || trail.history->size() > kHistoryMax ||
      trail.reduce_at < kReduceMin || trail.beginning.words() != scxml::StateSet(states).words())
    return bad("it is of another size");
  return state;
}

}  // namespace

bool operator==(const Trail& a, const Trail& b) {
  return a.beginning == b.beginning && a.violations == b.violations && a.history_complete == b.history_complete &&
         a.reduce_at == b.reduce_at && a.seen == b.seen && a.started == b.started && are_same(a.history, b.history) &&
         a.test == b.test && are_same(a.entered_by, b.entered_by);
}

Result<Value> save(std::span<const Model> models, const MonitorSet::Memory& memory) {
  Pool pool;
  List states;
  for (std::size_t i = 0; i < memory.states.size(); ++i) {
    const State& state = memory.states[i];
    const Model::Parts& parts = Access::parts(models[i]);
    auto session = scxml::save(parts.spec.chart, state.session);
    if (!session) return session;
    auto renaming = parts.renaming ? scxml::save(*parts.renaming, state.renaming) : Result<Value>(Value());
    if (!renaming) return renaming;
    auto test =
        state.trail.test ? scxml::save(models[i].test()->chart(), state.trail.test->session) : Result<Value>(Value());
    if (!test) return test;
    archive::Saver saver;
    MemoryMembers::visit(state, saver);
    saver.map.append("test", std::move(*test));
    saver.map.append("session", std::move(*session));
    saver.map.append("renaming", std::move(*renaming));
    saver.map.append("history", pool.numbers(*state.trail.history));
    saver.map.append("entered_by", pool.numbers(*state.trail.entered_by));
    states.emplace_back(std::move(saver.map));
  }
  archive::Saver leaves;
  MemoryMembers::visit_leaves(memory.leaves, leaves);
  return Value(Map{{"observations", pool.take()}, {"states", std::move(states)}, {"leaves", std::move(leaves.map)}});
}

Result<MonitorSet::Memory> restore(std::span<const Model> models, const Value& saved) {
  const Value* observations = saved.find("observations");
  const Value* states = saved.find("states");
  const Value* leaves = saved.find("leaves");
  if (observations == nullptr || observations->as_list() == nullptr || states == nullptr ||
      states->as_list() == nullptr || states->as_list()->size() != models.size() || leaves == nullptr)
    return bad("it has other members");
  std::vector<Observation> pool;
  for (const Value& item : *observations->as_list()) {
    Message message;
    if (const std::string problem = archive::restore(item, message); !problem.empty())
      return bad("an observation's " + problem);
    pool.push_back(std::make_shared<const Message>(std::move(message)));
  }
  MonitorSet::Memory memory;
  for (std::size_t i = 0; i < models.size(); ++i) {
    auto state = restore_state(models[i], (*states->as_list())[i], pool);
    if (!state) return tl::unexpected(state.error());
    memory.states.push_back(std::move(*state));
  }
  std::string problem;
  MemoryMembers::visit_leaves(memory.leaves, archive::Restorer{leaves, {}, &problem});
  if (!problem.empty()) return bad(problem);
  return memory;
}

}  // namespace sentree::monitor
