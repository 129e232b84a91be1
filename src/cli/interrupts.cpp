#include "sentree/cli/interrupts.h"

#include <atomic>
#include <csignal>
#include <cstdint>
#include <ctime>

namespace sentree::cli {
namespace {

// Whoever starts a program may hand on the signal that it got itself too.
constexpr std::int64_t kSameNs = 500'000'000;

std::atomic<bool> interrupted = false;
std::atomic<std::int64_t> last_ns = 0;  // when one came that counts
struct sigaction interrupt_before {};
struct sigaction terminate_before {};
struct sigaction hangup_before {};

// What is asked to end and does not come to look at it, in a script without an end, ends when it is asked again.
void note(int signal) {
  struct timespec now {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t now_ns = now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
  std::int64_t last = last_ns;
  // In another thread it may come at the same time.
  if ((last != 0 && now_ns - last < kSameNs) || !last_ns.compare_exchange_strong(last, now_ns)) return;
  if (!interrupted.exchange(true)) return;
  struct sigaction usual {};
  usual.sa_handler = SIG_DFL;
  sigaction(signal, &usual, nullptr);
  raise(signal);
}

}  // namespace

Interrupts::Interrupts() {
  interrupted = false;
  last_ns = 0;
  struct sigaction action {};
  action.sa_handler = note;
  sigaction(SIGINT, &action, &interrupt_before);
  sigaction(SIGTERM, &action, &terminate_before);
  sigaction(SIGHUP, nullptr, &hangup_before);
  if (hangup_before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // unless nohup started it
}

Interrupts::~Interrupts() {
  sigaction(SIGINT, &interrupt_before, nullptr);
  sigaction(SIGTERM, &terminate_before, nullptr);
  sigaction(SIGHUP, &hangup_before, nullptr);
}

bool is_interrupted() { return interrupted; }

bool take_interrupt() { return interrupted.exchange(false); }

}  // namespace sentree::cli
