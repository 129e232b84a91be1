#pragma once

#include <string>

#include "sentree/bt/load.h"

namespace sentree::bt {

/// A file whose tree Main has that body; `more` is beside it.
inline std::string in_tree(const std::string& body, const std::string& more = {}) {
  return "<root BTCPP_format=\"4\" main_tree_to_execute=\"Main\">\n<BehaviorTree ID=\"Main\">" + body +
         "</BehaviorTree>" + more + "</root>";
}

/// What is found in m.xml, a line each.
inline std::string messages(const std::string& xml, const LoadOptions& options = {}) {
  std::string all;
  for (const Diagnostic& d : load(xml, options, "m.xml").diagnostics) all += to_string(d) + "\n";
  return all;
}

}  // namespace sentree::bt
