#pragma once

#include <functional>
#include <string>

#include "sentree/base/result.h"
#include "sentree/record/reader.h"
#include "sentree/studio/history.h"

namespace sentree::studio {

/// Brings the messages of a recording into the history of a run that goes on, but for those that `wants` leaves out.
/// Errors: those of `record::Reader`.
[[nodiscard]] Result<void> take_recording(
    History& history, const std::string& recording,
    const std::function<bool(const record::RawMessage&, const record::RunRecord&)>& wants);

}  // namespace sentree::studio
