#pragma once

#include <optional>

#include "sentree/scxml/model.h"

namespace sentree::scxml {

/// Where a chart does more with an id that the engine makes up (SCXML 6.2.4, 6.4.1: idlocation, `_event.sendid`, …)
/// than to keep it, to compare it with another one, to cancel and to send by it: there it matters how the id is
/// spelled. Nothing: nowhere. What cannot be read counts as such a place if it names an id. Cost: O(length of the
/// scripts).
[[nodiscard]] std::optional<Place> where_ids_are_spelled(const Model& model);

}  // namespace sentree::scxml
