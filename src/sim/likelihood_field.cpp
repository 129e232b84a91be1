#include "sentree/sim/likelihood_field.h"

#include <algorithm>
#include <cmath>

namespace sentree::sim {

namespace {

constexpr int kMiss = 255;
constexpr std::size_t kLanes = 8;
using Floats = float __attribute__((vector_size(4 * kLanes)));
using Ints = std::int32_t __attribute__((vector_size(4 * kLanes)));

}  // namespace

LikelihoodField::LikelihoodField(const GridMap& map, const DistanceField& distance, const ReadingSpec& spec)
    : stride_(map.width() + 2),
      rows_(map.height() + 2),
      log_best_(std::log(1.0 + spec.random_share)),
      log_step_((log_best_ - std::log(spec.random_share)) / kMiss),
      loss_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(rows_), kMiss) {
  const double sigma = spec.hit_sigma_m / map.resolution_m();
  // Beyond five sigma only the uniform part is left.
  const auto reach = static_cast<std::size_t>(std::min(25.0 * sigma * sigma, 65'000.0)) + 1;
  std::vector<std::uint8_t> loss_of_square(reach);
  for (std::size_t square = 0; square < reach; ++square) {
    const double hit = std::exp(-static_cast<double>(square) / (2.0 * sigma * sigma));
    loss_of_square[square] =
        static_cast<std::uint8_t>(std::lround((log_best_ - std::log(hit + spec.random_share)) / log_step_));
  }
  for (int y = 0; y < map.height(); ++y) {
    std::uint8_t* row = loss_.data() + static_cast<std::ptrdiff_t>(y + 1) * stride_ + 1;
    for (int x = 0; x < map.width(); ++x) {
      const std::size_t square = distance.squared_cells({x, y});
      if (square < reach) row[x] = loss_of_square[square];
    }
  }
}

// Of eight beams at once where the processor can; to the same bit where it cannot.
#if defined(__x86_64__)
__attribute__((target_clones("avx2", "default")))
#endif
double
LikelihoodField::log_likelihood(const BeamEnds& ends, Vec2 at, double heading_rad) const {
  const auto c = static_cast<float>(std::cos(heading_rad));
  const auto s = static_cast<float>(std::sin(heading_rad));
  // With the border; what is beyond it counts as on it. A float resolves a thousandth of a cell on the largest map.
  const auto from_x = static_cast<float>(at.x + 1.0);
  const auto from_y = static_cast<float>(at.y + 1.0);
  const auto x_max = static_cast<float>(stride_ - 1);
  const auto y_max = static_cast<float>(rows_ - 1);
  const std::size_t count = ends.x.size();
  int loss = 0;
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) {
    Floats end_x;
    Floats end_y;
    std::copy_n(ends.x.data() + i, kLanes, reinterpret_cast<float*>(&end_x));
    std::copy_n(ends.y.data() + i, kLanes, reinterpret_cast<float*>(&end_y));
    Floats x = from_x + c * end_x - s * end_y;
    Floats y = from_y + s * end_x + c * end_y;
    x = x < x_max ? x : x_max - Floats{};
    x = x > 0.0F ? x : Floats{};
    y = y < y_max ? y : y_max - Floats{};
    y = y > 0.0F ? y : Floats{};
    const Ints slot = __builtin_convertvector(y, Ints) * stride_ + __builtin_convertvector(x, Ints);
    for (std::size_t lane = 0; lane < kLanes; ++lane) loss += loss_[static_cast<std::size_t>(slot[lane])];
  }
  for (; i < count; ++i) {
    const float x = std::clamp(from_x + c * ends.x[i] - s * ends.y[i], 0.0F, x_max);
    const float y = std::clamp(from_y + s * ends.x[i] + c * ends.y[i], 0.0F, y_max);
    loss += loss_[static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_) + static_cast<std::size_t>(x)];
  }
  return static_cast<double>(count) * log_best_ - loss * log_step_;
}

double LikelihoodField::best() const { return std::exp(log_best_); }

}  // namespace sentree::sim
