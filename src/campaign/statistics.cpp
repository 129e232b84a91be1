#include "sentree/campaign/statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "sentree/base/diagnostic.h"

namespace sentree::campaign {

Interval clopper_pearson(std::uint64_t hits, std::uint64_t trials, double confidence) {
  if (trials == 0) return {};
  using boost::math::binomial_distribution;
  const double tail = (1.0 - confidence) / 2.0;
  const auto n = static_cast<double>(trials);
  const auto k = static_cast<double>(hits);
  return {hits == 0 ? 0.0 : binomial_distribution<>::find_lower_bound_on_p(n, k, tail),
          hits == trials ? 1.0 : binomial_distribution<>::find_upper_bound_on_p(n, k, tail)};
}

Interval mean_of_shares(const std::vector<double>& values, double confidence) {
  if (values.size() < 2) return {};
  const auto n = static_cast<double>(values.size());
  double sum = 0;
  for (const double value : values) sum += value;
  const double mean = sum / n;
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const boost::math::students_t distribution(n - 1);
  const double off = quantile(distribution, 1 - (1 - confidence) / 2) * std::sqrt(squares / (n - 1) / n);
  return {std::max(0.0, mean - off), std::min(1.0, mean + off)};
}

Tally::Tally(double width, double high)
    : width_(std::max(width, high / static_cast<double>(kBinsMax - 1))),
      bins_(static_cast<std::size_t>(high / width_) + 1) {}

void Tally::add(double value) {
  // Just below a bound by rounding is at it.
  const double place = std::max(0.0, value / width_ + 1e-6);
  ++bins_[std::min(bins_.size() - 1, static_cast<std::size_t>(place))];
  least_ = count_ == 0 ? value : std::min(least_, value);
  most_ = count_ == 0 ? value : std::max(most_, value);
  ++count_;
  sum_ += value;
}

double Tally::quantile(double p) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(p * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    seen += bins_[i];
    if (seen >= wanted && seen > 0) return std::clamp(static_cast<double>(i) * width_, least_, most_);
  }
  return most_;
}

std::vector<std::pair<double, std::uint64_t>> Tally::histogram(std::size_t bins) const {
  std::vector<std::pair<double, std::uint64_t>> out;
  if (count_ == 0) return out;
  const auto place = [&](double value) {
    return std::min(bins_.size() - 1, static_cast<std::size_t>(std::max(0.0, value / width_ + 1e-6)));
  };
  const std::size_t first = place(least_);
  const std::size_t last = place(most_);
  const std::size_t step = (last - first) / bins + 1;
  for (std::size_t i = first; i <= last; ++i) {
    if ((i - first) % step == 0) out.emplace_back(static_cast<double>(i) * width_, 0);
    out.back().second += bins_[i];
  }
  return out;
}

Influence influence(const std::vector<Group>& groups) {
  Group all;
  double within = 0;
  double levels = 0;
  for (const Group& group : groups) {
    if (group.count < 2) continue;
    ++levels;
    all.count += group.count;
    all.sum += group.sum;
    all.squares += group.squares;
    within += group.squares - group.sum * group.sum / static_cast<double>(group.count);
  }
  const auto n = static_cast<double>(all.count);
  if (levels < 2 || n <= levels) return {};
  const double total = all.squares - all.sum * all.sum / n;
  if (!(total > 1e-12 * std::max(1.0, all.squares))) return {};  // always the same
  within = std::max(within, 0.0);
  const double between = std::max(total - within, 0.0);
  const double freedom = levels - 1.0;
  const double noise = within / (n - levels);
  Influence out;
  out.share = std::clamp((between - freedom * noise) / (total + noise), 0.0, 1.0);
  out.p_value =
      noise > 0 ? cdf(complement(boost::math::fisher_f(freedom, n - levels), between / freedom / noise)) : 0.0;
  return out;
}

std::optional<double> parse_share(const std::string& text) {
  const char* const begin = text.c_str();
  char* end = nullptr;
  double value = std::strtod(begin, &end);
  std::string unit(end);
  std::erase(unit, ' ');
  if (end == begin || !(unit.empty() || unit == "%")) return std::nullopt;
  if (unit == "%") {
    const std::string number = text.substr(0, static_cast<std::size_t>(end - begin));
    // The nearest to what is written, which a division of the nearest to the per cent is not.
    value = number.find_first_of("eEpP") == std::string::npos ? std::strtod((number + "e-2").c_str(), nullptr)
                                                              : value / 100;
  }
  return value > 0 && value < 1 ? std::optional(value) : std::nullopt;
}

Result<Expectation> parse_expectation(const std::string& text, const std::vector<std::string>& requirements) {
  Expectation out;
  out.text = text;
  std::istringstream words(text);
  std::string sign;
  std::string number;
  words >> out.subject >> out.what >> sign;
  std::getline(words, number);
  const auto wrong = [&](const std::string& why) {
    return fail(
        "campaign.expect",
        fmt::format("\"{}\": {}; write \"REQUIREMENT violated < 1e-3\" or \"mission SUCCESS > 95 %\"", text, why));
  };
  static const std::vector<std::string> kOutcomes{"SUCCESS", "FAILURE", "RUNNING"};
  static const std::vector<std::string> kVerdicts{"violated", "satisfied"};
  std::vector<std::string> subjects = requirements;
  subjects.emplace_back("mission");
  if (std::find(subjects.begin(), subjects.end(), out.subject) == subjects.end())
    return wrong(fmt::format("the project has no requirement or monitor \"{}\"{}", out.subject,
                             did_you_mean(out.subject, subjects)));
  const auto& whats = out.subject == "mission" ? kOutcomes : kVerdicts;
  if (std::find(whats.begin(), whats.end(), out.what) == whats.end())
    return wrong(fmt::format("there is no \"{}\" of it{}", out.what, did_you_mean(out.what, whats)));
  if (sign != "<" && sign != ">") return wrong("it needs < or >");
  out.below = sign == "<";
  const auto rate = parse_share(number);
  if (!rate) return wrong("a rate is above 0 and below 1");
  out.rate = *rate;
  return out;
}

SequentialTest::SequentialTest(Expectation expectation, double confidence) : expectation_(std::move(expectation)) {
  const double bound = expectation_.rate;
  const double holds =
      expectation_.below ? std::max(bound / 2, 1 - 2 * (1 - bound)) : std::min(2 * bound, 1 - (1 - bound) / 2);
  indifference_ = {std::min(bound, holds), std::max(bound, holds)};
  step_hit_ = std::log(holds / bound);
  step_miss_ = std::log((1 - holds) / (1 - bound));
  // A likelihood ratio exceeds 1/α with a probability of at most α.
  threshold_ = -std::log(1 - confidence);
}

void SequentialTest::add(bool hit) {
  if (state_ != State::kOpen) return;
  ++runs_;
  hits_ += hit ? 1 : 0;
  ratio_ += hit ? step_hit_ : step_miss_;
  if (ratio_ >= threshold_)
    state_ = State::kHolds;
  else if (ratio_ <= -threshold_)
    state_ = State::kRefuted;
}

std::string_view to_string(SequentialTest::State state) {
  constexpr std::array<std::string_view, 3> kNames{"undecided", "holds", "REFUTED"};
  return kNames[static_cast<std::size_t>(state)];
}

}  // namespace sentree::campaign
