#include "sentree/studio/reached.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "sentree/replay/replay.h"

namespace sentree::studio {

Value coverage_value(const campaign::Coverage& coverage, const std::filesystem::path& folder) {
  using Kind = campaign::Coverage::Kind;
  List kinds;
  for (const Kind kind :
       {Kind::kNode, Kind::kState, Kind::kTransition, Kind::kGuard, Kind::kMethod, Kind::kRequirement}) {
    const auto count = coverage.count(kind);
    kinds.push_back(Map{{"kind", campaign::to_string(kind)},
                        {"reached", static_cast<std::int64_t>(count.reached)},
                        {"of", static_cast<std::int64_t>(count.of)}});
  }
  List missing;
  for (const auto& [thing, reached] : coverage.things()) {
    if (reached) continue;
    const std::size_t colon = thing.at.rfind(':');
    std::string file = thing.at.substr(0, std::min(colon, thing.at.size()));
    if (const auto inside = std::filesystem::path(file).lexically_relative(folder);
        !inside.empty() && *inside.begin() != "..")
      file = inside.generic_string();
    const bool is_of_chart =
        thing.kind == Kind::kState || thing.kind == Kind::kTransition || thing.kind == Kind::kGuard;
    missing.push_back(
        Map{{"kind", campaign::to_string(thing.kind)},
            {"of", is_of_chart ? file : thing.of},
            {"what", thing.what},
            {"file", file},
            {"line",
             colon == std::string::npos ? std::int64_t{0} : std::int64_t{std::atoi(thing.at.c_str() + colon + 1)}}});
  }
  return Map{{"kinds", std::move(kinds)}, {"not_reached", std::move(missing)}};
}

Result<Reached> reached_by(const std::string& recording, replay::RecordedCode code) {
  auto run = replay::RecordedRun::open(recording);
  if (!run) return tl::unexpected(run.error());
  const auto prepared = [&]() -> Result<project::Plan> {
    auto scenario = run->scenario(code);
    if (scenario.ok()) {
      scenario.value->virtual_time = false;  // what is executed elsewhere is replayed in this process
      if (auto plan = project::prepare(std::move(*scenario.value)); plan.ok()) return std::move(*plan.value);
    }
    return fail("record.no-project", "the recorded project cannot be loaded", SourceSpan{recording});
  };
  // One is watched, the other given away.
  const auto watched = prepared();
  if (!watched) return tl::unexpected(watched.error());
  auto plan = prepared();
  if (!plan) return tl::unexpected(plan.error());
  Reached reached{.coverage = {}, .folder = watched->scenario.project.folder};
  replay::ReplayOptions options;
  campaign::CoverageWatch watch(*watched, reached.coverage, options.run);
  const auto report = replay::replay(*run, std::move(*plan), std::move(options));
  if (!report) return tl::unexpected(report.error());
  if (!report->differences.empty()) {
    const auto& first = report->differences.front();
    return fail("coverage.differs",
                fmt::format("executed again, the run differs from its recording: {} {} instead of {}", first.who,
                            first.replayed, first.recorded));
  }
  watch.finish(report->run);
  return reached;
}

}  // namespace sentree::studio
