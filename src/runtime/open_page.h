#pragma once

#include <functional>
#include <string>

#include "sentree/base/result.h"

namespace sentree::runtime {

/// Where a run's page is, and the file to which the run is recorded (empty: none).
struct PageAt {
  std::string url;
  std::string recording;
};
/// Opens a run's page if it is not open yet, at [HOST:]PORT (empty: the usual place).
using OpenPage = std::function<Result<PageAt>(const std::string& at, bool insecure)>;

}  // namespace sentree::runtime
