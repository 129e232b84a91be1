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
struct AskedPage {
  std::string at;         ///< [HOST:]PORT; empty: the usual place.
  bool insecure = false;  ///< Other machines may connect without TLS.
};
/// Opens a run's page if it is not open yet.
using OpenPage = std::function<Result<PageAt>(const AskedPage& asked)>;

}  // namespace sentree::runtime
