// Nodes that work in threads: one that is done in a moment, one that works until it is halted, and one that does not
// listen.
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "sentree/exec/threaded_action.h"

namespace bt = sentree::bt;
namespace exec = sentree::exec;

SENTREE_REGISTER_NODES(registry) {
  const auto threads = std::make_shared<exec::Threads>(2);
  exec::threaded_action(registry, threads, "Plan", {bt::output<int>("steps")}, [](exec::Job& job) {
    job.sleep_for(std::chrono::milliseconds(2));
    job.output("steps", 7);
    return bt::Status::kSuccess;
  });
  exec::threaded_action(registry, threads, "Follow", {}, [](exec::Job& job) {
    while (job.sleep_for(std::chrono::hours(1))) {
    }
    return bt::Status::kFailure;
  });
  // Does not ask whether it is to stop.
  exec::threaded_action(registry, threads, "Deaf", {}, [](exec::Job&) {
    static auto* const mutex = new std::mutex();
    static auto* const told = new std::condition_variable();
    std::unique_lock lock(*mutex);
    told->wait(lock, [] { return false; });
    return bt::Status::kSuccess;
  });
}
