#pragma once

#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/monitor/requirement_types.h"
#include "sentree/project/chart_facts.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// The events that can arrive at a chart from outside.
struct ChartEvents {
  std::vector<std::string> names;
  /// Of an event of that name, `_event.data`: a record, or unknown.
  std::function<monitor::DataType(const std::string& name)> data_of;
  /// Names that a run gives to the chart's data (ports): they can be anything.
  std::set<std::string> given;
  /// Those of them that are text whatever they look like: constants of ports that have no type.
  std::set<std::string> texts = {};
  /// Functions that a run offers to its scripts: those of models, which choose.
  std::set<std::string> functions = {};
  /// What a param of a <send type="thrift"> must be: a type, or unknown. Null: that is not looked at.
  std::function<monitor::DataType(const std::string& target, const std::string& event, const std::string& param)>
      param_of = {};
  /// The same as its interface has it; null: that is not known.
  std::function<const idl::Type*(const std::string& target, const std::string& event, const std::string& param)>
      type_of = {};
};

/// What the expressions of a chart say that cannot be: names that nobody declares, members that the event's data do not
/// have, words that are no enumerator, values compared that are never equal, numbers of another unit.
///
/// What cannot be told is taken to be right: data that scripts write, events of the chart itself, functions.
/// Errors: check.unknown-send (of <cancel>), check.delay, check.unknown-name, check.unknown-member, check.unknown-word,
/// check.never-equal, check.unit, idl.* (of records that are sent: `check_literal`). Warnings: check.unknown-word
/// (where other words are possible), check.out-of-range, check.always-true. Cost: O(size of the chart · events that a
/// transition takes).
void check_expressions(const ChartFacts& facts, const ChartEvents& events, Diagnostics& diagnostics);

/// The same of the expressions of a renamed event, whose names are the members of the observations' data.
/// @param observed  Data of the observations that it stands for.
/// @returns the type of the event's data.
monitor::DataType check_renamed_data(const EventRename& rename, const std::vector<monitor::DataType>& observed,
                                     Diagnostics& diagnostics);

}  // namespace sentree::project
