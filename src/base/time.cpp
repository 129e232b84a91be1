#include "sentree/base/time.h"

#include "sentree/base/assert.h"

namespace sentree {

void ManualClock::set(TimePoint now) {
  SENTREE_ASSERT(now >= now_);
  now_ = now;
}

}  // namespace sentree
