#include "sentree/studio/chart_player.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "sentree/text/json.h"

namespace sentree::studio {

namespace {

std::string name_of(const scxml::Chart& chart, scxml::StateIndex index) {
  const scxml::State& state = chart.states()[index];
  return state.id.empty() ? fmt::format("<{}>", to_string(state.kind)) : state.id;
}

List names_of(const scxml::Chart& chart, const std::vector<scxml::StateIndex>& states) {
  List names;
  for (const scxml::StateIndex state : states) names.emplace_back(name_of(chart, state));
  return names;
}

std::string data_text(const std::optional<Value>& data) { return data ? " " + to_json(*data) : std::string(); }

}  // namespace

// All that a command works on. If its script never ends, it is left to the thread that executes it.
struct ChartPlayer::Work final : scxml::Observer {
  scxml::Chart chart;
  scxml::Host host;
  scxml::Session session;
  TimePoint now{};
  ChartTrace trace;
  std::size_t left_out = 0;
  scxml::Effects effects;
  std::size_t effects_told = 0;
  std::optional<Value> value;
  std::optional<Diagnostic> failure;
  std::string hung;
  std::shared_ptr<runtime::Watched> watched;

  explicit Work(scxml::Chart c) : chart(std::move(c)) {}

  void note(std::string what, std::string text, Value data) {
    tell_effects();  // what was done before
    add(std::move(what), std::move(text), std::move(data));
  }
  void add(std::string what, std::string text, Value data) {
    if (trace.entries.size() < kEntriesMax)
      trace.entries.push_back({std::move(what), now, std::move(text), std::move(data)});
    else
      ++left_out;
  }

  static std::string prefix(const scxml::Session& own, std::string_view id) {
    return id == own.id() ? std::string() : fmt::format("[{}] ", id);
  }

  void event(const scxml::Chart&, std::string_view id, const scxml::Event& e) override {
    Map data{{"name", e.name}, {"type", to_string(e.type)}};
    if (e.data) data["data"] = *e.data;
    note("event", fmt::format("{}event {}{}", prefix(session, id), e.name, data_text(e.data)), std::move(data));
  }
  void transition(const scxml::Chart& of, std::string_view id, scxml::TransitionIndex index) override {
    const scxml::Transition& taken = of.transitions()[index];
    std::string targets;
    for (const scxml::StateIndex target : taken.targets) targets += " " + name_of(of, target);
    const std::string place = to_string(of.span({taken.place.line, 0, 0}));
    note("transition",
         fmt::format("{}taken {} →{}{}  {}", prefix(session, id), name_of(of, taken.source),
                     targets.empty() ? " (stays)" : targets,
                     taken.condition.empty() ? "" : fmt::format("  [{}]", taken.condition), place),
         Map{{"source", name_of(of, taken.source)},
             {"targets", names_of(of, taken.targets)},
             {"line", taken.place.line}});
  }
  void exited(const scxml::Chart& of, std::string_view id, scxml::StateIndex state) override {
    note("exit", fmt::format("{}exit  {}", prefix(session, id), name_of(of, state)), name_of(of, state));
  }
  void entered(const scxml::Chart& of, std::string_view id, scxml::StateIndex state) override {
    note("enter", fmt::format("{}enter {}", prefix(session, id), name_of(of, state)), name_of(of, state));
  }

  void tell_effects() {
    while (effects_told < effects.size()) std::visit([&](const auto& e) { tell(e); }, effects[effects_told++]);
  }
  void take_effects() {
    tell_effects();
    effects.clear();
    effects_told = 0;
    // Said once, however much has been shown before.
    const bool said = !trace.entries.empty() && trace.entries.back().what == "failed";
    if (session.failure() && !said) {
      const std::string why = to_string(*session.failure());
      trace.entries.push_back({"failed", now, "failed " + why, Value(why)});
    }
  }
  void tell(const scxml::OutgoingSend& send) {
    Map data{{"type", send.type}, {"target", send.target}, {"event", send.event}, {"sendid", send.sendid}};
    if (send.data) data["data"] = *send.data;
    add("send",
        fmt::format("send  {} {}{}{}{}  ({})", send.type, send.target, send.target.empty() ? "" : ".", send.event,
                    data_text(send.data), send.sendid),
        std::move(data));
  }
  void tell(const scxml::LogLine& line) {
    add("log", fmt::format("log   {}{}{}", line.label, line.label.empty() ? "" : ": ", line.text),
        Map{{"label", line.label}, {"text", line.text}});
  }
  void tell(const scxml::Done& done) {
    Map data{{"final", done.final_id}};
    if (done.donedata) data["data"] = *done.donedata;
    add("done", fmt::format("done  {}{}", done.final_id, data_text(done.donedata)), std::move(data));
  }
  void tell(const scxml::StartInvoke& invoke) {
    add("invoke", fmt::format("invoke {} {} ({})", invoke.type, invoke.src, invoke.invokeid),
        Map{{"type", invoke.type}, {"src", invoke.src}, {"invokeid", invoke.invokeid}});
  }
  void tell(const scxml::CancelInvoke& cancelled) {
    add("invoke", "cancel " + cancelled.invokeid, Map{{"cancelled", cancelled.invokeid}});
  }
  void tell(const scxml::InvokeEvent& sent) {
    add("invoke", fmt::format("to {}: {}{}", sent.invokeid, sent.event.name, data_text(sent.event.data)),
        Map{{"invokeid", sent.invokeid}, {"event", sent.event.name}});
  }
};

ChartPlayer::ChartPlayer(scxml::Chart chart, scxml::Host host, std::uint64_t seed, Duration script_max)
    : chart_(std::move(chart)), host_(std::move(host)), seed_(seed), watchdog_(script_max) {}

bool ChartPlayer::run(std::shared_ptr<Work> work, std::function<void(Work&)> step) {
  // Shared with the watchdog's thread, which may call `leave` after everything else is over.
  const auto thread = std::make_shared<runtime::LeavableThread>();
  work->watched = std::make_shared<runtime::Watched>([thread, work = work.get(), this](const SourceSpan& script) {
    work->hung = watchdog_.reason(script, "the command");
    thread->leave();
  });
  work->host = host_;
  work->host.observer = work.get();
  work->host.watch = &work->watched->execution();
  watchdog_.watch(work->watched);
  const bool ended = thread->run([work, step = std::move(step)] {
    work->watched->in_this_thread();
    step(*work);
  });
  if (!ended) {
    hung_ = work->hung;
    runtime::keep_for_ever(std::move(work));
  }
  return ended;
}

Result<ChartTrace> ChartPlayer::change(const std::function<void(Work&)>& step) {
  remember();
  auto work = std::make_shared<Work>(chart_);
  // Moved, since data without a value form (functions) cannot be copied.
  work->session = std::move(session_);
  work->now = now_;
  const bool ended = run(work, step);
  if (!ended) {
    session_ = std::move(past_.back().session);
    past_.pop_back();
    return fail("chart.endless-script", hung_);
  }
  work->take_effects();
  session_ = std::move(work->session);
  now_ = work->now;
  if (work->left_out > 0) {
    work->trace.entries.push_back({"more", now_, fmt::format("… and {} more", work->left_out), Value()});
  }
  return std::move(work->trace);
}

void ChartPlayer::remember() {
  if (past_.size() == kBackMax) past_.pop_front();
  past_.push_back({session_, now_});
}

Result<ChartTrace> ChartPlayer::start(const Map& data) {
  auto trace = change([data, seed = seed_](Work& work) {
    scxml::start(work.chart, work.session, {.data = data, .seed = seed}, work.now, work.effects, work.host);
    work.take_effects();
  });
  past_.clear();
  return trace;
}

Result<ChartTrace> ChartPlayer::send(const scxml::Event& event) {
  if (!session_.running())
    return fail("chart.ended",
                fmt::format("the chart has ended ({}); `back` takes the last step back, `restart` begins again",
                            to_string(session_.status())));
  return change([event](Work& work) {
    const auto info = scxml::step(work.chart, work.session, event, work.now, work.effects, work.host);
    if (!info.enabled) work.note("ignored", "no transition takes it", event.name);
    work.take_effects();
  });
}

Result<ChartTrace> ChartPlayer::wait(Duration time) {
  return change([until = add_saturating(now_, time)](Work& work) {
    for (std::size_t rung = 0; work.session.running() && work.session.next_timer() <= until; ++rung) {
      if (rung == kTimersMax) {
        work.trace.entries.push_back(
            {"more", work.now, fmt::format("{} timers have rung by now; wait again to go on", kTimersMax), Value()});
        return;
      }
      work.now = std::max(work.now, work.session.next_timer());
      scxml::step_timers(work.chart, work.session, work.now, work.effects, work.host);
      work.take_effects();
    }
    work.now = until;
  });
}

Result<void> ChartPlayer::back(std::size_t count) {
  if (count == 0 || count > past_.size())
    return fail("chart.no-way-back", fmt::format("there are {} steps to go back, not {}", past_.size(), count));
  const Moment& moment = past_[past_.size() - count];
  if (const auto reason = moment.session.unsaveable())
    return fail("chart.no-way-back", "that state cannot be gone back to: " + reason->message);
  session_ = moment.session;
  now_ = moment.now;
  past_.resize(past_.size() - count);
  return {};
}

Result<std::optional<Value>> ChartPlayer::evaluate(const std::string& expression) {
  auto work = std::make_shared<Work>(chart_);
  if (const auto reason = session_.unsaveable()) return tl::unexpected(*reason);
  work->session = session_;
  work->now = now_;
  const bool ended = run(work, [expression](Work& w) {
    auto value = scxml::evaluate(w.chart, w.session, expression, w.now, w.host);
    if (value)
      w.value = *std::move(value);
    else
      w.failure = std::move(value.error());
  });
  if (!ended) return fail("chart.endless-script", hung_);
  if (work->failure) return tl::unexpected(*std::move(work->failure));
  return std::move(work->value);
}

Result<Value> ChartPlayer::save() const {
  auto saved = scxml::save(chart_, session_);
  if (!saved) return saved;
  return Value(Map{{"now", now_.time_since_epoch().count()}, {"session", *std::move(saved)}});
}

Result<void> ChartPlayer::restore(const Value& saved) {
  const Value* now = saved.find("now");
  const Value* session = saved.find("session");
  if (!now || !now->as_int() || !session)
    return fail("chart.bad-file", "this is no file that `save` of this command has written");
  scxml::LoadOptions options;
  options.read = host_.read;
  auto restored = scxml::restore(chart_, *session, options);
  if (!restored) return tl::unexpected(std::move(restored.error()));
  remember();
  session_ = *std::move(restored);
  now_ = TimePoint(Duration(*now->as_int()));
  return {};
}

std::vector<std::string> ChartPlayer::events_handled_here() const {
  std::vector<std::string> events;
  session_.configuration().for_each([&](scxml::StateIndex state) {
    for (const scxml::TransitionIndex transition : chart_.states()[state].transitions) {
      const auto& named = chart_.transitions()[transition].events;
      events.insert(events.end(), named.begin(), named.end());
    }
  });
  std::sort(events.begin(), events.end());
  events.erase(std::unique(events.begin(), events.end()), events.end());
  return events;
}

scxml::Host host_for(const scxml::Chart& chart, const scxml::LoadOptions& options) {
  scxml::Host host;
  for (const scxml::SendInfo& send : chart.sends()) {
    if (!send.type || send.type->empty() || *send.type == scxml::kScxmlProcessor ||
        *send.type == scxml::kScxmlProcessorShort)
      continue;
    const bool known = std::any_of(host.processors.begin(), host.processors.end(),
                                   [&](const scxml::Processor& processor) { return processor.type == *send.type; });
    if (!known) host.processors.push_back({*send.type, ""});
  }
  host.read = options.read;
  return host;
}

}  // namespace sentree::studio
