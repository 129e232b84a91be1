#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "sentree/base/rng.h"
#include "sentree/base/time.h"
#include "sentree/sim/grid_map.h"
#include "sentree/sim/shape.h"

namespace sentree::sim {

inline constexpr int kBeamsMax = 10'000;

/// A planar range finder. Beam 0 points along `angle_min`; beams run counter-clockwise.
struct LaserSpec {
  Pose2 mount;  ///< Pose of the laser in base_link.
  double angle_min_rad = -std::numbers::pi;
  double angle_increment_rad = 2.0 * std::numbers::pi / 360;
  int beams = 360;            ///< 1 to kBeamsMax.
  double range_min_m = 0.05;  ///< Nearer returns are reported as -inf (REP 117).
  double range_max_m = 8.0;   ///< Beyond it: +inf.
  Duration period = std::chrono::milliseconds(100);
  double noise_m = 0.0;  ///< Standard deviation of the range.
  double dropout = 0.0;  ///< Share of the beams that return nothing, 0 to 1.

  friend bool operator==(const LaserSpec&, const LaserSpec&) = default;
};

/// One turn of the laser.
struct Scan {
  TimePoint stamp{};
  std::vector<double> ranges;  ///< Metres per beam; +inf: nothing within range.

  friend bool operator==(const Scan&, const Scan&) = default;
};

/// A map prepared for ray casting: per cell and quadrant of travel, the largest empty square that begins at the cell.
class RayField {
 public:
  RayField() = default;
  /// O(cells); four bytes a cell.
  explicit RayField(const GridMap& map);

  /// Distance [cells] from `from` (grid coordinates) along the unit vector `direction` to the boundary of the first
  /// occupied cell; 0 from inside one, +inf if the ray leaves the map or `range_max` first. Unknown cells let it pass.
  ///
  /// Exact: each crossing of a boundary is computed from the boundary, never summed up, so that the empty squares,
  /// which skip cells, do not change a bit of it. A ray through a corner of cells meets a cell beside the corner as
  /// well; it does not slip between two walls that touch there. Source: Amanatides & Woo, "A Fast Voxel Traversal
  /// Algorithm for Ray Tracing", 1987.
  [[nodiscard]] double cast(Vec2 from, Vec2 direction, double range_max) const;

  /// The same for each of `directions`; `ranges` is as long. Faster: four rays are followed side by side.
  void cast(Vec2 from, std::span<const Vec2> directions, double range_max, std::span<double> ranges) const;

  friend bool operator==(const RayField&, const RayField&) = default;

 private:
  struct Ray;
  [[nodiscard]] bool contains(Vec2 from) const;
  [[nodiscard]] Ray start(Vec2 from, Vec2 direction, double range_max) const;
  [[nodiscard]] double length(const Ray& ray) const;

  int width_ = 0;
  int height_ = 0;
  int stride_ = 0;  // one cell of border on each side
  // Side of the square, at most 255; 0 for an occupied cell or the border. By quadrant: +x +y, -x +y, +x -y, -x -y.
  std::array<std::vector<std::uint8_t>, 4> empty_;
};

/// Ranges [m] of a laser at `laser_pose` (map frame) among the map's walls and `shapes`: exact, without noise.
/// A pose outside the map sees shapes only. Cost: O(beams · range / cell size) at most; allocates only to grow
/// `ranges`.
void cast_scan(const GridMap& map, const RayField& field, std::span<const Shape> shapes, const Pose2& laser_pose,
               const LaserSpec& spec, std::vector<double>& ranges);

/// The same of some beams, each bit as in the whole scan; among the map's walls only.
void cast_beams(const GridMap& map, const RayField& field, const Pose2& laser_pose, const LaserSpec& spec,
                std::span<const std::size_t> beams, std::span<double> ranges);

/// Cosine and sine of the angle of each of `beams` beams in the laser's frame. In this thread's memory until others are
/// asked for.
[[nodiscard]] std::span<const Vec2> beam_directions(const LaserSpec& spec, std::size_t beams);

/// Applies the spec's noise and drop-outs. Draws nothing from `rng` where both are 0.
void disturb_scan(const LaserSpec& spec, Rng& rng, std::vector<double>& ranges);

}  // namespace sentree::sim
