// Loaded into a program before everything else: shows it a machine that has been started anew, with its clock set back.
// SENTREE_TEST_BOOT: a file that stands for the identity of the boot; SENTREE_TEST_SET_BACK_S: by how many seconds.
// SENTREE_TEST_SYNC_MS: its disk is that slow. SENTREE_TEST_SYNCS: so many times it writes, and then no more.

#include <dlfcn.h>
#include <poll.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

extern "C" {

FILE* fopen(const char* path, const char* mode) {
  static const auto real = reinterpret_cast<FILE* (*)(const char*, const char*)>(dlsym(RTLD_NEXT, "fopen"));
  const char* boot = std::getenv("SENTREE_TEST_BOOT");
  return real(boot != nullptr && std::strcmp(path, "/proc/sys/kernel/random/boot_id") == 0 ? boot : path, mode);
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static const auto real = reinterpret_cast<int (*)(clockid_t, timespec*)>(dlsym(RTLD_NEXT, "clock_gettime"));
  const int result = real(clock, time);
  const char* back = clock == CLOCK_REALTIME ? std::getenv("SENTREE_TEST_SET_BACK_S") : nullptr;
  if (result == 0 && back != nullptr) time->tv_sec -= std::strtol(back, nullptr, 10);
  return result;
}

int fdatasync(int file) {
  static const auto real = reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, "fdatasync"));
  const char* slow = std::getenv("SENTREE_TEST_SYNC_MS");
  if (slow != nullptr) poll(nullptr, 0, static_cast<int>(std::strtol(slow, nullptr, 10)));
  static std::atomic<long> count = 0;
  const char* most = std::getenv("SENTREE_TEST_SYNCS");
  if (most != nullptr && ++count > std::strtol(most, nullptr, 10)) {
    errno = EIO;
    return -1;
  }
  return real(file);
}

}  // extern "C"
