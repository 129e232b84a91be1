#include "sentree/cli/watched_work.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/runtime/watchdog.h"

namespace sentree::cli {

namespace {

// "skill GoToKitchen": whose chart a file is; of several leaves with one chart all are named.
class Owners {
 public:
  void add(const scxml::Chart& chart, const std::string& name) { charts_.emplace_back(chart.file(), name); }
  void add(const std::vector<monitor::Model>& monitors) {
    for (const monitor::Model& model : monitors) add(model.chart(), "monitor " + model.name());
  }
  void add(const project::Plan& plan) {
    for (const project::LeafPlan& leaf : plan.leaves) {
      if (leaf.chart) add(*leaf.chart, "skill " + leaf.name);
    }
    for (const project::ModelPlan& model : plan.models) add(model.chart, "model " + model.name);
    add(plan.monitors);
  }
  [[nodiscard]] std::string of(const std::string& file) const {
    std::vector<std::string> all;
    for (const auto& [its, name] : charts_) {
      if (its == file && std::find(all.begin(), all.end(), name) == all.end()) all.push_back(name);
    }
    return all.empty() ? "a chart that is invoked" : fmt::format("{}", fmt::join(all, ", "));
  }

 private:
  std::vector<std::pair<std::string, std::string>> charts_;
};

thread_local WorkWatch* watch_of_thread = nullptr;

}  // namespace

class WorkWatch {
 public:
  explicit WorkWatch(Duration script_max) : script_max_(script_max), watchdog_(script_max) {}

  // Of a thread, as long as it is kept.
  std::shared_ptr<runtime::Watched> look_on() {
    auto watched = std::make_shared<runtime::Watched>([this](const SourceSpan& script) {
      {
        const std::lock_guard lock(mutex_);
        if (!script_) script_ = script;
      }
      thread_.leave();
    });
    watched->in_this_thread();
    watchdog_.watch(watched);
    return watched;
  }

  // False: a script did not end.
  bool run(std::function<void()> work) { return thread_.run(std::move(work)); }

  Diagnostic endless(const Owners& owners) {
    const std::lock_guard lock(mutex_);
    return {Severity::kError, "script.endless",
            fmt::format("this script does not end (more than {} ms of processor time in one step); it is of {}. Bound "
                        "its loop; a step that may take longer has deadlines: {{script: …}} in sentree.yaml",
                        script_max_ / std::chrono::milliseconds(1), owners.of(script_->file)),
            *script_};
  }

 private:
  const Duration script_max_;
  std::mutex mutex_;
  std::optional<SourceSpan> script_;
  runtime::LeavableThread thread_;
  runtime::Watchdog watchdog_;
};

struct Watching::Inside {
  explicit Inside(WorkWatch& watch)
      : watched(watch.look_on()), thread(&watched->execution()), before(std::exchange(watch_of_thread, &watch)) {}
  ~Inside() { watch_of_thread = before; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

  std::shared_ptr<runtime::Watched> watched;
  scxml::WatchThread thread;
  WorkWatch* before;
};

Watching::Watching(WorkWatch* watch) : inside_(watch != nullptr ? std::make_unique<Inside>(*watch) : nullptr) {}
Watching::~Watching() = default;
WorkWatch* Watching::of_this_thread() { return watch_of_thread; }

namespace {

int watched_work(const Owners& owners, Duration script_max, bool json, const std::function<int()>& work,
                 const Shown& shown) {
  // Behind an endless script it is never destroyed.
  auto watch = std::make_unique<WorkWatch>(script_max);
  int code = kOk;
  const bool done = watch->run([&, of = watch.get()] {
    const Watching watching(of);
    code = work();
  });
  if (done) return code;
  Diagnostics errors{watch.release()->endless(owners)};
  if (shown) errors = shown(std::move(errors));
  show_status("");
  if (json) print(to_json(Value(Map{{"errors", to_value(errors)}})) + "\n");
  say(errors);
  return leave(kInvalidInput);
}

}  // namespace

int watched_work(const project::Plan& plan, bool json, const std::function<int()>& work, const Shown& shown) {
  Owners owners;
  owners.add(plan);
  return watched_work(owners, plan.scenario.project.deadlines.script, json, work, shown);
}

int watched_work(const std::vector<monitor::Model>& monitors, Duration script_max, bool json,
                 const std::function<int()>& work, const Shown& shown) {
  Owners owners;
  owners.add(monitors);
  return watched_work(owners, script_max, json, work, shown);
}

}  // namespace sentree::cli
