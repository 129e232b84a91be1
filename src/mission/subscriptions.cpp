#include "sentree/mission/subscriptions.h"

#include <utility>

#include <fmt/format.h>

#include "sentree/idl/conform.h"

namespace sentree::mission {

Subscriptions::Subscriptions(const project::Plan& plan, const std::function<bool(std::size_t leaf)>& here)
    : plan_(&plan) {
  for (std::size_t i = 0; i < plan.leaves.size(); ++i) {
    if (here && !here(i)) continue;
    for (const std::string& topic : plan.leaves[i].subscribes)
      takers_[topic].push_back({.is_model = false, .index = i});
  }
  for (std::size_t i = 0; i < plan.models.size(); ++i) {
    for (const std::string& topic : plan.models[i].subscribes) takers_[topic].push_back({.is_model = true, .index = i});
  }
}

Subscriptions::Told Subscriptions::told_of(const Message& request) const {
  Told told;
  if (takers_.empty() || request.kind != MessageKind::kRequest) return told;
  std::string_view topic = request.name;
  topic.remove_suffix(std::min(topic.size(), std::string_view(".request").size()));
  const auto takers = takers_.find(topic);
  if (takers == takers_.end()) return told;
  // It may come from elsewhere, and say anything.
  const auto service = plan_->services.find(request.target);
  const idl::Method* const method = service != plan_->services.end() && topic.size() > request.target.size()
                                        ? service->second.service->find(topic.substr(request.target.size() + 1))
                                        : nullptr;
  const Value* const args = request.data.find("args");
  auto conforming = method != nullptr ? idl::conform_arguments(*method, args != nullptr ? *args : Value(Map()))
                                      : fail("run.topic", "the run has no such service");
  if (!conforming) {
    told.problem = fmt::format("{} of {} reaches nobody: {}", topic, request.source, conforming.error().message);
    return told;
  }
  told.topic = topic;
  told.takers = &takers->second;
  told.what = Shared<Publication>(Publication{std::string(topic), request.source, std::move(*conforming)});
  return told;
}

}  // namespace sentree::mission
