#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sentree/project/plan.h"
#include "sentree/verify/any_reply.h"
#include "sentree/verify/counterexample.h"
#include "sentree/verify/explore.h"
#include "sentree/verify/judge.h"
#include "sentree/verify/walk.h"

namespace sentree::verify {

/// The scenario with every service that a model stands for served by that model, and with skills of other processes in
/// that of the run, as far as the project has their charts. Written down, it is so too.
[[nodiscard]] project::Scenario with_models(project::Scenario scenario);

struct Verification {
  Graph graph;
  std::vector<Judgement> judgements;     ///< As the requirements were asked for.
  std::vector<std::string> not_reached;  ///< What no behaviour reaches: "FILE:LINE: …".
  Diagnostics errors;                    ///< Nothing was explored.
  double explored_s = 0;                 ///< Wall time.
};

struct Asked {
  Options explore;
  JudgeOptions judge;
  std::vector<std::string> only;  ///< Names of monitors; empty: all.
  Each each;                      ///< Explores and judges, perhaps several at a time; the result is the same.
  std::vector<Untried> untried;   ///< By the models of the plan.
};

/// That the plan has no requirement or monitor of such a name: verify.unknown-requirement, one for each.
[[nodiscard]] Diagnostics unknown_requirements(const project::Plan& plan, const std::vector<std::string>& names);

/// Explores the mission once and judges each requirement on what was found. What is refuted by what is tried is
/// refuted; nothing else is said of a requirement on which something untried has a bearing. Codes: those of
/// `obstacles`, `unknown_requirements` and `explore`; verify.fair.
[[nodiscard]] Verification verify(const project::Plan& plan, const Asked& asked);

/// The text of a scenario file that shows a counterexample.
/// @param project  The project's folder, as seen from the file; empty: one folder above.
[[nodiscard]] std::string scenario_text(const project::Scenario& example, const Judgement& judgement,
                                        const std::string& project);

}  // namespace sentree::verify
