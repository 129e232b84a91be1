#pragma once

#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/bt/load.h"
#include "sentree/bt/palette.h"
#include "sentree/bt/state.h"
#include "sentree/bt/step.h"
#include "sentree/bt/tree.h"

namespace sentree::studio {

/// One tree in the hands of a person, who is all its leaves: each tick of a leaf gets the answer that was given last.
///
/// A condition says FAILURE until somebody says otherwise, an action RUNNING. Time stands still but for `wait`.
class TreePlayer {
 public:
  /// Moments that can be gone back to; older ones are forgotten.
  static constexpr std::size_t kBackMax = 200;
  /// Steps that one tick may take.
  static constexpr std::size_t kStepsMax = 100'000;

  /// Ticks the tree once. `answers` by `Tree::event_name`; those of leaves that are not there are ignored.
  /// `entries` are on its blackboard before.
  /// Errors: those of `bt::load`; bt.unknown-node (nodes of which nobody says what they do).
  [[nodiscard]] static Result<TreePlayer> start(const std::string& xml, const std::string& file,
                                                const std::string& tree, const bt::Palette& palette,
                                                const std::map<std::string, bt::Status>& answers,
                                                std::vector<bt::StartEntry> entries = {});

  /// What the leaf says from now on, and a tick. Errors: simulate.no-such-leaf, simulate.bad-answer (a condition does
  /// not run), and those of `tick`.
  [[nodiscard]] Result<void> answer(std::string_view leaf, bt::Status status);
  /// Errors: simulate.endless, and what the tree itself fails with.
  [[nodiscard]] Result<void> tick();
  /// Lets time pass up to the next timer of the tree, and ticks. Errors: simulate.no-timer, and those of `tick`.
  [[nodiscard]] Result<void> wait();
  /// Takes the last answer, tick or wait back. Errors: simulate.no-way-back.
  [[nodiscard]] Result<void> back();

  [[nodiscard]] const bt::Tree& tree() const { return tree_; }
  /// What a node said in the last tick; IDLE: it was not ticked, or halted.
  [[nodiscard]] bt::Status said(bt::NodeId node) const { return now_.said[node]; }
  /// The root's.
  [[nodiscard]] bt::Status result() const { return now_.result; }
  [[nodiscard]] bt::Status answer_of(bt::NodeId leaf) const { return now_.answers.at(leaf); }
  [[nodiscard]] std::map<std::string, bt::Status> answers() const;
  [[nodiscard]] TimePoint time() const { return now_.time; }
  [[nodiscard]] TimePoint next_timer() const { return now_.state.next_timer(); }
  [[nodiscard]] std::size_t ticks() const { return now_.ticks; }
  [[nodiscard]] std::size_t steps_back() const { return past_.size(); }

 private:
  struct Moment {
    bt::State state;
    TimePoint time{};
    std::map<bt::NodeId, bt::Status> answers;
    std::vector<bt::Status> said;
    bt::Status result = bt::Status::kIdle;
    std::size_t ticks = 0;
  };

  explicit TreePlayer(bt::Tree tree);
  [[nodiscard]] Result<void> run(const bt::Input& first);
  [[nodiscard]] Result<void> change(const bt::Input& input);
  void remember();

  bt::Tree tree_;
  Moment now_;
  std::deque<Moment> past_;
};

}  // namespace sentree::studio
