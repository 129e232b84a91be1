#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/runtime/watchdog.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/step.h"

namespace sentree::studio {

/// What one command did to a chart, for printing.
struct ChartTrace {
  /// One thing that happened, in order. `what`: event, transition, exit, enter, ignored, send, log, done, invoke,
  /// failed.
  struct Entry {
    std::string what;
    TimePoint at{};
    std::string text;  ///< For people.
    Value data;        ///< For programs.
  };
  std::vector<Entry> entries;
};

/// One chart in the hands of a person: events, virtual time, and the way back.
class ChartPlayer {
 public:
  /// States that can be gone back to; older ones are forgotten.
  static constexpr std::size_t kBackMax = 1000;
  /// Entries that one command shows; more are counted only.
  static constexpr std::size_t kEntriesMax = 1000;
  /// Timers that ring in one `wait`: about as many as one command has time for.
  static constexpr std::size_t kTimersMax = 1'000'000;

  /// @param script_max  Processor time that one step may take.
  ChartPlayer(scxml::Chart chart, scxml::Host host, std::uint64_t seed, Duration script_max);

  [[nodiscard]] Result<ChartTrace> start(const Map& data);
  [[nodiscard]] Result<ChartTrace> send(const scxml::Event& event);
  /// Lets virtual time pass; delayed sends arrive at their times. Behind `kTimersMax` of them it stops, and says so.
  [[nodiscard]] Result<ChartTrace> wait(Duration time);
  /// Undoes the last `count` of start, send, wait and restore.
  [[nodiscard]] Result<void> back(std::size_t count);
  [[nodiscard]] Result<std::optional<Value>> evaluate(const std::string& expression);
  [[nodiscard]] Result<Value> save() const;
  [[nodiscard]] Result<void> restore(const Value& saved);

  [[nodiscard]] const scxml::Chart& chart() const { return chart_; }
  [[nodiscard]] const scxml::Session& session() const { return session_; }
  [[nodiscard]] TimePoint now() const { return now_; }
  /// Events that a transition of an active state names.
  [[nodiscard]] std::vector<std::string> events_handled_here() const;

 private:
  struct Moment {
    scxml::Session session;
    TimePoint now{};
  };
  struct Work;

  [[nodiscard]] Result<ChartTrace> change(const std::function<void(Work&)>& step);
  [[nodiscard]] bool run(std::shared_ptr<Work> work, std::function<void(Work&)> step);
  void remember();

  scxml::Chart chart_;
  scxml::Host host_;
  std::uint64_t seed_;
  runtime::Watchdog watchdog_;
  scxml::Session session_;
  TimePoint now_{};
  std::deque<Moment> past_;
  std::string hung_;
};

/// What a chart needs of its surroundings to be run by hand: what it sends elsewhere is only told.
[[nodiscard]] scxml::Host host_for(const scxml::Chart& chart, const scxml::LoadOptions& options);

}  // namespace sentree::studio
