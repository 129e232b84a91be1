#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "sentree/idl/schema.h"

namespace sentree::idl {

/// Whether a file's name ends as those of ROS's interfaces do: .msg, .srv, .action. Private to the library.
[[nodiscard]] bool is_ros_file(std::string_view file);

/// Reads an interface of ROS 2 with the messages that it uses. Its package and form are the last two folders of its
/// name: std_srvs/srv/SetBool.srv. Null: there were errors, which `diagnostics` has.
[[nodiscard]] std::shared_ptr<const Schema::Program> load_ros(std::string_view source, const std::string& file,
                                                              const IncludeReader& include, Diagnostics& diagnostics);

}  // namespace sentree::idl
