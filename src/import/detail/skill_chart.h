#pragma once

#include <map>
#include <string>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/import/detail/cpp_expression.h"
#include "sentree/import/import.h"
#include "sentree/text/xml.h"

namespace sentree::import {

/// What a <data> of a Qt SCXML skill says about a service that the skill calls.
struct ServiceUse {
  std::string variable;   ///< The <data>'s id, through which snippets call.
  std::string interface;  ///< Name of the Thrift service.
  std::string server;     ///< Port of the component, without '/'; may be empty.
  bool observed = false;  ///< The connection goes through a portmonitor.
  SourceSpan span;
};

/// What a skill gets when its program starts.
struct SkillOption {
  std::string name;
  bool is_text = false;
  SourceSpan span;
};

/// The parts of a skill's chart that the rest of the system must know.
struct SkillFacts {
  std::string name;  ///< Of the chart, without "SkillStateMachine".
  std::vector<ServiceUse> services;
  std::vector<SkillOption> options;
  bool handles_halt = false;
};

/// Whether the chart is a skill: it is told when to start, or has states with a status for the tree.
[[nodiscard]] bool is_skill_chart(const text::XmlDocument& document);
[[nodiscard]] SkillFacts facts_of(const text::XmlDocument& document);

/// What a skill's chart is translated with.
struct SkillContext {
  std::map<std::string, Names::Remote> remotes;  ///< By variable.
  std::set<std::string> enumerators;
  std::map<std::string, const idl::Struct*> structures;  ///< By name, for initial values.
};

struct TranslatedChart {
  std::string source;
  std::vector<Finding> findings;
};

/// The chart in the form of a Sentree skill: ecmascript; `tick` and `halt` for the events by which the tree starts and
/// stops it; the states that tell SUCCESS and FAILURE are its ends, and what returns to the idle state ends in
/// `halted`; snippets in SCXML. A call whose result is used becomes a state of its own that waits for the reply.
/// Comments, layout and unknown attributes stay.
[[nodiscard]] TranslatedChart translate_skill_chart(const text::XmlDocument& document, const SkillContext& context);

}  // namespace sentree::import
