#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include "sentree/base/flat_map.h"
#include "sentree/base/hash128.h"
#include "sentree/base/result.h"
#include "sentree/bt/encode.h"
#include "sentree/mission/kept_tree.h"
#include "sentree/mission/parts.h"

namespace sentree::mission {

using PartState = std::variant<TreeState, SkillState, ModelState>;
using PartView = std::variant<const TreeState*, const SkillState*, const ModelState*>;

/// States of parts as numbers: those that behave alike from here on have one (`encode`), times relative to now. A part
/// is its index among leaves, then models, then the tree. Nothing is ever forgotten.
///
/// Several may read at a time, while nobody finds out anything.
class PartStates {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  /// A state as it was found first, at a time that means nothing but what its own times are relative to.
  struct Kept {
    std::uint32_t part = 0;
    TimePoint at{};
    bool timeless = false;  ///< It is the same at any later time.
    // Of the tree.
    bool ended = false;
    bool over = false;
    Duration until_planned{};
    // Of a skill.
    bool killed = false;
    std::uint64_t unanswered = 0;  ///< Number of the tick; 0: none.
    // Of skills and models: until its timer rings.
    std::optional<Duration> wake;
  };

  /// @param parts  Borrowed.
  /// @param times  kAbsolute: states of the tree at different times are different ones.
  explicit PartStates(const Parts& parts, bt::Times times = bt::Times::kFromNow) : parts_(parts), times_(times) {}

  [[nodiscard]] const Kept& operator[](std::uint32_t state) const { return all_[state].kept; }
  [[nodiscard]] const KeptTree& tree(std::uint32_t state) const {
    return *std::get<std::unique_ptr<const KeptTree>>(all_[state].content);
  }
  [[nodiscard]] const SkillState& skill(std::uint32_t state) const {
    return *std::get<std::unique_ptr<const SkillState>>(all_[state].content);
  }
  [[nodiscard]] const ModelState& model(std::uint32_t state) const {
    return *std::get<std::unique_ptr<const ModelState>>(all_[state].content);
  }
  /// A copy, of any part.
  [[nodiscard]] PartState whole(std::uint32_t state) const;
  /// Every state that was found, by its part.
  void each(const std::function<void(std::size_t part, PartView, std::optional<Duration> wake)>& visit) const;

  /// @param from  A state of the part that it differs little from; kNone: there is none.
  std::uint32_t number(std::uint32_t part, PartState&& state, TimePoint at, std::uint32_t from = kNone);
  /// What a state is a while later.
  std::uint32_t aged(std::uint32_t state, Duration by);
  /// Likewise, if that is known.
  [[nodiscard]] std::optional<std::uint32_t> known_aged(std::uint32_t state, Duration by) const;

  /// A state that has no canonical form.
  [[nodiscard]] const std::optional<Diagnostic>& error() const { return error_; }
  /// About.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct One {
    Kept kept;
    std::variant<std::unique_ptr<const KeptTree>, std::unique_ptr<const SkillState>, std::unique_ptr<const ModelState>>
        content;
    // The last time that passed over it, and what it was then.
    Duration aged_by{};
    std::uint32_t aged = kNone;
  };
  // A state, and how long ago it was so.
  using Aged = std::pair<std::uint32_t, Duration>;
  struct AgedHash {
    std::size_t operator()(const Aged& of) const {
      return WordHash()(WordHash()(of.first) ^ static_cast<std::uint64_t>(of.second.count()));
    }
  };

  const Parts& parts_;
  bt::Times times_;
  std::vector<One> all_;
  FlatMap<Hash128, Hash128Hash> number_of_;
  std::unordered_map<Aged, std::uint32_t, AgedHash> number_of_aged_;
  std::optional<Diagnostic> error_;
  std::uint64_t bytes_ = 0;
  std::string form_;
  std::string later_;
};

}  // namespace sentree::mission
