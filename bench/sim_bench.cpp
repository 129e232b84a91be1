// Speed of the simulator's parts against the bounds that it promises (docs/simulator.md). The depot map is measured
// where SENTREE_TEST_MAPS or ../shared/maps has it, else a generated map of the same size.

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>

#include "sentree/sim/astar.h"
#include "sentree/sim/detail/particle_filter.h"
#include "sentree/sim/detail/route.h"
#include "sentree/sim/map_file.h"
#include "sentree/sim/simulation.h"
#include "sentree/text/file.h"

namespace sentree::sim {
namespace {

GridMap generated(int width, int height, double density) {
  Rng rng(1);
  std::vector<std::int8_t> cells(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
  const auto boxes = static_cast<int>(density * width * height);
  for (int i = 0; i < boxes; ++i) {
    const int x = static_cast<int>(rng.below(static_cast<std::uint64_t>(width - 12)));
    const int y = static_cast<int>(rng.below(static_cast<std::uint64_t>(height - 12)));
    for (int v = y; v < y + 10; ++v) {
      for (int u = x; u < x + 10; ++u) cells[static_cast<std::size_t>(v * width + u)] = 100;
    }
  }
  return {width, height, 0.05, {}, std::move(cells)};
}

GridMap depot() {
  const char* named = std::getenv("SENTREE_TEST_MAPS");
  const std::filesystem::path folder =
      (named != nullptr ? std::filesystem::path(named)
                        : std::filesystem::path(SENTREE_SOURCE_DIR) / ".." / "shared" / "maps") /
      "nav2";
  const auto source = text::read_file(folder / "depot.yaml");
  if (source) {
    Loaded<GridMap> map = parse_map(*source, "depot.yaml", [&](const std::string& image) {
      return text::read_file(folder / image, image, kImageBytesMax);
    });
    if (map.ok()) return *std::move(map.value);
  }
  std::cerr << "no depot map; measuring a generated one of its size\n";
  return generated(604, 307, 1.0 / 4000);
}

struct Setup {
  GridMap map = depot();
  DistanceField distance{map};
  RayField rays{map};
  CostGrid costs{map, distance, {.blocked_m = 0.28, .inflated_m = 0.78}};

  // Open cells a path apart.
  std::vector<Cell> open_cells(std::size_t count) const {
    Rng rng(7);
    std::vector<Cell> cells;
    while (cells.size() < count) {
      const Cell c{static_cast<int>(rng.below(static_cast<std::uint64_t>(map.width()))),
                   static_cast<int>(rng.below(static_cast<std::uint64_t>(map.height())))};
      if (costs.at(c) == CostGrid::kBlocked) continue;
      if (!cells.empty() && find_path(costs, cells.front(), c, 100'000'000).outcome != Plan::Outcome::kFound) continue;
      cells.push_back(c);
    }
    return cells;
  }
};

const Setup& setup() {
  static const Setup kSetup;
  return kSetup;
}

void Scan360(benchmark::State& state) {
  const std::vector<Cell> places = setup().open_cells(64);
  const LaserSpec laser;
  std::vector<double> ranges;
  std::size_t i = 0;
  for (auto _ : state) {
    const Vec2 p = setup().map.centre(places[i++ % places.size()]);
    cast_scan(setup().map, setup().rays, {}, {p.x, p.y, 0.1 * static_cast<double>(i)}, laser, ranges);
    benchmark::DoNotOptimize(ranges.data());
  }
}
BENCHMARK(Scan360)->Unit(benchmark::kMicrosecond);

void FilterUpdate(benchmark::State& state) {
  LocalizationSpec spec{.method = LocalizationSpec::Method::kAmcl};
  spec.particles_min = spec.particles_max = static_cast<int>(state.range(0));
  const LaserSpec laser;
  const Vec2 p = setup().map.centre(setup().open_cells(1)[0]);
  Localization localization = initial_localization(spec, {.pose = {p.x, p.y, 0.0}}, Rng(1));
  Scan scan;
  cast_scan(setup().map, setup().rays, {}, {p.x, p.y, 0.0}, laser, scan.ranges);
  const LikelihoodField field(setup().map, setup().distance, spec.reading);
  for (auto _ : state) {
    // To and fro, so that the particles stay where the scan was taken.
    update_particles({setup().map, field, spec, laser}, localization, {}, WholeScan(scan));
  }
  state.counters["per_particle"] = benchmark::Counter(
      static_cast<double>(state.range(0)), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(FilterUpdate)->Arg(500)->Arg(2000)->Unit(benchmark::kMicrosecond);

void PlanAcross(benchmark::State& state) {
  // The two of many open cells that are furthest apart.
  const std::vector<Cell> cells = setup().open_cells(200);
  Cell a = cells[0];
  Cell b = cells[0];
  int furthest = 0;
  for (const Cell p : cells) {
    for (const Cell q : cells) {
      const int d = (p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y);
      if (d > furthest) furthest = d, a = p, b = q;
    }
  }
  const RouteModel model{setup().map, setup().distance, setup().costs, 100'000'000, 0.22};
  for (auto _ : state) {
    Route route = find_route(model, setup().map.centre(a), setup().map.centre(b), {}, {});
    benchmark::DoNotOptimize(route.points.data());
  }
}
BENCHMARK(PlanAcross)->Unit(benchmark::kMillisecond);

void PlanRandom(benchmark::State& state) {
  const std::vector<Cell> cells = setup().open_cells(100);
  std::size_t i = 0;
  for (auto _ : state) {
    Plan plan = find_path(setup().costs, cells[i % 100], cells[(i * 37 + 11) % 100], 100'000'000);
    ++i;
    benchmark::DoNotOptimize(plan.cost);
  }
}
BENCHMARK(PlanRandom)->Unit(benchmark::kMillisecond);

void DistanceField2000(benchmark::State& state) {
  const GridMap map = generated(2000, 2000, 1.0 / 4000);
  for (auto _ : state) {
    DistanceField field(map);
    benchmark::DoNotOptimize(field.squared_cells().data());
  }
}
BENCHMARK(DistanceField2000)->Unit(benchmark::kMillisecond);

// A simulated minute of driving between random places on the depot map; `times_real_time` is the figure.
void WholeRobot(benchmark::State& state) {
  World world;
  world.map_id = "depot";
  world.map = setup().map;
  world.distance = setup().distance;
  world.rays = setup().rays;
  RobotSpec robot;
  const std::vector<Cell> places = setup().open_cells(50);
  const Vec2 start = world.map.centre(places[0]);
  robot.start = {start.x, start.y, 0.0};
  derive(world, robot);
  robot.laser.noise_m = 0.02;
  // Without a filter such wheels would lose the robot, and it would plan around walls that it believes to be new.
  if (state.range(0) != 0) {
    robot.localization.method = LocalizationSpec::Method::kAmcl;
    robot.odometry = {.scale = 0.03, .turn_scale = 0.02, .white = 0.1};
  }
  world.robots.push_back(robot);
  State sim = initial_state(world, 1);
  std::size_t goal = 0;
  for (auto _ : state) {
    for (int tick = 0; tick < 600; ++tick) {
      Navigator& navigator = sim.robots[0].navigator;
      if (!is_active(navigator.status)) {
        const Vec2 p = world.map.centre(places[++goal % places.size()]);
        start_goal(world.robots[0].navigation, navigator, "", {{p.x, p.y, 0.0}}, sim.time);
      }
      advance_by(world, sim, std::chrono::milliseconds(100));
    }
  }
  state.counters["times_real_time"] = benchmark::Counter(60.0, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(WholeRobot)->ArgName("amcl")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace sentree::sim

BENCHMARK_MAIN();
