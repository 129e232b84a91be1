#include <algorithm>
#include <utility>

#include "sentree/scxml/detail/script_heap.h"

namespace sentree::scxml {

std::shared_ptr<ScriptHeap> HeapPool::take(std::uint64_t tag) {
  const std::lock_guard lock(mutex_);
  if (free_.empty()) return nullptr;
  auto found = std::find_if(free_.begin(), free_.end(), [&](const auto& heap) { return tag != 0 && heap->tag == tag; });
  if (found == free_.end()) found = free_.begin();
  auto heap = std::move(*found);
  free_.erase(found);
  return heap;
}

void HeapPool::give(std::shared_ptr<ScriptHeap> heap) {
  heap->attach(nullptr);
  const std::lock_guard lock(mutex_);
  // The one that waited longest is the first to go, and the first to be taken by another session.
  if (free_.size() == kKeptMax) free_.erase(free_.begin());
  free_.push_back(std::move(heap));
}

std::uint64_t HeapPool::next_tag() {
  const std::lock_guard lock(mutex_);
  return ++tags_;
}

}  // namespace sentree::scxml
