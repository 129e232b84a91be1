#pragma once

#include <string>
#include <string_view>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/record/mcap.h"
#include "sentree/record/packed_json.h"

namespace sentree::record {

inline constexpr std::string_view kObservationsTopic = "/observations";

/// Appends an observation as JSON, as `sentree::to_json` has it. The time is told by the recording, and in seconds for
/// people. Cost: about that of copying the text; no allocation but to grow `out`.
void append_observation(std::string& out, const Message& message);
/// The same, to be printed later. Cost: a copy.
void pack_observation(PackedJson& out, const Message& message);

/// The observation that was recorded so. Non-finite numbers come back as the texts "Infinity", "-Infinity", "NaN": only
/// the IDL knows which are which.
/// Errors: record.not-an-observation, json.*.
[[nodiscard]] Result<Message> read_observation(const RawMessage& recorded);

}  // namespace sentree::record
