#pragma once

#include <string>

#include "sentree/base/result.h"
#include "sentree/idl/schema.h"

namespace sentree::cli {

/// The interface "sensor_msgs/msg/BatteryState", from ./interfaces, $AMENT_PREFIX_PATH or those that come with Sentree.
[[nodiscard]] Loaded<idl::Schema> ros_interface(const std::string& type);
/// The service in it.
[[nodiscard]] Result<idl::ServicePtr> ros_service(const std::string& type);

}  // namespace sentree::cli
