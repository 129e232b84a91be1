// Leaves a file behind as soon as it is loaded, before anybody asks it for its nodes.
#include <cstdlib>
#include <fstream>

#include "sentree/bt/registry.h"

namespace {

struct OnLoad {
  OnLoad() {
    if (const char* file = std::getenv("SENTREE_TEST_MARK")) std::ofstream(file) << "loaded\n";
  }
};
const OnLoad on_load;

}  // namespace

SENTREE_REGISTER_NODES(registry) {
  registry.action("Mark", [](sentree::bt::Context&) { return sentree::bt::Status::kSuccess; });
}
