#pragma once

#include <span>
#include <string_view>
#include <vector>

namespace sentree::sim {

/// A topic of the interface `kTelemetry` of interfaces/robot.thrift: its only argument is what a service answers.
struct TopicInfo {
  std::string_view topic;    ///< A one-way method of the interface.
  std::string_view service;  ///< Whose answer it is, and of which method.
  std::string_view method;
};

/// What the simulator can publish. Nobody calls it, so it is none of `services()`.
inline constexpr std::string_view kTelemetry = "Telemetry";
[[nodiscard]] std::span<const TopicInfo> topics();
/// Null if the simulator cannot publish a topic of that name.
[[nodiscard]] const TopicInfo* find_topic(std::string_view name);

}  // namespace sentree::sim
