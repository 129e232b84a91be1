#include "sentree/monitor/explanation.h"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include "sentree/monitor/detail/model.h"

namespace sentree::monitor {

namespace {

std::string time_text(TimePoint time) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.3f s", seconds(time));
  return buffer;
}

std::string value_text(const Value& value) {
  if (value.as_string()) return *value.as_string();
  if (!value.is_number()) return to_json(value);
  // Computed numbers carry the dust of their binary form.
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.10g", value.number());
  return buffer;
}

// What the chart's data hold, by their names in the requirement.
std::vector<std::optional<Value>> values(const Model& model, const Core& state) {
  const Map data = state.session.data(model.chart());
  std::vector<std::optional<Value>> all;
  for (const Datum& datum : model.origin()->data) {
    const Value* value = data.find(datum.id);
    all.push_back(value != nullptr ? std::optional(*value) : std::nullopt);
  }
  return all;
}

Value message_value(const Message& message) {
  Map map{{"sequence", static_cast<std::int64_t>(message.sequence)},
          {"time", seconds(message.time)},
          {"tick", static_cast<std::int64_t>(message.tick)},
          {"name", message.name},
          {"source", message.source}};
  if (!message.target.empty()) map["target"] = message.target;
  map["data"] = message.data;
  return map;
}

}  // namespace

std::optional<Explanation> explain(const Model& model, const Decision& decision, std::string leaf) {
  const Origin* origin = model.origin();
  if (origin == nullptr) return std::nullopt;
  const Requirement& r = origin->requirement;
  Explanation e;
  e.requirement = r.name;
  e.importance = r.importance;
  e.prose = r.prose;
  e.text = r.text();
  e.place = r.span;
  e.verdict = decision.verdict;
  e.number = decision.number;
  e.detected = decision.at;
  e.triggered = decision.since;
  e.deciding = decision.deciding;
  e.leaf = std::move(leaf);
  e.complete = decision.witness_complete;
  if (r.bound) e.bound = r.bound->text();
  if (decision.since && r.bound && r.bound->unit == Bound::Unit::kTime)
    e.deadline = add_saturating(*decision.since, r.bound->time);

  State state = start(model, decision.started);
  std::vector<std::optional<Value>> before = values(model, state);
  for (const Message& message : decision.witness) {
    while (step_timers(model, state, message.time - Duration(1), Tracing{&state.trail}, nullptr).verdict !=
           Verdict::kUndecided) {
    }
    const auto observation = std::make_shared<const Message>(message);
    // What is waited for before the observation that decides is what was owed.
    e.owed = standing(model, state).says;
    step_alone(model, state, message, {&state.trail, observation}, nullptr);
    std::vector<std::optional<Value>> after = values(model, state);
    Explanation::Step step{.observation = message};
    for (std::size_t i = 0; i < after.size(); ++i) {
      const Datum& datum = origin->data[i];
      if (datum.is_event) {
        if (after[i] && after[i]->as_bool() && *after[i]->as_bool()) step.set.push_back(datum.id);
      } else if (after[i] != before[i]) {
        step.set.push_back(fmt::format("{} = {}", datum.id, after[i] ? value_text(*after[i]) : "unknown"));
      }
    }
    step.is_trigger = decision.since && message.time == *decision.since && state.since == decision.since &&
                      std::find(state.trail.entered_by->begin(), state.trail.entered_by->end(), observation) !=
                          state.trail.entered_by->end();
    step.is_deciding = decision.deciding && message.sequence == decision.deciding->sequence;
    if (step.is_trigger) e.trigger = message;
    before = std::move(after);
    e.steps.push_back(std::move(step));
  }
  if (!decision.deciding) e.owed = standing(model, state).says;
  return e;
}

std::string story(const Explanation& e, std::string_view indent) {
  std::string text;
  const auto line = [&](const std::string& what) { text += fmt::format("{}{}\n", indent, what); };
  if (!e.prose.empty()) line(e.prose);
  line("required: " + e.text);
  // Ticks that only follow each other are one line.
  const auto is_plain_tick = [&](std::size_t i) {
    const Explanation::Step& step = e.steps[i];
    return step.observation.name == "mission.tick" && step.set.empty() && !step.is_trigger && !step.is_deciding;
  };
  std::vector<std::string> told;
  for (std::size_t i = 0; i < e.steps.size(); ++i) {
    const Explanation::Step& step = e.steps[i];
    std::string what = "  " + time_text(step.observation.time);
    const std::size_t first = i;
    while (is_plain_tick(first) && i + 1 < e.steps.size() && is_plain_tick(i + 1)) ++i;
    if (i > first) what += " to " + time_text(e.steps[i].observation.time);
    what += "  " + step.observation.name;
    if (i > first) what += fmt::format(", {} times", i - first + 1);
    if (!step.observation.source.empty() && step.observation.source != "mission")
      what += " of " + step.observation.source;
    std::string set;
    for (const std::string& one : step.set) set += (set.empty() ? ": " : ", ") + one;
    what += set;
    if (step.is_trigger) what += "  ← from here on it " + e.owed;
    if (step.is_deciding) what += std::string("  ← ") + std::string(to_string(e.verdict));
    told.push_back(std::move(what));
  }
  constexpr std::size_t kEnd = 3;
  for (std::size_t i = 0; i < told.size(); ++i) {
    // The beginning and the end tell most.
    if (told.size() > kStoryStepsMax && i == kStoryStepsMax - kEnd) {
      line(fmt::format("  … {} more (--json has all)", told.size() - kStoryStepsMax));
      i = told.size() - kEnd;
    }
    line(told[i]);
  }
  if (!e.deciding)
    line(fmt::format("  {}  nothing came: the deadline passed, and the requirement {}", time_text(e.detected), e.owed));
  std::string where;
  if (e.triggered)
    where = fmt::format("owed since {}{}; ", time_text(*e.triggered),
                        e.bound.empty() ? "" : fmt::format(", {} long", e.bound));
  where += "decided at " + time_text(e.detected);
  if (!e.leaf.empty()) where += fmt::format(" while {} was at work", e.leaf);
  line(where);
  if (!e.complete) line("(the history before was too long to keep)");
  return text;
}

Value to_value(const Explanation& e) {
  Map map{{"requirement", e.requirement},
          {"severity", to_string(e.importance)},
          {"prose", e.prose},
          {"text", e.text},
          {"place", to_string(e.place)},
          {"verdict", to_string(e.verdict)},
          {"number", static_cast<std::int64_t>(e.number)},
          {"detected", seconds(e.detected)}};
  if (e.triggered) map["triggered"] = seconds(*e.triggered);
  if (e.trigger) map["trigger"] = message_value(*e.trigger);
  if (e.deadline) map["deadline"] = seconds(*e.deadline);
  if (!e.bound.empty()) map["bound"] = e.bound;
  if (!e.owed.empty()) map["waited_for"] = e.owed;
  if (e.deciding)
    map["deciding"] = message_value(*e.deciding);
  else
    map["deciding"] = nullptr;
  if (!e.leaf.empty()) map["leaf"] = e.leaf;
  List steps;
  for (const Explanation::Step& step : e.steps) {
    Map entry{{"observation", message_value(step.observation)}};
    List set;
    for (const std::string& one : step.set) set.push_back(one);
    entry["sets"] = std::move(set);
    if (step.is_trigger) entry["role"] = "trigger";
    if (step.is_deciding) entry["role"] = "deciding";
    steps.push_back(std::move(entry));
  }
  map["steps"] = std::move(steps);
  map["complete"] = e.complete;
  return map;
}

}  // namespace sentree::monitor
