#include "sentree/sim/detail/particle_filter.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

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
// A filter that has settled in the wrong one of two rooms that look alike has no particle left in the other. So the
// whole map is asked now and then whether the scan fits better somewhere else; what does gets a few particles.
constexpr double kChallengeShare = 0.1;  // of the updates
constexpr int kChallengeDraws = 500;
constexpr std::size_t kChallengers = 8;     // the best of them, climbed from
constexpr std::size_t kChallengeSize = 10;  // particles

// A pose on a free cell, each as likely as any other. Nothing on a map without one.
std::optional<Pose2> random_pose(const GridMap& map, Rng& rng) {
  const auto random_cell = [&] {
    return Cell{static_cast<int>(rng.below(static_cast<std::uint64_t>(map.width()))),
                static_cast<int>(rng.below(static_cast<std::uint64_t>(map.height())))};
  };
  if (map.cells().empty()) return std::nullopt;
  Cell cell = random_cell();
  constexpr int kTriesMax = 200;
  for (int i = 0; i < kTriesMax && !map.is_free(cell); ++i) cell = random_cell();
  if (!map.is_free(cell)) {
    // Hardly any is free: the next one, row by row.
    const auto free = [](std::int8_t v) { return v >= 0 && v < GridMap::kOccupiedMin; };
    const auto from = map.cells().begin() + static_cast<std::ptrdiff_t>(map.index(cell));
    auto found = std::find_if(from, map.cells().end(), free);
    if (found == map.cells().end()) found = std::find_if(map.cells().begin(), from, free);
    if (found == from) return std::nullopt;
    const auto index = static_cast<int>(found - map.cells().begin());
    cell = {index % map.width(), index / map.width()};
  }
  const Vec2 p = map.from_grid({cell.x + rng.uniform(), cell.y + rng.uniform()});
  return Pose2{p.x, p.y, rng.uniform(-std::numbers::pi, std::numbers::pi)};
}

std::uint64_t bin_of(const Pose2& pose) {
  // Truncation is floor where nothing is negative.
  const auto part = [](double v, double size) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(v * (1.0 / size) + (1 << 20))) & 0x1FFFFFU;
  };
  return part(pose.x, kBin_m) << 42U | part(pose.y, kBin_m) << 21U | part(pose.theta, kBin_rad);
}

// Weight per bin; open addressing, at most half full.
class Histogram {
 public:
  explicit Histogram(std::size_t entries_max)
      : bits_(static_cast<unsigned>(std::bit_width(std::max<std::size_t>(16, 2 * entries_max) - 1))),
        slots_(std::size_t{1} << bits_, Slot{kEmpty, 0.0}) {}

  struct Slot {
    std::uint64_t bin;
    double weight;
  };
  // The slot of the bin, and whether it was empty.
  std::pair<std::size_t, bool> add(std::uint64_t bin, double weight) {
    const std::size_t mask = slots_.size() - 1;
    // Fibonacci hashing: the upper bits of the product.
    std::size_t i = bin * 0x9E3779B97F4A7C15U >> (64U - bits_);
    while (slots_[i].bin != kEmpty && slots_[i].bin != bin) i = (i + 1) & mask;
    const bool is_new = slots_[i].bin == kEmpty;
    slots_[i].bin = bin;
    slots_[i].weight += weight;
    return {i, is_new};
  }
  double weight(std::size_t slot) const { return slots_[slot].weight; }

 private:
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  unsigned bits_;
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

// Where the used beams end, for those that hit something.
BeamEnds beam_ends(const LocalizationModel& model, const Sight& sight) {
  BeamEnds ends;
  const double resolution = model.map.resolution_m();
  const auto beams = static_cast<std::size_t>(model.laser.beams);
  std::vector<std::size_t> used(std::min(beams, static_cast<std::size_t>(model.spec.beams)));
  for (std::size_t k = 0; k < used.size(); ++k) used[k] = k * beams / used.size();
  std::vector<double> ranges(used.size());
  sight.ranges_of(used, ranges);
  const std::span<const Vec2> directions = beam_directions(model.laser, beams);
  for (std::size_t k = 0; k < used.size(); ++k) {
    const double range = ranges[k];
    if (!(range > 0.0 && range < model.laser.range_max_m)) continue;
    const Vec2 along = directions[used[k]];
    // A beam ends on the near edge of a cell; the field measures to cell centres.
    const double reach = range + resolution / 2;
    const Vec2 end = transform(model.laser.mount, {reach * along.x, reach * along.y});
    ends.x.push_back(static_cast<float>(end.x / resolution));
    ends.y.push_back(static_cast<float>(end.y / resolution));
  }
  return ends;
}

// Draws from a discrete distribution in constant time on average: a table leads near the entry.
class Drawing {
 public:
  explicit Drawing(std::span<const Particle> particles) : cumulative_(particles.size()), guide_(particles.size()) {
    double sum = 0.0;
    for (std::size_t i = 0; i < particles.size(); ++i) cumulative_[i] = sum += particles[i].weight;
    const double count = static_cast<double>(guide_.size());
    std::size_t at = 0;
    for (std::size_t k = 0; k < guide_.size(); ++k) {
      const double start = sum * static_cast<double>(k) / count;
      while (at + 1 < cumulative_.size() && cumulative_[at] <= start) ++at;
      guide_[k] = static_cast<std::uint32_t>(at);
    }
  }
  std::size_t draw(Rng& rng) const {
    const double u = rng.uniform();
    const double wanted = u * cumulative_.back();
    std::size_t i = guide_[static_cast<std::size_t>(u * static_cast<double>(guide_.size()))];
    // The table's start may be a rounding beyond the entry.
    while (i > 0 && cumulative_[i - 1] > wanted) --i;
    while (i + 1 < cumulative_.size() && cumulative_[i] <= wanted) ++i;
    return i;
  }

 private:
  std::vector<double> cumulative_;
  std::vector<std::uint32_t> guide_;
};

// Mean, covariance and share of the weight of the heaviest cluster.
double summarize(Localization& state) {
  Histogram bins(state.particles.size());
  std::vector<std::uint32_t> slots;
  slots.reserve(state.particles.size());
  for (const Particle& p : state.particles) {
    slots.push_back(static_cast<std::uint32_t>(bins.add(bin_of(p.pose), p.weight).first));
  }
  std::size_t heaviest = 0;
  for (std::size_t i = 1; i < slots.size(); ++i) {
    if (bins.weight(slots[i]) > bins.weight(slots[heaviest])) heaviest = i;
  }
  Pose2 centre = state.particles[heaviest].pose;
  const auto is_far = [](double dx, double dy, double turn) {
    return dx * dx + dy * dy > kCluster_m * kCluster_m || std::abs(turn) > kCluster_rad;
  };
  double share = 0.0;
  // The second round starts from the mean of the first, so that a cluster cut by bins is met in its middle.
  for (int round = 0; round < 2; ++round) {
    double sum = 0.0;
    double x = 0.0;
    double y = 0.0;
    double turn = 0.0;
    for (const Particle& p : state.particles) {
      const double off = wrap_angle(p.pose.theta - centre.theta);
      if (is_far(p.pose.x - centre.x, p.pose.y - centre.y, off)) continue;
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
    if (share <= 0.0 || is_far(d[0], d[1], d[2])) continue;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column)
        covariance[3 * row + column] += p.weight / share * d[row] * d[column];
    }
  }
  state.estimate = {centre, covariance};
  return share;
}

struct Fit {
  Pose2 pose;
  double log = -1e300;  // of the scan's likelihood
};

double log_likelihood(const LocalizationModel& model, const BeamEnds& ends, const Pose2& pose) {
  return model.field.log_likelihood(ends, model.map.to_grid(pose.position()), pose.theta - model.map.origin().theta);
}

// The best of what random draws and a random climb from the best of them find on the whole map.
Fit best_anywhere(const LocalizationModel& model, const BeamEnds& ends, Rng& rng) {
  std::array<Fit, kChallengers> found;
  for (int i = 0; i < kChallengeDraws; ++i) {
    const auto pose = random_pose(model.map, rng);
    if (!pose) return {};
    const Fit fit{*pose, log_likelihood(model, ends, *pose)};
    Fit& worst =
        *std::min_element(found.begin(), found.end(), [](const Fit& a, const Fit& b) { return a.log < b.log; });
    if (fit.log > worst.log) worst = fit;
  }
  constexpr int kRounds = 6;
  constexpr int kTries = 8;
  Fit best;
  for (Fit& fit : found) {
    double reach_m = 0.3;
    double reach_rad = 0.25;
    for (int round = 0; round < kRounds; ++round, reach_m *= 0.6, reach_rad *= 0.6) {
      for (int i = 0; i < kTries; ++i) {
        const Pose2 pose{fit.pose.x + reach_m * nearly_normal(rng), fit.pose.y + reach_m * nearly_normal(rng),
                         wrap_angle(fit.pose.theta + reach_rad * nearly_normal(rng))};
        if (!model.map.is_free(model.map.cell_at(pose.position()))) continue;
        const double log = log_likelihood(model, ends, pose);
        if (log > fit.log) fit = {pose, log};
      }
    }
    if (fit.log > best.log) best = fit;
  }
  return best;
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
  const auto count = static_cast<std::size_t>(spec.particles_global);
  if (!random_pose(map, state.rng)) return;
  state.particles.assign(count, {});
  for (Particle& p : state.particles) {
    p.pose = *random_pose(map, state.rng);
    p.weight = 1.0 / static_cast<double>(count);
  }
  state.likelihood_slow = state.likelihood_fast = 0.0;
  summarize(state);
}

void update_particles(const LocalizationModel& model, Localization& state, const Pose2& motion, const Sight& sight) {
  if (state.particles.empty()) return;
  const LocalizationSpec& spec = model.spec;
  const MotionModel motion_model(spec, motion);
  for (Particle& p : state.particles) p.pose = motion_model.sample(p.pose, state.rng);

  const BeamEnds ends = beam_ends(model, sight);
  Fit challenger;
  if (!ends.x.empty()) {
    std::vector<double> logs(state.particles.size());
    double best = -1e300;
    const double beams = static_cast<double>(ends.x.size());
    for (std::size_t i = 0; i < logs.size(); ++i) {
      const Pose2& pose = state.particles[i].pose;
      logs[i] =
          model.field.log_likelihood(ends, model.map.to_grid(pose.position()), pose.theta - model.map.origin().theta);
      best = std::max(best, logs[i]);
    }
    if (state.status != LocalizationStatus::kLocalizedOk || state.rng.uniform() < kChallengeShare) {
      challenger = best_anywhere(model, ends, state.rng);
      if (challenger.log < best) challenger = {};
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
  const double best_reading = model.field.best();
  const double fit = state.likelihood_fast / best_reading;
  const bool localized = spread < kLocalized_m && share > kLocalizedShare && fit > kPoorFit;
  state.status = localized ? LocalizationStatus::kLocalizedOk : LocalizationStatus::kNotYetLocalized;

  const double expected = std::max(kWorse * state.likelihood_slow, kGoodFit * best_reading);
  const double random_share = std::clamp(2.0 * (1.0 - state.likelihood_fast / expected), 0.0, kSearchMax);
  // The next generation.
  const Drawing drawing(state.particles);
  // Lost, it may take a quarter of what covers the whole map: more only costs time.
  const auto most = static_cast<std::size_t>(localized ? spec.particles_max
                                                       : std::max(spec.particles_max, spec.particles_global / 4));
  const auto least = static_cast<std::size_t>(spec.particles_min);
  std::vector<Particle> next;
  next.reserve(std::min<std::size_t>(most, state.particles.size() + least));
  if (challenger.log > -1e300) next.assign(kChallengeSize, {challenger.pose, 0.0});
  Histogram bins(most);
  std::size_t used = 0;
  double wanted = 0.0;
  while (next.size() < most && (next.size() < least || static_cast<double>(next.size()) < wanted)) {
    std::optional<Pose2> pose;
    if (random_share > 0.0 && state.rng.uniform() < random_share) pose = random_pose(model.map, state.rng);
    if (!pose) pose = state.particles[drawing.draw(state.rng)].pose;
    if (bins.add(bin_of(*pose), 1.0).second) wanted = kld_size(spec, ++used);
    next.push_back({*pose, 0.0});
  }
  for (Particle& p : next) p.weight = 1.0 / static_cast<double>(next.size());
  state.particles = std::move(next);
}

}  // namespace sentree::sim
