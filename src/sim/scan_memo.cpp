#include "sentree/sim/scan_memo.h"

#include <algorithm>
#include <utility>

namespace sentree::sim {

bool ScanMemo::recall(std::size_t robot, const Pose2& laser, std::span<const Shape> shapes,
                      std::vector<double>& ranges) const {
  if (robot >= seen_.size()) return false;
  const Seen& seen = seen_[robot];
  if (seen.ranges.empty() || seen.laser != laser ||
      !std::equal(shapes.begin(), shapes.end(), seen.shapes.begin(), seen.shapes.end()))
    return false;
  ranges = seen.ranges;
  return true;
}

void ScanMemo::keep(std::size_t robot, const Pose2& laser, std::span<const Shape> shapes,
                    const std::vector<double>& ranges) {
  if (robot >= seen_.size()) seen_.resize(robot + 1);
  Seen& seen = seen_[robot];
  seen.laser = laser;
  seen.shapes.assign(shapes.begin(), shapes.end());
  seen.ranges = ranges;
}

const std::vector<double>* ScanMemo::recall_near(std::size_t robot, const Pose2& laser, double range_m) const {
  if (robot >= near_.size()) return nullptr;
  const Near& near = near_[robot];
  return near.range_m >= range_m && near.laser == laser ? &near.ranges : nullptr;
}

const std::vector<double>& ScanMemo::keep_near(std::size_t robot, const Pose2& laser, double range_m,
                                               std::vector<double>&& ranges) {
  if (robot >= near_.size()) near_.resize(robot + 1);
  near_[robot] = {laser, range_m, std::move(ranges)};
  return near_[robot].ranges;
}

}  // namespace sentree::sim
