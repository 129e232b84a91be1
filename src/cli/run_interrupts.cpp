#include "sentree/cli/run_interrupts.h"

#include <pthread.h>
#include <unistd.h>

#include <chrono>

#include "sentree/cli/commands.h"

namespace sentree::cli {

namespace {

sigset_t awaited_signals() {
  sigset_t awaited;
  sigemptyset(&awaited);
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) sigaddset(&awaited, signal);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaddset(&awaited, SIGHUP);  // unless nohup started it
  return awaited;
}

}  // namespace

void RunInterrupts::block() {
  const sigset_t awaited = awaited_signals();
  pthread_sigmask(SIG_BLOCK, &awaited, nullptr);
}

RunInterrupts::RunInterrupts(runtime::Run& run) : run_(&run) {
  block();
  thread_ = std::thread([this] { wait(); });
}

RunInterrupts::~RunInterrupts() {
  done_ = true;
  pthread_kill(thread_.native_handle(), SIGUSR1);
  thread_.join();
}

void RunInterrupts::run_is_over() {
  const std::lock_guard lock(mutex_);
  run_ = nullptr;
}

void RunInterrupts::wait_for_one() {
  std::unique_lock lock(mutex_);
  asked_.wait(lock, [this] { return asked_to_end_; });
}

void RunInterrupts::wait() {
  const sigset_t awaited = awaited_signals();
  // Whoever starts a program may hand on the signal that it got itself too.
  constexpr std::chrono::milliseconds kSame{500};
  std::chrono::steady_clock::time_point last{};
  for (int received = 0;;) {
    int signal = 0;
    sigwait(&awaited, &signal);
    if (done_) return;
    if (signal == SIGUSR1) continue;
    if (signal == SIGHUP && received > 0) continue;  // shell and terminal both say it
    const auto now = std::chrono::steady_clock::now();
    if (received > 0 && now - last < kSame) continue;
    last = now;
    if (++received > 1) _exit(kInterrupted);  // asked twice: at once
    const std::lock_guard lock(mutex_);
    if (run_ != nullptr) run_->interrupt();
    asked_to_end_ = true;
    asked_.notify_one();
  }
}

}  // namespace sentree::cli
