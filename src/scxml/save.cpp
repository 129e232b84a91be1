#include <algorithm>
#include <charconv>
#include <utility>

#include "sentree/scxml/detail/session_members.h"
#include "sentree/scxml/interpreter.h"
#include "sentree/scxml/model.h"

namespace sentree::scxml {
namespace {

constexpr int kFormat = 2;

// As text: JSON's numbers are doubles to many readers.
std::string hex(std::uint64_t word) {
  char buffer[17];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, word, 16).ptr;
  return {buffer, end};
}

std::optional<std::uint64_t> from_hex(const Value* value) {
  const std::string_view text = value ? value->text() : std::string_view();
  std::uint64_t word = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), word, 16);
  if (text.empty() || failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return word;
}

// Whether a set can be one of `model`: of its size, and of states that can be active.
bool fits(const StateSet& set, const Model& model) {
  if (set.words() != StateSet(model.states.size()).words()) return false;
  bool fits = true;
  set.for_each([&](StateIndex s) { fits = fits && s > 0 && s < model.states.size() && !model.states[s].is_history(); });
  return fits;
}

}  // namespace

struct SessionSnapshot {
  static bool is_bound(const Session& session) { return session.fingerprint_ != 0; }

  static Value save(const Session& session) {
    archive::Saver saver;
    saver.map["format"] = kFormat;
    saver.map["chart"] = hex(session.fingerprint_);
    SessionMembers::visit(session, saver);
    List invocations;
    for (const Invocation& invocation : session.invocations_) {
      Map item{{"id", invocation.id}, {"invoke", static_cast<std::int64_t>(invocation.invoke)}};
      if (invocation.child) {
        item["session"] = save(*invocation.child);
        item["file"] = invocation.child.chart().file();
        item["source"] = invocation.child.chart().source();
      }
      invocations.emplace_back(std::move(item));
    }
    saver.map["invocations"] = std::move(invocations);
    return std::move(saver.map);
  }

  static bool restore_invocation(const Chart& chart, const Value& saved, const LoadOptions& options, int depth,
                                 Invocation& invocation) {
    const auto& invokes = chart.model().invokes;
    const Value* invoke = saved.find("invoke");
    if (!invoke || !invoke->as_int() || *invoke->as_int() < 0 || !saved.find("id")) return false;
    if (static_cast<std::uint64_t>(*invoke->as_int()) >= invokes.size()) return false;
    invocation.invoke = static_cast<std::uint32_t>(*invoke->as_int());
    invocation.state = invokes[invocation.invoke].state;
    invocation.id = saved.find("id")->text();
    const Value* child = saved.find("session");
    if (!child) return true;
    const Value* source = saved.find("source");
    const Value* file = saved.find("file");
    if (!source || !file) return false;
    const auto& known = invokes[invocation.invoke].child;
    auto loaded = known && known->source() == source->text()
                      ? known
                      : load(source->text(), std::string(file->text()), options).value;
    if (!loaded) return false;
    invocation.child = ChildSession(*std::move(loaded));
    return restore(invocation.child.chart(), *child, options, depth + 1, *invocation.child);
  }

  static bool restore(const Chart& chart, const Value& saved, const LoadOptions& options, int depth, Session& session) {
    const Value* format = saved.find("format");
    const Value* invocations = saved.find("invocations");
    if (depth > kSavedDepthMax || !format || *format != Value(kFormat) || !invocations || !invocations->as_list())
      return false;
    reset_session(chart, session, {}, 1);
    std::string problem;
    SessionMembers::visit(session, archive::Restorer{&saved, {}, &problem});
    if (!problem.empty() || !is_session_of(chart.model(), session)) return false;
    for (const Value& item : *invocations->as_list()) {
      if (!restore_invocation(chart, item, options, depth, session.invocations_.emplace_back())) return false;
    }
    return true;
  }

  // What the engine takes for granted of a session; everything else that is well formed is harmless.
  static bool is_session_of(const Model& model, const Session& session) {
    const auto is_event = [](const Event& event) { return event.type <= EventType::kExternal; };
    return session.status_ <= SessionStatus::kFailed && fits(session.configuration_, model) &&
           (model.late_binding ? fits(*session.initialized_, model) : session.initialized_->empty()) &&
           session.variables_->size() == model.variables.size() &&
           std::all_of(session.internal_.begin(), session.internal_.end(), is_event) &&
           std::all_of(session.external_.begin(), session.external_.end(), is_event) &&
           std::all_of(session.timers_->begin(), session.timers_->end(),
                       [&](const Timer& timer) { return is_event(timer.event); }) &&
           std::all_of(session.history_->begin(), session.history_->end(), [&](const auto& entry) {
             const auto& [history, states] = entry;
             return history < model.states.size() && model.states[history].is_history() &&
                    std::all_of(states.begin(), states.end(), [&, parent = model.states[history].parent](StateIndex s) {
                      return s < model.states.size() && !model.states[s].is_history() && model.is_descendant(s, parent);
                    });
           });
  }

  static constexpr int kSavedDepthMax = 64;
};

Result<Value> save(const Chart&, const Session& session) {
  if (!SessionSnapshot::is_bound(session)) return Value();
  if (auto reason = session.unsaveable()) return tl::unexpected(*std::move(reason));
  return SessionSnapshot::save(session);
}

Result<Session> restore(const Chart& chart, const Value& saved, const LoadOptions& options) {
  if (saved.is_null()) return Session();
  const auto fingerprint = from_hex(saved.find("chart"));
  if (fingerprint && *fingerprint != chart.fingerprint()) {
    return fail("scxml.other-chart", "the saved session belongs to another chart, or to another version of " +
                                         (chart.file().empty() ? std::string("this one") : chart.file()));
  }
  Session session;
  if (!fingerprint || !SessionSnapshot::restore(chart, saved, options, 0, session)) {
    return fail("scxml.bad-snapshot", "this is no saved session, or a damaged one");
  }
  return session;
}

}  // namespace sentree::scxml
