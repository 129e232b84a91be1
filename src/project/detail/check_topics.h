#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/project/plan.h"

namespace sentree::project {

/// A service that nobody serves (at: topics) has one-way methods only. Error: check.topic.
void check_all_oneway(const ServiceEntry& entry, const idl::Service& service, Diagnostics& diagnostics);

/// The topics that a chart subscribes to are there, and it takes them. Errors: check.unknown-topic,
/// check.unheard-event.
/// @param who  As messages name it: skill "X".
void check_subscriptions(const std::string& who, const Subscriptions& subscribes, const scxml::Chart& chart,
                         const std::map<std::string, ServicePlan>& services, Diagnostics& diagnostics);

/// The topics of `services` that a chart has transitions for.
[[nodiscard]] std::vector<std::string> topics_handled(const scxml::Chart& chart,
                                                      const std::map<std::string, ServicePlan>& services);

/// Topics inside the run, and where the project publishes for others, that somebody subscribes to and no chart
/// publishes. Code: check.unpublished, a warning inside the run.
/// Two types at one name of ROS, of which a node has one.
void check_types(const Project& project, const std::map<std::string, ServicePlan>& services, Diagnostics& diagnostics);

void check_publishers(const Project& project, const std::vector<LeafPlan>& leaves, const std::vector<ModelPlan>& models,
                      const std::map<std::string, ServicePlan>& services, Diagnostics& diagnostics);

/// What a service publishes by `publish:`: one-way methods that the simulator knows.
/// Codes: check.publish, idl.unknown-method.
void check_published(const ServiceEntry& entry, const idl::Service& service, Diagnostics& diagnostics);

}  // namespace sentree::project
