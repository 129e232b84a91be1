#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sentree/campaign/runner.h"
#include "sentree/campaign/search.h"
#include "sentree/campaign/summary.h"

namespace sentree::campaign {

/// A part of a campaign: the runs whose number, less one, has the remainder `index` − 1 by `count`.
struct Shard {
  std::uint64_t index = 1;
  std::uint64_t count = 1;
};

/// What is written down beside the table of runs, so that it can be gone on with and merged.
struct Settings {
  std::string project;  ///< As it was named.
  std::string vary;     ///< Likewise; empty: none.
  Asked asked;
  Shard shard;
  std::uint64_t identity = 0;  ///< Of the files.
};
[[nodiscard]] Value to_value(const Settings& settings);
/// Of the folder that a campaign wrote them into: the project and what is varied are named so that they are found from
/// the present folder, if they are still where they were beside it. Error: campaign.settings.
[[nodiscard]] Result<Settings> read_settings(const std::filesystem::path& folder);

/// What is asked of a campaign that is gone on with; nothing: what was asked before.
struct AskedAgain {
  std::optional<std::uint64_t> seed;
  std::optional<std::uint64_t> runs;
  std::optional<double> confidence;
  std::optional<double> precision;
  std::vector<std::string> expectations;
};
/// What was asked, with more runs if they are asked for now.
/// @param folder  Of the runs, for messages.
/// Error: campaign.changed, if something else is asked.
[[nodiscard]] Result<Asked> ask_again(Asked before, const AskedAgain& now, const std::filesystem::path& folder);

inline constexpr const char* kTableName = "runs.csv";
inline constexpr const char* kSettingsName = "campaign.json";
inline constexpr const char* kResultName = "result.json";

struct Progress {
  std::uint64_t done = 0;   ///< Runs, those of a table that is gone on with among them.
  std::uint64_t fresh = 0;  ///< Of them, those that were run now.
  std::uint64_t of = 0;
  const Summary* summary = nullptr;
};

struct CampaignOptions {
  std::size_t jobs = 1;
  std::filesystem::path folder;  ///< Exists.
  bool resume = false;           ///< Go on behind the runs that the folder has.
  Coverage* coverage = nullptr;  ///< If given, has what can be reached, and gets what is. Borrowed.
  Search* search = nullptr;      ///< Chooses what runs are drawn from; null: the seed of each alone. Borrowed.
  std::function<void(const Progress&)> on_progress;
  std::function<bool()> is_interrupted;
};

/// Runs a campaign, or its shard, in processes of their own, and writes its table and settings into the folder. The
/// result is that of the runs so far, in the order of their numbers, whatever the number of processes. A shard runs all
/// of its part: only who merges knows whether it could have ended. What is reached, and a search, are of the runs that
/// are executed now: for neither can a campaign be gone on with, nor be one shard of several.
/// Errors: campaign.process, campaign.table, campaign.settings, campaign.changed, file.*.
[[nodiscard]] Result<Summary> run_campaign(Runner& runner, const Settings& settings, const CampaignOptions& options);

/// The result of tables in several folders, shards of one campaign, and one table of all into `folder`, which is none
/// of them and keeps what it has until the table is whole. Runs that no shard has are lost; there are as many as most
/// were asked for. Errors: as `run_campaign`; campaign.other-shard, if `folder` is one of them.
[[nodiscard]] Result<Summary> merge_campaign(const Runner& runner, const Settings& settings,
                                             const std::vector<std::filesystem::path>& shards,
                                             const std::filesystem::path& folder);

/// Writes the least scenario of each requirement that was violated, and of the first mission that failed, into the
/// folder; by name, its file.
/// Errors: campaign.process, file.*.
[[nodiscard]] Result<std::map<std::string, std::string>> write_least(Runner& runner, const Summary& summary,
                                                                     const CampaignOptions& options);

/// Takes away the least scenarios that the `kResultName` of the folder names, but for those `kept` by their names and
/// those that somebody has edited.
/// Error: file.unwritable.
[[nodiscard]] Result<void> take_away_least(const std::filesystem::path& folder,
                                           const std::map<std::string, std::string>& kept);

}  // namespace sentree::campaign
