#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sentree/cli/commands.h"
#include "sentree/verify/verify.h"

namespace sentree::cli {

/// What is verified: the scenario that the command line names, or the project alone. Codes: those of `load_scenario`
/// and `load_project`.
[[nodiscard]] Loaded<project::Scenario> load_verified(const VerifyCommand& command);

/// "2 GB" in bytes; nothing: it is no size.
[[nodiscard]] std::optional<std::uint64_t> bytes_of(const std::string& text);

/// Work in so many threads, this one among them; 1: one after the other.
[[nodiscard]] verify::Each in_threads(std::size_t threads);

/// What the statistics of a command are about.
struct Sampled {
  double confidence = 0.95;
  std::vector<std::size_t> monitors;  ///< By index in the plan.
  Duration length{};                  ///< Of a run.
  std::optional<std::uint64_t> memory;
  std::vector<std::string> warnings;  ///< Of bounds that no run comes to; said already.
  std::size_t faults_left_out = 0;    ///< Of `verify:`. Nobody says how likely they are, so none comes.
  /// One line that says so; empty: there are none.
  [[nodiscard]] std::string left_out() const;
};
/// An exit code: said what is wrong.
[[nodiscard]] std::variant<Sampled, int> read_statistics(const VerifyCommand& command, const project::Plan& plan);

/// What the command line and the project's `verify:` ask of an exploration. False: said what is wrong.
[[nodiscard]] bool read_options(const VerifyCommand& command, const project::Plan& plan, verify::Asked& asked);

}  // namespace sentree::cli
