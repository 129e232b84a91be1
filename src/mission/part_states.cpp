#include "sentree/mission/part_states.h"

#include "sentree/base/encoder.h"
#include "sentree/mission/encode.h"

namespace sentree::mission {

PartState PartStates::whole(std::uint32_t state) const {
  const auto& content = all_[state].content;
  if (const auto* const tree = std::get_if<std::unique_ptr<const KeptTree>>(&content)) return (*tree)->state();
  if (const auto* const skill = std::get_if<std::unique_ptr<const SkillState>>(&content)) return **skill;
  return model(state);
}

void PartStates::each(
    const std::function<void(std::size_t part, PartView, std::optional<Duration> wake)>& visit) const {
  for (const One& one : all_) {
    if (const auto* const tree = std::get_if<std::unique_ptr<const KeptTree>>(&one.content)) {
      const TreeState whole = (*tree)->state();
      visit(one.kept.part, &whole, one.kept.wake);
    } else if (const auto* const skill = std::get_if<std::unique_ptr<const SkillState>>(&one.content)) {
      visit(one.kept.part, skill->get(), one.kept.wake);
    } else {
      visit(one.kept.part, std::get<std::unique_ptr<const ModelState>>(one.content).get(), one.kept.wake);
    }
  }
}

std::uint32_t PartStates::number(std::uint32_t part, PartState&& state, TimePoint at, std::uint32_t from) {
  form_.clear();
  Encoder(form_).number(part);
  const auto encode_at = [&](TimePoint now, std::string& out) -> Result<void> {
    if (const auto* tree = std::get_if<TreeState>(&state)) return encode(parts_, *tree, now, out, times_);
    if (const auto* skill = std::get_if<SkillState>(&state)) return encode(parts_, part, *skill, now, out);
    return encode(parts_, part - parts_.skills(), std::get<ModelState>(state), now, out);
  };
  if (auto encoded = encode_at(at, form_); !encoded && !error_) error_ = encoded.error();
  const auto [found, is_new] = number_of_.try_emplace(hash128(form_), static_cast<std::uint32_t>(all_.size()));
  if (!is_new) return *found;
  One one;
  Kept& kept = one.kept;
  kept.part = part;
  kept.at = at;
  // What is in the future is nearer a nanosecond later, as the next tick is; what is past stays so.
  const auto* const of_tree = std::get_if<TreeState>(&state);
  if (of_tree == nullptr || of_tree->over) {
    later_.clear();
    Encoder(later_).number(part);
    kept.timeless = encode_at(at + Duration(1), later_) && later_ == form_;
  }
  std::uint64_t bytes = 0;
  if (auto* const tree = std::get_if<TreeState>(&state)) {
    kept.ended = tree->phase == TreePhase::kEnded;
    kept.over = tree->over;
    kept.until_planned = tree->planned - at;
    const KeptTree* const like = from != kNone ? &this->tree(from) : nullptr;
    auto content = std::make_unique<const KeptTree>(std::move(*tree), like);
    bytes = content->bytes_beside(like);
    one.content = std::move(content);
  } else {
    // A session shares most of what it has in common with the one before.
    bytes = 4 * form_.size();
    if (auto* const skill = std::get_if<SkillState>(&state)) {
      kept.killed = skill->phase == SkillPhase::kKilled;
      kept.unanswered = skill->answered == skill->tick ? 0 : skill->tick;
      if (skill->wake != kNever) kept.wake = skill->wake - at;
      one.content = std::make_unique<const SkillState>(std::move(*skill));
      bytes += sizeof(SkillState);
    } else {
      auto& model = std::get<ModelState>(state);
      if (model.wake != kNever) kept.wake = model.wake - at;
      one.content = std::make_unique<const ModelState>(std::move(model));
      bytes += sizeof(ModelState);
    }
  }
  bytes_ += sizeof(One) + bytes + 64;
  all_.push_back(std::move(one));
  return static_cast<std::uint32_t>(all_.size() - 1);
}

std::uint32_t PartStates::aged(std::uint32_t state, Duration by) {
  if (const auto known = known_aged(state, by)) {
    // So that it is found at once the next time.
    if (!all_[state].kept.timeless && by != Duration(0)) {
      all_[state].aged_by = by;
      all_[state].aged = *known;
    }
    return *known;
  }
  const std::uint32_t later = number(all_[state].kept.part, whole(state), all_[state].kept.at + by, state);
  number_of_aged_.emplace(Aged{state, by}, later);
  all_[state].aged_by = by;
  return all_[state].aged = later;
}

std::optional<std::uint32_t> PartStates::known_aged(std::uint32_t state, Duration by) const {
  const One& one = all_[state];
  if (by == Duration(0) || one.kept.timeless) return state;
  if (one.aged != kNone && one.aged_by == by) return one.aged;
  const auto known = number_of_aged_.find({state, by});
  return known != number_of_aged_.end() ? std::optional(known->second) : std::nullopt;
}

}  // namespace sentree::mission
