// Runs of the recharge story as a campaign makes them, one after another, the project loaded before.

#include <benchmark/benchmark.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>

#include "sentree/base/temporary_folder.h"
#include "sentree/campaign/runner.h"

namespace sentree::campaign {
namespace {

// `localization`: what the scenario says instead of the world.
void run_of(benchmark::State& state, const std::string& localization) {
  const std::filesystem::path project = std::filesystem::path(SENTREE_SOURCE_DIR) / "examples" / "recharge";
  const TemporaryFolder folder("bench");
  const std::filesystem::path vary = folder.path() / "vary.yaml";
  std::ofstream(vary) << "scenario: " << (project / "scenarios" / "recharge.yaml").string()
                      << "\noverride: {world: {localization: " << localization << "}}\n";
  const auto runner = Runner::load(project, vary);
  if (!runner.ok()) {
    for (const Diagnostic& diagnostic : runner.diagnostics) std::cerr << to_string(diagnostic) << '\n';
    state.SkipWithError("it cannot be loaded");
    return;
  }
  std::uint64_t run = 0;
  std::uint64_t observations = 0;
  for (auto _ : state) {
    ++run;
    const Runner::Executed executed = (*runner.value)->execute((*runner.value)->drawing().draw(seed_of(1, run)));
    observations += executed.report->observations;
    if (executed.report->mission != bt::Status::kSuccess) state.SkipWithError("a run did not succeed");
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(run));
  state.counters["observations"] = static_cast<double>(observations) / static_cast<double>(run);
}

void run_exact(benchmark::State& state) { run_of(state, "exact"); }
void run_amcl(benchmark::State& state) { run_of(state, "{method: amcl}"); }

// A run has a thread of its own.
BENCHMARK(run_exact)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);
BENCHMARK(run_amcl)->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sentree::campaign

BENCHMARK_MAIN();
