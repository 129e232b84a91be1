#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "sentree/base/flat_map.h"
#include "sentree/base/hash128.h"
#include "sentree/mission/choice.h"
#include "sentree/scxml/guards.h"
#include "sentree/verify/explore.h"
#include "sentree/verify/frontier.h"
#include "sentree/verify/gates.h"
#include "sentree/verify/orders.h"

namespace sentree::verify {

/// Periods from one state, one after the other, until each decision has taken every alternative that is to be tried.
class Ways {
 public:
  void begin() {
    open_.clear();
    script_.clear();
    leaves_out_ = false;
  }
  /// What the next period decides first.
  [[nodiscard]] std::span<const std::uint32_t> script() const { return script_; }
  /// Behind a period of `Periods` or of a `Scout`: whether there is another to be tried.
  template <class Tried>
  [[nodiscard]] bool next(Tried& tried) {
    const bool reduces = tried.tells_orders();
    open(tried.made(), reduces);
    if (reduces) tried.want_orders(open_);
    return next();
  }
  /// Orders were left out.
  [[nodiscard]] bool leaves_out() const { return leaves_out_; }

 private:
  void open(const std::vector<Made>& made, bool reduces);
  bool next();

  std::vector<OpenDecision> open_;
  std::vector<std::uint32_t> script_;
  bool leaves_out_ = false;
};

/// States of a mission between two periods, each with a number, and the periods that lead from one to the next, tried
/// one at a time. What they do is kept once, in a graph whose edges belong to the caller.
class Periods final : public mission::Surroundings, public mission::PartMemory::Outside, private scxml::GuardObserver {
 public:
  /// Decides what the script of a period leaves open, below `count`.
  /// @param choice  Null: an order, or a fault.
  using Decider = std::function<std::uint32_t(std::uint64_t count, const mission::Choice* choice)>;
  /// Where a period led.
  struct Way {
    std::uint32_t to = 0;
    bool is_new = false;  ///< Nothing led there before.
    bool over = false;    ///< No tick follows.
    Duration took{};
    Duration judged{};         ///< How much of it monitors judge (`mission::judged_until`).
    Duration until_planned{};  ///< From there to the next tick.
  };

  /// Both are borrowed.
  Periods(const project::Plan& plan, const Options& options);

  /// From now on `look` is shown each new state as it is found.
  void on_new(std::function<void(const Frontier&)> look) { look_ = std::move(look); }
  /// State 0: the mission before anything has happened. Errors: those of `mission::encode`.
  Result<void> begin();
  /// Executes one period from a state. Errors: those of `period` and of `explore`.
  /// @param script  What is decided first, in order.
  /// @param rest    Decides the rest; empty: everything takes its first alternative.
  Result<Way> go_on(std::uint32_t from, std::span<const std::uint32_t> script, const Decider& rest = {});
  /// `look` is asked in a period every now and then; its error is that of the period.
  void on_the_way(std::function<Result<void>()> look) { on_the_way_ = std::move(look); }
  /// From now on no fault comes or goes.
  void leave_faults_out() { faults_come_ = false; }
  /// Nobody goes on any more from the first state, in the order of numbers, from which somebody did.
  void drop() { frontier_->drop(); }

  // Of the last period.
  [[nodiscard]] const std::vector<Made>& made() const { return made_; }
  /// Whether the orders that matter are known: where steps are remembered, nothing judges and nothing is drawn.
  [[nodiscard]] bool tells_orders() const { return tells_orders_; }
  /// Wants of each order that was decided what else somebody can tell apart.
  /// @param open  Beside `made`.
  void want_orders(std::vector<OpenDecision>& open);
  /// Indices in the graph of what was seen and made.
  [[nodiscard]] std::uint32_t keep_seen();
  [[nodiscard]] std::uint32_t keep_made();
  /// Of everything that was said, by whom and when, if `Options::tells_what_is_said`.
  [[nodiscard]] const Hash128& said() const { return said_; }

  /// See `verify::most_varied`.
  [[nodiscard]] std::string most_varied(std::size_t count) const;

  [[nodiscard]] Graph& graph() { return graph_; }
  [[nodiscard]] const Graph& graph() const { return graph_; }
  /// About.
  [[nodiscard]] std::uint64_t bytes() const;

  /// Where a scout came to, as a way of this.
  struct Scouted {
    Hash128 key;
    std::uint32_t seen = 0;
    std::uint32_t made = 0;
    TimePoint now{};
    bool ended = false;
    bool cut_off = false;
    std::span<const std::uint32_t> form;
  };
  std::uint32_t adopt(const Scouted& way, std::uint32_t depth);

 private:
  friend class Scout;

  bool faults_come_ = true;
  // Numbers of faults that may come or go, while they stand: behind all that the scenario's own ones have.
  static constexpr std::uint64_t kFirstFault = std::uint64_t{1} << 32U;

  // A fault that may come or go, and what is said of it.
  struct Possible {
    project::Intervention what;
    std::size_t fault = 0;
    bool ends = false;
    /// Those that may go come before those that may come.
    [[nodiscard]] std::size_t number(const Options& options) const {
      return ends ? fault : options.faults.size() + fault;
    }
  };
  [[nodiscard]] static std::vector<Possible> possible_faults(const Options& options, const Frontier& frontier,
                                                             std::size_t from);
  // Lets faults come and go, one after the other; `decide` names one of those that are possible, or null: no more.
  static Result<void> put_faults(const Options& options, Frontier& frontier,
                                 const std::function<const Possible*(const std::vector<Possible>& possible)>& decide);
  [[nodiscard]] ChoicePoint point_of(const Possible& fault) const;
  [[nodiscard]] static std::string key_of(const ChoicePoint& point);
  [[nodiscard]] static bool is_cut_off(const Frontier& frontier) {
    return frontier.ended() && !bt::is_completed(frontier.root());
  }
  static Hash128 hash_of(const std::vector<Seen>& seen, std::vector<std::uint32_t>& words);
  static Hash128 hash_of(const std::vector<Made>& made, std::vector<std::uint32_t>& words);

  void add(std::uint32_t depth);
  [[nodiscard]] std::uint32_t find();
  Result<void> fault();
  std::uint32_t intern_choice(ChoicePoint point);
  std::uint32_t intern_place(const std::string& place);
  std::uint32_t decide(Made::Kind kind, std::uint64_t count, const mission::Choice* choice = nullptr);
  std::uint64_t decide_choice(const mission::Choice& choice);
  void note(const mission::Choice& choice, std::uint64_t alternative);
  std::uint32_t hear(const Message& message);
  std::uint32_t kept_observation(const Message& message, const monitor::Projection& projection);
  void see(std::uint32_t observation, TimePoint now);
  void say(const Hash128& what, TimePoint now);
  bool looks_at_clock(const Message& message);
  void refuse_clock(const Message& message, const std::string& member);
  [[nodiscard]] std::uint32_t part(const mission::Delivery& delivery) const;

  // Surroundings of a run that is executed,
  void observed(const Message& message) override;
  bool is_heard(mission::ObservationName& name) override;
  std::optional<std::uint64_t> choose(const mission::Choice& choice) override;
  std::size_t order(std::uint64_t number, std::span<const mission::Delivery* const> due) override;
  // and of one that is remembered,
  void observed(std::uint32_t number, TimePoint now, const Message& message) override;
  std::uint64_t choose(std::uint32_t number, const mission::Choice& choice) override;
  std::size_t order(std::span<const std::uint32_t> parts) override;
  // and of both.
  std::optional<mission::Veto> judge(const Message& request) override;
  void taken(std::size_t leaf, scxml::TransitionIndex transition) override { graph_.taken[leaf][transition] = true; }
  void met(const mission::Met& what) override;
  void guard(const scxml::Chart& chart, scxml::TransitionIndex of, bool holds) override;
  void refused(const Diagnostic& why) override;
  void problem(const std::string& what) override;

  template <class Known, class All, class One>
  std::uint32_t keep(Known& known, All& all, const One& one);

  void note_call(const Message& message);
  void note_order(std::span<const std::uint32_t> parts);

  static constexpr std::uint32_t kNobody = UINT32_MAX;
  static constexpr std::uint32_t kUnheard = UINT32_MAX - 1;

  const project::Plan& plan_;
  const Options& options_;
  std::unique_ptr<Frontier> frontier_;
  std::function<void(const Frontier&)> look_;
  std::function<Result<void>()> on_the_way_;
  Gates gates_;
  monitor::Dispatch dispatch_;
  Graph graph_;
  FlatMap<Hash128, Hash128Hash> known_;
  std::unordered_map<std::string, std::uint32_t> known_forms_;  // instead, if states are compared
  std::vector<std::uint64_t> places_;                           // by state, in the frontier
  std::vector<std::uint32_t> gates_of_;                         // by state, one for each gate
  std::unordered_map<Hash128, std::uint32_t, Hash128Hash> sequence_of_;
  std::unordered_map<Hash128, std::uint32_t, Hash128Hash> decisions_of_;
  std::unordered_map<std::string, std::uint32_t> choice_of_;
  std::unordered_map<std::string, std::uint32_t> place_of_{{"", 0}};
  std::unordered_map<std::string, std::uint32_t> observation_of_;
  std::vector<std::uint32_t> heard_;  // observations by the numbers of the memory
  std::vector<Hash128> said_of_;      // what they say, likewise
  struct Noted {
    std::vector<std::uint32_t> alternatives;
    std::uint32_t place = 0;
  };
  std::vector<Noted> noted_;  // choices, likewise
  Orders orders_;
  bool tells_orders_ = false;
  std::vector<std::uint64_t> hearers_;  // by the numbers of the memory, as `Orders` wants them
  std::unordered_map<const scxml::Model*, std::size_t> leaf_of_chart_;  // the first
  std::set<std::string> told_;
  std::unordered_set<std::string> replies_;  // by name
  std::uint64_t kept_bytes_ = 0;
  // Of the period that is being tried.
  std::span<const std::uint32_t> script_;
  const Decider* rest_ = nullptr;
  std::vector<Made> made_;
  std::vector<Seen> seen_;
  Hash128 said_;
  mission::PartMemory::Trace trace_;
  std::vector<OrderDecision> ordered_;
  std::vector<std::uint32_t> due_;
  bool ended_ = false;
  std::vector<std::uint32_t> gates_now_;
  std::optional<Diagnostic> error_;
  TimePoint begin_{};
  std::vector<std::uint32_t> words_;
  std::vector<std::uint32_t> parts_;
  std::string form_;
};

}  // namespace sentree::verify
