#pragma once

#include <cstddef>
#include <string>

#include "sentree/base/value.h"
#include "sentree/verify/explore.h"

namespace sentree::verify {

// The first thing in which two graphs differ; empty: nothing.
inline std::string difference(const Graph& a, const Graph& b) {
  if (a.nodes != b.nodes) return "states: " + std::to_string(a.nodes.size()) + ", " + std::to_string(b.nodes.size());
  if (a.edges != b.edges) return "periods";
  if (a.decisions != b.decisions) return "decisions";
  if (a.choices != b.choices) return "choices";
  if (a.observations.size() != b.observations.size()) return "how many observations";
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    if (!(a.observations[i] == b.observations[i])) return "observation " + to_json(b.observations[i].data);
  }
  if (a.sequences != b.sequences) return "sequences of observations";
  if (a.taken != b.taken) return "transitions taken";
  if (a.statuses != b.statuses) return "statuses";
  if (a.values != b.values) return "values";
  if (a.nodes_had != b.nodes_had) return "statuses of nodes";
  if (a.entered != b.entered) return "states of charts entered";
  if (a.guards != b.guards) return "conditions evaluated";
  if (a.models_entered != b.models_entered || a.models_taken != b.models_taken) return "what models did";
  if (a.calls != b.calls) return "outcomes of calls";
  if (a.problems.empty() != b.problems.empty()) return "problems";
  return a.limit != b.limit ? "limit: " + a.limit + ", " + b.limit : "";
}

}  // namespace sentree::verify
