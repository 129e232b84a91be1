#pragma once

#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <vector>

namespace sentree {

/// Whether SENTREE_SEED=S asks for the random test of one seed, of which nothing can be counted.
inline bool is_one_seed() { return std::getenv("SENTREE_SEED") != nullptr; }

/// Seeds of a random test: 1 to `usual`, or to N of SENTREE_SEEDS=N; of SENTREE_SEED=S that one.
inline std::vector<std::uint64_t> seeds(std::uint64_t usual) {
  if (const char* one = std::getenv("SENTREE_SEED")) return {std::strtoull(one, nullptr, 10)};
  const char* many = std::getenv("SENTREE_SEEDS");
  std::vector<std::uint64_t> all(many != nullptr ? std::strtoull(many, nullptr, 10) : usual);
  std::iota(all.begin(), all.end(), 1);
  return all;
}

}  // namespace sentree
