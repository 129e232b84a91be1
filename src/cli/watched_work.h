#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/project/plan.h"

namespace sentree::cli {

using Shown = std::function<Diagnostics(Diagnostics)>;

/// Does `work`, which steps charts of a plan in this process, while a watchdog looks on: a script that does not end
/// ends the command, with its place and whose it is, and nothing else can. Threads that `work` makes must be
/// `Watching`.
///
/// @param plan  Says how long one step of a chart may take (`deadlines: {script: …}`) and whose charts there are.
/// @param json  What is wrong is printed as JSON too.
/// @return  The exit code of `work`. Behind an endless script the process ends by kInvalidInput, right here: what the
///          script works on must not be destroyed.
/// @param shown  Puts files of the message as the user knows them; empty: they are as the charts say.
[[nodiscard]] int watched_work(const project::Plan& plan, bool json, const std::function<int()>& work,
                               const Shown& shown = {});
/// The same of monitors of whatever project. `script_max`: processor time of one step.
[[nodiscard]] int watched_work(const std::vector<monitor::Model>& monitors, Duration script_max, bool json,
                               const std::function<int()>& work, const Shown& shown);

class WorkWatch;

/// While it lives, scripts of this thread are those of the work that `watch` is of.
class Watching {
 public:
  /// @param watch  Of the thread that has the work (`of_this_thread`); null: nobody looks on.
  explicit Watching(WorkWatch* watch);
  ~Watching();
  Watching(const Watching&) = delete;
  Watching& operator=(const Watching&) = delete;

  [[nodiscard]] static WorkWatch* of_this_thread();

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace sentree::cli
