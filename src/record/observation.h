#pragma once

#include <cstdint>
#include <optional>
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

/// What the JSON of an observation begins with: views of it.
struct ObservationHead {
  std::uint64_t sequence = 0;
  std::uint64_t stamp = 0;
  std::uint64_t call = 0;
  std::uint64_t tick = 0;
  MessageKind kind = MessageKind::kEvent;
  std::string_view source;
  std::string_view target;
  std::string_view name;
  std::string_view data;  ///< JSON, which nobody has looked at; empty: none.
};
/// The head, if the text is as `append_observation` writes it, without escapes in its texts; any other must be parsed.
/// Cost: a tenth of parsing it.
[[nodiscard]] std::optional<ObservationHead> observation_head(std::string_view json);

/// The observation that was recorded so. Non-finite numbers come back as the texts "Infinity", "-Infinity", "NaN": only
/// the IDL knows which are which.
/// Errors: record.not-an-observation, json.*.
[[nodiscard]] Result<Message> read_observation(const RawMessage& recorded);

}  // namespace sentree::record
