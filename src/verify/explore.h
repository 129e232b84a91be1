#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sentree/base/hash128.h"
#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/bt/encode.h"
#include "sentree/mission/virtual_host.h"
#include "sentree/monitor/monitor.h"
#include "sentree/monitor/monitor_set.h"

namespace sentree::verify {

/// One alternative that was taken in a period: of a choice of a model, of an order, or of the faults.
struct Made {
  enum class Kind : std::uint8_t { kChoice, kOrder, kFault };
  Kind kind = Kind::kChoice;
  std::uint32_t alternative = 0;
  std::uint32_t count = 1;
  std::uint32_t what = 0;   ///< Of choices and of faults that come or go: index in `Graph::choices`; of orders: in
                            ///< `Graph::parts`, which part comes first.
  double probability = -1;  ///< Below 0: nobody says.
  std::uint32_t place = 0;  ///< Of choices: index in `Graph::places`.
  friend bool operator==(const Made&, const Made&) = default;
};

/// An alternative of a choice of a model; or a fault, whose `function` is "fault" or "end of fault".
struct ChoicePoint {
  std::string model;
  std::string function;
  std::string name;   ///< Of pick('NAME', …); of a fault, what it does in one line.
  std::string place;  ///< "models/robot.scxml:31" of a choice without a name: what stands elsewhere is another one.
  std::string value;  ///< As JSON; of a fault, its entry in a timeline.
  friend bool operator==(const ChoicePoint&, const ChoicePoint&) = default;
};

/// Something that a monitor may want to see, and when.
struct Seen {
  Duration after{};               ///< Since the beginning of the period.
  std::uint32_t observation = 0;  ///< Index in `Graph::observations`.
  friend bool operator==(const Seen&, const Seen&) = default;
};

struct Edge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  std::uint32_t seen = 0;  ///< Index in `Graph::sequences`.
  std::uint32_t made = 0;  ///< Index in `Graph::decisions`.
  friend bool operator==(const Edge&, const Edge&) = default;
};

/// Every behaviour of a mission: states between two periods, joined by what one period can do.
struct Graph {
  struct Node {
    TimePoint at{};           ///< On one of the shortest ways.
    std::uint32_t depth = 0;  ///< Periods from the beginning, at least.
    std::uint32_t first_edge = 0;
    std::uint32_t edges = 0;
    bool ended = false;    ///< Nothing of the mission is left to do.
    bool cut_off = false;  ///< It has ended, and not by itself.
    friend bool operator==(const Node&, const Node&) = default;
  };
  std::vector<Node> nodes;            ///< The first is the beginning; in order of depth.
  std::deque<Edge> edges;             ///< Those of a node beside each other. In blocks, since they are most of a graph.
  std::vector<Message> observations;  ///< Each once, without numbers and times, and with the data that is looked at.
  std::vector<std::vector<Seen>> sequences;
  std::vector<std::vector<Made>> decisions;
  std::vector<Hash128> said;  ///< By edge, of all that is said in it (`Options::tells_what_is_said`).
  std::vector<ChoicePoint> choices;
  std::vector<std::string> places{""};  ///< Where choices stand, "models/robot.scxml:31"; the first: it is not known.
  std::vector<std::string> parts;       ///< Of the mission, by name.
  bool complete = true;
  std::string limit;  ///< Why exploring ended before it was complete; empty: it did not.
  std::string grows;  ///< What took most values until a limit, with a way out (`most_varied`); may be empty.
  Duration period{};
  std::uint32_t complete_to = 0;  ///< Ticks up to which every behaviour is known.
  /// How long the period of an edge is: before the first tick no time passes, and the mission may end between two.
  [[nodiscard]] Duration lasts(const Edge& edge) const;
  /// How much of that monitors judge (`mission::judged_until`).
  [[nodiscard]] Duration judged(const Edge& edge) const;
  /// The state at which a limit ended it between two ways on; those that were gone are there. UINT32_MAX: none.
  std::uint32_t partial = UINT32_MAX;
  /// From this state on a limit let only what no fault has touched go on, without faults (UINT32_MAX: it did not),
  std::uint32_t faultless_from = UINT32_MAX;
  std::uint32_t faultless_to = 0;   ///< up to this tick,
  bool faultless_complete = false;  ///< or all of it.

  // What was reached at all.
  std::vector<std::vector<bool>> taken;                 ///< By leaf and transition.
  std::vector<std::vector<bool>> statuses;              ///< By leaf: RUNNING, SUCCESS, FAILURE answered.
  std::vector<std::uint8_t> nodes_had;                  ///< By node of the tree: a bit for each status.
  std::vector<std::vector<bool>> entered;               ///< By leaf and state.
  std::vector<std::vector<std::uint8_t>> guards;        ///< By leaf and transition: bit 0 did not hold, bit 1 held. Of
                                                        ///< leaves with one chart the first.
  std::vector<std::vector<bool>> models_entered;        ///< By model and state,
  std::vector<std::vector<bool>> models_taken;          ///< by model and transition.
  std::set<std::pair<std::string, std::string>> calls;  ///< "SERVICE.METHOD" and "reply", "error" or "late".
  std::map<std::string, std::set<std::string>> values;  ///< By "MODEL.NAME" of a pick: what was taken, as JSON.
  std::vector<std::string> problems;                    ///< Of the mission, each once, at most kProblemsMax.
  bool probabilistic = false;                           ///< Something is drawn,
  bool nondeterministic = false;                        ///< something is left open without a probability.
  bool times_apart = false;                             ///< `Options::times` was kAbsolute.
  bool reduced = false;                                 ///< Orders were left out (`Options::reduce_orders`).

  static constexpr std::size_t kProblemsMax = 100;
};

enum class Order : std::uint8_t {
  kAny,      ///< What happens at one instant in different parts comes in any order.
  kVirtual,  ///< The one order of virtual time.
};

/// Does work(0) … work(count - 1), perhaps at the same time, and returns when all is done. Whoever gives one has the
/// threads; an empty one means one after the other.
using Each = std::function<void(std::size_t count, const std::function<void(std::size_t)>& work)>;
void for_each(const Each& each, std::size_t count, const std::function<void(std::size_t)>& work);

struct Options {
  Order order = Order::kAny;
  std::vector<project::Intervention> faults;  ///< That may come at any period.
  std::size_t faults_at_most = 1;             ///< At a time.
  std::uint64_t states = 5'000'000;
  std::uint64_t ticks = UINT64_MAX;
  /// Orders that no monitor and no part tells apart are left out. Only with a memory of steps, without gates and
  /// without probabilities.
  bool reduce_orders = true;
  /// kAbsolute: no state is the same as one of another time. `explore` and `Walk` take it by themselves where a node in
  /// C++ asks for the time, or may do so.
  bt::Times times = bt::Times::kFromNow;
  bool memory_of_steps = true;      ///< Steps are looked up where they are known; else each is executed.
  bool exact = false;               ///< States are compared, not their hashes; every step is executed.
  bool tells_what_is_said = false;  ///< Also what no monitor listens to: `Graph::said`. In one thread.
  /// Goes through periods that are known already, several at a time; the graph is the same, whoever gives one. Where a
  /// limit of memory or of time ends it may differ.
  Each each;
  /// Bytes, of which a rough account is kept. Where there are not so many, it ends when there are no more.
  std::uint64_t memory = 4'000'000'000;
  std::optional<std::chrono::nanoseconds> time;
  std::function<bool()> interrupted;                                    ///< May be empty.
  std::function<void(std::size_t states, std::size_t edges)> progress;  ///< Told now and then; may be empty.
};

/// Alternatives of one choice that are tried; more are an error, since no machine tries them all.
inline constexpr std::uint64_t kAlternativesMax = 10'000;
/// Says so of a choice of the plan's models, with its line: verify.choice.
[[nodiscard]] Diagnostic too_many_alternatives(const project::Plan& plan, const mission::Choice& choice);
/// Ways in which one period of one state can go on; more are a limit.
inline constexpr std::size_t kWaysMax = 100'000;
/// Executes one period after the other for every choice, breadth first.
/// Errors: verify.choice (too many alternatives of one choice), verify.endless, those of `mission::encode`,
/// verify.fault.
[[nodiscard]] Result<Graph> explore(const project::Plan& plan, const Options& options);

/// What no exploration can deal with: parts elsewhere, charts that read clocks or random numbers or their names.
/// Codes: verify.elsewhere, verify.no-model, verify.clock, verify.fault.
[[nodiscard]] Diagnostics obstacles(const project::Plan& plan);

}  // namespace sentree::verify
