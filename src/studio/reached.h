#pragma once

#include <filesystem>
#include <string>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/campaign/coverage.h"
#include "sentree/replay/recorded_code.h"
#include "sentree/replay/recorded_run.h"

namespace sentree::studio {

/// Coverage as pages get it: {kinds: [{kind, reached, of}], not_reached: [{kind, of, what, file, line}]}, with files as
/// paths inside `folder`, and line 0 for what stands in no file.
[[nodiscard]] Value coverage_value(const campaign::Coverage& coverage, const std::filesystem::path& folder);

/// What a recorded run has reached, and the folder that the names of files in it lead to.
struct Reached {
  campaign::Coverage coverage;
  std::filesystem::path folder;
};
/// Guards and transitions are in no recording: the run is executed again, its services answering as they did then.
/// Cost: that of `replay::replay`. Errors: those of it and of `RecordedRun`; coverage.differs (what is executed now
/// does something else, as after an upgrade).
[[nodiscard]] Result<Reached> reached_by(const std::string& recording, replay::RecordedCode code);

}  // namespace sentree::studio
