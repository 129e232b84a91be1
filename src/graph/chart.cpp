#include "sentree/graph/chart.h"

#include <fmt/format.h>

#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "sentree/scxml/model.h"

namespace sentree::graph {
namespace {

using namespace scxml;

class Drawer {
 public:
  Drawer(const Chart& chart, const Session* session, TransitionIndex last)
      : model_(chart.model()), session_(session), last_(last) {}

  draw::Chart run(std::vector<StateIndex>* states_of, std::vector<TransitionIndex>* transitions_of) {
    drawn_.title = model_.name;
    index_.assign(model_.states.size(), -1);
    for (StateIndex s = 0; s < model_.states.size(); ++s) add_state(s);
    for (TransitionIndex t = 0; t < model_.transitions.size(); ++t) add_transition(t);
    if (states_of) *states_of = std::move(origin_);
    if (transitions_of) *transitions_of = std::move(transition_origin_);
    return std::move(drawn_);
  }

 private:
  void add_state(StateIndex s) {
    const State& state = model_.states[s];
    const StateCode& code = model_.state_code[s];
    if (s != 0) {
      draw::ChartState drawn;
      drawn.parent = state.parent == 0 ? -1 : index_[state.parent];
      drawn.name = state.id;
      switch (state.kind) {
        case StateKind::kParallel: drawn.kind = draw::StateKind::kParallel; break;
        case StateKind::kFinal: drawn.kind = draw::StateKind::kFinal; break;
        case StateKind::kHistoryShallow: drawn.kind = draw::StateKind::kHistoryShallow; break;
        case StateKind::kHistoryDeep: drawn.kind = draw::StateKind::kHistoryDeep; break;
        default: break;
      }
      for (const Block& block : code.onentry) add_line(drawn, "entry / ", block);
      for (const Block& block : code.onexit) add_line(drawn, "exit / ", block);
      for (const std::uint32_t i : code.invokes) {
        const Invoke& invoke = model_.invokes[i];
        drawn.lines.push_back("invoke / " + (!invoke.id.empty()             ? invoke.id
                                             : !invoke.src.constant.empty() ? invoke.src.constant
                                                                            : "chart"));
      }
      drawn.active = session_ && session_->is_active(s);
      index_[s] = static_cast<int>(drawn_.states.size());
      drawn_.states.push_back(std::move(drawn));
      origin_.push_back(s);
    }
    if (code.initial == kNoTransition || state.is_history()) return;
    draw::ChartState dot;
    dot.parent = s == 0 ? -1 : index_[s];
    dot.kind = draw::StateKind::kInitial;
    dots_.emplace_back(code.initial, static_cast<int>(drawn_.states.size()));
    drawn_.states.push_back(std::move(dot));
    origin_.push_back(kNoState);
  }

  void add_line(draw::ChartState& drawn, const char* prefix, const Block& block) const {
    const std::string text = actions(block);
    if (!text.empty()) drawn.lines.push_back(prefix + text);
  }

  // Where the arrow of a transition begins: at its state, at the dot of an initial state, at the history state.
  [[nodiscard]] int source_of(TransitionIndex t) const {
    for (const auto& [transition, dot] : dots_) {
      if (transition == t) return dot;
    }
    const StateIndex source = model_.transitions[t].source;
    for (const StateIndex history : model_.state_code[source].history) {
      if (model_.state_code[history].initial == t) return index_[history];
    }
    return index_[source];
  }

  void add_transition(TransitionIndex t) {
    const Transition& transition = model_.transitions[t];
    draw::ChartTransition drawn;
    drawn.source = source_of(t);
    if (drawn.source < 0) return;
    for (const StateIndex target : transition.targets) drawn.targets.push_back(index_[target]);
    for (const std::string& event : transition.events) drawn.event += (drawn.event.empty() ? "" : " ") + event;
    drawn.condition = transition.condition;
    drawn.actions = actions(model_.transition_code[t].content);
    drawn.last = t == last_;
    drawn_.transitions.push_back(std::move(drawn));
    transition_origin_.push_back(t);
  }

  [[nodiscard]] const std::string& text(ExpressionId id) const {
    static const std::string kNone;
    return id == kNoExpression ? kNone : model_.expressions[id].text;
  }

  [[nodiscard]] std::string actions(const Block& block) const {
    std::string result;
    for (const Action& action : block) result += (result.empty() ? "" : "; ") + describe(action);
    return result;
  }

  [[nodiscard]] std::string describe(const Action& action) const {
    if (const auto* raised = std::get_if<Raise>(&action.what)) return "raise " + raised->event;
    if (const auto* send = std::get_if<Send>(&action.what)) {
      const std::string event = send->event.constant.empty() ? text(send->event.expr) : send->event.constant;
      const std::string target = send->target.constant.empty() ? text(send->target.expr) : send->target.constant;
      const std::string delay = send->delay.constant.empty() ? text(send->delay.expr) : send->delay.constant;
      return fmt::format("send {}{}{}", target.empty() ? "" : target + ".", event,
                         delay.empty() ? "" : " after " + delay);
    }
    if (const auto* assign = std::get_if<Assign>(&action.what)) {
      return fmt::format("{} = {}", text(assign->location), assign->expr == kNoExpression ? "…" : text(assign->expr));
    }
    if (const auto* log = std::get_if<Log>(&action.what))
      return "log " + (log->label.empty() ? text(log->expr) : log->label);
    if (const auto* cancelled = std::get_if<Cancel>(&action.what)) {
      return "cancel " + (cancelled->sendid.empty() ? text(cancelled->sendid_expr) : cancelled->sendid);
    }
    if (std::holds_alternative<Script>(action.what)) return "script";
    if (const auto* loop = std::get_if<Foreach>(&action.what))
      return fmt::format("for each {} of {}", text(loop->item), text(loop->array));
    const If& branch = std::get<If>(action.what);
    return fmt::format("if {} …", text(branch.branches.front().condition));
  }

  const Model& model_;
  const Session* session_;
  TransitionIndex last_;
  draw::Chart drawn_;
  std::vector<int> index_;
  std::vector<StateIndex> origin_;
  std::vector<TransitionIndex> transition_origin_;
  std::vector<std::pair<TransitionIndex, int>> dots_;
};

}  // namespace

draw::Chart drawing_of(const scxml::Chart& chart, const scxml::Session* session, scxml::TransitionIndex last,
                       std::vector<scxml::StateIndex>* states_of, std::vector<scxml::TransitionIndex>* transitions_of) {
  return Drawer(chart, session, last).run(states_of, transitions_of);
}

}  // namespace sentree::graph
