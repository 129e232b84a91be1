#pragma once

#include <cstdint>
#include <string_view>

namespace sentree {

/// Seeded pseudo-random numbers, the same on every machine. A plain value: a copy continues alike.
///
/// Not for secrets. Source: Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators" (SplitMix64), 2014.
class Rng {
 public:
  explicit Rng(std::uint64_t seed) : state_(seed) {}

  /// A generator for one part of a run, independent of how much the other parts draw.
  [[nodiscard]] static Rng of(std::uint64_t seed, std::string_view part);

  [[nodiscard]] std::uint64_t next();
  /// Uniform in [0, 1).
  [[nodiscard]] double uniform();
  /// Uniform in [low, high), for low < high.
  [[nodiscard]] double uniform(double low, double high) {
    const double x = low + (high - low) * uniform();
    return x < high ? x : low;  // rounding can reach `high`
  }
  /// Uniform in [0, bound), without bias; 0 for bound 0.
  [[nodiscard]] std::uint64_t below(std::uint64_t bound);
  /// Standard normal (Marsaglia's polar method). Keeps no second value, so that the state is one word.
  [[nodiscard]] double normal();

  friend bool operator==(const Rng&, const Rng&) = default;
  [[nodiscard]] std::uint64_t state() const { return state_; }

 private:
  std::uint64_t state_;
};

}  // namespace sentree
