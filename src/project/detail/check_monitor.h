#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/monitor/requirement_types.h"
#include "sentree/project/chart_memory.h"
#include "sentree/project/plan.h"

namespace sentree::project {

/// What a monitor drawn by hand waits for that can never come: events that no observation of the project has, renamed
/// events that it does not know, a violation that no path of its chart leads to; and what its expressions say of the
/// observations' data (see `check_expressions`).
///
/// Errors: check.unknown-event, check.unheard-event, check.unreachable-verdict, and those of `check_expressions`.
/// Warning: check.idle-transition.
/// @param vocabulary  Null: it is not known what the project observes, so only the chart is looked at.
void check_monitor(const MonitorEntry& entry, const ChartFacts& facts, const monitor::Vocabulary* vocabulary,
                   Diagnostics& diagnostics);

/// What the expressions of a model's chart say of calls and topics that it gets, and of what it answers and publishes.
/// Errors: those of `check_expressions`.
void check_model_expressions(const ModelEntry& entry, const ChartFacts& facts,
                             const std::map<std::string, ServicePlan>& services, const monitor::Vocabulary& vocabulary,
                             Diagnostics& diagnostics);

/// <send>s of a skill or a model that nobody receives. Error: check.unknown-receiver.
void check_receivers(const scxml::Chart& chart, const std::map<std::string, ServicePlan>& services,
                     Diagnostics& diagnostics);

/// The same of a skill's chart.
///
/// Errors: check.unknown-event (a call's outcome that does not exist), check.no-outcome, check.unknown-receiver, and
/// those of `check_expressions`. Warnings: check.never-arrives, check.idle-transition, check.no-outcome (of an action
/// that may be meant to go on until it is halted).
void check_skill_events(const ChartFacts& facts, const std::map<std::string, ServicePlan>& services,
                        const monitor::Vocabulary& vocabulary, const SkillUse& use, Diagnostics& diagnostics);

}  // namespace sentree::project
