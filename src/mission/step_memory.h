#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "sentree/mission/choice.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/session.h"

namespace sentree::mission {

/// Remembers the steps of one chart: from equal canonical forms (`scxml::encode`) the same event leads to the same
/// session and effects, so the interpreter is asked once. A step in which something is chosen branches with what comes.
///
/// What is looked up differs from what the interpreter would have done in nothing that the chart can see; ids that the
/// engine makes up are those of the first time. Charts that ask for such ids, clocks or random numbers are not
/// remembered, nor are those whose steps hardly ever come again.
class StepMemory {
 public:
  /// `what` of the step that time takes.
  static constexpr std::string_view kTimers = "timers";
  /// Steps that are remembered; more are executed each time.
  static constexpr std::size_t kStepsMax = 200'000;
  /// Steps executed after which fewer than half as many that were looked up are not worth what is kept of them.
  static constexpr std::uint64_t kTried = 4'096;
  /// Alternatives of a choice whose values are kept; a step with a larger one is executed each time.
  static constexpr std::uint64_t kAlternativesMax = 256;

  /// What an observer of the chart saw in a step.
  struct Seen {
    std::optional<scxml::TransitionIndex> transition;
    std::string event;    ///< Without a transition.
    std::string message;  ///< Of that event's data; empty: none.
  };

  explicit StepMemory(const scxml::Chart& chart);

  /// Does a step.
  /// @param what     Which step it is: an event with its data, or that time has come.
  /// @param begins   It puts the session at its beginning. Else what the session is, and what time is left to its
  ///                 timers, tells steps apart too.
  /// @param ask      Has one of `Choice::count` alternatives chosen.
  /// @param see      Is told what a remembered step did to the chart.
  /// @param execute  Does the step by the interpreter, which asks `given` and tells `chosen` and `saw`; what it gives
  /// is
  ///                 given again.
  bool step(std::string_view what, bool begins, scxml::Session& session, TimePoint now, scxml::Effects& effects,
            const std::function<std::uint64_t(Choice)>& ask, const std::function<void(const Seen&)>& see,
            const std::function<bool()>& execute);

  /// What tells the step of one event from those of others.
  [[nodiscard]] static std::string name_of(const scxml::Event& event);

  // While a step is executed.

  /// What has been chosen already, on the way to where the memory ends; then `chosen` is told all the same.
  [[nodiscard]] std::optional<std::uint64_t> given();
  void chosen(const Choice& choice, std::uint64_t alternative);
  void saw(Seen seen);
  /// This step depends on something else.
  void spoil() { spoilt_ = true; }

  [[nodiscard]] std::uint64_t looked_up() const { return looked_up_; }
  [[nodiscard]] std::uint64_t executed() const { return executed_; }

 private:
  struct Asked {
    const char* function = "";
    std::string name;
    std::string place;
    std::vector<Value> alternatives;
    std::vector<double> probabilities;  // empty: nobody says
    [[nodiscard]] Choice choice() const;
  };
  struct Done {
    scxml::Session session;
    TimePoint at{};
    scxml::Effects effects;
    std::vector<Seen> seen;
    bool result = false;
  };
  struct Node {
    std::optional<Asked> asked;
    std::vector<std::unique_ptr<Node>> next;  // by alternative
    std::optional<Done> done;
    /// It sends later or cancels, so that it matters which timers there are. Known by the longer name.
    bool looks_at_timers = false;
  };
  struct Chosen {
    std::optional<Asked> asked;  // nothing: it was known
    std::uint64_t alternative = 0;
    std::size_t count = 0;
  };

  [[nodiscard]] Node* named(const std::string& key);
  [[nodiscard]] Node* follow(Node* node, const std::function<std::uint64_t(Choice)>& ask);

  const scxml::Chart& chart_;
  bool remembers_ = true;
  std::unordered_map<std::string, Node> steps_;
  std::size_t remembered_ = 0;
  std::uint64_t looked_up_ = 0;
  std::uint64_t executed_ = 0;
  // Of the step that is executed.
  std::vector<std::uint64_t> given_;
  std::size_t taken_ = 0;
  std::size_t told_ = 0;
  std::size_t known_ = 0;  // choices on the way to where the memory ends
  std::vector<Chosen> chosen_;
  std::vector<Seen> seen_;
  bool spoilt_ = false;
  std::string key_;
};

}  // namespace sentree::mission
