#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sentree/campaign/coverage.h"
#include "sentree/campaign/quick_runs.h"
#include "sentree/campaign/row.h"
#include "sentree/campaign/vary.h"
#include "sentree/project/part_cache.h"
#include "sentree/project/plan.h"
#include "sentree/project/variant.h"
#include "sentree/runtime/run.h"

namespace sentree::campaign {

/// Executes runs of one project, which it loads once.
class Runner {
 public:
  /// @param vary  File of what is varied; nothing: only the seed is.
  /// Codes: those of `load_project`, `load_vary`, `prepare`; campaign.elsewhere, campaign.area.
  [[nodiscard]] static Loaded<std::unique_ptr<Runner>> load(const std::filesystem::path& project,
                                                            const std::optional<std::filesystem::path>& vary);
  /// With what of the project is known already.
  [[nodiscard]] static Loaded<std::unique_ptr<Runner>> load(const std::filesystem::path& project,
                                                            const std::optional<std::filesystem::path>& vary,
                                                            project::PartCache& parts);

  /// What came out of one run.
  struct Executed {
    std::optional<runtime::RunReport> report;  ///< Nothing: what was drawn cannot be run.
    std::string invalid;                       ///< Why.
    std::optional<double> battery_least;
    std::optional<double> battery_end;
    std::map<std::string, double> violated_at;  ///< By monitor, the first violation [s].
    /// Places among the things that were given.
    std::vector<std::uint32_t> reached;
  };
  [[nodiscard]] Executed execute(const Draw& draw);
  /// From now on every run is executed, also where its steps are known from runs before it (`QuickRuns`).
  void forgo_memory() { remembers_ = false; }
  /// The same, and what it reaches of `things`.
  [[nodiscard]] Executed execute(const Draw& draw, const Coverage* things);
  [[nodiscard]] Row row(std::uint64_t run, std::uint64_t seed) { return row(run, seed, execute(drawing_->draw(seed))); }
  [[nodiscard]] Row row(std::uint64_t run, std::uint64_t seed, const Executed& executed) const;
  /// An endless script has been left behind in a thread of this process, which had better end.
  [[nodiscard]] bool spoilt() const { return spoilt_; }

  [[nodiscard]] const project::Plan& plan() const { return plan_; }
  [[nodiscard]] const project::Scenario& base() const { return base_; }
  [[nodiscard]] const Vary& vary() const { return vary_; }
  [[nodiscard]] const Drawing& drawing() const { return *drawing_; }
  /// Names of the monitors, as `Row::requirements` has them.
  [[nodiscard]] const std::vector<std::string>& requirements() const { return requirements_; }
  [[nodiscard]] std::vector<std::string> factor_names() const;
  /// Of the contents of all files: campaigns of one identity, seed and number are the same.
  [[nodiscard]] std::uint64_t identity() const;

 private:
  Runner(project::Plan plan, project::Scenario base, Vary vary);
  std::optional<QuickRuns::Done> execute_quickly();

  Vary vary_;
  project::Scenario base_;
  std::shared_ptr<const sim::World> world_;  // of the base
  std::optional<project::WorldSource> source_;
  project::Plan plan_;  // of the run at present
  std::unique_ptr<Drawing> drawing_;
  std::vector<std::string> requirements_;
  bool follows_files_ = false;  // what is varied is more than the world, deadlines and the timeline
  bool spoilt_ = false;
  bool remembers_ = true;
  std::optional<std::unique_ptr<QuickRuns>> quick_;  // nothing: not yet asked for; null: the plan is none for it
};

/// Seed of run `run` (from 1) of a campaign.
[[nodiscard]] constexpr std::uint64_t seed_of(std::uint64_t campaign, std::uint64_t run) {
  return campaign * kRunsMax + run;
}
/// The scenario of the run with that seed. Codes: as `Runner::load`.
[[nodiscard]] Loaded<project::Scenario> load_drawn(const std::filesystem::path& project,
                                                   const std::filesystem::path& vary, std::uint64_t seed);
/// Campaign seeds are at most this, so that runs' seeds fit a scenario file.
inline constexpr std::uint64_t kCampaignSeedMax = 9'000'000'000'000;

}  // namespace sentree::campaign
