#include "sentree/base/alarm.h"

#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>

namespace sentree {

Alarm::Alarm() : fd_(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC)) {}

Alarm::~Alarm() {
  if (fd_ >= 0) ::close(fd_);
}

void Alarm::set(Time when) {
  itimerspec spec{};
  if (when != Time::max()) {
    const std::int64_t ns = std::max<std::int64_t>(1, when.time_since_epoch().count());
    spec.it_value = {ns / 1'000'000'000, ns % 1'000'000'000};
  }
  timerfd_settime(fd_, TFD_TIMER_ABSTIME, &spec, nullptr);
}

void Alarm::wait() {
  std::uint64_t rings = 0;
  while (::read(fd_, &rings, sizeof rings) < 0 && errno == EINTR) {
  }
}

}  // namespace sentree
