#pragma once

#include "sentree/scxml/chart.h"

namespace sentree::scxml {

/// Sees the conditions of transitions, which an `Observer` is not told of.
class GuardObserver {
 public:
  virtual ~GuardObserver() = default;
  /// One has been evaluated; one that cannot be does not hold.
  virtual void guard(const Chart& chart, TransitionIndex of, bool holds) = 0;
};

/// While it lives, `observer` sees all that this thread evaluates. Null: nobody does.
class ObserveGuards {
 public:
  explicit ObserveGuards(GuardObserver* observer) : before_(seeing) { seeing = observer; }
  ~ObserveGuards() { seeing = before_; }
  ObserveGuards(const ObserveGuards&) = delete;
  ObserveGuards& operator=(const ObserveGuards&) = delete;

  [[nodiscard]] static GuardObserver* present() { return seeing; }

 private:
  static inline thread_local GuardObserver* seeing = nullptr;
  GuardObserver* before_;
};

}  // namespace sentree::scxml
