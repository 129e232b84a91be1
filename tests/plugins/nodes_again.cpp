// A node of the ID that another plug-in has too.
#include "sentree/bt/registry.h"

SENTREE_REGISTER_NODES(registry) {
  registry.action("Double", [](sentree::bt::Context&) { return sentree::bt::Status::kSuccess; });
}
