#include "sentree/rpc/call.h"

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

}  // namespace sentree::rpc
