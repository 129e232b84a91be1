#include "sentree/bt/status.h"

namespace sentree::bt {

std::string_view to_string(Status status) {
  switch (status) {
    case Status::kIdle: return "IDLE";
    case Status::kRunning: return "RUNNING";
    case Status::kSuccess: return "SUCCESS";
    case Status::kFailure: return "FAILURE";
    case Status::kSkipped: return "SKIPPED";
  }
  return "IDLE";
}

std::optional<Status> parse_status(std::string_view text) {
  for (const Status status : {Status::kIdle, Status::kRunning, Status::kSuccess, Status::kFailure, Status::kSkipped}) {
    if (to_string(status) == text) return status;
  }
  return std::nullopt;
}

}  // namespace sentree::bt
