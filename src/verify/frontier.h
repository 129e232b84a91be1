#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "sentree/base/hash128.h"
#include "sentree/base/result.h"
#include "sentree/mission/part_memory.h"
#include "sentree/mission/virtual_host.h"
#include "sentree/project/plan.h"

namespace sentree::verify {

/// States of a mission from which to go on, and the run that is being tried from one of them.
class Frontier {
 public:
  virtual ~Frontier() = default;

  /// The run is the mission before anything has happened.
  virtual Result<void> begin() = 0;
  /// The run is a state that was kept and not dropped.
  /// @param place  Of `keep`.
  /// @param at     Its time.
  virtual void again(std::uint64_t place, TimePoint at) = 0;
  /// Goes on by one period. Errors: those of `period`, and of `mission::encode`.
  /// @param before_tick, on_the_way  Of `period`.
  virtual Result<void> go_on(const std::function<Result<void>()>& before_tick,
                             const std::function<Result<void>()>& on_the_way) = 0;
  /// From now on steps are appended to it. False: they cannot be.
  virtual bool trace(mission::PartMemory::Trace& trace) = 0;
  /// Stands for the run between two periods: equal for runs that behave alike from here on.
  [[nodiscard]] virtual Hash128 key() = 0;
  /// What `key` is a hash of. Valid until the run goes on.
  [[nodiscard]] virtual std::string_view form() = 0;
  /// Keeps the run, which is not there any more then; where, for `again`. The first is the beginning.
  virtual std::uint64_t keep() = 0;
  /// Keeps a run that a scout came to: its `kept_form`.
  virtual std::uint64_t keep(std::span<const std::uint32_t> form) = 0;
  /// Nobody goes on any more from the one that was kept first of those that are left.
  virtual void drop() = 0;

  /// Another run, which goes on from the states that are kept here by what is known already; null: there is no such
  /// thing. Several may go on at a time, while this one does nothing.
  [[nodiscard]] virtual std::unique_ptr<Frontier> scout(mission::PartMemory::Outside& outside) const = 0;
  /// Of a scout: it came to something that is not known, so that the run means nothing. Forgets it.
  virtual bool missed() = 0;
  [[nodiscard]] virtual std::span<const std::uint32_t> kept_form() const = 0;

  // Of the run.
  [[nodiscard]] virtual TimePoint now() const = 0;
  [[nodiscard]] virtual bool ended() const = 0;
  /// What the root of the tree answered last.
  [[nodiscard]] virtual bt::Status root() const = 0;
  /// No tick follows; else when the next one is planned.
  [[nodiscard]] virtual bool over() const = 0;
  [[nodiscard]] virtual TimePoint planned() const = 0;
  [[nodiscard]] virtual const mission::Faults& faults() const = 0;
  /// A skill or a service that is killed.
  [[nodiscard]] virtual bool is_down(const std::string& part) const = 0;
  /// Of that index in the plan.
  [[nodiscard]] virtual const mission::ModelState& model(std::size_t index) const = 0;
  /// @param number  Of what stands then.
  virtual Result<void> inject(const project::Intervention& what, std::uint64_t number) = 0;

  /// States of parts by the index of their part among leaves, then models, then the tree, each with the time until a
  /// timer of it rings: all that were found, or those that are kept, if the others are not known any more.
  using Visit = std::function<void(std::size_t part, mission::PartView, std::optional<Duration> wake)>;
  virtual void each_state(const Visit& visit) const = 0;
  /// About.
  [[nodiscard]] virtual std::uint64_t bytes() const = 0;
};

/// Executes every step.
[[nodiscard]] std::unique_ptr<Frontier> executing(const project::Plan& plan, mission::Surroundings& surroundings,
                                                  bt::Times times);
/// Looks up what it knows (`mission::PartMemory`).
[[nodiscard]] std::unique_ptr<Frontier> remembering(const project::Plan& plan, mission::PartMemory::FaultsFrom faults,
                                                    mission::PartMemory::Outside& outside, bt::Times times);

}  // namespace sentree::verify
