#include "sentree/scxml/remote_step.h"

#include <utility>

#include "sentree/scxml/detail/session_members.h"

namespace sentree::scxml {

constexpr StepOrder::Kind last_enumerator(StepOrder::Kind) { return StepOrder::Kind::kCancel; }

template <class S, class V>
requires archive::MaybeConst<S, StartOptions>
void visit_members(S& s, V&& visit) {
  visit("data", s.data);
  visit("session_id", s.session_id);
  visit("seed", s.seed);
}
template <class S, class V>
requires archive::MaybeConst<S, StepOrder>
void visit_members(S& s, V&& visit) {
  visit("kind", s.kind);
  visit("now", s.now);
  visit("event", s.event);
  visit("options", s.options);
}
template <class S, class V>
requires archive::MaybeConst<S, OutgoingSend>
void visit_members(S& s, V&& visit) {
  visit("session", s.session);
  visit("type", s.type);
  visit("target", s.target);
  visit("event", s.event);
  visit("sendid", s.sendid);
  visit("data", s.data);
  visit("is_content", s.is_content);
  visit("delay", s.delay);
  visit("span", s.span);
}
template <class S, class V>
requires archive::MaybeConst<S, LogLine>
void visit_members(S& s, V&& visit) {
  visit("label", s.label);
  visit("text", s.text);
  visit("span", s.span);
}
template <class S, class V>
requires archive::MaybeConst<S, Done>
void visit_members(S& s, V&& visit) {
  visit("final_id", s.final_id);
  visit("donedata", s.donedata);
}

namespace {

// What a host without types of <invoke> of its own has to do.
using ToldEffect = std::variant<OutgoingSend, LogLine, Done>;

struct Saw {
  enum class What : std::uint8_t { kEvent, kTransition, kEntered };
  What what = What::kEvent;
  Event event;
  std::uint32_t index = 0;
};
constexpr Saw::What last_enumerator(Saw::What) { return Saw::What::kEntered; }
template <class S, class V>
requires archive::MaybeConst<S, Saw>
void visit_members(S& s, V&& visit) {
  visit("what", s.what);
  visit("event", s.event);
  visit("index", s.index);
}

struct Told {
  bool enabled = false;
  std::vector<ToldEffect> effects;
  std::vector<Saw> saw;
};
template <class S, class V>
requires archive::MaybeConst<S, Told>
void visit_members(S& s, V&& visit) {
  visit("enabled", s.enabled);
  visit("effects", s.effects);
  visit("saw", s.saw);
}

class Teller final : public Observer {
 public:
  Teller(const Chart& chart, std::vector<Saw>& saw) : chart_(chart), saw_(saw) {}
  void event(const Chart& chart, std::string_view, const Event& event) override {
    if (chart == chart_) saw_.push_back({Saw::What::kEvent, event, 0});
  }
  void transition(const Chart& chart, std::string_view, TransitionIndex taken) override {
    if (chart == chart_) saw_.push_back({Saw::What::kTransition, {}, taken});
  }
  void entered(const Chart& chart, std::string_view, StateIndex state) override {
    if (chart == chart_) saw_.push_back({Saw::What::kEntered, {}, state});
  }

 private:
  const Chart& chart_;
  std::vector<Saw>& saw_;
};

tl::unexpected<Diagnostic> bad_order(const std::string& what) {
  return fail("scxml.bad-order", "this is no step of a chart: " + what);
}

}  // namespace

bool execute(const Chart& chart, Session& session, StepOrder&& order, Effects& effects, const Host& host) {
  switch (order.kind) {
    case StepOrder::Kind::kStart:
      return start(chart, session, std::move(order.options), order.now, effects, host).enabled;
    case StepOrder::Kind::kEvent: return step(chart, session, order.event, order.now, effects, host).enabled;
    case StepOrder::Kind::kTimers: return step_timers(chart, session, order.now, effects, host).enabled;
    case StepOrder::Kind::kCancel: return cancel(chart, session, order.now, effects, host).enabled;
  }
  return false;
}

Value save(const StepOrder& order) { return archive::save(order); }

Result<StepOrder> restore_order(const Value& saved) {
  StepOrder order;
  if (const std::string problem = archive::restore(saved, order); !problem.empty()) return bad_order(problem);
  return order;
}

Result<Value> execute_and_tell(const Chart& chart, Session& session, const StepOrder& order, Host host) {
  Told told;
  Teller teller(chart, told.saw);
  host.observer = &teller;
  Effects effects;
  told.enabled = execute(chart, session, StepOrder(order), effects, host);
  for (Effect& effect : effects) {
    std::visit(
        [&](auto& what) {
          if constexpr (requires { ToldEffect(std::move(what)); }) told.effects.emplace_back(std::move(what));
        },
        effect);
  }
  auto saved = save(chart, session);
  if (!saved) return saved;
  return Value(Map{{"session", std::move(*saved)}, {"told", archive::save(told)}});
}

Result<bool> take_step(const Chart& chart, const Value& told, Session& session, Effects& effects, Observer* observer) {
  const Value* after = told.find("session");
  const Value* rest = told.find("told");
  if (after == nullptr || rest == nullptr) return bad_order("a part is missing");
  Told done;
  if (const std::string problem = archive::restore(*rest, done); !problem.empty()) return bad_order(problem);
  for (const Saw& saw : done.saw) {
    const bool is_there = saw.what == Saw::What::kTransition ? saw.index < chart.transitions().size()
                          : saw.what == Saw::What::kEntered  ? saw.index < chart.states().size()
                                                             : true;
    if (!is_there) return bad_order("it tells of what the chart has not");
  }
  auto restored = restore(chart, *after);
  if (!restored) return tl::unexpected(restored.error());
  session = std::move(*restored);
  for (ToldEffect& effect : done.effects)
    std::visit([&](auto& what) { effects.emplace_back(std::move(what)); }, effect);
  if (observer == nullptr) return done.enabled;
  for (const Saw& saw : done.saw) {
    switch (saw.what) {
      case Saw::What::kEvent: observer->event(chart, session.id(), saw.event); break;
      case Saw::What::kTransition: observer->transition(chart, session.id(), saw.index); break;
      case Saw::What::kEntered: observer->entered(chart, session.id(), saw.index); break;
    }
  }
  return done.enabled;
}

}  // namespace sentree::scxml
