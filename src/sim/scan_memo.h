#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sentree/sim/geometry.h"
#include "sentree/sim/shape.h"

namespace sentree::sim {

/// What each laser of one world saw last, without noise: while nothing moves, it sees the same again.
/// Scans that are looked up in it (Remember<ScanMemo>) must be of that world.
class ScanMemo {
 public:
  /// True: `ranges` are what was kept of that robot, for the same pose of its laser among the same shapes.
  [[nodiscard]] bool recall(std::size_t robot, const Pose2& laser, std::span<const Shape> shapes,
                            std::vector<double>& ranges) const;
  void keep(std::size_t robot, const Pose2& laser, std::span<const Shape> shapes, const std::vector<double>& ranges);

 private:
  struct Seen {
    Pose2 laser;
    std::vector<Shape> shapes;
    std::vector<double> ranges;
  };
  std::vector<Seen> seen_;  // by robot; without ranges: nothing
};

}  // namespace sentree::sim
