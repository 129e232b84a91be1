#pragma once

#include <chrono>

namespace sentree {

/// A timer of the kernel, for a thread that waits for it. Unlike a condition's time limit it can be set anew, by any
/// thread, without waking the one that waits.
class Alarm {
 public:
  using Time = std::chrono::steady_clock::time_point;

  Alarm();
  ~Alarm();
  Alarm(const Alarm&) = delete;
  Alarm& operator=(const Alarm&) = delete;

  /// False: no file descriptor was left for it.
  [[nodiscard]] bool works() const { return fd_ >= 0; }
  /// Rings once, at `when`; at once if that has passed, never for `Time::max()`.
  void set(Time when);
  /// Until it rings.
  void wait();
  /// For poll(): readable once it has rung, until `wait` or `set`.
  [[nodiscard]] int descriptor() const { return fd_; }

 private:
  const int fd_;
};

}  // namespace sentree
