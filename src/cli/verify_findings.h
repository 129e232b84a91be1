#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/campaign/coverage.h"
#include "sentree/project/plan.h"
#include "sentree/verify/any_reply.h"
#include "sentree/verify/verify.h"

namespace sentree::cli {

/// A counterexample as it was written down.
struct ShownCounterexample {
  std::string scenario;   ///< File.
  std::string recording;  ///< File.
  std::size_t choices = 0;
  std::size_t loop_ticks = 0;
  std::size_t orders = 0;
  std::map<std::string, std::size_t> faults;  ///< In words, and how often each comes.
  std::string story;                          ///< Lines of text; empty: nobody asked for it.
};

/// What `sentree verify` found, and what it rests on. All but `shown` is borrowed.
struct Findings {
  const project::Plan& plan;
  const verify::Asked& asked;
  const verify::Verification& result;
  const std::vector<verify::MadeModel>& any;         ///< Models that were made for the services without one.
  std::map<std::string, ShownCounterexample> shown;  ///< By requirement, of each that is refuted.
};

/// As a terminal shows it.
[[nodiscard]] std::string to_text(const Findings& findings);

/// As docs/verification.md describes `--json`.
[[nodiscard]] Value to_value(const Findings& findings, const campaign::Coverage& reached);

}  // namespace sentree::cli
