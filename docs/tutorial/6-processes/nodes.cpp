#include <cstdio>
#include <string>

#include "sentree/bt/registry.h"

namespace bt = sentree::bt;

SENTREE_REGISTER_NODES(registry) {
  // An action with an input port. It is done within its tick.
  registry.action("Say", {bt::input<std::string>("text")}, [](bt::Context& self) {
    std::printf("robot: %s\n", self.input_or<std::string>("text", "...").c_str());
    std::fflush(stdout);
    return bt::Status::kSuccess;
  });
}
