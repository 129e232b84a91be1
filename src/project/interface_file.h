#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "sentree/idl/schema.h"

namespace sentree::project {

/// What `interface:` and `--interface` name.
struct InterfaceName {
  std::string file;     ///< "robot.thrift", "std_srvs/srv/SetBool.srv"; empty: the text has no slash.
  std::string service;  ///< "Battery", "SetBool".
};
/// "robot.thrift/Battery", or of ROS "std_srvs/srv/SetBool".
[[nodiscard]] InterfaceName interface_name(const std::string& text);

/// Where the file is that an interface's name has: in `own`, an interface of ROS then in the share/ of each folder of
/// $AMENT_PREFIX_PATH, and last among those that come with Sentree. Nothing: nowhere.
[[nodiscard]] std::optional<std::filesystem::path> find_interface(const std::filesystem::path& own,
                                                                  const std::string& file);

/// Of a name whose file has no ending, "std_srvs/SetBool": "; did you mean …?" of ROS, else how interfaces are named.
/// Empty: it has one.
[[nodiscard]] std::string missing_form(const std::filesystem::path& own, const std::string& file,
                                       const std::string& service);

/// Called for each file that was tried, with its text, or nothing if it could not be read.
using OnInterfaceRead = std::function<void(const std::filesystem::path& file, const std::string& shown,
                                           const std::optional<std::string>& content)>;

/// Reads a Thrift IDL file with all that it includes. As for the Thrift compiler, an include is looked for in the
/// folder of the file that has it, then among the interfaces that come with Sentree. Of ROS a .msg, .srv or .action
/// with the messages that it uses, each where `find_interface` finds it; `file` lies in PACKAGE/FORM/.
///
/// `shown` is the file's name in messages; included files are named beside it. Codes: those of `idl::Schema::load`, and
/// of `text::read_file` for `file` itself.
[[nodiscard]] Loaded<idl::Schema> load_interface(const std::filesystem::path& file, const std::string& shown,
                                                 const OnInterfaceRead& on_read = {});

}  // namespace sentree::project
