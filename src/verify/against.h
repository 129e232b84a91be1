#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/project/plan.h"

namespace sentree::verify {

/// States in which one model may be at a time, as far as a recording tells; beyond it is given up.
inline constexpr std::size_t kPossibleMax = 4'096;
/// Answers that a model would have allowed instead, of which is told.
inline constexpr std::size_t kAllowedToldMax = 4;
/// Answers of one model that it does not allow, of which is told; the others are counted.
inline constexpr std::size_t kDisallowedToldMax = 1'000;

struct AgainstOptions {
  /// What happens may come so much earlier or later than the model has it [run time].
  Duration tolerance{};
  /// Replies are compared number by number; else as the mission tells them apart (`look`).
  bool exact = false;
};

/// An answer of the real component that no behaviour of its model gives.
struct Disallowed {
  TimePoint at{};
  std::uint64_t tick = 0;
  std::string call;  ///< SERVICE.METHOD
  Value args;
  std::string answered;
  std::vector<std::string> allowed;  ///< "no answer" among them; at most kAllowedToldMax.
};

/// How far a recording is a behaviour of one model.
struct Agreement {
  std::string model;
  std::uint64_t requests = 0;     ///< That reached the component.
  std::uint64_t answers = 0;      ///< That were compared.
  std::uint64_t not_allowed = 0;  ///< Of them.
  std::vector<Disallowed> disallowed;
  std::size_t possible_most = 1;  ///< States in which the model may have been at a time, at most.
  std::size_t possible = 1;       ///< In the end.
  std::string given_up;           ///< Why it was not followed to the end; empty: it was.
  TimePoint followed_to{};
};

/// Follows a recording with every behaviour of each model of the plan: all choices, timers as they are due, and
/// requests as they were recorded. An answer is allowed if some behaviour that gave all answers before gives it too, at
/// that time within the tolerance. What the models do not allow is told, and then taken as given.
///
/// Requests that did not reach their component (unreachable, refused by a gate, a fault), and answers that a fault held
/// back, are left out. What a component publishes is heard by the models that subscribe, and not compared.
///
/// An argument that is named like a number or a text of an earlier reply, and has the value that was recorded, means
/// what the model said then: a goal has the number that the model gave it.
///
/// @param recording  Observations of a run of the mission, in their order.
/// Errors: verify.choice (too many alternatives), verify.reply (a model says what is no answer), verify.endless.
[[nodiscard]] Result<std::vector<Agreement>> against(const project::Plan& plan, std::span<const Message> recording,
                                                     const AgainstOptions& options);

}  // namespace sentree::verify
