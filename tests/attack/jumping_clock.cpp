// Loaded into a program before everything else: clocks that jump once the program is at work.
// SENTREE_TEST_JUMP: back, forward, zero, negative (the wall clock by a year, or to that), suspended (an hour that the
// clock of the boot has seen and the monotonic one has not), leaps (the wall clock by an hour, to and fro).
// SENTREE_TEST_JUMP_AFTER_S: how long after the start.

#include <dlfcn.h>

#include <cstdlib>
#include <ctime>
#include <string_view>

namespace {

using Get = int (*)(clockid_t, timespec*);

Get real_clock() {
  static const auto real = reinterpret_cast<Get>(dlsym(RTLD_NEXT, "clock_gettime"));
  return real;
}

void jump(clockid_t clock, timespec* time, std::string_view how) {
  constexpr time_t kHour_s = 3600;
  constexpr time_t kYear_s = 365 * 24 * kHour_s;
  timespec now{};
  real_clock()(CLOCK_MONOTONIC, &now);
  static const time_t begin = now.tv_sec;
  const char* after = std::getenv("SENTREE_TEST_JUMP_AFTER_S");
  if (now.tv_sec - begin < (after != nullptr ? std::strtol(after, nullptr, 10) : 0)) return;
  if (how == "suspended") {
    if (clock != CLOCK_MONOTONIC && clock != CLOCK_MONOTONIC_COARSE && clock != CLOCK_MONOTONIC_RAW)
      time->tv_sec += kHour_s;
  } else if (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE) {
    if (how == "back") time->tv_sec -= kYear_s;
    if (how == "forward") time->tv_sec += kYear_s;
    if (how == "zero") time->tv_sec = now.tv_sec - begin;
    if (how == "negative") time->tv_sec = begin - now.tv_sec - 1;
    if (how == "leaps") time->tv_sec += now.tv_nsec % 2 == 0 ? kHour_s : -kHour_s;
  }
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const int result = real_clock()(clock, time);
  const char* how = std::getenv("SENTREE_TEST_JUMP");
  const bool is_time = clock != CLOCK_PROCESS_CPUTIME_ID && clock != CLOCK_THREAD_CPUTIME_ID;
  if (result == 0 && how != nullptr && is_time) jump(clock, time, how);
  return result;
}

extern "C" time_t time(time_t* to) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (to != nullptr) *to = now.tv_sec;
  return now.tv_sec;
}
