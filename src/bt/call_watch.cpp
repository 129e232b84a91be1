#include "sentree/bt/call_watch.h"

#include <vector>

#include "sentree/bt/load.h"
#include "sentree/bt/model.h"
#include "sentree/bt/registry.h"

namespace sentree::bt {

namespace {

constexpr unsigned kNodeBits = 24;
static_assert(kNodesMax < 1U << kNodeBits);
constexpr std::uint64_t kGivenUp = ~std::uint64_t{0};

}  // namespace

std::optional<CallWatch::Call> CallWatch::pending() const {
  const std::uint64_t call = call_.load(std::memory_order_acquire);
  if (call == 0 || call == kGivenUp) return std::nullopt;
  const std::uint64_t began = call >> kNodeBits;
  const std::uint64_t now = clock_() + 1;
  return Call{static_cast<NodeId>(call & ((1U << kNodeBits) - 1)),
              std::chrono::milliseconds(now > began ? now - began : 0), call};
}

bool CallWatch::give_up(const Call& call) {
  std::uint64_t which = call.which;
  return call_.compare_exchange_strong(which, kGivenUp, std::memory_order_acq_rel);
}

std::shared_ptr<void> nodes_of(const Tree& tree) {
  auto nodes = std::make_shared<std::vector<std::shared_ptr<const Behaviour>>>();
  for (NodeId id = 0; id < tree.size(); ++id) {
    if (tree.is_user(id)) nodes->push_back(tree.model().manifest(id).behaviour);
  }
  return nodes;
}

std::uint64_t CallWatch::enter(NodeId node) { return replace((clock_() + 1) << kNodeBits | node); }

void CallWatch::leave(std::uint64_t before) { (void)replace(before); }

std::uint64_t CallWatch::replace(std::uint64_t next) {
  std::uint64_t present = call_.load(std::memory_order_relaxed);
  for (;;) {
    if (present == kGivenUp) {
      call_.wait(kGivenUp);
      present = call_.load(std::memory_order_relaxed);
    } else if (call_.compare_exchange_weak(present, next, std::memory_order_acq_rel)) {
      return present;
    }
  }
}

}  // namespace sentree::bt
