#include "sentree/sim/topics.h"

#include <algorithm>

namespace sentree::sim {

std::span<const TopicInfo> topics() {
  static constexpr TopicInfo kTopics[] = {
      {"battery", "Battery", "getBatteryState"},
      {"position", "Localization", "getCurrentPosition"},
      {"odometry", "Localization", "getEstimatedOdometry"},
      {"navigation", "Navigation", "getNavigationState"},
      {"scan", "Laser", "getLaserMeasurement"},
  };
  return kTopics;
}

const TopicInfo* find_topic(std::string_view name) {
  const auto all = topics();
  const auto found = std::find_if(all.begin(), all.end(), [&](const TopicInfo& info) { return info.topic == name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace sentree::sim
