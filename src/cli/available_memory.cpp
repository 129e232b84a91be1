#include "sentree/cli/available_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>

namespace sentree::cli {

namespace {

// The number behind `name`, or the first one.
std::optional<std::uint64_t> number_in(const char* file, const std::string& name = "") {
  std::ifstream in(file);
  std::string word;
  while (!name.empty() && in >> word && word != name) continue;
  std::uint64_t number = 0;
  return in >> number ? std::optional(number) : std::nullopt;
}

}  // namespace

std::uint64_t available_memory() {
  std::uint64_t least = UINT64_MAX;
  if (const auto kib = number_in("/proc/meminfo", "MemAvailable:")) least = *kib * 1024;
  // Of a container; "max", which is no number: there is no limit.
  if (const auto most = number_in("/sys/fs/cgroup/memory.max")) {
    const std::uint64_t taken = number_in("/sys/fs/cgroup/memory.stat", "anon").value_or(0);
    least = std::min(least, *most - std::min(*most, taken));
  }
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    const std::uint64_t pages = number_in("/proc/self/statm").value_or(0);
    const auto taken = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    least = std::min<std::uint64_t>(least, limit.rlim_cur - std::min<std::uint64_t>(limit.rlim_cur, taken));
  }
  return least == UINT64_MAX ? 0 : least;
}

}  // namespace sentree::cli
