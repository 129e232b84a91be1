#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sentree/base/coarse_clock.h"
#include "sentree/bt/call_watch.h"
#include "sentree/bt/runner.h"

namespace sentree::exec {

struct ExecutorOptions {
  Duration period = std::chrono::milliseconds(10);  ///< Between the beginnings of two ticks; above 0.
};

/// Ticks a tree in real time: at a rate, and at once when a node, a timer or another thread asks for it.
///
///     exec::Executor executor(std::move(*loaded.value), {.period = 100ms});
///     const bt::Status status = executor.run();   // in this thread, until the root completes
///
/// `halt` and `wake` may be called by any thread, also from a handler that is not a signal handler. The tree is only
/// ever touched by the thread that is in `run`.
class Executor {
 public:
  explicit Executor(bt::Tree tree, ExecutorOptions options = {});
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  /// Ticks until the root is no longer RUNNING, and returns its status: SUCCESS, FAILURE (also of a tick that was given
  /// up, see `error`) or SKIPPED. IDLE: it was halted. May be called again, for another run of the tree.
  /// Periods in which the tick before was not over are left out and counted.
  bt::Status run();
  /// Ends `run`, or the next one if there is none at present: the tree is halted, between two ticks. Does not wait.
  void halt();
  /// Asks for a tick at once.
  void wake();

  /// A node in C++ that has been called and has not come back.
  struct Call {
    std::string path;
    std::string id;
    Duration lasted{0};  ///< Wall time.
  };
  /// Where `run` is at this moment, from any thread: which node holds it up, where it does not return after `halt`, or
  /// longer than it may. Nothing: in none.
  [[nodiscard]] std::optional<Call> pending() const;

  /// Why the tick was given up.
  [[nodiscard]] const std::optional<Diagnostic>& error() const { return runner_.error(); }
  [[nodiscard]] std::uint64_t ticks() const { return ticks_; }
  [[nodiscard]] std::uint64_t missed() const { return missed_; }
  /// The tree with its state. Only while nobody is in `run`, or from a node, which may look at it, and `halt` it: that
  /// takes effect when the tick ends, and `run` returns IDLE unless the tree has completed by then. A tick from a node
  /// fails the tick.
  [[nodiscard]] bt::Runner& runner() { return runner_; }

 private:
  class SteadyClock;
  struct Signals;

  std::unique_ptr<SteadyClock> clock_;
  bt::Runner runner_;
  ExecutorOptions options_;
  bt::CallWatch calls_{&coarse_ms};
  /// Shared with the wakers that nodes keep: they may outlive the executor.
  std::shared_ptr<Signals> signals_;
  std::uint64_t ticks_ = 0;
  std::uint64_t missed_ = 0;
};

}  // namespace sentree::exec
