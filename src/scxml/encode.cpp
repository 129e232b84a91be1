#include "sentree/scxml/encode.h"

#include <algorithm>
#include <unordered_map>
#include <utility>
#include <vector>

#include "sentree/base/encoder.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

/// Writes a session and its children.
class SessionEncoder {
 public:
  SessionEncoder(const Chart& chart, const Session& root, TimePoint now, std::string& out,
                 const std::vector<bool>& dead)
      : out_(out), root_(root), now_(now), dead_(dead), asks_(chart.model().ambient_kinds) {
    collect_ids(chart.model(), root);
  }

  void run(const Model& model) {
    if (asks(Ambient::kSessionId) || asks(Ambient::kInvokeId) || asks(Ambient::kIdText)) out_.text(root_.id());
    if (asks(Ambient::kClock)) out_.word(static_cast<std::uint64_t>(now_.time_since_epoch().count()));
    session(model, root_);
  }

  static bool is_lost(const Session& session) { return session.heap_.data_lost; }

  static void take_timers(Session& to, const Session& from) {
    to.timers_ = from.timers_;
    to.sequence_ = from.sequence_;
  }

  static void postpone(Session& session, Duration by) {
    if (!session.timers_->empty()) {
      TimerQueue later;
      for (Timer timer : *session.timers_) {
        timer.due = add_saturating(timer.due, by);
        later.insert(std::move(timer));
      }
      session.timers_.edit() = std::move(later);
    }
    for (Invocation& invocation : session.invocations_) {
      if (invocation.child) postpone(*invocation.child, by);
    }
  }

 private:
  enum : std::uint8_t { kUndefined = Encoder::kFree, kMadeUp };

  [[nodiscard]] bool asks(Ambient what) const {
    return (asks_ & (1U << static_cast<unsigned>(what) | 1U << static_cast<unsigned>(Ambient::kAnything))) != 0;
  }

  // The ids of invocations that have got theirs from the engine.
  void collect_ids(const Model& model, const Session& session) {
    for (const Invocation& invocation : session.invocations_) {
      if (model.invokes[invocation.invoke].id.empty()) invocation_ids_.push_back(invocation.id);
      if (invocation.child) collect_ids(invocation.child.chart().model(), *invocation.child);
    }
  }

  void session(const Model& model, const Session& s) {
    const bool queued = !s.internal_.empty() || !s.external_.empty();
    const auto flag = [](bool set, int bit) { return set ? 1U << bit : 0U; };
    out_.byte(static_cast<std::uint8_t>(static_cast<unsigned>(s.status_) | flag(s.scripts_run_, 3) | flag(queued, 4) |
                                        flag(!s.timers_->empty(), 5) | flag(!s.invocations_.empty(), 6) |
                                        flag(!s.globals_->empty(), 7)));
    if (s.status_ != SessionStatus::kRunning) return;  // it ignores everything
    set(s.configuration_, model);
    if (model.late_binding) set(*s.initialized_, model);
    if (model.has_history) history(*s.history_);
    if (asks(Ambient::kRandom)) out_.word(s.rng_.state());
    if (asks(Ambient::kIdText)) out_.number(s.ids_);
    const auto& variables = *s.variables_;
    for (std::size_t slot = 0; slot < variables.size(); ++slot) {
      if (&s != &root_ || slot >= dead_.size() || !dead_[slot]) optional(variables[slot]);
    }
    if (!s.globals_->empty()) out_.map(*s.globals_, [this](std::string_view text) { string(text); });
    if (queued) {
      for (const EventQueue* queue : {&s.internal_, &s.external_}) {
        out_.number(queue->size());
        for (const Event& e : *queue) event(e);
      }
    }
    if (!s.timers_->empty()) {
      out_.number(s.timers_->size());
      for (const Timer& t : *s.timers_) timer(t);
    }
    if (s.invocations_.empty()) return;
    out_.number(s.invocations_.size());
    for (const Invocation& i : s.invocations_) invocation(model, i);
  }

  void set(const StateSet& states, const Model& model) {
    for (std::size_t i = 0; i * 8 < model.states.size(); ++i)
      out_.byte(static_cast<std::uint8_t>(states.word(i / 8) >> (i % 8 * 8)));
  }

  void history(const std::vector<std::pair<StateIndex, std::vector<StateIndex>>>& values) {
    out_.number(values.size());
    for (const auto& [state, value] : values) {
      out_.number(state);
      out_.number(value.size());
      for (const StateIndex s : value) out_.number(s);
    }
  }

  void optional(const std::optional<Value>& value) {
    if (value)
      out_.value(*value, [this](std::string_view text) { string(text); });
    else
      out_.byte(kUndefined);
  }

  void event(const Event& e) {
    const std::pair<const std::string*, unsigned> members[] = {
        {&e.sendid, 4U}, {&e.origin, 8U}, {&e.origintype, 16U}, {&e.invokeid, 32U}, {&e.raw, 64U}};
    unsigned there = static_cast<unsigned>(e.type) | (e.data ? 128U : 0U);
    for (const auto& [text, bit] : members) there |= text->empty() ? 0U : bit;
    out_.byte(static_cast<std::uint8_t>(there));
    string(e.name);
    for (const auto& [text, bit] : members) {
      if (!text->empty()) string(*text);
    }
    if (e.data) optional(e.data);
  }

  // The delay is over when the event leaves, and where it was sent shows outside only.
  void timer(const Timer& t) {
    const bool outside = !is_scxml_processor(t.type);
    const bool never = t.due == kNever;
    out_.byte(static_cast<std::uint8_t>((outside ? 1U : 0U) | (never ? 2U : 0U) | (t.is_content ? 4U : 0U) |
                                        (t.target.empty() ? 0U : 8U)));
    if (!never) out_.integer((t.due - now_).count());
    event(t.event);
    if (!t.target.empty()) string(t.target);
    if (!outside) return;
    out_.text(t.type);
    for (const int part : {t.place.line, t.place.column, t.place.length}) out_.integer(part);
  }

  void invocation(const Model& model, const Invocation& i) {
    const Invoke& invoke = model.invokes[i.invoke];
    const bool known = i.child && invoke.child && *invoke.child == i.child.chart();
    out_.number(i.invoke << 2U | (i.child ? 1U : 0U) | (known ? 2U : 0U));
    if (invoke.id.empty()) string(i.id);
    if (!i.child) return;
    if (!known) out_.word(i.child.chart().fingerprint());
    session(i.child.chart().model(), *i.child);
  }

  void string(std::string_view text) {
    if (!text.empty() && text.back() >= '0' && text.back() <= '9' && !asks(Ambient::kIdText) && made_up(text)) return;
    out_.byte(Encoder::kString);
    out_.text(text);
  }

  // Whether it is an id that the engine has made up, and if so, its number in order of appearance.
  bool made_up(std::string_view text) {
    std::string_view id = text;
    std::uint8_t form = 0;
    if (id.starts_with("#_")) {
      id.remove_prefix(2);
      form = 1;
      if (id.starts_with("scxml_")) {
        id.remove_prefix(6);
        form = 2;
      }
    }
    const std::string_view stem = id.substr(0, id.find_last_not_of("0123456789") + 1);
    const std::string& root = root_.id();
    const bool below_root = id.size() > root.size() && id.starts_with(root) && id[root.size()] == '.';
    if (!(below_root && stem.ends_with(".send"))) {
      if (invocation_ids_.empty()) return false;
      if (form == 2 && below_root) id.remove_prefix(root.size() + 1);
      if (std::find(invocation_ids_.begin(), invocation_ids_.end(), id) == invocation_ids_.end()) return false;
    }
    out_.byte(kMadeUp);
    out_.byte(form);
    out_.number(ids_.emplace(id, ids_.size()).first->second);
    return true;
  }

  Encoder out_;
  const Session& root_;
  TimePoint now_;
  const std::vector<bool>& dead_;
  unsigned asks_;
  std::vector<std::string_view> invocation_ids_;
  std::unordered_map<std::string_view, std::size_t> ids_;
};

Result<void> encode(const Chart& chart, const Session& session, TimePoint now, std::string& out,
                    const std::vector<bool>& dead) {
  if (auto reason = session.unsaveable()) return tl::unexpected(*std::move(reason));
  if (SessionEncoder::is_lost(session))
    return fail("scxml.no-value-form", "the session is a copy of one whose data cannot be copied");
  SessionEncoder(chart, session, now, out, dead).run(chart.model());
  return {};
}

void postpone(Session& session, Duration by) {
  if (by != Duration(0)) SessionEncoder::postpone(session, by);
}

void take_timers(Session& to, const Session& from) { SessionEncoder::take_timers(to, from); }

}  // namespace sentree::scxml
