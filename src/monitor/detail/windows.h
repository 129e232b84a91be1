#pragma once

#include <string>
#include <vector>

#include "sentree/monitor/detail/requirement_script.h"
#include "sentree/monitor/requirement.h"

namespace sentree::monitor {

/// What a chart writes to keep two windows of one bound apart, where only closed segments of a scope count: that of the
/// latest trigger in segments that have closed, and that of the latest one in the present segment. The latter begins
/// later, so it also ends later; it takes the place of the former when that ends, or when its own segment closes. With
/// one window, that is *the oldest*.
///
/// A deadline in time is one of two timers, since a timer cannot be renamed; both send "deadline".
class Windows {
 public:
  using Actions = std::vector<std::string>;
  struct Datum {
    std::string id;
    std::string initial;
    std::string what;
  };

  explicit Windows(const Bound& bound) : bound_(bound) {}

  [[nodiscard]] std::vector<Datum> data() const;
  /// A second window runs, from the present segment.
  [[nodiscard]] static Js has_newer() { return {kNewer, 9}; }
  /// Of ticks: more have passed since the newer one began than it may last.
  [[nodiscard]] Js newer_is_late() const;

  /// No window runs.
  [[nodiscard]] Actions none() const;
  /// The first begins.
  [[nodiscard]] Actions begin() const;
  /// The only one begins anew.
  [[nodiscard]] Actions restart() const;
  /// The newer one begins, beside one from a closed segment, or begins anew.
  [[nodiscard]] Actions restart_newer() const;
  /// The oldest is over; the newer one, of the present segment, is the only one.
  [[nodiscard]] Actions end_oldest() const;
  /// The present segment closes; what is owed from it outlasts the oldest.
  [[nodiscard]] Actions close() const;
  /// One more tick, or observation, for the newer one; empty: its bound is in time.
  [[nodiscard]] std::string count_newer() const;

 private:
  static constexpr const char* kNewer = "newer_owed";
  [[nodiscard]] bool in_time() const { return bound_.unit == Bound::Unit::kTime; }
  [[nodiscard]] std::string clock() const { return bound_.unit == Bound::Unit::kTicks ? "ticks" : "observations"; }
  [[nodiscard]] std::string clock_of_newer() const { return clock() + "_of_newer"; }
  [[nodiscard]] std::string start_timer(bool second) const;

  const Bound& bound_;
};

/// Datum of a chart: what is owed (of windows the oldest) is from a segment that has closed.
inline constexpr const char* kFromClosed = "from_closed";

}  // namespace sentree::monitor
