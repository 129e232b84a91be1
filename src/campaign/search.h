#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/rng.h"
#include "sentree/campaign/runner.h"
#include "sentree/campaign/summary.h"

namespace sentree::campaign {

/// Looks for runs that reach what no run before has, as a fuzzer does: runs that did are a corpus, and most runs take
/// what was drawn for one of them and draw a part of it anew. Rates over such runs say nothing about how often
/// something happens.
///
/// Runs come in generations. What a run is drawn from depends on the seed, its number and the generations before, so
/// that a search is the same however many processes execute it.
class Search {
 public:
  static constexpr std::uint64_t kGeneration = 32;  ///< Runs.

  /// A run that reached something first.
  struct Entry {
    std::uint64_t run = 0;
    Seeds seeds;
    std::vector<std::uint32_t> reached;  ///< Places among `coverage().things()`.
    std::size_t fresh = 0;               ///< How many of them no run before had.
  };

  /// @param drawing   Borrowed.
  /// @param coverage  What can be reached; what of it is has been before.
  /// @param seed      Of the campaign.
  Search(const Drawing& drawing, Coverage coverage, std::uint64_t seed);

  /// What a run of the present generation is drawn from.
  [[nodiscard]] Seeds seeds(std::uint64_t run) const;
  /// What the next run of the present generation has reached. It changes nothing before that is over.
  void take(std::uint64_t run, std::vector<std::uint32_t> reached);
  void end_generation();
  /// Remembers what a run of the present generation is drawn from.
  void keep(std::uint64_t run) { kept_[run] = seeds(run); }
  /// Of a run that was kept; null: it was not.
  [[nodiscard]] const Seeds* kept(std::uint64_t run) const;

  [[nodiscard]] const Coverage& coverage() const { return coverage_; }
  [[nodiscard]] const std::vector<Entry>& corpus() const { return corpus_; }

 private:
  [[nodiscard]] const Entry& choose(Rng& rng) const;

  const Drawing& drawing_;
  Coverage coverage_;
  std::uint64_t seed_;
  std::vector<std::uint64_t> hits_;  // by thing, the runs that reached it
  std::vector<Entry> corpus_;        // at most one entry for each thing
  std::vector<Entry> taken_;         // of the present generation
  std::map<std::uint64_t, Seeds> kept_;
};

/// Writes the corpus into the folder, a scenario file a run: run-N.yaml. Runs that cannot be run are left out. Error:
/// file.unwritable.
[[nodiscard]] Result<void> write_corpus(const Runner& runner, const Search& search,
                                        const std::filesystem::path& folder);
/// What was found, as data and as a few lines for people.
/// @param least  By requirement (or "mission"), the file of its least scenario.
[[nodiscard]] Value to_value(const Search& search, const Summary& summary);
[[nodiscard]] std::string to_text(const Search& search, const Summary& summary,
                                  const std::map<std::string, std::string>& least);

}  // namespace sentree::campaign
