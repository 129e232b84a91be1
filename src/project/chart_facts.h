#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sentree/scxml/chart.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/script_syntax.h"

namespace sentree::project {

/// The expressions of a chart as trees, read once, and what they tell of its <data>. A value that copies share; of one
/// thread at a time.
class ChartFacts {
 public:
  /// Cost: O(size of the expressions).
  explicit ChartFacts(const scxml::Chart& chart);

  [[nodiscard]] const scxml::Chart& chart() const { return facts_->chart; }
  /// Nothing: a script, or an expression that is not read (see `scxml::parse_script_expression`).
  [[nodiscard]] const std::optional<scxml::ScriptTree>& tree(scxml::ExpressionId id) const { return facts_->trees[id]; }
  /// Whether the chart itself may write this <data>, as far as its text tells.
  [[nodiscard]] bool is_written(const std::string& data) const;
  /// Whether it calculates with this <data>, compares it by size or gives it to a service, and never asks whether it
  /// is there.
  [[nodiscard]] bool needs(const std::string& data) const;

 private:
  struct Facts {
    scxml::Chart chart;
    std::vector<std::optional<scxml::ScriptTree>> trees;  // by expression
    std::map<std::string, bool> written;                  // as far as asked
    std::map<std::string, bool> needed;
  };
  std::shared_ptr<Facts> facts_;
};

}  // namespace sentree::project
