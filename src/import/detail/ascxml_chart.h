#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "sentree/import/detail/ros_interfaces.h"
#include "sentree/import/import.h"
#include "sentree/text/xml.h"

namespace sentree::import {

/// Where a ROS service or action is served, in the words of Sentree.
struct RosPlace {
  std::string service;
  std::string method;
};

/// What the charts of one system call each other, filled by `declare` and read by `translate`.
struct RosWorld {
  std::map<std::string, RosPlace> services;  ///< By ROS name.
  std::map<std::string, RosPlace> actions;   ///< `method` is a prefix: _send_goal, _result, _feedback.
  std::map<std::string, std::set<std::string>>
      handlers;  ///< Of plain events: the charts that have a transition for them …
  std::map<std::string, std::set<std::string>> senders;  ///< … and those that send them.
  RosInterfaces interfaces;
  bool has_topics = false;
};

/// One ASCXML chart, as plug-in of a tree or as node.
struct AscxmlChart {
  const text::XmlDocument* document = nullptr;
  std::string name;
  bool is_plugin = false;
  std::map<std::string, std::string> ports;  ///< Values of the ports that name topics, services and actions.
  std::set<std::string> given;               ///< Input ports that the tree gives to every leaf of a plug-in …
  std::set<std::string> sometimes;           ///< … and to some only.
};

/// A top-level declaration of a port.
struct PortDeclaration {
  std::string key;
  std::string type;
  bool is_input = false;
};

/// The name that the one-way methods of topics have as a service, and the events that a protocol gives.
inline constexpr std::string_view kTopics = "topics";

/// Whether the root is <ascxml>, or <scxml> with elements of that dialect.
[[nodiscard]] std::string chart_name(const text::XmlDocument& document, const std::string& file);
[[nodiscard]] std::vector<PortDeclaration> ports_of(const text::XmlDocument& document);
/// Ports that name a topic, a service or an action: their values must be known where the chart is translated.
[[nodiscard]] std::vector<std::string> naming_ports(const text::XmlDocument& document);

/// Enters what the chart serves and handles. Before any `use`.
void declare(const AscxmlChart& chart, RosWorld& world);
/// Enters the fields and types of what the chart sends and reads. Before any `translate`.
void use(const AscxmlChart& chart, RosWorld& world);

struct TranslatedAscxml {
  std::string source;
  std::vector<std::string> goal_counters;  ///< <data> that number the goals of a client; each leaf needs other numbers.
  std::set<std::string> subscribes;        ///< Topics, as SERVICE.METHOD.
  std::vector<Finding> findings;
};
/// The chart as SCXML for a skill with the protocol `as2fm`, or for the model of a component.
[[nodiscard]] TranslatedAscxml translate(const AscxmlChart& chart, RosWorld& world);

/// The part of a name that Thrift can have.
[[nodiscard]] std::string method_name(std::string_view ros_name);

}  // namespace sentree::import
