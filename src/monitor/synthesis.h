#pragma once

#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/monitor/requirement.h"
#include "sentree/monitor/requirement_types.h"

namespace sentree::monitor {

/// What a state of a synthesized chart means for the requirement.
struct Situation {
  enum class Role : std::uint8_t {
    kWatching,  ///< Nothing is owed; it holds so far.
    kOutside,   ///< Outside its scope, or its assumption is broken.
    kPending,   ///< Something is owed, or must stay as it is.
    kBreached,  ///< Broken, but only told when the scope ends.
  };
  std::string state;  ///< The chart's id for it.
  Role role = Role::kWatching;
  std::string says;  ///< For people: "waits for level < 30".
};

/// A value or an event as a chart keeps it.
struct Datum {
  std::string id;     ///< Of the chart's <data>.
  std::string shown;  ///< What it is in the requirement's words.
  bool is_event = false;
};

/// A requirement as a state chart.
struct Synthesis {
  std::string chart;  ///< SCXML, standard elements only; the same requirement gives the same bytes.
  std::vector<Situation> situations;
  std::vector<Datum> data;
  /// The chart's <data> that every observation sets anew before anything reads them.
  std::vector<std::string> overwritten;
  /// All its data are set anew by every observation, before anything reads them: none outlives an observation.
  bool forgets = false;
};

/// Writes the chart that watches `requirement`.
///
/// It expects observations as external events (docs/observations.md) and decides by entering the state "violated" or
/// the final state "satisfied". Deadlines are delayed sends, so silence is noticed.
/// @param typing  From `check_requirement`, without errors.
[[nodiscard]] Synthesis synthesize(const Requirement& requirement, const Typing& typing);

}  // namespace sentree::monitor
