#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace sentree {

using Duration = std::chrono::nanoseconds;

/// Time since the start of a run. A tag for `TimePoint`; it cannot be asked for the time: that is `Clock`.
struct RunTime {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = Duration;
  using time_point = std::chrono::time_point<RunTime>;
  static constexpr bool is_steady = true;
};
using TimePoint = RunTime::time_point;

/// Later than any time of any run.
inline constexpr TimePoint kNever = TimePoint::max();

/// Seconds since the start of the run.
[[nodiscard]] constexpr double seconds(TimePoint time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}
[[nodiscard]] constexpr double seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

/// The nearest nanosecond; saturates at the ends of the range, NaN gives 0.
[[nodiscard]] constexpr Duration from_seconds(double s) {
  const double ns = s * 1e9;
  if (ns >= 9.2e18) return Duration::max();
  if (ns <= -9.2e18) return Duration::min();
  if (ns != ns) return Duration(0);
  return Duration(static_cast<std::int64_t>(ns < 0 ? ns - 0.5 : ns + 0.5));
}

/// `time + duration`; where that would overflow, `kNever` or the earliest time.
[[nodiscard]] constexpr TimePoint add_saturating(TimePoint time, Duration duration) {
  if (duration > Duration(0) && time > kNever - duration) return kNever;
  if (duration < Duration(0) && time < TimePoint::min() - duration) return TimePoint::min();
  return time + duration;
}

/// What tells the time of a run: the steady clock in real time, the event queue in virtual time, a
/// number in a test.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
};

/// A clock that stands still until it is set. Not thread-safe.
class ManualClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  /// Time does not run backwards: earlier than `now()` is a bug of the caller.
  void set(TimePoint now);
  void advance(Duration by) { set(now_ + by); }

 private:
  TimePoint now_{};
};

}  // namespace sentree
