#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/monitor/reader.h"
#include "sentree/scxml/enabled.h"
#include "sentree/scxml/plain.h"

namespace sentree::monitor {

/// A monitor that decides the same at the same times, but keeps no observations: its decisions have no witness. For
/// whoever wants verdicts of many runs.
[[nodiscard]] Model without_witnesses(const Model& model);
/// Whether observations that it is given must outlive its step.
[[nodiscard]] bool keeps_observations(const Model& model);

/// What several monitors need to step at observations of one name, found out once. What their steps look at is read
/// once for all of them, when the first one asks. Of one thread; states stay with whoever steps.
class Listeners {
 public:
  /// @param models  A monitor is named by its place among them (`which`). None is over when it is asked to step.
  /// @param observation  The name.
  Listeners(std::vector<Model> models, const std::string& observation);

  /// The present observation; borrowed until the next.
  void hear(const Message& message) {
    message_ = &message;
    members_ = nullptr;
  }
  /// As `scxml::enabled_by`, told from the observation where it is. Nothing: only that can tell.
  [[nodiscard]] std::optional<std::vector<scxml::TransitionIndex>> enabled(std::size_t which, const Core& core);
  /// As the functions of these names, at the present observation.
  Stepped step(std::size_t which, Core& core);
  Decisions observe(std::size_t which, State& state);

 private:
  struct Listener {
    Model model;
    std::optional<scxml::PlainPlan> plan;
  };
  const scxml::PlainValue* members() {
    if (members_ == nullptr) members_ = reader_.read(*message_);
    return members_;
  }

  std::vector<Listener> listeners_;
  Reader reader_;
  const Message* message_ = nullptr;
  const scxml::PlainValue* members_ = nullptr;
};

}  // namespace sentree::monitor
