#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace sentree::import {

/// The Thrift type of a type as ROS interfaces and AS2FM write it ("int16", "float64[]", "string"); nothing for others.
[[nodiscard]] std::optional<std::string> thrift_type(std::string_view ros_type);

/// Fields by name, in the order in which they were first used; a name like "linear.x" is a member of a struct.
class Fields {
 public:
  /// A field that somebody uses; `type` is empty if that does not tell one. The first that tells one counts.
  void use(const std::string& name, const std::string& type);
  [[nodiscard]] bool empty() const { return names_.empty(); }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] std::string type(const std::string& name) const;  ///< "double" if nothing told one.
  [[nodiscard]] std::vector<std::string> untold() const;          ///< Those whose type nothing told.

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::string> types_;
};

/// The fields of ROS interfaces that everybody has, by "package/Name": those of a message, or of a service's request
/// and response, or of an action's goal and result.
struct KnownInterface {
  std::vector<std::pair<std::string, std::string>> first;
  std::vector<std::pair<std::string, std::string>> second;
};
[[nodiscard]] const KnownInterface* known_interface(std::string_view type);

/// A method that stands for a ROS service, for the goal of an action, or (one-way) for a topic.
struct RosMethod {
  Fields arguments;
  Fields result;
  std::string plain_result;  ///< A Thrift type instead of `result`, e.g. "bool".
  bool oneway = false;
  std::string comment;  ///< What it stands for.
};

/// The Thrift services that an AS2FM system is made of, by service and method name.
class RosInterfaces {
 public:
  [[nodiscard]] RosMethod& method(const std::string& service, const std::string& name);
  [[nodiscard]] const std::map<std::string, std::map<std::string, RosMethod>>& services() const { return services_; }
  /// An IDL file with one service; nested names become structs of their own.
  [[nodiscard]] std::string idl(const std::string& service) const;

 private:
  std::map<std::string, std::map<std::string, RosMethod>> services_;
};

}  // namespace sentree::import
