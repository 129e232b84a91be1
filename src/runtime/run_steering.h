#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sentree/runtime/plan.h"
#include "sentree/runtime/scheduler.h"
#include "sentree/runtime/steering.h"

namespace sentree::runtime {

/// What steering needs of the run. The functions are called in the director's actor.
struct SteeredRun {
  const Plan* plan = nullptr;
  Scheduler* scheduler = nullptr;
  ActorId director = 0;
  std::function<void(Message)> publish;
  std::function<std::uint64_t()> tick;  ///< Number of the last root tick. From any thread.
  std::function<CallOutcome(const std::string& service, const std::string& method, const Value& args)> call;
  std::function<void()> stop;
  std::function<void(const std::string& process)> kill_process;
};

/// Does to a run what its timeline says and what a person asks for.
class RunSteering final : public Steering {
 public:
  explicit RunSteering(SteeredRun run);

  /// In the director's actor: publishes an intervention and does it. `source` is who wanted it.
  Result<Applied> execute(const Intervention& what, const std::string& source);
  /// In the mission's actor: a root tick has been done.
  void tick_done(std::uint64_t tick);
  /// Nothing is executed any more: whoever waits is told.
  void finish();
  /// As `stop`, without waiting; for whoever wants the run to end. From any thread.
  void ask_to_stop(const std::string& source);

  Status status() const override;
  Status wait_paused() override;
  TimePoint time() const override { return run_.scheduler->view_time(); }
  Result<void> pause() override;
  Result<void> resume() override;
  Result<void> step(std::uint64_t ticks) override;
  Result<void> run_until(TimePoint time) override;
  Result<void> set_factor(double factor) override;
  Result<Applied> apply(const Intervention& what) override;
  std::vector<StandingIntervention> standing() const override;
  std::vector<SteeredPart> parts() const override;
  Result<std::string> scenario() const override;

 private:
  // An answer that somebody waits for.
  struct Answer {
    std::mutex mutex;
    std::condition_variable changed;
    std::optional<Result<Applied>> result;
  };
  // Runs `work` in the director's actor and waits for what it returns.
  Result<Applied> in_director(std::function<Result<Applied>()> work);
  Result<void> refuse() const;
  void go_on();
  void hold();

  SteeredRun run_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::uint64_t step_until_ = 0;  // number of the tick after which it pauses; 0: it does not
  std::uint64_t until_ = 0;       // which `run_until` holds; each change of mind makes an older one void
  std::vector<std::weak_ptr<Answer>> open_;
};

}  // namespace sentree::runtime
