#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "sentree/base/value.h"
#include "sentree/bt/tree.h"
#include "sentree/runtime/run.h"

namespace sentree::cli {

/// What `ok` of a run means: that nothing is unmet, or what its command says by its exit code.
enum class Judged : std::uint8_t { kByExpectations, kPassed, kFailed };
/// The whole report as data. In virtual time it depends on project, scenario and seed only.
[[nodiscard]] Value to_value(const runtime::RunReport& report, Judged judged = Judged::kByExpectations);

/// The report as a few lines for people.
[[nodiscard]] std::string summary(const runtime::RunReport& report);
/// A line about the entries of the timeline for which the run ended too early; empty: there are none.
[[nodiscard]] std::string undone(const project::Scenario& scenario, const runtime::RunReport& report);

/// How a monitor stands, on one line; on a second one why it was given up.
[[nodiscard]] std::string monitor_line(const runtime::MonitorReport& monitor);

/// A decision as a short story: what was required, what was seen, when.
[[nodiscard]] std::string story(const runtime::MonitorReport& report);
/// For whoever shows the witness beside it.
[[nodiscard]] std::string story_without_witness(const runtime::MonitorReport& report);

/// One observation on one line.
[[nodiscard]] std::string line(const Message& message);

/// "123.400 s", right-aligned in ten characters.
[[nodiscard]] std::string time_column(TimePoint time);

/// Picks the observations that tell the story of a run: what leaves begin, how they end, when a condition changes, what
/// the scenario does. Empty text: nothing new.
class Narrator {
 public:
  /// @param watched  A tree that another program executes, of whose leaves statuses are all that is known; borrowed.
  explicit Narrator(const bt::Tree* watched = nullptr) : watched_(watched) {}
  [[nodiscard]] std::string tell(const Message& message);

 private:
  const bt::Tree* watched_;
  std::map<std::string, std::string> last_;  // status by leaf
};

}  // namespace sentree::cli
