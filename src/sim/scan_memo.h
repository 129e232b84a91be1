#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sentree/sim/geometry.h"
#include "sentree/sim/shape.h"

namespace sentree::sim {

/// What each laser of one world saw last, without noise: while nothing moves, it sees the same again.
/// Scans that are looked up in it (Present<ScanMemo>) must be of that world.
class ScanMemo {
 public:
  /// True: `ranges` are what was kept of that robot, for the same pose of its laser among the same shapes.
  [[nodiscard]] bool recall(std::size_t robot, const Pose2& laser, std::span<const Shape> shapes,
                            std::vector<double>& ranges) const;
  void keep(std::size_t robot, const Pose2& laser, std::span<const Shape> shapes, const std::vector<double>& ranges);
  /// What the laser of that robot sees of walls within `range_m`, or further. Null: nobody has looked from there.
  [[nodiscard]] const std::vector<double>* recall_near(std::size_t robot, const Pose2& laser, double range_m) const;
  /// Takes the ranges, and gives them back for as long as no others are kept.
  const std::vector<double>& keep_near(std::size_t robot, const Pose2& laser, double range_m,
                                       std::vector<double>&& ranges);

 private:
  struct Seen {
    Pose2 laser;
    std::vector<Shape> shapes;
    std::vector<double> ranges;
  };
  struct Near {
    Pose2 laser;
    double range_m = -1.0;
    std::vector<double> ranges;
  };
  std::vector<Seen> seen_;  // by robot; without ranges: nothing
  std::vector<Near> near_;  // by robot
};

}  // namespace sentree::sim
