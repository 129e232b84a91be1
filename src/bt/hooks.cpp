#include "sentree/bt/hooks.h"

namespace sentree::bt {

Status TickHooks::begin(NodeId node, Status kept, TimePoint now) {
  const auto hooks = nodes_.find(node);
  if (hooks == nodes_.end()) return Status::kIdle;
  if (hooks->second.before && !is_completed(kept)) {
    const Status instead = hooks->second.before(node);
    if (is_completed(instead)) return instead;
  }
  if (hooks->second.monitor) begun_[node] = clock_ != nullptr ? clock_->now() : now;
  return Status::kIdle;
}

Status TickHooks::end(NodeId node, Status status, TimePoint now) {
  const auto hooks = nodes_.find(node);
  if (hooks == nodes_.end()) return status;
  if (const auto begun = begun_.find(node); begun != begun_.end()) {
    const TimePoint since = begun->second;
    begun_.erase(begun);
    hooks->second.monitor(node, status, (clock_ != nullptr ? clock_->now() : now) - since);
  }
  if (hooks->second.after && is_completed(status)) {
    const Status instead = hooks->second.after(node, status);
    if (is_completed(instead)) return instead;
  }
  return status;
}

}  // namespace sentree::bt
