#pragma once

#include "sentree/record/mcap.h"

namespace sentree::record {

/// Who is given what is recorded while it is written: the same channels, schemas and octets as are in the file, in the
/// same order. Called in the writer's thread of a recorder, which waits for it; it must not ask the recorder anything.
class Audience {
 public:
  virtual ~Audience() = default;
  /// Before the first message of it.
  virtual void channel(const Channel& channel, const Schema& schema) = 0;
  /// Its data are borrowed for the call.
  virtual void message(const RawMessage& message) = 0;
};

}  // namespace sentree::record
