#include "sentree/sim/likelihood_field.h"

#include <algorithm>
#include <cmath>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace sentree::sim {

namespace {

constexpr int kMiss = 255;
// Bytes that may be read behind the last one, and say nothing.
constexpr std::size_t kBehind = 3;

// Where the robot is, in the cells of the field.
struct Placing {
  float c;
  float s;
  float x;
  float y;
  float x_max;
  float y_max;
  int stride;
};

constexpr std::size_t kLanes = 4;
using Floats = float __attribute__((vector_size(4 * kLanes)));
using Ints = std::int32_t __attribute__((vector_size(4 * kLanes)));

// Adds what the first beams lose, and says how many those are.
std::size_t sum_by_four(const Placing& place, const BeamEnds& ends, const std::uint8_t* loss, int& sum) {
  std::size_t i = 0;
  for (; i + kLanes <= ends.x.size(); i += kLanes) {
    Floats end_x;
    Floats end_y;
    std::copy_n(ends.x.data() + i, kLanes, reinterpret_cast<float*>(&end_x));
    std::copy_n(ends.y.data() + i, kLanes, reinterpret_cast<float*>(&end_y));
    Floats x = place.x + place.c * end_x - place.s * end_y;
    Floats y = place.y + place.s * end_x + place.c * end_y;
    x = x < place.x_max ? x : place.x_max - Floats{};
    x = x > 0.0F ? x : Floats{};
    y = y < place.y_max ? y : place.y_max - Floats{};
    y = y > 0.0F ? y : Floats{};
    const Ints slot = __builtin_convertvector(y, Ints) * place.stride + __builtin_convertvector(x, Ints);
    for (std::size_t lane = 0; lane < kLanes; ++lane) sum += loss[static_cast<std::size_t>(slot[lane])];
  }
  return i;
}

#if defined(__x86_64__)

// The same to the bit.
__attribute__((target("avx2"))) std::size_t sum_by_eight(const Placing& place, const BeamEnds& ends,
                                                         const std::uint8_t* loss, int& sum) {
  constexpr std::size_t kEight = 8;
  const __m256 c = _mm256_set1_ps(place.c);
  const __m256 s = _mm256_set1_ps(place.s);
  const __m256 from_x = _mm256_set1_ps(place.x);
  const __m256 from_y = _mm256_set1_ps(place.y);
  const __m256 x_max = _mm256_set1_ps(place.x_max);
  const __m256 y_max = _mm256_set1_ps(place.y_max);
  const __m256 zero = _mm256_setzero_ps();
  const __m256i stride = _mm256_set1_epi32(place.stride);
  __m256i lost = _mm256_setzero_si256();
  std::size_t i = 0;
  for (; i + kEight <= ends.x.size(); i += kEight) {
    const __m256 end_x = _mm256_loadu_ps(ends.x.data() + i);
    const __m256 end_y = _mm256_loadu_ps(ends.y.data() + i);
    const __m256 x = _mm256_sub_ps(_mm256_add_ps(from_x, _mm256_mul_ps(c, end_x)), _mm256_mul_ps(s, end_y));
    const __m256 y = _mm256_add_ps(_mm256_add_ps(from_y, _mm256_mul_ps(s, end_x)), _mm256_mul_ps(c, end_y));
    const __m256i column = _mm256_cvttps_epi32(_mm256_max_ps(_mm256_min_ps(x, x_max), zero));
    const __m256i row = _mm256_cvttps_epi32(_mm256_max_ps(_mm256_min_ps(y, y_max), zero));
    const __m256i slot = _mm256_add_epi32(_mm256_mullo_epi32(row, stride), column);
    const __m256i four = _mm256_i32gather_epi32(reinterpret_cast<const int*>(loss), slot, 1);
    lost = _mm256_add_epi32(lost, _mm256_and_si256(four, _mm256_set1_epi32(0xFF)));
  }
  alignas(32) std::int32_t lanes[kEight];
  _mm256_store_si256(reinterpret_cast<__m256i*>(lanes), lost);
  for (const std::int32_t lane : lanes) sum += lane;
  return i;
}

#endif

std::size_t sum_many(const Placing& place, const BeamEnds& ends, const std::uint8_t* loss, int& sum) {
#if defined(__x86_64__)
  static const bool kByEight = __builtin_cpu_supports("avx2") != 0;
  if (kByEight) return sum_by_eight(place, ends, loss, sum);
#endif
  return sum_by_four(place, ends, loss, sum);
}

}  // namespace

LikelihoodField::LikelihoodField(const GridMap& map, const DistanceField& distance, const ReadingSpec& spec)
    : stride_(map.width() + 2),
      rows_(map.height() + 2),
      log_best_(std::log(1.0 + spec.random_share)),
      log_step_((log_best_ - std::log(spec.random_share)) / kMiss),
      loss_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(rows_) + kBehind, kMiss) {
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

double LikelihoodField::log_likelihood(const BeamEnds& ends, Vec2 at, double heading_rad) const {
  // With the border; what is beyond it counts as on it. A float resolves a thousandth of a cell on the largest map.
  const Placing place{.c = static_cast<float>(std::cos(heading_rad)),
                      .s = static_cast<float>(std::sin(heading_rad)),
                      .x = static_cast<float>(at.x + 1.0),
                      .y = static_cast<float>(at.y + 1.0),
                      .x_max = static_cast<float>(stride_ - 1),
                      .y_max = static_cast<float>(rows_ - 1),
                      .stride = stride_};
  const std::size_t count = ends.x.size();
  int loss = 0;
  for (std::size_t i = sum_many(place, ends, loss_.data(), loss); i < count; ++i) {
    const float x = std::clamp(place.x + place.c * ends.x[i] - place.s * ends.y[i], 0.0F, place.x_max);
    const float y = std::clamp(place.y + place.s * ends.x[i] + place.c * ends.y[i], 0.0F, place.y_max);
    loss += loss_[static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_) + static_cast<std::size_t>(x)];
  }
  return static_cast<double>(count) * log_best_ - loss * log_step_;
}

double LikelihoodField::best() const { return std::exp(log_best_); }

}  // namespace sentree::sim
