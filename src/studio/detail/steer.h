#pragma once

#include <string>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/runtime/steering.h"
#include "sentree/studio/subject.h"

namespace sentree::studio {

/// Does what a page asks for: one of the steering requests of docs/studio-protocol.md. Blocks until it has happened.
/// Errors: steering.*, studio.request (something in it is missing or of the wrong kind), studio.unknown-request.
[[nodiscard]] Result<Value> steer(runtime::Steering& steering, const Subject& subject, const std::string& op,
                                  const Value& request);

}  // namespace sentree::studio
