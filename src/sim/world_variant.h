#pragma once

#include "sentree/sim/world.h"

namespace sentree::sim {

/// `parse_world` of a file with changes, where a world of the same map is known: the map, and what follows from it
/// alone, is taken over instead of being read.
/// @param like  Null: the map is read. Borrowed.
[[nodiscard]] Loaded<World> parse_world_like(const text::YamlNode& root, const FileReader& read, const World* like);

}  // namespace sentree::sim
