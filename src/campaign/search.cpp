#include "sentree/campaign/search.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "sentree/project/scenario_text.h"
#include "sentree/text/file.h"

namespace sentree::campaign {

namespace {

// Runs that are drawn as if there were no corpus: what it has may be the wrong place to begin from.
constexpr double kBlind = 0.2;
// Runs that take parts of two entries: what each has reached may be needed together.
constexpr double kCrossed = 0.25;
// Runs that change one part more, each time.
constexpr double kOneMore = 0.4;
// Entries of which the rarest is taken.
constexpr int kCandidates = 3;

}  // namespace

Search::Search(const Drawing& drawing, Coverage coverage, std::uint64_t seed)
    : drawing_(drawing), coverage_(std::move(coverage)), seed_(seed), hits_(coverage_.things().size()) {}

// The one whose rarest thing has been reached least often.
const Search::Entry& Search::choose(Rng& rng) const {
  const Entry* chosen = nullptr;
  std::uint64_t rarest = 0;
  for (int i = 0; i < kCandidates; ++i) {
    const Entry& entry = corpus_[rng.below(corpus_.size())];
    std::uint64_t least = UINT64_MAX;
    for (const std::uint32_t thing : entry.reached) least = std::min(least, hits_[thing]);
    if (chosen != nullptr && least >= rarest) continue;
    chosen = &entry;
    rarest = least;
  }
  return *chosen;
}

Seeds Search::seeds(std::uint64_t run) const {
  const std::uint64_t own = seed_of(seed_, run);
  Rng rng = Rng::of(own, "campaign.search");
  const std::vector<std::size_t> free = drawing_.free_sources();
  if (corpus_.empty() || free.empty() || rng.uniform() < kBlind) return drawing_.seeds(own);
  Seeds seeds = choose(rng).seeds;
  if (rng.uniform() < kCrossed) {
    const Entry& other = choose(rng);
    for (std::size_t i = 0; i < seeds.size(); ++i) {
      if (rng.below(2) == 1) seeds[i] = other.seeds[i];
    }
  }
  do {
    seeds[free[rng.below(free.size())]] = own;
  } while (rng.uniform() < kOneMore);
  return seeds;
}

void Search::take(std::uint64_t run, std::vector<std::uint32_t> reached) {
  coverage_.reach(reached);
  taken_.push_back({.run = run, .seeds = seeds(run), .reached = std::move(reached)});
}

void Search::end_generation() {
  for (Entry& entry : std::exchange(taken_, {})) {
    for (const std::uint32_t thing : entry.reached) entry.fresh += hits_[thing]++ == 0 ? 1 : 0;
    if (entry.fresh > 0) corpus_.push_back(std::move(entry));
  }
}

const Seeds* Search::kept(std::uint64_t run) const {
  const auto found = kept_.find(run);
  return found != kept_.end() ? &found->second : nullptr;
}

namespace {

// What was violated, the mission's failure last.
std::vector<Summary::Requirement> found_in(const Summary& summary) {
  std::vector<Summary::Requirement> found = summary.requirements();
  found.push_back(summary.failing());
  found.back().violated = summary.ended(Outcome::kFailure);
  std::erase_if(found, [](const Summary::Requirement& requirement) { return requirement.first_run == 0; });
  return found;
}

}  // namespace

Result<void> write_corpus(const Runner& runner, const Search& search, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::filesystem::path project = runner.base().project.folder.empty() ? "." : runner.base().project.folder;
  const std::string from = std::filesystem::relative(project, folder, error).generic_string();
  for (const Search::Entry& entry : search.corpus()) {
    const auto scenario = scenario_of(runner.base(), runner.vary(), runner.drawing().draw(entry.seeds));
    if (!scenario.ok()) continue;
    const std::string text = project::scenario_text(*scenario.value, {}, std::nullopt, from);
    if (auto written = text::write_file(folder / fmt::format("run-{}.yaml", entry.run), text); !written) return written;
  }
  return {};
}

Value to_value(const Search& search, const Summary& summary) {
  List corpus;
  for (const Search::Entry& entry : search.corpus())
    corpus.push_back(
        Map{{"run", static_cast<std::int64_t>(entry.run)}, {"reached_first", static_cast<std::int64_t>(entry.fresh)}});
  List violated;
  for (const Summary::Requirement& requirement : found_in(summary))
    violated.push_back(Map{{"name", requirement.name},
                           {"first_run", static_cast<std::int64_t>(requirement.first_run)},
                           {"runs", static_cast<std::int64_t>(requirement.violated)}});
  return Map{{"seed", static_cast<std::int64_t>(summary.asked().seed)},
             {"runs", static_cast<std::int64_t>(summary.runs())},
             {"counted", static_cast<std::int64_t>(summary.counted())},
             {"corpus", std::move(corpus)},
             {"violated", std::move(violated)},
             {"coverage", search.coverage().to_value()}};
}

std::string to_text(const Search& search, const Summary& summary, const std::map<std::string, std::string>& least) {
  std::string out = fmt::format("searched      {} runs, seed {}; {} of them reached something first\n", summary.runs(),
                                summary.asked().seed, search.corpus().size());
  for (const Summary::Requirement& requirement : found_in(summary)) {
    const auto file = least.find(requirement.name);
    out += fmt::format("{} {} in {} runs, first in run {}{}\n", requirement.name,
                       requirement.name == "mission" ? "fails" : "is violated", requirement.violated,
                       requirement.first_run, file != least.end() ? ": " + file->second : "");
  }
  if (summary.counted() < summary.runs())
    out += fmt::format("{} runs could not be run, or not to their end\n", summary.runs() - summary.counted());
  return fmt::format("{}{}Runs were looked for, not drawn: they say nothing about how often something happens.\n", out,
                     search.coverage().to_text());
}

}  // namespace sentree::campaign
