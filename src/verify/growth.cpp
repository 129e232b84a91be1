#include "sentree/verify/detail/growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/bt/state.h"

namespace sentree::verify {

namespace {

enum class Kind : std::uint8_t { kDatum, kEntry, kSends, kDelay, kFresh };
constexpr std::array<const char*, 5> kWaysOut{
    "count no further than anybody tells apart (n % 8), or leave out what nobody reads",
    "count no further than the tree tells apart, or unset what it does not read any more",
    "<cancel> a delayed <send> that is not wanted any more, or send none while one is on its way",
    "a shorter delay, or a lower rate of the mission, has fewer periods",
    "give numbers out again (n % 4) as soon as nobody holds them",
};

class Varied {
 public:
  explicit Varied(const project::Plan& plan) : plan_(plan) {}

  void see(std::size_t part, mission::PartView state, std::optional<Duration> wake) {
    if (const auto* const tree = std::get_if<const mission::TreeState*>(&state)) {
      for (const bt::EntryFact& entry : bt::blackboard(plan_.tree, (*tree)->tree)) {
        const std::string scope = entry.scope.empty() ? "" : entry.scope + ".";
        add(Kind::kEntry, fmt::format("the blackboard's {}{}", scope, entry.name), to_json(*entry.value));
      }
      return;
    }
    const bool is_leaf = part < plan_.leaves.size();
    const std::string& name = is_leaf ? plan_.leaves[part].name : plan_.models[part - plan_.leaves.size()].name;
    const scxml::Chart& chart = is_leaf ? *plan_.leaves[part].chart : plan_.models[part - plan_.leaves.size()].chart;
    const bool is_model = std::holds_alternative<const mission::ModelState*>(state);
    const mission::ModelState* const model = is_model ? std::get<const mission::ModelState*>(state) : nullptr;
    const scxml::Session& session = is_model ? model->session : std::get<const mission::SkillState*>(state)->session;
    if (session.status() == scxml::SessionStatus::kNew) return;
    session.visit_data(chart, [&](const std::string& datum, const Value& value) {
      add(Kind::kDatum, fmt::format("{}.{}", name, datum), to_json(value));
    });
    add(Kind::kSends, "the number of delayed <send>s of " + name, std::to_string(session.timers().size()));
    if (wake) add(Kind::kDelay, "what is left of a delay of " + name, std::to_string(wake->count()));
    if (model != nullptr) add(Kind::kFresh, "fresh() of " + name, std::to_string(model->fresh));
  }

  [[nodiscard]] std::string text(std::size_t count) const {
    struct One {
      std::size_t values;
      Kind kind;
      std::string name;
    };
    std::vector<One> most;
    for (const auto& [what, of] : values_) {
      if (of.size() > 1) most.push_back({of.size(), what.first, what.second});
    }
    std::stable_sort(most.begin(), most.end(), [](const One& a, const One& b) { return a.values > b.values; });
    if (most.size() > count) most.resize(count);
    std::string text;
    for (const One& one : most) text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", one.name, one.values);
    return most.empty() ? text : fmt::format("{}; {}", text, kWaysOut[static_cast<std::size_t>(most.front().kind)]);
  }

 private:
  void add(Kind kind, std::string name, const std::string& value) {
    values_[{kind, std::move(name)}].insert(hash_bytes(value));
  }

  const project::Plan& plan_;
  std::map<std::pair<Kind, std::string>, std::set<std::uint64_t>> values_;  // hashes
};

}  // namespace

std::string most_varied(const project::Plan& plan, const Frontier& frontier, std::size_t count) {
  Varied varied(plan);
  frontier.each_state(
      [&](std::size_t part, mission::PartView state, std::optional<Duration> wake) { varied.see(part, state, wake); });
  return varied.text(count);
}

}  // namespace sentree::verify
