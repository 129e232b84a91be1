#include "sentree/project/chart_memory.h"

#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::project {

void ChartMemory::forget() {
  facts_.clear();
  words_.clear();
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

const ChartMemory::Words& ChartMemory::words(const scxml::Chart& chart) {
  if (words_.size() >= kChartsMax) forget();
  const auto [known, is_new] = words_.try_emplace(&chart.model(), Words{chart, {}, {}});
  if (is_new) {
    for (const scxml::Chart& one : scxml::with_invoked(chart)) {
      for (const scxml::Expression& expression : one.model().expressions) {
        for (const scxml::ScriptMention& mention : scxml::texts_in_script(expression.text)) {
          if (!mention.is_computed_state && !mention.text.empty()) known->second.texts.emplace(mention.text);
        }
      }
    }
    known->second.choices = choices_of(chart);
  }
  return known->second;
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
