#include "sentree/cli/ros_network.h"

#include "sentree/project/interface_file.h"

namespace sentree::cli {

Loaded<idl::Schema> ros_interface(const std::string& type) {
  const project::InterfaceName name = project::interface_name(type);
  const auto file = project::find_interface("interfaces", name.file);
  if (file) return project::load_interface(*file, name.file);
  Loaded<idl::Schema> out;
  out.diagnostics.push_back({Severity::kError, "check.no-interface", "there is no interfaces/" + name.file, {}});
  return out;
}

Result<idl::ServicePtr> ros_service(const std::string& type) {
  auto schema = ros_interface(type);
  if (schema.ok()) return schema.value->service(type.substr(type.rfind('/') + 1));
  return tl::unexpected(schema.diagnostics.front());
}

}  // namespace sentree::cli
