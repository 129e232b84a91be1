#include "sentree/verify/detail/probability.h"

#include <algorithm>
#include <utility>

namespace sentree::verify {

namespace {

class Reaching {
 public:
  Reaching(const Branching& of, const std::vector<bool>& targets) : of_(of), targets_(targets), n_(of.places.size()) {
    before_.resize(n_);
    for (std::uint32_t at = 0; at < n_; ++at)
      each_arc(at, [&](const Branching::Arc& arc) { before_[arc.to].push_back(at); });
  }

  Judgement::Probability operator()(const std::function<bool()>& interrupted) {
    const std::vector<bool> can = reaches(std::vector<bool>(n_, true));
    if (!can[0]) return {0, 0};
    const std::vector<bool> surely = reaches_surely(can, interrupted);
    if (surely.empty()) return {0, 1};
    if (surely[0]) return {1, 1};
    low_.assign(n_, 0);
    high_.assign(n_, 0);
    Places open;
    for (std::uint32_t at = static_cast<std::uint32_t>(n_); at-- > 0;) {
      if (surely[at]) low_[at] = high_[at] = 1;
      if (surely[at] || !can[at]) continue;
      high_[at] = 1;
      open.push_back(at);
    }
    find_components(open);
    constexpr int kRoundsMax = 1'000'000;
    constexpr double kEnough = 1e-10;  // of what it is: what is rare is not rounded away
    bool changed = true;
    for (int round = 0; round < kRoundsMax && changed && high_[0] - low_[0] > kEnough * high_[0]; ++round) {
      if (round % 64 == 63 && interrupted && interrupted()) break;
      changed = false;
      for (const std::uint32_t at : open) {
        const double low = std::max(low_[at], value(at, low_));
        const double high = std::min(high_[at], value(at, high_));
        changed = changed || low != low_[at] || high != high_[at];
        low_[at] = low;
        high_[at] = high;
      }
      for (const Places& component : components_) {
        // Who stays for ever reaches nothing: it is worth no more than the best way out.
        double best = 0;
        for (const std::uint32_t at : component) {
          if (of_.places[at].drawn) continue;
          each_arc(at, [&](const Branching::Arc& arc) {
            if (component_of_[arc.to] != component_of_[at]) best = std::max(best, high_[arc.to]);
          });
        }
        for (const std::uint32_t at : component) {
          changed = changed || best < high_[at];
          high_[at] = std::min(high_[at], best);
        }
      }
    }
    return {low_[0], std::max(low_[0], high_[0])};
  }

 private:
  template <class Do>
  void each_arc(std::uint32_t at, const Do& what) const {
    const Branching::Place& place = of_.places[at];
    for (std::uint32_t arc = place.first; arc < place.first + place.count; ++arc) what(of_.arcs[arc]);
  }

  double value(std::uint32_t at, const std::vector<double>& values) const {
    double result = 0;
    const bool drawn = of_.places[at].drawn;
    each_arc(at, [&](const Branching::Arc& arc) {
      result = drawn ? result + arc.probability * values[arc.to] : std::max(result, values[arc.to]);
    });
    return result;
  }

  // From where a target can be reached if no draw of the way may lead out of `within`.
  std::vector<bool> reaches(const std::vector<bool>& within) const {
    std::vector<bool> found(targets_);
    Places work;
    for (std::uint32_t at = 0; at < n_; ++at) {
      if (targets_[at]) work.push_back(at);
    }
    while (!work.empty()) {
      const std::uint32_t to = work.back();
      work.pop_back();
      for (const std::uint32_t at : before_[to]) {
        if (found[at] || !within[at]) continue;
        bool stays = true;
        if (of_.places[at].drawn) each_arc(at, [&](const Branching::Arc& arc) { stays = stays && within[arc.to]; });
        if (!stays) continue;
        found[at] = true;
        work.push_back(at);
      }
    }
    return found;
  }

  // From where what is left open can be decided so that a target is reached with probability 1; empty: interrupted.
  std::vector<bool> reaches_surely(std::vector<bool> within, const std::function<bool()>& interrupted) const {
    for (;;) {
      std::vector<bool> less = reaches(within);
      if (less == within) return within;
      if (interrupted && interrupted()) return {};
      within = std::move(less);
    }
  }

  void find_components(const Places& open) {
    component_of_.assign(n_, Branching::kNone);
    components_ = Components(of_).end(open, Allowed(of_.arcs.size(), true));
    for (std::uint32_t i = 0; i < components_.size(); ++i) {
      for (const std::uint32_t at : components_[i]) component_of_[at] = i;
    }
  }

  const Branching& of_;
  const std::vector<bool>& targets_;
  std::size_t n_;
  std::vector<Places> before_;
  std::vector<Places> components_;
  std::vector<std::uint32_t> component_of_;  // by place; kNone: of none
  std::vector<double> low_;
  std::vector<double> high_;
};

}  // namespace

Judgement::Probability greatest_chance(const Branching& of, const std::vector<bool>& targets,
                                       const std::function<bool()>& interrupted) {
  return Reaching(of, targets)(interrupted);
}

}  // namespace sentree::verify
