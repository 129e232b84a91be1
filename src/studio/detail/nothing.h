#pragma once

#include "sentree/studio/history.h"
#include "sentree/studio/subject.h"

namespace sentree::studio {

/// What a server shows while there is no run: a tree of one node that did nothing yet.
struct Nothing {
  Nothing();

  const project::Plan plan;
  const Subject subject;
  const History history;
};

}  // namespace sentree::studio
