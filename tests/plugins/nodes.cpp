// A plug-in as users write it: a node with ports, one that remembers, a script enum, a port of any type.
#include "sentree/bt/registry.h"

namespace bt = sentree::bt;

namespace {

struct CountTo {
  int count = 0;
  static bt::Ports ports() { return {bt::input<int>("limit"), bt::input("anything")}; }
  bt::Status on_start(bt::Context& self) {
    count = 0;
    return on_running(self);
  }
  bt::Status on_running(bt::Context& self) {
    const auto limit = self.input<int>("limit");
    if (!limit) return bt::Status::kFailure;
    return ++count < *limit ? bt::Status::kRunning : bt::Status::kSuccess;
  }
};

}  // namespace

SENTREE_REGISTER_NODES(registry) {
  registry.add<CountTo>("CountTo");
  registry.action("Double", {bt::input<double>("in"), bt::output<double>("out")}, [](bt::Context& self) {
    return self.output("out", 2 * self.input_or("in", 0.0)) ? bt::Status::kSuccess : bt::Status::kFailure;
  });
  registry.enum_value("THE_ANSWER", 42);
}
