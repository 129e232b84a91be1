#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "sentree/bt/registry.h"

namespace sentree::bt {

// Nodes on queues: entries that hold a list. As in BehaviorTree.CPP they are templates, registered where needed:
//
//     registry.add<bt::PopFromQueue<double>>("PopFromQueue");
//     registry.add<bt::ConsumeQueue<Pose>>("ConsumeQueue", bt::Category::kDecorator);

/// Takes the first element: SUCCESS; FAILURE where there is no queue or no element.
template <Convertible T>
struct PopFromQueue {
  static Ports ports() { return {inout<std::vector<T>>("queue"), output<T>("popped_item")}; }
  Status tick(Context& self) {
    auto queue = self.input<std::vector<T>>("queue");
    if (!queue || queue->empty()) return Status::kFailure;
    const T first = queue->front();
    queue->erase(queue->begin());
    return self.output("queue", *queue) && self.output<T>("popped_item", first) ? Status::kSuccess : Status::kFailure;
  }
};

/// Tells the number of elements: SUCCESS; FAILURE where there is no queue or no element.
template <Convertible T>
struct QueueSize {
  static Ports ports() { return {input<std::vector<T>>("queue"), output<int>("size")}; }
  Status tick(Context& self) {
    const auto queue = self.input<std::vector<T>>("queue");
    if (!queue || queue->empty()) return Status::kFailure;
    return self.output<int>("size", static_cast<int>(queue->size())) ? Status::kSuccess : Status::kFailure;
  }
};

/// Runs its child once per element, all within one tick unless the child runs on; SUCCESS when the queue is empty,
/// FAILURE as soon as the child fails. `Registry::loop` is the newer one.
template <Convertible T>
struct ConsumeQueue {
  static Ports ports() { return {inout<std::vector<T>>("queue"), output<T>("popped_item")}; }
  Next on_tick(Context& self) { return self.child_status(0) == Status::kRunning ? Next::tick(0) : next(self); }
  Next on_child(Context& self, std::size_t child, Status status) {
    if (status == Status::kRunning) return Next::done(status);
    self.reset_child(child);
    return status == Status::kFailure ? Next::done(status) : next(self);
  }

 private:
  static Next next(Context& self) {
    auto queue = self.input<std::vector<T>>("queue");
    if (!queue || queue->empty()) return Next::done(Status::kSuccess);
    const T first = queue->front();
    queue->erase(queue->begin());
    if (!self.output("queue", *queue) || !self.output<T>("popped_item", first)) return Next::done(Status::kFailure);
    return Next::tick(0);
  }
};

}  // namespace sentree::bt
