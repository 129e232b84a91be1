#pragma once

#include <memory>

#include "sentree/exec/executor.h"
#include "sentree/groot/server.h"

namespace sentree::groot {

/// Shows the tree of an executor to Groot 1 and Groot 2, as BehaviorTree.CPP's publishers do; hooks work as they do
/// there: a breakpoint stops the thread that ticks inside the node, and a replaced result is the node's result.
///
///     exec::Executor executor(std::move(*tree.value), {.period = 100ms});
///     auto groot = groot::Publisher::start(executor);
///     if (!groot) …print groot.error()…
///     executor.run();
///
/// Whoever waits at a breakpoint goes on when Groot says so, when it is silent for 5 s, and when the publisher ends.
class Publisher {
 public:
  /// Made and destroyed while nobody is in `executor.run`; the executor lives longer. An observer that the executor has
  /// already is told as before; hooks that it has already stay alone, and those of Groot are refused.
  /// Errors: those of `Server::start`, groot.too-many-nodes.
  [[nodiscard]] static Result<std::unique_ptr<Publisher>> start(exec::Executor& executor, ServerOptions options = {});
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  [[nodiscard]] const Server& server() const;
  /// Lets who waits at a breakpoint go on, and refuses further breakpoints. From any thread: before `executor.halt()`.
  void let_go();

 private:
  struct Impl;
  explicit Publisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace sentree::groot
