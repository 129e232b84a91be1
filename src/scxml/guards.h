#pragma once

#include "sentree/base/present.h"
#include "sentree/scxml/chart.h"

namespace sentree::scxml {

/// Sees the conditions of transitions, which an `Observer` is not told of.
class GuardObserver {
 public:
  virtual ~GuardObserver() = default;
  /// One has been evaluated; one that cannot be does not hold.
  virtual void guard(const Chart& chart, TransitionIndex of, bool holds) = 0;
};

/// While it lives, an observer sees all that this thread evaluates. Null: nobody does.
using ObserveGuards = Present<GuardObserver>;

}  // namespace sentree::scxml
