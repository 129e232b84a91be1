#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sentree/monitor/monitor.h"

namespace sentree::monitor {

/// Why a requirement is violated or satisfied, as far as people ask.
struct Explanation {
  std::string requirement;  ///< Its name.
  Importance importance = Importance::kMajor;
  std::string prose;
  std::string text;  ///< The formal part.
  SourceSpan place;
  Verdict verdict = Verdict::kUndecided;
  std::uint64_t number = 1;  ///< Of its violations.

  TimePoint detected{};
  std::optional<TimePoint> triggered;  ///< When what was decided began to be owed.
  std::optional<Message> trigger;      ///< The observation that began it; nothing: the start of the run.
  /// When silence would decide; nothing: the bound is no time. `bound` says it in words.
  std::optional<TimePoint> deadline;
  std::string bound;
  std::optional<Message> deciding;  ///< Nothing: it was its absence until the deadline.
  std::string owed;                 ///< What the monitor waited for.
  std::string leaf;                 ///< That was at work; empty: none.

  /// What an observation of the witness did.
  struct Step {
    Message observation;
    std::vector<std::string> set;  ///< "level = 28"; events by their name.
    bool is_trigger = false;
    bool is_deciding = false;
  };
  std::vector<Step> steps;
  bool complete = true;  ///< Replaying the steps alone decides the same at the same time.
};

/// Nothing for a monitor that was drawn by hand. Replays the witness.
[[nodiscard]] std::optional<Explanation> explain(const Model& model, const Decision& decision, std::string leaf);

/// Steps that a story shows, ticks that only follow each other as one; of more it leaves out the middle.
inline constexpr std::size_t kStoryStepsMax = 24;

/// A short story, one thing a line, each line indented by `indent`.
[[nodiscard]] std::string story(const Explanation& explanation, std::string_view indent);
/// The whole of it. The same explanation gives the same bytes.
[[nodiscard]] Value to_value(const Explanation& explanation);

}  // namespace sentree::monitor
