#pragma once

#include <optional>

#include "sentree/base/value.h"
#include "sentree/monitor/monitor.h"

namespace sentree::runtime {

/// A decision as data, for the journal, and back; nothing: it is none.
[[nodiscard]] Value save(const monitor::Decision& decision);
[[nodiscard]] std::optional<monitor::Decision> restore_decision(const Value& saved);

}  // namespace sentree::runtime
