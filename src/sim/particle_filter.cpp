#include "sentree/sim/particle_filter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>

#include "sentree/base/value.h"

namespace sentree::sim {

namespace {

constexpr double kSpreadMin_m = 0.05;
constexpr double kSpreadMin_rad = 0.03;
constexpr double kBin_m = 0.5;
constexpr double kBin_rad = std::numbers::pi / 12;
// A cluster: what lies this near to the middle of the heaviest bin.
constexpr double kCluster_m = 0.75;
constexpr double kCluster_rad = 0.5;
// Localized while the cluster is this narrow and holds most of the weight.
constexpr double kLocalized_m = 0.4;
constexpr double kLocalizedShare = 0.6;
// How well the readings fit where the robot believes to be, from 0 to 1: measured 0.94 to 0.98 at the right place on
// three maps with noise, 0.48 to 0.87 at a wrong one. Below this, particles are spent on a search …
constexpr double kGoodFit = 0.93;
// … and below this the robot does not claim to know its place.
constexpr double kPoorFit = 0.75;
// Readings worse than in the long run mean a search too, also where people hide the walls.
constexpr double kWorse = 0.85;
constexpr double kSearchMax = 0.5;  // share of the particles

std::vector<Cell> free_cells(const GridMap& map) {
  std::vector<Cell> cells;
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      if (map.is_free({x, y})) cells.push_back({x, y});
    }
  }
  return cells;
}

Pose2 random_pose(const GridMap& map, const std::vector<Cell>& cells, Rng& rng) {
  const Cell cell = cells[rng.below(cells.size())];
  const Vec2 p = map.from_grid({cell.x + rng.uniform(), cell.y + rng.uniform()});
  return {p.x, p.y, rng.uniform(-std::numbers::pi, std::numbers::pi)};
}

std::uint64_t bin_of(const Pose2& pose) {
  const auto part = [](double v, double size) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v / size)) + (1 << 20)) & 0x1FFFFFU;
  };
  return part(pose.x, kBin_m) << 42U | part(pose.y, kBin_m) << 21U | part(pose.theta, kBin_rad);
}

// Weight per bin; open addressing, at most half full.
class Histogram {
 public:
  explicit Histogram(std::size_t entries_max)
      : slots_(std::bit_ceil(std::max<std::size_t>(16, 2 * entries_max)), Slot{kEmpty, 0.0}) {}

  // True if the bin was empty.
  bool add(std::uint64_t bin, double weight) {
    Slot& slot = find(bin);
    const bool is_new = slot.bin == kEmpty;
    slot.bin = bin;
    slot.weight += weight;
    return is_new;
  }
  double weight(std::uint64_t bin) { return find(bin).weight; }

 private:
  struct Slot {
    std::uint64_t bin;
    double weight;
  };
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

  Slot& find(std::uint64_t bin) {
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = hash_combine(0, bin) & mask;
    while (slots_[i].bin != kEmpty && slots_[i].bin != bin) i = (i + 1) & mask;
    return slots_[i];
  }
  std::vector<Slot> slots_;
};

// Particles that make the sampled distribution's error at most kld_error (Fox 2001, eq. 7) with `bins` in use.
double kld_size(const LocalizationSpec& spec, std::size_t bins) {
  if (bins < 2) return 0.0;
  const double k = static_cast<double>(bins - 1);
  const double a = 2.0 / (9.0 * k);
  const double b = 1.0 - a + std::sqrt(a) * spec.kld_z;
  return k / (2.0 * spec.kld_error) * b * b * b;
}

// Standard normal but for its tails, which end at 3.5 sigma: the sum of four uniform draws. The filter draws three a
// particle, and this costs a tenth of the exact one.
double nearly_normal(Rng& rng) {
  const std::uint64_t word = rng.next();
  const auto sum =
      static_cast<double>((word & 0xFFFFU) + (word >> 16U & 0xFFFFU) + (word >> 32U & 0xFFFFU) + (word >> 48U));
  constexpr double kMean = 2.0 * 65535.0;
  constexpr double kSigma = 37837.22;  // 2^16 · sqrt(4 / 12)
  return (sum - kMean) / kSigma;
}

// Turn, drive, turn; each with noise that grows with all three.
class MotionModel {
 public:
  MotionModel(const LocalizationSpec& spec, const Pose2& motion) {
    trans_ = norm(motion.position());
    // A turn on the spot has no direction of travel; atan2 would make one out of noise.
    constexpr double kTravelMin_m = 0.01;
    if (trans_ >= kTravelMin_m) {
      rot1_ = std::atan2(motion.y, motion.x);
      // Driving backwards is no half turn.
      if (std::abs(rot1_) > std::numbers::pi / 2) {
        rot1_ = wrap_angle(rot1_ + std::numbers::pi);
        trans_ = -trans_;
      }
    }
    rot2_ = wrap_angle(motion.theta - rot1_);
    const auto& a = spec.motion_noise;
    const double length = std::abs(trans_);
    sigma1_ = a[0] * std::abs(rot1_) + a[1] * length;
    sigma2_ = a[0] * std::abs(rot2_) + a[1] * length;
    sigma_trans_ = a[2] * length + a[3] * (std::abs(rot1_) + std::abs(rot2_));
  }
  Pose2 sample(const Pose2& from, Rng& rng) const {
    const double heading = from.theta + rot1_ + sigma1_ * nearly_normal(rng);
    const double trans = trans_ + sigma_trans_ * nearly_normal(rng);
    return {from.x + trans * std::cos(heading), from.y + trans * std::sin(heading),
            wrap_angle(heading + rot2_ + sigma2_ * nearly_normal(rng))};
  }

 private:
  double rot1_ = 0.0;
  double trans_ = 0.0;
  double rot2_ = 0.0;
  double sigma1_ = 0.0;
  double sigma2_ = 0.0;
  double sigma_trans_ = 0.0;
};

// The scan's likelihood at a pose, up to a factor: the log of a hit's density (normal over the distance to the nearest
// wall) plus a uniform part, from a table over squared distances.
class LikelihoodField {
 public:
  LikelihoodField(const LocalizationSpec& spec, const GridMap& map, const DistanceField& distance,
                  const LaserSpec& laser, const Scan& scan)
      : map_(map), squared_(distance.squared_cells().data()) {
    const double sigma = spec.hit_sigma_m / map.resolution_m();
    // Beyond five sigma only the uniform part is left.
    const auto last = static_cast<std::size_t>(std::min(25.0 * sigma * sigma, 65'000.0));
    for (std::size_t square = 0; square <= last; ++square) {
      const double hit = std::exp(-static_cast<double>(square) / (2.0 * sigma * sigma));
      table_.push_back(static_cast<float>(std::log(hit + spec.random_share)));
    }
    miss_ = static_cast<float>(std::log(spec.random_share));
    const std::size_t beams = scan.ranges.size();
    const std::size_t used = std::min(beams, static_cast<std::size_t>(spec.beams));
    for (std::size_t k = 0; k < used; ++k) {
      const std::size_t i = k * beams / used;
      const double range = scan.ranges[i];
      if (!(range > 0.0 && range < laser.range_max_m)) continue;
      const double angle = laser.angle_min_rad + static_cast<double>(i) * laser.angle_increment_rad;
      // A beam ends on the near edge of a cell; the field measures to cell centres.
      const double reach = range + map.resolution_m() / 2;
      const Vec2 end = transform(laser.mount, {reach * std::cos(angle), reach * std::sin(angle)});
      ends_.push_back((1.0 / map.resolution_m()) * end);
    }
  }

  std::size_t beams() const { return ends_.size(); }

  // Sum over the beams of the log likelihood.
  double at(const Pose2& pose) const {
    const Vec2 origin = map_.to_grid(pose.position());
    const double angle = pose.theta - map_.origin().theta;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const auto width = static_cast<unsigned>(map_.width());
    const auto height = static_cast<unsigned>(map_.height());
    const std::size_t last = table_.size() - 1;
    float sum = 0.0F;
    // One up before the conversion, which truncates, so that (-1, 0) does not become cell 0.
    const double x0 = origin.x + 1.0;
    const double y0 = origin.y + 1.0;
    for (const Vec2 end : ends_) {
      const unsigned x = static_cast<unsigned>(static_cast<int>(x0 + c * end.x - s * end.y)) - 1U;
      const unsigned y = static_cast<unsigned>(static_cast<int>(y0 + s * end.x + c * end.y)) - 1U;
      if (x < width && y < height) {
        const std::size_t square = squared_[static_cast<std::size_t>(y) * width + x];
        sum += table_[std::min(square, last)];
      } else {
        sum += miss_;
      }
    }
    return static_cast<double>(sum);
  }

 private:
  const GridMap& map_;
  const std::uint16_t* squared_;
  std::vector<float> table_;
  float miss_ = 0.0F;
  std::vector<Vec2> ends_;  // of the beams, in cells from the robot
};

// Mean, covariance and share of the weight of the heaviest cluster.
double summarize(Localization& state) {
  Histogram bins(state.particles.size());
  for (const Particle& p : state.particles) bins.add(bin_of(p.pose), p.weight);
  const Particle* heaviest = &state.particles.front();
  double most = -1.0;
  for (const Particle& p : state.particles) {
    const double weight = bins.weight(bin_of(p.pose));
    if (weight > most) {
      most = weight;
      heaviest = &p;
    }
  }
  Pose2 centre = heaviest->pose;
  double share = 0.0;
  // The second round starts from the mean of the first, so that a cluster cut by bins is met in its middle.
  for (int round = 0; round < 2; ++round) {
    double sum = 0.0;
    double x = 0.0;
    double y = 0.0;
    double turn = 0.0;
    for (const Particle& p : state.particles) {
      const double off = wrap_angle(p.pose.theta - centre.theta);
      if (distance(p.pose.position(), centre.position()) > kCluster_m || std::abs(off) > kCluster_rad) continue;
      sum += p.weight;
      x += p.weight * p.pose.x;
      y += p.weight * p.pose.y;
      turn += p.weight * off;
    }
    if (sum <= 0.0) break;
    centre = {x / sum, y / sum, wrap_angle(centre.theta + turn / sum)};
    share = sum;
  }
  std::array<double, 9> covariance{};
  for (const Particle& p : state.particles) {
    const std::array<double, 3> d{p.pose.x - centre.x, p.pose.y - centre.y, wrap_angle(p.pose.theta - centre.theta)};
    if (norm({d[0], d[1]}) > kCluster_m || std::abs(d[2]) > kCluster_rad || share <= 0.0) continue;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column)
        covariance[3 * row + column] += p.weight / share * d[row] * d[column];
    }
  }
  state.estimate = {centre, covariance};
  return share;
}

}  // namespace

void scatter_around(const LocalizationSpec& spec, Localization& state) {
  const auto& covariance = state.estimate.covariance;
  // Cholesky of the position's part.
  const double sx = std::max(kSpreadMin_m, std::sqrt(covariance[0]));
  const double slope = covariance[1] / sx;
  const double sy = std::max(kSpreadMin_m, std::sqrt(std::max(0.0, covariance[4] - slope * slope)));
  const double st = std::max(kSpreadMin_rad, std::sqrt(covariance[8]));
  const auto count = static_cast<std::size_t>(spec.particles_max);
  state.particles.assign(count, {});
  const Pose2& mean = state.estimate.pose;
  for (Particle& p : state.particles) {
    const double u = state.rng.normal();
    const double v = state.rng.normal();
    p.pose = {mean.x + sx * u, mean.y + slope * u + sy * v, wrap_angle(mean.theta + st * state.rng.normal())};
    p.weight = 1.0 / static_cast<double>(count);
  }
  state.likelihood_slow = state.likelihood_fast = 0.0;
}

void scatter_everywhere(const LocalizationSpec& spec, const GridMap& map, Localization& state) {
  const std::vector<Cell> cells = free_cells(map);
  if (cells.empty()) return;
  const auto count = static_cast<std::size_t>(spec.particles_global);
  state.particles.assign(count, {});
  for (Particle& p : state.particles) {
    p.pose = random_pose(map, cells, state.rng);
    p.weight = 1.0 / static_cast<double>(count);
  }
  state.likelihood_slow = state.likelihood_fast = 0.0;
  summarize(state);
}

void update_particles(const LocalizationSpec& spec, const GridMap& map, const DistanceField& distance,
                      const LaserSpec& laser, Localization& state, const Pose2& motion, const Scan& scan) {
  if (state.particles.empty()) return;
  const MotionModel model(spec, motion);
  for (Particle& p : state.particles) p.pose = model.sample(p.pose, state.rng);

  const LikelihoodField field(spec, map, distance, laser, scan);
  if (field.beams() > 0) {
    std::vector<double> logs(state.particles.size());
    double best = -1e300;
    const double beams = static_cast<double>(field.beams());
    for (std::size_t i = 0; i < logs.size(); ++i) {
      logs[i] = field.at(state.particles[i].pose);
      best = std::max(best, logs[i]);
    }
    double sum = 0.0;
    // Of the particles as weighted: those that were thrown in at random and fit nowhere say nothing about the fit.
    double mean_reading = 0.0;
    for (std::size_t i = 0; i < logs.size(); ++i) {
      double& weight = state.particles[i].weight;
      weight *= std::exp(spec.tempering * (logs[i] - best));
      sum += weight;
      mean_reading += weight * std::exp(logs[i] / beams);
    }
    mean_reading /= sum;
    for (Particle& p : state.particles) p.weight /= sum;
    const auto average = [&](double& value, double rate) {
      value = value == 0.0 ? mean_reading : value + rate * (mean_reading - value);
    };
    average(state.likelihood_slow, spec.recovery_slow);
    average(state.likelihood_fast, spec.recovery_fast);
  }
  const double share = summarize(state);
  const double spread = std::sqrt(state.estimate.covariance[0] + state.estimate.covariance[4]);
  const double best_reading = 1.0 + spec.random_share;
  const double fit = state.likelihood_fast / best_reading;
  const bool localized = spread < kLocalized_m && share > kLocalizedShare && fit > kPoorFit;
  state.status = localized ? LocalizationStatus::kLocalizedOk : LocalizationStatus::kNotYetLocalized;

  const double expected = std::max(kWorse * state.likelihood_slow, kGoodFit * best_reading);
  const double random_share = std::clamp(2.0 * (1.0 - state.likelihood_fast / expected), 0.0, kSearchMax);
  std::vector<Cell> cells;
  if (random_share > 0.0) cells = free_cells(map);
  // The next generation.
  std::vector<double> cumulative(state.particles.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < cumulative.size(); ++i) cumulative[i] = sum += state.particles[i].weight;
  // Lost, it may take a quarter of what covers the whole map: more only costs time.
  const auto most = static_cast<std::size_t>(localized ? spec.particles_max
                                                       : std::max(spec.particles_max, spec.particles_global / 4));
  const auto least = static_cast<std::size_t>(spec.particles_min);
  std::vector<Particle> next;
  next.reserve(std::min<std::size_t>(most, state.particles.size() + least));
  Histogram bins(most);
  std::size_t used = 0;
  double wanted = 0.0;
  while (next.size() < most && (next.size() < least || static_cast<double>(next.size()) < wanted)) {
    Particle p;
    if (!cells.empty() && state.rng.uniform() < random_share) {
      p.pose = random_pose(map, cells, state.rng);
    } else {
      const double draw = state.rng.uniform() * sum;
      const auto found = std::upper_bound(cumulative.begin(), cumulative.end(), draw);
      p.pose = state
                   .particles[std::min<std::size_t>(static_cast<std::size_t>(found - cumulative.begin()),
                                                    cumulative.size() - 1)]
                   .pose;
    }
    if (bins.add(bin_of(p.pose), 1.0)) wanted = kld_size(spec, ++used);
    next.push_back(p);
  }
  for (Particle& p : next) p.weight = 1.0 / static_cast<double>(next.size());
  state.particles = std::move(next);
}

}  // namespace sentree::sim
