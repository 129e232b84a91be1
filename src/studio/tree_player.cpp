#include "sentree/studio/detail/tree_player.h"

#include <fmt/format.h>

#include <algorithm>

#include "sentree/bt/load.h"

namespace sentree::studio {

namespace {

// What each node said last while a tick went on.
class Said final : public bt::Observer {
 public:
  explicit Said(std::vector<bt::Status>& said) : said_(said) {}
  void status_changed(bt::NodeId node, bt::Status /*from*/, bt::Status to, TimePoint /*time*/) override {
    if (to != bt::Status::kIdle) said_[node] = to;
  }
  void skipped(bt::NodeId node, TimePoint /*time*/) override { said_[node] = bt::Status::kSkipped; }

 private:
  std::vector<bt::Status>& said_;
};

}  // namespace

TreePlayer::TreePlayer(bt::Tree tree) : tree_(std::move(tree)) {
  now_.state = bt::State(tree_);
  now_.said.assign(tree_.size(), bt::Status::kIdle);
  for (const bt::NodeId leaf : tree_.external_leaves())
    now_.answers[leaf] = tree_.category(leaf) == bt::Category::kCondition ? bt::Status::kFailure : bt::Status::kRunning;
}

Result<TreePlayer> TreePlayer::start(const std::string& xml, const std::string& file, const std::string& tree,
                                     const bt::Palette& palette, const std::map<std::string, bt::Status>& answers,
                                     std::vector<bt::StartEntry> entries) {
  bt::LoadOptions options;
  options.entries = std::move(entries);
  options.palette = &palette;
  options.partial = true;
  options.main_tree = tree;
  auto loaded = bt::load(xml, options, file);
  if (!loaded.value) {
    const auto error = std::find_if(loaded.diagnostics.begin(), loaded.diagnostics.end(),
                                    [](const Diagnostic& d) { return d.severity == Severity::kError; });
    if (error != loaded.diagnostics.end()) return tl::unexpected(*error);
    return fail("bt.not-a-tree", file + " has no tree that could be ticked");
  }
  for (bt::NodeId node = 0; node < loaded.value->size(); ++node) {
    if (loaded.value->is_unknown(node)) {
      return fail("bt.unknown-node",
                  fmt::format("nobody says what {} does; a tree can be ticked when all of its control nodes, "
                              "decorators and SubTrees are known",
                              loaded.value->registration(node)),
                  loaded.value->span(node));
    }
  }
  TreePlayer player(std::move(*loaded.value));
  for (auto& [leaf, status] : player.now_.answers) {
    const auto given = answers.find(player.tree_.event_name(leaf));
    if (given != answers.end()) status = given->second;
  }
  if (auto done = player.run(bt::Input::tick()); !done) return tl::unexpected(done.error());
  return player;
}

std::map<std::string, bt::Status> TreePlayer::answers() const {
  std::map<std::string, bt::Status> answers;
  for (const auto& [leaf, status] : now_.answers) answers[tree_.event_name(leaf)] = status;
  return answers;
}

Result<void> TreePlayer::run(const bt::Input& first) {
  bt::Effects effects;
  std::fill(now_.said.begin(), now_.said.end(), bt::Status::kIdle);
  Said said(now_.said);
  effects.observer = &said;
  std::deque<bt::Input> inputs{first};
  for (std::size_t steps = 0; !inputs.empty(); ++steps) {
    if (steps == kStepsMax) {
      return fail("simulate.endless",
                  "the tick does not end: something in the tree repeats itself within one tick "
                  "as long as its leaves answer so");
    }
    const bt::Input input = std::move(inputs.front());
    inputs.pop_front();
    const bt::StepResult result = bt::step(tree_, now_.state, input, now_.time, effects);
    if (result.kind == bt::StepResult::Kind::kFailed)
      return effects.error ? Result<void>(tl::unexpected(*effects.error)) : fail("simulate.failed", "the tick failed");
    if (result.done()) {
      now_.result = result.status;
      ++now_.ticks;
    }
    for (const bt::Effect& effect : effects.list) {
      if (effect.kind == bt::Effect::Kind::kHaltLeaf) inputs.push_front(bt::Input::leaf_halted(effect.leaf));
    }
    if (result.waiting()) inputs.push_back(bt::Input::answer(result.leaf, now_.answers.at(result.leaf)));
    // A node that yielded wants to be ticked again at once, as the run does it.
    if (result.done() && effects.wake && result.status == bt::Status::kRunning) inputs.push_back(bt::Input::tick());
  }
  return {};
}

void TreePlayer::remember() {
  if (past_.size() == kBackMax) past_.pop_front();
  past_.push_back(now_);
}

Result<void> TreePlayer::change(const bt::Input& input) {
  auto done = run(input);
  if (done) return done;
  now_ = std::move(past_.back());
  past_.pop_back();
  return done;
}

Result<void> TreePlayer::answer(std::string_view leaf, bt::Status status) {
  const auto& leaves = tree_.external_leaves();
  const auto found =
      std::find_if(leaves.begin(), leaves.end(), [&](bt::NodeId one) { return tree_.event_name(one) == leaf; });
  if (found == leaves.end()) return fail("simulate.no-such-leaf", fmt::format("there is no leaf \"{}\"", leaf));
  if (status == bt::Status::kRunning && tree_.category(*found) == bt::Category::kCondition)
    return fail("simulate.bad-answer", "a condition holds or does not; it does not run");
  remember();
  now_.answers[*found] = status;
  return change(bt::Input::tick());
}

Result<void> TreePlayer::tick() {
  remember();
  return change(bt::Input::tick());
}

Result<void> TreePlayer::wait() {
  const TimePoint due = next_timer();
  if (due == kNever) return fail("simulate.no-timer", "nothing in the tree waits for a time");
  remember();
  now_.time = std::max(now_.time, due);
  if (auto done = change(bt::Input::timer()); !done) return done;
  if (auto done = run(bt::Input::tick()); !done) {
    now_ = std::move(past_.back());
    past_.pop_back();
    return done;
  }
  return {};
}

Result<void> TreePlayer::back() {
  if (past_.empty()) return fail("simulate.no-way-back", "this is how it began");
  now_ = std::move(past_.back());
  past_.pop_back();
  return {};
}

}  // namespace sentree::studio
