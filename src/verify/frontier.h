#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "sentree/base/hash128.h"
#include "sentree/base/result.h"
#include "sentree/mission/part_memory.h"
#include "sentree/mission/virtual_host.h"
#include "sentree/project/plan.h"

namespace sentree::verify {

/// States of a mission that wait to be gone on from, first in, first out, and the run that is being tried from the
/// first of them.
class Frontier {
 public:
  virtual ~Frontier() = default;

  /// The run is the mission before anything has happened.
  virtual Result<void> begin() = 0;
  /// The run is the first state that waits.
  /// @param at  Its time.
  virtual void again(TimePoint at) = 0;
  /// Goes on by one period. Errors: those of `period`, and of `mission::encode`.
  virtual Result<void> go_on(const std::function<Result<void>()>& before_tick) = 0;
  /// Stands for the run between two periods: equal for runs that behave alike from here on.
  [[nodiscard]] virtual Hash128 key() = 0;
  /// The run waits behind all others.
  virtual void keep() = 0;
  /// The first state that waits has been gone on from.
  virtual void drop() = 0;

  // Of the run.
  [[nodiscard]] virtual TimePoint now() const = 0;
  [[nodiscard]] virtual bool ended() const = 0;
  [[nodiscard]] virtual const mission::Faults& faults() const = 0;
  /// A skill or a service that is killed.
  [[nodiscard]] virtual bool is_down(const std::string& part) const = 0;
  virtual Result<void> inject(const project::Intervention& what) = 0;

  /// About.
  [[nodiscard]] virtual std::uint64_t bytes() const = 0;
};

/// Executes every step.
[[nodiscard]] std::unique_ptr<Frontier> executing(const project::Plan& plan, mission::Surroundings& surroundings);
/// Looks up what it knows (`mission::PartMemory`).
/// @param faults  Some may come.
[[nodiscard]] std::unique_ptr<Frontier> remembering(const project::Plan& plan, bool faults,
                                                    mission::PartMemory::Outside& outside);

}  // namespace sentree::verify
