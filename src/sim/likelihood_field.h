#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sentree/sim/distance_field.h"
#include "sentree/sim/geometry.h"
#include "sentree/sim/grid_map.h"

namespace sentree::sim {

/// How the likelihood of a reading falls with the distance of its end from the nearest wall.
struct ReadingSpec {
  double hit_sigma_m = 0.2;
  double random_share = 0.4;  ///< Weight of a uniform reading beside a hit, above 0.

  friend bool operator==(const ReadingSpec&, const ReadingSpec&) = default;
};

/// Where the used beams of a scan end, as seen from the robot [cells].
struct BeamEnds {
  std::vector<float> x;
  std::vector<float> y;  ///< As many.
};

/// Per cell, the log of the density of a reading that ends there: a normal hit over the distance to the nearest wall
/// plus a uniform part, up to a factor, in 255 steps between the best and a miss.
class LikelihoodField {
 public:
  LikelihoodField() = default;
  /// O(cells); a byte a cell.
  LikelihoodField(const GridMap& map, const DistanceField& distance, const ReadingSpec& spec);

  /// Sum over the beams of the log likelihood with the robot at `at` (grid coordinates) and `heading_rad` in the grid.
  /// Source: Thrun, Burgard, Fox, "Probabilistic Robotics", 2005, table 6.3.
  [[nodiscard]] double log_likelihood(const BeamEnds& ends, Vec2 at, double heading_rad) const;

  /// exp of the log likelihood of the best reading.
  [[nodiscard]] double best() const;

  friend bool operator==(const LikelihoodField&, const LikelihoodField&) = default;

 private:
  int stride_ = 0;  // a border of misses around the map
  int rows_ = 0;
  double log_best_ = 0.0;
  double log_step_ = 0.0;           // per unit of `loss_`
  std::vector<std::uint8_t> loss_;  // against the best
};

}  // namespace sentree::sim
