#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/time.h"
#include "sentree/project/plan.h"
#include "sentree/runtime/run.h"

namespace sentree::replay {

/// Whether the mission told that a leaf's skill, which ran elsewhere, could not be reached.
[[nodiscard]] bool tells_unreached(const Message& message);

/// The skill, or leaf, that a process executed, by the process.
using ProcessSkills = std::map<std::string, std::string>;
/// The leaves, by index in `plan`, that the process executed. @return None: it is none of `processes`.
[[nodiscard]] std::vector<std::size_t> leaves_of_process(const project::Plan& plan, const ProcessSkills& processes,
                                                         const std::string& process);

/// When what passes between the mission and its leaves arrived in a recorded run, and when a leaf took what it took
/// behind something that came later.
class Arrivals {
 public:
  using LeafMessage = runtime::RunOptions::LeafMessage;

  /// What had not come when the recording ended: does not come in a replay of the same project, and comes at once in
  /// that of a changed one, which got there by itself.
  enum class NeverCame : std::uint8_t { kDoesNotCome, kComesAtOnce };

  /// Whether all observations are noted, or those behind a moment at which nothing was on its way.
  enum class From : std::uint8_t { kBeginning, kMiddle };

  /// @param plan         Of which leaves and deadlines are looked at; borrowed.
  /// @param tell_timers  The leaves of which it was observed when a timer rang. A leaf of which one is noted is one of
  ///                     them, too.
  Arrivals(const project::Plan& plan, ProcessSkills processes, NeverCame never_came, std::set<std::size_t> tell_timers,
           From from);
  Arrivals(const Arrivals&) = delete;
  Arrivals& operator=(const Arrivals&) = delete;

  /// The observations of the recording, in order. True: it was one of these, and nothing else is to be known of it.
  bool note(const Message& message);

  // The same run again.
  /// A request is published.
  void published(const Message& request) { ++published_now_[{topic_of(request), request.source}]; }
  /// As `runtime::RunOptions::arrival`. @param tick  The root's, the latest.
  [[nodiscard]] TimePoint of(std::size_t leaf, LeafMessage what, std::uint64_t tick, TimePoint now);
  /// When the mission knew that what it last asked of a leaf, whose skill ran elsewhere, would not be answered;
  /// nothing: it was not waiting for that.
  struct Unreached {
    TimePoint known;
    bool was_at_work;  ///< The skill had begun with it.
  };
  [[nodiscard]] std::optional<Unreached> of_unreached(std::size_t leaf) const;
  /// As `runtime::RunOptions::topic_arrival` and `timer_arrival`.
  [[nodiscard]] TimePoint of_topic(std::size_t leaf, const mission::Publication& what) const;
  [[nodiscard]] TimePoint of_timer(std::size_t leaf, std::uint64_t number) const;
  /// As `runtime::RunOptions::stop_arrival`, of the next stop.
  [[nodiscard]] TimePoint of_stop();
  /// As `runtime::RunOptions::veto_arrival`: of the next veto of that call.
  [[nodiscard]] TimePoint of_veto(std::size_t leaf, const std::string& call);

 private:
  // When what never came comes.
  [[nodiscard]] TimePoint never() const { return never_came_ == NeverCame::kDoesNotCome ? kNever : TimePoint{}; }

  // Something that the mission asked of a leaf, and what came of it.
  struct Activation {
    TimePoint asked{};  // or, where that is known, when the leaf took it
    std::optional<TimePoint> answered;
    bool late = false;  // `answered` is when the mission gave up
    // Of a skill elsewhere.
    bool seen = false;       // it has published something since
    bool unreached = false;  // it failed because the skill was not reached, or gone
  };
  // By leaf and root tick, in order.
  using Activations = std::map<std::pair<std::size_t, std::uint64_t>, std::deque<Activation>>;

  // What of a leaf a fault has held back and it has not taken yet.
  struct Delayed {
    std::deque<Activation*> ticks;
    std::deque<Activation*> halts;
    std::deque<TimePoint*> cancels;
  };

  // A topic, or a call, and who publishes or asks.
  using TopicOf = std::pair<std::string, std::string>;
  // In a replay nothing takes time: who publishes does so as soon as it has taken what it publishes for.
  struct PublishedThen {
    TimePoint time{};
    std::map<std::size_t, TimePoint> late;  // by leaf: when it took it, if that is known
  };

  [[nodiscard]] static std::string topic_of(const Message& request);
  bool note_taken(const Message& message);
  bool note_delayed(const Message& message);
  void note_injection(const Message& message);
  void note_restarted(const Message& message);
  bool note_unreached(const Message& message);
  void note_topic(std::size_t leaf, const Message& message, TimePoint taken);

  const project::Plan& plan_;
  ProcessSkills processes_;
  NeverCame never_came_;
  std::set<std::size_t> tell_timers_;
  From from_;
  TimePoint ended_{};                          // the latest observation
  std::map<std::uint64_t, TimePoint> ticked_;  // when each tick of the root began
  std::deque<TimePoint> stops_;
  std::map<std::string, std::size_t, std::less<>> leaves_;
  Activations ticks_;
  Activations halts_;
  std::map<std::uint64_t, Activation*> open_;                                       // by call
  std::map<std::string, Activation*, std::less<>> latest_ticks_;                    // by leaf
  std::map<std::string, Activation*, std::less<>> latest_halts_;                    // likewise
  std::map<std::pair<std::size_t, std::uint64_t>, std::deque<TimePoint>> cancels_;  // by leaf and root tick
  std::map<std::string, TimePoint*, std::less<>> latest_cancels_;
  std::map<TopicOf, std::vector<PublishedThen>> published_;
  std::map<std::uint64_t, std::pair<TopicOf, std::size_t>> places_;  // by sequence: which of `published_`
  std::map<TopicOf, std::size_t> published_now_;
  std::map<std::size_t, std::optional<Activation>> ticking_;  // by leaf: what was last asked of it
  std::map<std::size_t, std::optional<Activation>> halting_;
  std::map<std::pair<std::size_t, std::uint64_t>, TimePoint> taken_timers_;      // by leaf and number
  std::map<std::size_t, std::uint64_t> timers_before_;                           // by leaf: not noted
  std::map<std::pair<std::size_t, std::string>, std::deque<TimePoint>> vetoes_;  // by leaf and call
  std::map<std::size_t, Delayed> delayed_;                                       // by leaf
  std::map<std::size_t, std::deque<TimePoint>> kills_;                           // by leaf; time 0: when it was asked
  std::map<std::size_t, std::deque<TimePoint>> restarts_;                        // likewise
};

}  // namespace sentree::replay
