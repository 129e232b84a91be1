#include "sentree/project/chart_memory.h"

namespace sentree::project {

void ChartMemory::forget() {
  facts_.clear();
  first_ += contexts_.size();  // ids stay unique
  contexts_.clear();
  finds_ = 0;
  found_ = {};
}

ChartFacts ChartMemory::facts(const scxml::Chart& chart) {
  if (facts_.size() >= kChartsMax) forget();
  const auto known = facts_.find(&chart.model());
  return known != facts_.end() ? known->second : facts_.emplace(&chart.model(), ChartFacts(chart)).first->second;
}

ChartMemory::ContextId ChartMemory::context(const monitor::Vocabulary& vocabulary,
                                            const std::map<std::string, ServicePlan>& services) {
  const auto is_it = [&](const Context& context) {
    return context.services.size() == services.size() && context.vocabulary == vocabulary &&
           std::all_of(services.begin(), services.end(), [&](const auto& service) {
             const auto found = context.services.find(service.first);
             return found != context.services.end() && found->second == service.second.service;
           });
  };
  // The last one is the likeliest.
  const auto known = std::find_if(contexts_.rbegin(), contexts_.rend(), is_it);
  if (known != contexts_.rend()) return first_ + static_cast<ContextId>(std::distance(known, contexts_.rend()) - 1);
  if (contexts_.size() >= kContextsMax || finds_ >= kChartsMax) forget();
  Context& context = contexts_.emplace_back(Context{vocabulary, {}});
  for (const auto& [name, plan] : services) context.services.emplace(name, plan.service);
  return first_ + contexts_.size() - 1;
}

}  // namespace sentree::project
