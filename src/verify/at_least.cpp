#include "sentree/verify/at_least.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace sentree::verify {

namespace {

// How much a run speaks for `rate` and against `other` at the mean, if that is its rate: relative entropy.
double information(double rate, double other) {
  const auto part = [](double p, double q) { return p > 0 ? p * std::log(p / q) : 0; };
  return part(rate, other) + part(1 - rate, 1 - other);
}

}  // namespace

AtLeast::Ratios::Ratios(double allowed, double far, double confidence) {
  const double nearest = kNearest * std::min(allowed, 1 - allowed);
  for (double way = 1; way * std::abs(far - allowed) >= nearest; way /= 2) {
    const double rate = allowed + way * (far - allowed);
    all_.push_back({.violated = std::log(rate / allowed), .kept = std::log((1 - rate) / (1 - allowed)), .sum = 0});
  }
  bound_ = std::log(static_cast<double>(all_.size()) / (1 - confidence));
}

bool AtLeast::Ratios::add(bool is_violated) {
  double greatest = -HUGE_VAL;
  for (Ratio& one : all_) {
    one.sum += is_violated ? one.violated : one.kept;
    greatest = std::max(greatest, one.sum);
  }
  if (greatest + std::log(static_cast<double>(all_.size())) < bound_) return false;
  double sum = 0;
  for (const Ratio& one : all_) sum += std::exp(one.sum - greatest);
  return greatest + std::log(sum) >= bound_;
}

AtLeast::AtLeast(double share, double confidence)
    : allowed_(1 - share), holds_(allowed_, 0, confidence), refuted_(allowed_, 1, confidence) {}

void AtLeast::add(Run run) {
  if (state_ != State::kOpen) return;
  ++runs_;
  if (holds_.add(run != Run::kKept))
    state_ = State::kHolds;
  else if (refuted_.add(run == Run::kViolated))
    state_ = State::kRefuted;
}

AtLeast::Shares AtLeast::indifference() const {
  // The nearest rate that on the average passes the bound by now.
  const auto nearest = [&](double far, double bound) {
    const auto is_told = [&](double rate) { return static_cast<double>(runs_) * information(rate, allowed_) >= bound; };
    if (!is_told(far)) return far;
    double open = allowed_;
    for (int i = 0; i < 60; ++i) {
      const double middle = (open + far) / 2;
      (is_told(middle) ? far : open) = middle;
    }
    return far;
  };
  return {.low = 1 - nearest(1, refuted_.bound()), .high = 1 - nearest(0, holds_.bound())};
}

std::string_view to_string(AtLeast::State state) {
  constexpr std::array<std::string_view, 3> kNames{"undecided", "holds", "REFUTED"};
  return kNames[static_cast<std::size_t>(state)];
}

}  // namespace sentree::verify
