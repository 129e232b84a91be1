#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/campaign/coverage.h"
#include "sentree/cli/commands.h"
#include "sentree/project/plan.h"
#include "sentree/verify/any_reply.h"
#include "sentree/verify/verify.h"

namespace sentree::cli {

/// A counterexample, or what can stay open, as it was written down.
struct ShownCounterexample {
  std::string scenario;   ///< File.
  std::string recording;  ///< File.
  std::size_t choices = 0;
  std::size_t loop_ticks = 0;
  std::size_t orders = 0;
  std::map<std::string, std::size_t> faults;  ///< In words, and how often each comes.
  struct Chosen {
    std::uint64_t tick = 0;
    std::string name;   ///< "MODEL", or "MODEL.NAME" of a pick.
    std::string place;  ///< Empty: it is not known.
    std::string value;  ///< As JSON.
  };
  /// What models chose, among several alternatives, until it was violated or came round; in that order.
  std::vector<Chosen> chosen;
  std::string story;  ///< Lines of text; empty: nobody asked for it.
};

/// What `sentree verify` found, and what it rests on. All but `shown` is borrowed.
struct Findings {
  const VerifyCommand& command;
  const project::Plan& plan;
  const verify::Asked& asked;
  const verify::Verification& result;
  const std::vector<verify::MadeModel>& any;         ///< Models that were made for the services without one.
  std::map<std::string, ShownCounterexample> shown;  ///< By requirement, of each that is refuted.
  /// By requirement, of those that can stay open; not of one that could not be written.
  std::map<std::string, ShownCounterexample> open;
};

/// As a terminal shows it.
[[nodiscard]] std::string to_text(const Findings& findings);

/// As docs/verification.md describes `--json`.
[[nodiscard]] Value to_value(const Findings& findings, const campaign::Coverage& reached);

}  // namespace sentree::cli
