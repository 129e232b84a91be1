#pragma once

#include <cstdint>

namespace sentree::replay {

/// What becomes of the code that a recording brings, which are the plug-ins of the recorded project.
enum class RecordedCode : std::uint8_t { kRefused, kLoaded };

}  // namespace sentree::replay
