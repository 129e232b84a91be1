#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sentree/sim/geometry.h"
#include "sentree/sim/laser.h"

namespace sentree::sim {

/// The latest scan as the robot's software sees it. Its rays may not have been cast yet: who looks at some of them has
/// only those cast, and what follows from where the laser stood need not be looked at.
class Sight {
 public:
  virtual ~Sight() = default;
  /// Of all beams.
  [[nodiscard]] virtual const std::vector<double>& ranges() const = 0;
  /// Of some beams; `ranges` is as long.
  virtual void ranges_of(std::span<const std::size_t> beams, std::span<double> ranges) const {
    for (std::size_t i = 0; i < beams.size(); ++i) ranges[i] = this->ranges()[beams[i]];
  }
  /// Of all beams; those longer than `range_m` may be any number beyond it.
  [[nodiscard]] virtual const std::vector<double>& ranges_within(double /*range_m*/) const { return ranges(); }
  /// True: nothing returns from within `range_m`. False: it is not known without looking.
  [[nodiscard]] virtual bool is_clear(double /*range_m*/) const { return false; }
  /// True: each return from within `range_m`, put on the map from `laser_pose`, lies in a cell whose centre is within
  /// `margin_m` of the centre of a wall's. False: it is not known without looking.
  [[nodiscard]] virtual bool shows_walls_only(const Pose2& /*laser_pose*/, double /*range_m*/,
                                              double /*margin_m*/) const {
    return false;
  }
};

/// A scan whose rays have been cast.
class WholeScan final : public Sight {
 public:
  /// Borrowed.
  explicit WholeScan(const Scan& scan) : scan_(scan) {}
  [[nodiscard]] const std::vector<double>& ranges() const override { return scan_.ranges; }

 private:
  const Scan& scan_;
};

}  // namespace sentree::sim
