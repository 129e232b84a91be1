#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/idl/schema.h"
#include "sentree/ros/detail/cdr.h"
#include "sentree/rpc/call.h"

/// What interfaces and their methods are in a graph of ROS. Private to the library.
namespace sentree::ros {

enum class Form : std::uint8_t { kMessage, kService, kAction, kThrift };

struct TypeName {
  std::string package;
  std::string form;  ///< "msg", "srv", "action"
  std::string name;
};
/// "sensor_msgs/msg/BatteryState" and its parts; nothing: another form of name.
[[nodiscard]] std::optional<TypeName> type_name(std::string_view text);
/// "sensor_msgs::msg::dds_::BatteryState_"; and back, "sensor_msgs/msg/BatteryState", which is empty for others.
[[nodiscard]] std::string dds_name(const TypeName& type, std::string_view suffix = "");
[[nodiscard]] std::string ros_name(std::string_view dds_type);

[[nodiscard]] Form form_of(const idl::Service& interface);
/// Whether all that it has are topics.
[[nodiscard]] bool is_data(const idl::Service& interface);

/// One method as a service of ROS, or as a topic if it is one-way.
class Carried {
 public:
  /// @param base  The name in the graph; of a Thrift interface its methods stand below it.
  /// Error: ros.type.
  [[nodiscard]] static Result<std::shared_ptr<const Carried>> make(const idl::Service& interface,
                                                                   const idl::Method& method, const std::string& base);

  const idl::Method* method = nullptr;
  std::string name;  ///< In the graph.
  std::string type;  ///< Of a topic.
  std::string request_type;
  std::string reply_type;

  [[nodiscard]] Result<void> write_arguments(std::vector<std::uint8_t>& out, const Value& arguments) const {
    return arguments_->write(out, arguments);
  }
  [[nodiscard]] Result<Value> read_arguments(std::span<const std::uint8_t> message, const rpc::Limits& limits) const {
    return arguments_->read(message, kEncapsulation, limits);
  }
  /// The outcome of a Thrift method travels whole; an error of a service of ROS cannot: false.
  [[nodiscard]] Result<bool> write_outcome(std::vector<std::uint8_t>& out, const rpc::Outcome& outcome) const;
  [[nodiscard]] rpc::Outcome read_outcome(std::span<const std::uint8_t> message, const rpc::Limits& limits) const;

 private:
  bool is_thrift_ = false;
  idl::Struct response_;  ///< Of a Thrift method: error, result, exceptions; each but the first may be absent.
  std::optional<Codec> arguments_;
  std::optional<Codec> reply_;
};

}  // namespace sentree::ros
