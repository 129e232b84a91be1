#include <algorithm>
#include <charconv>
#include <utility>

#include "sentree/scxml/interpreter.h"
#include "sentree/scxml/model.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {
namespace {

// 64-bit words as text: a Value's integers are signed, and JSON's numbers are doubles to many readers.
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

Value save_optional(const std::optional<Value>& value) { return value ? Value(List{*value}) : Value(List{}); }

bool restore_optional(const Value* saved, std::optional<Value>& value) {
  const List* list = saved ? saved->as_list() : nullptr;
  if (!list || list->size() > 1) return false;
  value.reset();
  if (!list->empty()) value = list->front();
  return true;
}

Value save_event(const Event& event) {
  return Map{{"name", event.name},
             {"type", static_cast<int>(event.type)},
             {"sendid", event.sendid},
             {"origin", event.origin},
             {"origintype", event.origintype},
             {"invokeid", event.invokeid},
             {"data", save_optional(event.data)},
             {"raw", event.raw}};
}

bool restore_event(const Value& saved, Event& event) {
  const Value* type = saved.find("type");
  if (!type || !type->as_int() || *type->as_int() < 0 || *type->as_int() > 2) return false;
  event.type = static_cast<EventType>(*type->as_int());
  for (const auto& [key, member] : {std::pair<const char*, std::string*>{"name", &event.name},
                                    {"sendid", &event.sendid},
                                    {"origin", &event.origin},
                                    {"origintype", &event.origintype},
                                    {"invokeid", &event.invokeid},
                                    {"raw", &event.raw}}) {
    const Value* text = saved.find(key);
    if (!text || !text->as_string()) return false;
    *member = *text->as_string();
  }
  return restore_optional(saved.find("data"), event.data);
}

std::int64_t integer(const Value* value, std::int64_t otherwise = -1) {
  return value && value->as_int() ? *value->as_int() : otherwise;
}

}  // namespace

/// Reads and writes all members of a session.
struct SessionSnapshot {
  static Value save_set(const StateSet& set) {
    List states;
    set.for_each([&](StateIndex s) { states.emplace_back(static_cast<std::int64_t>(s)); });
    return states;
  }

  static bool restore_states(const Value* saved, std::size_t count, std::vector<StateIndex>& states) {
    const List* list = saved ? saved->as_list() : nullptr;
    if (!list) return false;
    for (const Value& item : *list) {
      const std::int64_t state = integer(&item);
      if (state < 0 || static_cast<std::size_t>(state) >= count) return false;
      states.push_back(static_cast<StateIndex>(state));
    }
    return true;
  }

  static bool restore_set(const Value* saved, const Model& model, StateSet& set) {
    const std::size_t count = model.states.size();
    std::vector<StateIndex> states;
    if (!restore_states(saved, count, states)) return false;
    set = StateSet(count);
    for (const StateIndex s : states) {
      if (s == 0 || model.states[s].is_history()) return false;
      set.insert(s);
    }
    return true;
  }

  static Value save(const Session& session) {
    Map saved;
    saved["format"] = 1;
    saved["chart"] = hex(session.fingerprint_);
    saved["status"] = static_cast<int>(session.status_);
    saved["id"] = session.id_;
    saved["parent"] = session.parent_id_;
    saved["invokeid"] = session.invokeid_;
    saved["configuration"] = save_set(session.configuration_);
    saved["initialized"] = save_set(session.initialized_);
    List history;
    for (const auto& [state, value] : session.history_) {
      List states;
      for (const StateIndex s : value) states.emplace_back(static_cast<std::int64_t>(s));
      history.push_back(List{Value(static_cast<std::int64_t>(state)), Value(std::move(states))});
    }
    saved["history"] = std::move(history);
    for (const auto& [key, queue] : {std::pair{"internal", &session.internal_}, {"external", &session.external_}}) {
      List events;
      for (const Event& event : *queue) events.push_back(save_event(event));
      saved[key] = std::move(events);
    }
    List timers;
    for (const Timer& timer : session.timers_) {
      timers.push_back(Map{{"due", timer.due.time_since_epoch().count()},
                           {"sequence", static_cast<std::int64_t>(timer.sequence)},
                           {"event", save_event(timer.event)},
                           {"target", timer.target},
                           {"type", timer.type},
                           {"is_content", timer.is_content},
                           {"delay", timer.delay.count()},
                           {"place", List{timer.place.line, timer.place.column, timer.place.length}}});
    }
    saved["timers"] = std::move(timers);
    List invocations;
    for (const Invocation& invocation : session.invocations_) {
      Map item{{"id", invocation.id}, {"invoke", static_cast<std::int64_t>(invocation.invoke)}};
      if (invocation.child) {
        item["session"] = save(*invocation.child);
        item["file"] = invocation.chart->file();
        item["source"] = invocation.chart->source();
      }
      invocations.emplace_back(std::move(item));
    }
    saved["invocations"] = std::move(invocations);
    List variables;
    for (const auto& variable : session.variables_) variables.push_back(save_optional(variable));
    saved["variables"] = std::move(variables);
    saved["globals"] = session.globals_;
    saved["sequence"] = static_cast<std::int64_t>(session.sequence_);
    saved["ids"] = static_cast<std::int64_t>(session.ids_);
    saved["random"] = hex(session.rng_.state());
    saved["scripts_run"] = session.scripts_run_;
    saved["done_data"] = save_optional(session.done_data_);
    if (session.failure_) {
      const Diagnostic& failure = *session.failure_;
      saved["failure"] = List{failure.code,      failure.message,     failure.span.file,
                              failure.span.line, failure.span.column, failure.span.length};
    }
    return saved;
  }

  static bool restore_timer(const Value& saved, Timer& timer) {
    const Value* due = saved.find("due");
    const Value* event = saved.find("event");
    const Value* place = saved.find("place");
    if (!due || !due->as_int() || !event || !restore_event(*event, timer.event)) return false;
    if (!place || !place->as_list() || place->as_list()->size() != 3) return false;
    timer.due = TimePoint(Duration(*due->as_int()));
    timer.sequence = static_cast<std::uint64_t>(integer(saved.find("sequence"), 0));
    timer.target = saved.find("target") ? saved.find("target")->text() : "";
    timer.type = saved.find("type") ? saved.find("type")->text() : "";
    timer.is_content =
        saved.find("is_content") && saved.find("is_content")->as_bool() && *saved.find("is_content")->as_bool();
    timer.delay = Duration(integer(saved.find("delay"), 0));
    const auto part = [&](std::size_t i) { return static_cast<int>(integer(&(*place->as_list())[i], 0)); };
    timer.place = {part(0), part(1), part(2)};
    return true;
  }

  static bool restore_invocation(const Chart& chart, const Value& saved, const LoadOptions& options, int depth,
                                 Invocation& invocation) {
    const std::int64_t invoke = integer(saved.find("invoke"));
    const auto& invokes = chart.model().invokes;
    if (invoke < 0 || static_cast<std::size_t>(invoke) >= invokes.size() || !saved.find("id")) return false;
    invocation.invoke = static_cast<std::uint32_t>(invoke);
    invocation.state = invokes[invocation.invoke].state;
    invocation.id = saved.find("id")->text();
    const Value* child = saved.find("session");
    if (!child) return true;
    const Value* source = saved.find("source");
    const Value* file = saved.find("file");
    if (!source || !file) return false;
    const auto& known = invokes[invocation.invoke].child;
    if (known && known->source() == source->text()) {
      invocation.chart = *known;
    } else {
      invocation.chart = load(source->text(), std::string(file->text()), options).value;
      if (!invocation.chart) return false;
    }
    invocation.child = std::make_unique<Session>();
    return restore(*invocation.chart, *child, options, depth + 1, *invocation.child);
  }

  static bool restore(const Chart& chart, const Value& saved, const LoadOptions& options, int depth, Session& session) {
    const Model& model = chart.model();
    const std::int64_t status = integer(saved.find("status"));
    const Value* id = saved.find("id");
    if (depth > kSavedDepthMax || !saved.as_map() || integer(saved.find("format")) != 1 || status < 0 || status > 4 ||
        !id)
      return false;
    reset_session(chart, session, std::string(id->text()), 1);
    session.status_ = static_cast<SessionStatus>(status);
    const auto random = from_hex(saved.find("random"));
    if (!random || !saved.find("parent") || !saved.find("invokeid")) return false;
    session.rng_ = Rng(*random);
    session.parent_id_ = saved.find("parent")->text();
    session.invokeid_ = saved.find("invokeid")->text();
    if (!restore_set(saved.find("configuration"), model, session.configuration_)) return false;
    if (model.late_binding && !restore_set(saved.find("initialized"), model, session.initialized_)) return false;

    const auto list = [&](const char* key) { return saved.find(key) ? saved.find(key)->as_list() : nullptr; };
    const List* lists[] = {list("history"), list("internal"),    list("external"),
                           list("timers"),  list("invocations"), list("variables")};
    if (std::find(std::begin(lists), std::end(lists), nullptr) != std::end(lists)) return false;
    for (const Value& item : *lists[0]) {
      const List* pair = item.as_list();
      if (!pair || pair->size() != 2) return false;
      const std::int64_t state = integer(&pair->front());
      if (state < 0 || static_cast<std::size_t>(state) >= model.states.size()) return false;
      session.history_.emplace_back(static_cast<StateIndex>(state), std::vector<StateIndex>());
      if (!restore_states(&pair->back(), model.states.size(), session.history_.back().second)) return false;
      const StateIndex history = session.history_.back().first;
      if (!model.states[history].is_history()) return false;
      for (const StateIndex s : session.history_.back().second) {
        if (model.states[s].is_history() || !model.is_descendant(s, model.states[history].parent)) return false;
      }
    }
    for (const int which : {1, 2}) {
      for (const Value& item : *lists[which]) {
        Event event;
        if (!restore_event(item, event)) return false;
        (which == 1 ? session.internal_ : session.external_).push(std::move(event));
      }
    }
    for (const Value& item : *lists[3]) {
      Timer timer;
      if (!restore_timer(item, timer)) return false;
      session.timers_.insert(std::move(timer));
    }
    for (const Value& item : *lists[4]) {
      if (!restore_invocation(chart, item, options, depth, session.invocations_.emplace_back())) return false;
    }
    if (lists[5]->size() != model.variables.size()) return false;
    for (std::size_t slot = 0; slot < model.variables.size(); ++slot) {
      if (!restore_optional(&(*lists[5])[slot], session.variables_[slot])) return false;
    }
    const Value* globals = saved.find("globals");
    if (!globals || !globals->as_map() || !restore_optional(saved.find("done_data"), session.done_data_)) return false;
    session.globals_ = *globals->as_map();
    session.sequence_ = static_cast<std::uint64_t>(integer(saved.find("sequence"), 0));
    session.ids_ = static_cast<std::uint64_t>(integer(saved.find("ids"), 0));
    const Value* scripts_run = saved.find("scripts_run");
    session.scripts_run_ = scripts_run && scripts_run->as_bool() && *scripts_run->as_bool();
    if (const List* failure = list("failure"); failure && failure->size() == 6) {
      const auto text = [&](std::size_t i) { return std::string((*failure)[i].text()); };
      const auto number = [&](std::size_t i) { return static_cast<int>(integer(&(*failure)[i], 0)); };
      session.failure_ = Diagnostic{Severity::kError, text(0), text(1), {text(2), number(3), number(4), number(5)}};
    }
    return true;
  }

  static constexpr int kSavedDepthMax = 64;
};

Result<Value> save(const Chart&, const Session& session) {
  if (auto reason = session.unsaveable()) return tl::unexpected(*std::move(reason));
  return SessionSnapshot::save(session);
}

Result<Session> restore(const Chart& chart, const Value& saved, const LoadOptions& options) {
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
