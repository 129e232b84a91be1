#include "sentree/rpc/call.h"

#include <algorithm>

namespace sentree::rpc {

std::string_view to_string(CallErrorKind kind) {
  switch (kind) {
    case CallErrorKind::kException: return "exception";
    case CallErrorKind::kVetoed: return "vetoed";
    case CallErrorKind::kUnreachable: return "unreachable";
    case CallErrorKind::kLate: return "late";
    case CallErrorKind::kProtocol: return "protocol";
    case CallErrorKind::kArguments: return "arguments";
  }
  return "";
}

void LogicalClock::receive(CausalStamp seen) {
  seen = std::min(seen, kStampMax);
  CausalStamp now = stamp_.load(std::memory_order_acquire);
  while (now <= seen && !stamp_.compare_exchange_weak(now, seen + 1, std::memory_order_acq_rel)) {
  }
}

}  // namespace sentree::rpc
