#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sentree/cli/commands.h"

namespace sentree::cli {

struct CampaignCommand {
  std::string project = ".";
  std::string vary;  ///< Empty: campaign.yaml of the project, if it has one.
  std::optional<std::uint64_t> runs;
  std::optional<std::uint64_t> seed;
  std::optional<std::size_t> jobs;  ///< All cores.
  std::string precision;            ///< "1 %"; empty: all runs.
  std::string confidence;           ///< Empty: 95 %, or as the runs were made.
  std::vector<std::string> expect;  ///< "never_empty violated < 1e-3".
  std::string shard;                ///< "2/4"; empty: all.
  bool mpi = false;                 ///< It is one of the ranks that a launcher has started.
  bool search = false;              ///< For what was not reached, instead of drawing runs.
  bool coverage = false;            ///< Say what runs have reached.
  std::string out;                  ///< Folder; empty: campaign/ in the project.
  bool resume = false;
  bool no_shrink = false;
  bool json = false;
  std::vector<std::string> merged;  ///< Folders of shards, of `merge`.
};
int campaign(const CampaignCommand& command);
int campaign_merge(const CampaignCommand& command);

/// Runs that of a campaign with the command's seed: its scenario is written into the project's campaign/.
/// @param vary  As `CampaignCommand::vary`.
int run_drawn(const RunCommand& command, const std::string& vary);

}  // namespace sentree::cli
