#include "sentree/cli/verdicts.h"

#include <memory>
#include <utility>

namespace sentree::cli {

Verdicts::Verdicts(std::vector<monitor::Model> models, std::function<void(const runtime::MonitorReport&)> decided)
    : set_(std::move(models), TimePoint{}), decided_(std::move(decided)) {
  for (const monitor::Model& model : set_.models()) reports_.emplace_back().name = model.name();
}

void Verdicts::observe(Message message) {
  set_.observe(std::make_shared<const Message>(std::move(message)), news_);
  take();
}

std::vector<runtime::MonitorReport> Verdicts::finish(TimePoint end) {
  set_.advance(end, news_);
  take();
  for (std::size_t i = 0; i < reports_.size(); ++i) {
    const monitor::State& state = set_.state(i);
    if (state.failure()) {
      reports_[i].failure = to_string(*state.failure());
    } else {
      reports_[i].vacuity = monitor::vacuity(set_.models()[i], state);
      if (reports_[i].verdict == monitor::Verdict::kUndecided)
        reports_[i].standing = monitor::standing(set_.models()[i], state).text();
    }
  }
  return reports_;
}

void Verdicts::take() {
  for (monitor::MonitorSet::Decided& decided : std::exchange(news_, {})) {
    runtime::MonitorReport& report = reports_[decided.monitor];
    report.verdict = decided.decision.verdict;
    if (report.verdict == monitor::Verdict::kViolated) report.violations = decided.decision.number;
    report.leaf = decided.leaf;
    report.explanation = monitor::explain(set_.models()[decided.monitor], decided.decision, decided.leaf);
    report.decision = std::move(decided.decision);
    if (decided_) decided_(report);
  }
}

}  // namespace sentree::cli
