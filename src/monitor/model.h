#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "sentree/monitor/monitor.h"

namespace sentree::monitor {

/// The inside of `Model`; for this library's own files.
struct Model::Parts {
  Spec spec;
  std::vector<scxml::StateIndex> violated;  ///< States whose entry decides.
  bool listens_to_all = false;
  std::vector<std::string> descriptors;  ///< Event descriptors of the chart's transitions.
  /// Computes the data of renamed events: event "<i>" in, effect send "<i>" with the data out.
  std::optional<scxml::Chart> renaming;
};

struct Access {
  static const Model::Parts& parts(const Model& model) { return *model.parts_; }
};

/// The smallest part of `history` (one-minimal) after which `decision` comes again.
[[nodiscard]] std::vector<Message> minimal_witness(const Model& model, const State& state, const Decision& decision,
                                                   scxml::ExecutionWatch* watch);

}  // namespace sentree::monitor
