#pragma once

#include <string>
#include <vector>

#include "sentree/import/detail/source_folder.h"
#include "sentree/import/import.h"

namespace sentree::import {

/// The files of the folder that are main files of AS2FM systems: <roaml>, or <convince_mc_tc>.
[[nodiscard]] std::vector<std::string> roaml_mains(const SourceFolder& folder);

/// An AS2FM system by its main file, as a Sentree project: plug-ins of the tree are skills that live on, nodes are
/// models of components, ROS services, actions and topics are Thrift interfaces made from what the charts use.
[[nodiscard]] Loaded<Imported> import_roaml(const SourceFolder& folder, const std::string& main);

}  // namespace sentree::import
