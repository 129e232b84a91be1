#pragma once

#include <optional>
#include <vector>

#include "sentree/base/time.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

/// Which parts of a chart may look at the event that it gets, told from the names in its expressions.
class EventReads {
 public:
  explicit EventReads(const Chart& chart);
  /// Something beside the conditions and the contents of transitions that events enable.
  [[nodiscard]] bool elsewhere() const { return elsewhere_; }
  /// The content of that transition.
  [[nodiscard]] bool in_content(TransitionIndex transition) const { return content_[transition]; }

 private:
  bool elsewhere_ = false;
  std::vector<bool> content_;
};

/// The transitions that an external event would enable in a stable configuration; the session stays as it is. Nothing:
/// a condition cannot be evaluated. Where neither they nor anything else looks at the event (`EventReads`), all that
/// follows from it follows from them.
[[nodiscard]] std::optional<std::vector<TransitionIndex>> enabled_by(const Chart& chart, const Session& session,
                                                                     const Event& event, TimePoint now);

/// None of its expressions and scripts needs an interpreter for JavaScript, so that each of them comes to an end.
[[nodiscard]] bool is_native(const Chart& chart);

}  // namespace sentree::scxml
