#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "sentree/runtime/run.h"

namespace sentree::cli {

/// Tells on the terminal how far a run in virtual time has come, once it takes longer than a second.
class Progress {
 public:
  /// Sees the run through `options`, which it adds to; no effect on runs in real time or at a pace.
  Progress(const project::Plan& plan, runtime::RunOptions& options);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

 private:
  void show_until_done();

  std::string name_;
  Duration limit_;
  std::mutex mutex_;
  std::condition_variable changed_;
  runtime::RunView* view_ = nullptr;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace sentree::cli
