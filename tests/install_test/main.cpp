#include <cstdio>

#include "sentree/bt/runner.h"

int main() {
  namespace bt = sentree::bt;
  bt::Registry registry;
  registry.action("Greet", [](bt::Context&) { return bt::Status::kSuccess; });
  auto tree =
      bt::load(R"(<root BTCPP_format="4"><BehaviorTree ID="Main"><Sequence><Greet/></Sequence></BehaviorTree></root>)",
               {.registry = &registry});
  if (!tree.ok()) return 1;
  bt::Runner runner(std::move(*tree.value));
  std::puts(runner.tick() == bt::Status::kSuccess ? "SUCCESS" : "no success");
}
