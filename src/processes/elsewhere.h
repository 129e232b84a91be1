#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sentree/runtime/elsewhere.h"

namespace sentree::processes {

struct ElsewhereOptions {
  /// The `sentree` that runs parts in processes of their own; empty: the program that runs.
  std::string program = {};
  /// Where skills on other machines publish what they do, beside the run's own socket; empty: nowhere.
  std::string listen = {};
  bool insecure = false;  ///< `listen` may be reached by other machines without TLS.
};

/// For `RunOptions::elsewhere`: processes of this machine under a supervisor, and parts at addresses through the
/// middleware of each (rpc/middleware.h).
[[nodiscard]] std::function<std::unique_ptr<runtime::Elsewhere>(runtime::Elsewhere::Surroundings)> elsewhere(
    ElsewhereOptions options = {});

}  // namespace sentree::processes
