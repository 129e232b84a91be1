#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "sentree/base/flat_map.h"
#include "sentree/monitor/monitor.h"
#include "sentree/monitor/projection.h"
#include "sentree/monitor/quick.h"
#include "sentree/runtime/run.h"
#include "sentree/scxml/enabled.h"

namespace sentree::campaign {

/// Monitors of runs whose observations have numbers: states of what decides are numbers too, and steps are looked up.
/// An observation that is not the same each time is looked at by the conditions of the chart, which say whether its
/// step is one that is known. A monitor that waits for time is stepped as it is.
class QuickMonitors {
 public:
  /// That belongs to no observation that comes again.
  static constexpr std::uint32_t kOnce = UINT32_MAX;

  /// @param models  Of which each `fits`; borrowed.
  explicit QuickMonitors(const std::vector<monitor::Model>& models);
  /// It keeps no observations, does not ask for the numbers of calls, and none of its scripts can go on for ever.
  [[nodiscard]] static bool fits(const monitor::Model& model);

  /// Puts each at its beginning.
  void begin();
  /// Forgets all but that.
  void forget();
  [[nodiscard]] bool hears(const std::string& observation) const;
  /// @param number  Of the observation.
  /// @param varies  Observations of that number differ in more than their time.
  void observe(std::uint32_t number, const Message& message, bool varies);
  void finish(TimePoint now);

  /// None is violated, or was given up.
  [[nodiscard]] bool go_well() const { return go_well_; }
  /// How many of the models have decided.
  [[nodiscard]] std::uint64_t decided() const { return decided_; }
  [[nodiscard]] std::vector<runtime::MonitorReport> reports() const;
  /// States that are known.
  [[nodiscard]] std::size_t known() const { return kept_.size(); }

 private:
  struct Of {
    const monitor::Model& model;
    bool is_test = false;  // of another one
    scxml::EventReads reads;
    monitor::Projection projection;
    bool remembers = false;
    monitor::Core beginning;
    std::uint64_t once = 0;   // steps that are not known again
    std::uint64_t fresh = 0;  // states that were new after them
  };
  // One in the run that goes on.
  struct Watch {
    std::optional<std::uint32_t> core;  // nothing: `state` is what it is
    monitor::Core state;
    bool seen = false;
    monitor::Verdict verdict = monitor::Verdict::kUndecided;
  };
  struct Step {
    std::optional<std::vector<scxml::TransitionIndex>> enabled;  // nothing: always
    std::uint32_t next = 0;
    monitor::Verdict verdict = monitor::Verdict::kUndecided;
  };
  // Where observations of one number go.
  struct Route {
    std::vector<std::uint32_t> monitors;
    monitor::Projection projection;
    monitor::Listeners listeners;
  };
  // An observation on its way, and the event that it is when somebody needs it.
  struct Heard {
    std::uint32_t number;
    const Message& message;
    bool varies;
    Route& route;
    std::optional<scxml::Event> made;
    [[nodiscard]] const scxml::Event& event() {
      if (!made) made = {.name = message.name, .data = route.projection.data(message)};
      return *made;
    }
  };

  void add(const monitor::Model& model, bool is_test);
  Route route_of(const Message& message) const;
  void observe(std::size_t which, Heard& heard);
  [[nodiscard]] std::optional<std::vector<scxml::TransitionIndex>> enabled(std::size_t which, Heard& heard);
  void execute(std::size_t which, Heard& heard, std::vector<Step>* known,
               std::optional<std::vector<scxml::TransitionIndex>> enabled);
  void step_as_it_is(std::size_t which, Heard& heard, Watch& watch);
  void decide(std::uint32_t i, Watch& watch, monitor::Verdict verdict);
  [[nodiscard]] std::vector<Step>& steps_of(std::uint32_t core, std::uint32_t number);
  [[nodiscard]] std::optional<std::uint32_t> intern(std::uint32_t i, const monitor::Core& core, TimePoint now);

  const std::vector<monitor::Model>& models_;
  std::vector<Of> monitors_;  // those, and their tests
  std::vector<Watch> watches_;
  bool go_well_ = true;
  std::uint64_t decided_ = 0;
  std::vector<std::unique_ptr<Route>> routes_;  // by observation
  std::vector<std::unique_ptr<const monitor::Core>> kept_;
  std::unordered_map<std::string, std::uint32_t> number_of_core_;
  std::deque<std::vector<Step>> steps_;
  FlatMap<std::uint64_t, WordHash> number_of_steps_;  // by state and observation
};

}  // namespace sentree::campaign
