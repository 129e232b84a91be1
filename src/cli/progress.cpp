#include "sentree/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <utility>

#include "sentree/cli/output.h"

namespace sentree::cli {

Progress::Progress(const project::Plan& plan, runtime::RunOptions& options)
    : name_(plan.scenario.name), limit_(plan.scenario.duration) {
  if (!plan.scenario.virtual_time || options.pace > 0 || options.paused || isatty(STDERR_FILENO) == 0) return;
  options.on_view = [this, before = std::move(options.on_view)](runtime::RunView* view) {
    if (before) before(view);
    const std::lock_guard lock(mutex_);
    view_ = view;
  };
  thread_ = std::thread([this] { show_until_done(); });
}

Progress::~Progress() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  show_status("");
}

void Progress::show_until_done() {
  const auto began = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  auto next = std::chrono::seconds(1);
  while (!changed_.wait_until(lock, began + next, [&] { return done_; })) {
    next += std::chrono::seconds(1);
    if (view_ == nullptr) continue;
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    const double now_s = seconds(view_->now());
    show_status(fmt::format("{}: {:.0f} s of at most {:.0f} s, {:.0f} times as fast as the clock; Ctrl-C ends it",
                            name_, now_s, std::chrono::duration<double>(limit_).count(), now_s / wall_s));
  }
}

}  // namespace sentree::cli
