#include "sentree/project/timeline.h"

#include <fmt/format.h>

#include <algorithm>

namespace sentree::project {

void read_timeline(const text::YamlNode& node, Scenario& scenario, Diagnostics& diagnostics) {
  for (const text::YamlNode& entry : node.items) {
    YamlReader reader(entry, "an entry of the timeline", diagnostics);
    Injection injection;
    injection.span = entry.span;
    injection.at = TimePoint(reader.duration("at").value_or(Duration(0)));
    if (reader.node("at") == nullptr)
      reader.error(entry.span, "project.missing-key", "an entry of the timeline needs \"at\"");
    if (const auto source = reader.string("source")) {
      static const std::vector<std::string> kSources{"scenario", "studio", "control", "groot", "interrupt"};
      injection.source = *source;
      if (std::find(kSources.begin(), kSources.end(), *source) == kSources.end()) {
        reader.error(reader.span("source"), "scenario.source",
                     fmt::format("nobody called \"{}\" does something to a run{}; there are scenario, studio, control, "
                                 "groot and interrupt",
                                 *source, did_you_mean(*source, kSources)));
      }
    }
    injection.what = read_intervention(reader, entry, diagnostics);
    scenario.timeline.push_back(std::move(injection));
  }
}

}  // namespace sentree::project
