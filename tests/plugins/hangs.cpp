// Nodes that do not come back: one that waits for what nobody tells it, and one that waits so when it is halted.
#include <condition_variable>
#include <mutex>

#include "sentree/bt/registry.h"

namespace bt = sentree::bt;

namespace {

void wait_for_nobody() {
  // Never destroyed: who waits goes on when the program ends.
  static auto* const mutex = new std::mutex();
  static auto* const told = new std::condition_variable();
  std::unique_lock lock(*mutex);
  told->wait(lock, [] { return false; });
}

struct HangsWhenHalted {
  bt::Status on_start(bt::Context&) { return bt::Status::kRunning; }
  bt::Status on_running(bt::Context&) { return bt::Status::kRunning; }
  void on_halted(bt::Context&) { wait_for_nobody(); }
};

}  // namespace

SENTREE_REGISTER_NODES(registry) {
  registry.condition("Hangs", [](bt::Context&) {
    wait_for_nobody();
    return bt::Status::kSuccess;
  });
  registry.add<HangsWhenHalted>("HangsWhenHalted");
}
