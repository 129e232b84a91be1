#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sentree/verify/periods.h"

namespace sentree::verify {

/// Goes through periods from states of `Periods` as that does, but finds out nothing: what is not known yet it leaves
/// to it. Several may do so at a time, while that one does nothing.
class Scout final : private mission::PartMemory::Outside {
 public:
  /// Every way on from one state, as far as `known`.
  struct From {
    std::size_t first = 0;  ///< In `way`.
    std::size_t count = 0;
    bool leaves_out = false;  ///< Orders.
    bool known = false;
  };

  /// @param of  Borrowed.
  explicit Scout(const Periods& of) : of_(of), orders_(of.orders_), frontier_(of.frontier_->scout(*this)) {
    if (frontier_ && of.tells_orders_) frontier_->trace(trace_);
  }
  /// Whether there is anything that it could go on by.
  [[nodiscard]] bool can() const { return frontier_ != nullptr; }

  /// Goes on from these states, from which nobody has gone on.
  void explore(std::uint32_t begin, std::uint32_t end);
  [[nodiscard]] const std::vector<From>& found() const { return found_; }
  [[nodiscard]] Periods::Scouted way(std::size_t index) const;

  // What `Ways` asks.
  [[nodiscard]] bool tells_orders() const { return of_.tells_orders_; }
  [[nodiscard]] const std::vector<Made>& made() const { return made_; }
  void want_orders(std::vector<OpenDecision>& open) {
    orders_.want({.trace = trace_, .decisions = ordered_, .due = due_, .ended = frontier_->ended()}, of_.hearers_,
                 open);
  }

 private:
  struct Found {
    Periods::Scouted way;
    std::size_t form = 0;  // in `forms_`
    std::size_t size = 0;
  };

  From explore(std::uint32_t from);
  bool go_on(std::uint32_t from, std::span<const std::uint32_t> script);
  Result<void> fault();
  std::uint32_t decide(Made::Kind kind, std::uint64_t count);

  void observed(std::uint32_t number, TimePoint now, const Message& message) override;
  std::uint64_t choose(std::uint32_t number, const mission::Choice& choice) override;
  std::size_t order(std::span<const std::uint32_t> parts) override;
  std::optional<mission::Veto> judge(const Message&) override;
  void taken(std::size_t leaf, scxml::TransitionIndex transition) override;
  void problem(const std::string& what) override;
  void refused(const Diagnostic&) override { missed_ = true; }

  const Periods& of_;
  Orders orders_;
  std::unique_ptr<Frontier> frontier_;
  Ways ways_;
  std::vector<From> found_;
  std::vector<Found> all_;
  std::vector<std::uint32_t> forms_;
  // Of the period that is being tried.
  bool missed_ = false;
  TimePoint begin_{};
  std::span<const std::uint32_t> script_;
  std::vector<Made> made_;
  std::vector<Seen> seen_;
  mission::PartMemory::Trace trace_;
  std::vector<OrderDecision> ordered_;
  std::vector<std::uint32_t> due_;
  std::vector<std::uint32_t> words_;
};

}  // namespace sentree::verify
