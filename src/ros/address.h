#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/ros/dds.h"

namespace sentree::ros {

/// Releases whose messages between nodes differ: up to Humble, and from Iron on.
enum class Release : std::uint8_t { kHumble, kIron };

/// A name in the graph of ROS 2, and where that graph is.
///
///   ros:/battery_state                    a topic, a service or an action, as the interface says
///   ros:/robot1/                          what names begin with: service battery is /robot1/battery there
///
/// Behind that `?` and, joined by `&`: `publish` (a topic that is ours; else it is read), `requests` (what is overheard
/// has requests too), `qos=default|sensor_data|
/// transient_local|best_effort`, `domain=N` (else ROS_DOMAIN_ID, else 0), `range=localhost|subnet` (else
/// ROS_AUTOMATIC_DISCOVERY_RANGE or ROS_LOCALHOST_ONLY=0, else localhost), `peers=HOST,HOST` (else ROS_STATIC_PEERS,
/// where a semicolon is between them), `release=humble|iron|jazzy|kilted` (else ROS_DISTRO, else humble).
struct GraphAddress {
  std::string name;  ///< With its slash. One at its end: what names begin with.
  bool publish = false;
  bool requests = false;
  std::string qos;  ///< Empty: read best effort, write reliable.
  std::optional<std::uint32_t> domain;
  std::optional<bool> localhost;
  std::vector<std::string> peers;  ///< Hosts beyond that range whose nodes are looked for.
  std::optional<Release> release;

  /// @param text  What stands behind "ros:". Error: rpc.address.
  [[nodiscard]] static Result<GraphAddress> parse(std::string_view text);

  /// The name of a service of the project.
  [[nodiscard]] std::string name_of(const std::string& service) const {
    return name.ends_with('/') ? name + service : name;
  }
  [[nodiscard]] dds::Qos qos_of(bool writes) const;

  /// Whether the environment says what it can mean, as far as the address leaves it to that: a domain, and a range
  /// other than OFF. Error: ros.environment, with the ways out.
  [[nodiscard]] Result<void> check_environment() const;
  // With the environment taken for what is not said.
  [[nodiscard]] std::uint32_t domain_or_environment() const;
  [[nodiscard]] bool localhost_or_environment() const;
  [[nodiscard]] std::vector<std::string> peers_or_environment() const;
  /// One participant is what all addresses with the same of these are reached by.
  [[nodiscard]] dds::ParticipantOptions participant() const {
    return {
        .domain = domain_or_environment(), .localhost = localhost_or_environment(), .peers = peers_or_environment()};
  }
  [[nodiscard]] Release release_or_environment() const;
};

/// What the environment says of ROS 2 that does not fit what is done here, each behind "; "; empty: nothing.
[[nodiscard]] std::string oddities_of_environment();

}  // namespace sentree::ros
