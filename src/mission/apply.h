#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/mission/delivery.h"
#include "sentree/project/intervention.h"

namespace sentree::mission {

/// A run, as interventions find it.
class Intervened {
 public:
  virtual ~Intervened() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  virtual void publish(Message message) = 0;
  virtual void stop_mission() = 0;
  /// Error: verify.fault.
  virtual Result<CallOutcome> call_service(const project::intervention::Call& what) = 0;

  // What stands.
  /// Error: steering.too-many.
  virtual Result<std::uint64_t> next_id() = 0;
  virtual void stand(std::uint64_t id, const project::Intervention& what) = 0;
  /// Error: steering.unknown-id.
  virtual Result<void> end_standing(std::uint64_t id) = 0;

  // Parts.
  /// Nothing: none is called so.
  [[nodiscard]] virtual std::optional<bool> is_killed(const std::string& part) const = 0;
  /// @param asked  Before it was told.
  virtual void kill_part(const std::string& part, TimePoint asked) = 0;
  virtual void restart_part(const std::string& part, TimePoint asked) = 0;
  /// A part in a process of its own may have ended by itself.
  [[nodiscard]] virtual bool is_process(const std::string& /*part*/) const { return false; }
  /// False: it has not ended.
  virtual bool restart_process(const std::string& /*part*/) { return false; }
};

/// What became of an intervention.
struct Applied {
  std::uint64_t id = 0;  ///< Of one that stands.
  CallOutcome outcome;   ///< Of a call.
};

/// Does to a run what an intervention says, and tells it as "scenario.injection" before it has an effect.
/// Errors: steering.part-state, steering.too-many, steering.unknown-id, verify.fault.
[[nodiscard]] Result<Applied> apply(const project::Intervention& what, const std::string& source, Intervened& run);

}  // namespace sentree::mission
