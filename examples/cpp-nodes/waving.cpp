// A plug-in: built alone, loaded by name.
#include <cstdio>

#include "sentree/bt/registry.h"

SENTREE_REGISTER_NODES(registry) {
  registry.action("Wave", [](sentree::bt::Context&) {
    std::puts("  waving");
    return sentree::bt::Status::kSuccess;
  });
}
