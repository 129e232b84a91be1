#include "sentree/verify/splitting.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "sentree/base/diagnostic.h"
#include "sentree/base/rng.h"
#include "sentree/scxml/model.h"

namespace sentree::verify {

namespace {

constexpr double kViolated = std::numeric_limits<double>::infinity();
// Of the walkers, those that are given up at a time: one in so many.
constexpr std::size_t kGivenUpOneIn = 10;

// A datum of a model that says how near a violation is.
struct Datum {
  std::size_t model = 0;
  std::string name;
};

Result<std::optional<Datum>> datum_of(const project::Plan& plan, const std::string& score) {
  if (score == kOwed) return std::optional<Datum>();
  std::vector<std::string> names{kOwed};
  for (std::size_t i = 0; i < plan.models.size(); ++i) {
    const project::ModelPlan& model = plan.models[i];
    for (const scxml::Variable& variable : model.chart.model().variables) {
      names.push_back(fmt::format("{}.{}", model.name, variable.id));
      if (names.back() == score) return std::optional(Datum{i, variable.id});
    }
  }
  return fail("verify.score", fmt::format("a score is MODEL.DATA or {}, and no model has data called \"{}\"{}", kOwed,
                                          score, did_you_mean(score, names)));
}

class Splitter {
 public:
  Splitter(const project::Plan& plan, std::size_t monitor, const Splitting& splitting, std::optional<Datum> datum)
      : plan_(plan),
        splitting_(splitting),
        monitor_(monitor),
        datum_(std::move(datum)),
        leaves_open_(leaves_open(plan.monitors[monitor], splitting.length, plan.scenario.project.period)),
        walk_(plan, splitting.order, score()) {}

  struct Estimates {
    double violated = 0;
    double open = 0;
  };
  // One repetition; nothing: interrupted.
  Result<std::optional<Estimates>> operator()(std::uint64_t number, Splits& counted) {
    if (!begun_ || walk_.bytes() > splitting_.memory) {
      if (auto begun = walk_.begin(); !begun) return tl::unexpected(begun.error());
      owed_.clear();
      begun_ = true;
    }
    Rng rng = rng_of(splitting_.seed, number);
    std::vector<Trail> trails(splitting_.walkers);
    for (Trail& trail : trails) {
      trail.marks.push_back({score_of(0, walk_.first(monitor_)), 0, walk_.first(monitor_), TimePoint{}});
      if (auto done = go_on(trail, rng); !done) return tl::unexpected(done.error());
      if (interrupted()) return std::optional<Estimates>();
      ++counted.runs;
      counted.violated += trail.best() == kViolated ? 1U : 0U;
      counted.owed += trail.owed ? 1U : 0U;
    }
    // What is given up stands for its share all the same (Bréhier et al.): so is known how likely a run ends open.
    const auto open_of = [](const std::vector<Trail>& of) {
      return static_cast<double>(std::count_if(of.begin(), of.end(), [](const Trail& trail) { return trail.owed; }));
    };
    const auto walkers = static_cast<double>(trails.size());
    double left = 1;
    double open = 0;
    std::vector<double> best;
    for (std::size_t levels = 0;; ++levels) {
      if (levels > kLevelsMax)
        return fail("verify.score", fmt::format("{} passes more than {} levels", splitting_.score, kLevelsMax));
      best.clear();
      for (const Trail& trail : trails) best.push_back(trail.best());
      const std::size_t last = std::max<std::size_t>(1, trails.size() / kGivenUpOneIn) - 1;
      std::nth_element(best.begin(), best.begin() + static_cast<std::ptrdiff_t>(last), best.end());
      const double level = best[last];
      if (level == kViolated) break;
      std::vector<std::size_t> above;
      std::vector<std::size_t> given_up;
      for (std::size_t i = 0; i < trails.size(); ++i) (trails[i].best() > level ? above : given_up).push_back(i);
      if (above.empty()) return std::optional(Estimates{0, open + left * open_of(trails) / walkers});
      for (const std::size_t i : given_up) open += trails[i].owed ? left / walkers : 0;
      left *= static_cast<double>(above.size()) / walkers;
      for (const std::size_t i : given_up) {
        const Trail& from = trails[above[rng.below(above.size())]];
        const auto passed =
            std::find_if(from.marks.begin(), from.marks.end(), [&](const Mark& mark) { return mark.score > level; });
        Trail branch{.marks = {from.marks.begin(), passed + 1}};
        if (auto done = go_on(branch, rng); !done) return tl::unexpected(done.error());
        trails[i] = std::move(branch);
        ++counted.branches;
      }
      if (interrupted()) return std::optional<Estimates>();
    }
    const auto violated = std::count(best.begin(), best.end(), kViolated);
    return std::optional(
        Estimates{left * static_cast<double>(violated) / walkers, open + left * open_of(trails) / walkers});
  }

 private:
  // Where a run first had a score that it had not had before.
  struct Mark {
    double score = 0;
    std::uint32_t at = 0;
    std::uint32_t core = 0;
    TimePoint now{};
  };
  struct Trail {
    std::vector<Mark> marks;  // of growing scores
    bool owed = false;        // something is still to come where it was ended
    [[nodiscard]] double best() const { return marks.back().score; }
  };

  std::function<Result<double>(const Frontier&)> score() const {
    if (!datum_) return {};
    return [this](const Frontier& run) -> Result<double> {
      const scxml::Chart& chart = plan_.models[datum_->model].chart;
      double score = 0;
      bool is_number = true;
      run.model(datum_->model).session.visit_data(chart, [&](const std::string& name, const Value& value) {
        if (name != datum_->name) return;
        is_number = value.is_number() || value.as_bool() != nullptr;
        if (is_number) score = value.is_number() ? value.number() : *value.as_bool() ? 1 : 0;
      });
      if (is_number && !std::isnan(score)) return score;
      return fail("verify.score", splitting_.score + " is not always a number");
    };
  }

  // How near a violation is, there.
  double score_of(std::uint32_t at, std::uint32_t core) {
    if (datum_) return walk_.score(at);
    while (owed_.size() <= core) {
      const MonitorMemory::Kept& kept = walk_.monitor(monitor_).kept(static_cast<std::uint32_t>(owed_.size()));
      owed_.push_back(used_up(monitor::standing(plan_.monitors[monitor_], kept.core), kept.at));
    }
    return owed_[core];
  }
  static double used_up(const monitor::Standing& standing, TimePoint at) {
    if (!standing.pending) return 0;
    // "3 of 10 ticks"
    if (!standing.counted.empty()) return 1 + std::strtod(standing.counted.c_str(), nullptr);
    if (!standing.deadline || !standing.since || *standing.deadline <= *standing.since) return 1;
    return 2 - seconds(*standing.deadline - at) / seconds(*standing.deadline - *standing.since);
  }

  // From its last mark to its end.
  Result<void> go_on(Trail& trail, Rng& rng) {
    const TimePoint end = TimePoint{} + splitting_.length;
    MonitorMemory& monitor = walk_.monitor(monitor_);
    auto [score, at, core, now] = trail.marks.back();
    if (score == kViolated) return {};
    bool is_last = false;
    bool ended = walk_.ended(at);
    for (std::uint64_t tick = 0; !is_last && !walk_.ended(at); ++tick) {
      // Of the period in which the run ends all comes that is before its end.
      is_last = walk_.is_at_end(at, now, end);
      if (tick % 1024 == 1023 && walk_.bytes() > splitting_.memory)
        return fail("verify.memory", "one repetition needs too much of it");
      const auto way = walk_.go_on(at, rng);
      if (!way) return tl::unexpected(way.error());
      const bool is_cut = is_last && now + way->took >= end;
      const auto* outcome = is_cut ? monitor.before(core, monitor.heard(way->seen), end - now)
                                   : monitor.after(core, monitor.heard(way->seen), way->judged);
      if (outcome == nullptr) return tl::unexpected(*monitor.error());
      at = way->to;
      core = outcome->core;
      now += way->took;
      ended = !is_cut && walk_.ended(at);
      // What is behind the end is near nothing any more.
      if (is_cut && !outcome->violated) break;
      const double reached = outcome->violated ? kViolated : score_of(at, core);
      if (reached > trail.best()) trail.marks.push_back({reached, at, core, now});
      if (outcome->violated) return {};
    }
    if (ended && monitor.kept(core).owes) trail.marks.push_back({kViolated, at, core, now});
    trail.owed = !ended && monitor.kept(core).to_come && leaves_open_;
    return {};
  }

  [[nodiscard]] bool interrupted() const { return splitting_.interrupted && splitting_.interrupted(); }

  const project::Plan& plan_;
  const Splitting& splitting_;
  std::size_t monitor_;
  std::optional<Datum> datum_;
  bool leaves_open_;
  Walk walk_;
  bool begun_ = false;
  std::vector<double> owed_;  // by state of the monitor
};

}  // namespace

Result<Splits> split(const project::Plan& plan, std::size_t monitor, const Splitting& splitting) {
  const auto datum = datum_of(plan, splitting.score);
  if (!datum) return tl::unexpected(datum.error());
  const std::size_t workers = std::max<std::size_t>(1, splitting.each ? splitting.workers : 1);
  std::vector<std::unique_ptr<Splitter>> splitters;
  for (std::size_t i = 0; i < workers; ++i)
    splitters.push_back(std::make_unique<Splitter>(plan, monitor, splitting, *datum));
  struct Repetition {
    Result<std::optional<Splitter::Estimates>> estimate = std::optional<Splitter::Estimates>();
    Splits counted;
  };
  Splits out;
  std::vector<Repetition> block;
  while (out.estimates.size() < splitting.repetitions) {
    const std::uint64_t done = out.estimates.size();
    block.assign(std::min<std::uint64_t>(workers, splitting.repetitions - done), Repetition());
    for_each(splitting.each, block.size(),
             [&](std::size_t i) { block[i].estimate = (*splitters[i])(done + i, block[i].counted); });
    for (const Repetition& one : block) {
      if (!one.estimate) return tl::unexpected(one.estimate.error());
      if (!*one.estimate) return out;
      const Splitter::Estimates& found = **one.estimate;
      out.estimates.push_back(found.violated);
      out.with_open.push_back(found.violated + found.open);
      out.runs += one.counted.runs;
      out.violated += one.counted.violated;
      out.owed += one.counted.owed;
      out.branches += one.counted.branches;
    }
    if (splitting.progress) splitting.progress(out.estimates.size());
  }
  return out;
}

}  // namespace sentree::verify
