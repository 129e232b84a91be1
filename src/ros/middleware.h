#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sentree/idl/schema.h"
#include "sentree/rpc/middleware.h"

namespace sentree::ros {

struct Options {
  /// Finds the interface "sensor_msgs/msg/BatteryState", for whoever looks at a topic without knowing its type.
  std::function<Loaded<idl::Schema>(const std::string& type)> find;
  /// Told once of each domain that is opened to other machines, where whoever opens it has no place for problems.
  std::function<void(const std::string&)> warn = {};
};

/// ros: addresses, see `GraphAddress`. What is there says the interface: a .srv is a service, a .msg a topic, which is
/// read unless the address says `publish`, an .action an action, whose feedback, results and statuses are read. A
/// Thrift interface is a service of ROS for each method, and a topic for each that is one-way. DDS comes from a shared
/// object that is loaded with the first address that is opened.
[[nodiscard]] std::unique_ptr<rpc::Middleware> make_middleware(Options options);

}  // namespace sentree::ros
