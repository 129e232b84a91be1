#include "sentree/cli/interrupts.h"

#include <atomic>
#include <csignal>

namespace sentree::cli {
namespace {

std::atomic<bool> interrupted = false;
struct sigaction interrupt_before {};
struct sigaction terminate_before {};

// What is asked to end and does not come to look at it, in a script without an end, ends when it is asked again.
void note(int signal) {
  if (!interrupted.exchange(true)) return;
  struct sigaction usual {};
  usual.sa_handler = SIG_DFL;
  sigaction(signal, &usual, nullptr);
  raise(signal);
}

}  // namespace

Interrupts::Interrupts() {
  interrupted = false;
  struct sigaction action {};
  action.sa_handler = note;
  sigaction(SIGINT, &action, &interrupt_before);
  sigaction(SIGTERM, &action, &terminate_before);
}

Interrupts::~Interrupts() {
  sigaction(SIGINT, &interrupt_before, nullptr);
  sigaction(SIGTERM, &terminate_before, nullptr);
}

bool is_interrupted() { return interrupted; }

bool take_interrupt() { return interrupted.exchange(false); }

}  // namespace sentree::cli
