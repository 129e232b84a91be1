#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/project/project.h"
#include "sentree/runtime/run.h"

namespace sentree::cli {

/// Lets models choose something else in a scenario: each of `choices` is "MODEL#NUMBER=VALUE", the number being that of
/// the choice among those of its model, the value as JSON. What the scenario lists behind the earliest of them is left
/// out, as is what it expects: from there on the run goes its own way.
/// Error: run.choose.
[[nodiscard]] Result<void> choose(const std::vector<std::string>& choices, project::Scenario& scenario);

/// The choices that a run makes, of the models of which somebody wants one to come out otherwise.
class ChoicesMade {
 public:
  /// @param choices  As `choose` has accepted them.
  explicit ChoicesMade(const std::vector<std::string>& choices);
  /// Listens to the run, and must outlive it.
  void install(runtime::RunOptions& options);
  /// After the run, a sentence for each that never came, with those that did.
  [[nodiscard]] std::vector<std::string> never_made() const;

 private:
  struct Wanted {
    std::string model;
    std::uint64_t number;
  };
  std::vector<Wanted> wanted_;
  std::map<std::string, std::vector<std::string>> made_;  // by model, in order: what they are called
};

}  // namespace sentree::cli
