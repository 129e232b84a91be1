#pragma once

#include <set>
#include <string>
#include <utility>

#include "sentree/base/diagnostic.h"

namespace sentree {

/// Findings that are told once, by whatever way they are reached: those of one code with one text are the same.
class ToldOnce {
 public:
  /// Whether it is new. Cost: O(log n) and its text.
  [[nodiscard]] bool add(const Diagnostic& diagnostic) {
    return told_.emplace(diagnostic.code, to_string(diagnostic)).second;
  }
  /// Puts those of `found` that are new behind `all`.
  void append(const Diagnostics& found, Diagnostics& all) {
    for (const Diagnostic& diagnostic : found) {
      if (add(diagnostic)) all.push_back(diagnostic);
    }
  }

 private:
  std::set<std::pair<std::string, std::string>> told_;
};

}  // namespace sentree
