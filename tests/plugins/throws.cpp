#include <stdexcept>

#include "sentree/bt/registry.h"

SENTREE_REGISTER_NODES(registry) {
  registry.enum_value("BEFORE", 1);
  throw std::runtime_error("the robot is not there");
}
