#include "sentree/studio/detail/simulations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sentree/bt/status.h"
#include "sentree/design/findings.h"
#include "sentree/graph/chart.h"
#include "sentree/project/mission_tree.h"
#include "sentree/scxml/model.h"
#include "sentree/text/file.h"

namespace sentree::studio {

namespace {

std::string request_text(const Value& request, std::string_view name) {
  const Value* value = request.find(name);
  return value != nullptr && value->as_string() != nullptr ? *value->as_string() : std::string();
}

std::int64_t ns(TimePoint time) { return time.time_since_epoch().count(); }

// Keeps the newest.
template <class Kept>
void keep_few(Kept& kept, std::size_t max) {
  while (kept.size() > max) {
    kept.erase(std::min_element(kept.begin(), kept.end(),
                                [](const auto& a, const auto& b) { return a.second.used < b.second.used; }));
  }
}

}  // namespace

Result<void> Simulations::begin(PlayedChart& played, const Text& text) const {
  scxml::LoadOptions options;
  options.read = [below = (folder_ / text.file).parent_path()](std::string_view uri) -> Result<std::string> {
    return text::read_file(below / (uri.starts_with("file:") ? uri.substr(5) : uri), std::string(uri));
  };
  auto loaded = scxml::load(text.text, text.file, options);
  if (!loaded.ok()) {
    const auto error = std::find_if(loaded.diagnostics.begin(), loaded.diagnostics.end(),
                                    [](const Diagnostic& d) { return d.severity == Severity::kError; });
    return tl::unexpected(*error);
  }
  auto player = std::make_unique<ChartPlayer>(*loaded.value, host_for(*loaded.value, options), 1, kScriptMax);
  auto trace = player->start(played.data);
  if (!trace) return tl::unexpected(trace.error());
  played.trace = std::move(*trace);
  played.player = std::move(player);
  played.version = text.version;
  return {};
}

// What was done once more, with another text; what does not go any more, and all behind it, is forgotten.
Result<void> Simulations::redo(PlayedChart& played, const Text& text) const {
  if (auto begun = begin(played, text); !begun) return begun;
  for (std::size_t i = 0; i < played.steps.size(); ++i) {
    const ChartStep& step = played.steps[i];
    auto trace = step.is_wait ? played.player->wait(step.time) : played.player->send(step.event);
    if (!trace) {
      played.steps.resize(i);
      break;
    }
    played.trace = std::move(*trace);
  }
  return {};
}

Result<Value> Simulations::chart(const Text& text, const Value& request) {
  const std::string what = request_text(request, "do");
  const auto known = charts_.find(text.file);
  PlayedChart& played = charts_[text.file];
  played.used = ++uses_;
  if (known == charts_.end() || what == "start") {
    played.steps.clear();
    if (const Value* data = request.find("data"); data != nullptr && data->as_map() != nullptr)
      played.data = *data->as_map();
    if (auto begun = begin(played, text); !begun) {
      charts_.erase(text.file);
      return tl::unexpected(begun.error());
    }
    keep_few(charts_, kKeptMax);
  } else if (played.version != text.version) {
    if (auto done = redo(played, text); !done) return tl::unexpected(done.error());
  }
  if (what == "send" || what == "wait") {
    if (played.steps.size() == kStepsMax)
      return fail("simulate.too-many", fmt::format("more than {} steps; begin again", kStepsMax));
    ChartStep step{.is_wait = what == "wait", .event = {}, .time = {}};
    if (step.is_wait) {
      const Value* time = request.find("time");
      const double given = time != nullptr && time->is_number() ? time->number() : -1;
      constexpr double kWaitMax_ns = 1e9 * 3600 * 24 * 365;
      if (!(given >= 0 && given <= kWaitMax_ns)) return fail("studio.request", "wait for how long?");
      step.time = Duration(static_cast<std::int64_t>(given));
    } else {
      step.event.name = request_text(request, "event");
      if (step.event.name.empty()) return fail("studio.request", "which event?");
      // SCXML 6.2.5: what prevents delivery is an event of the platform.
      if (step.event.name.starts_with("error.")) step.event.type = scxml::EventType::kPlatform;
      if (const Value* data = request.find("data"); data != nullptr && !data->is_null()) step.event.data = *data;
    }
    auto trace = step.is_wait ? played.player->wait(step.time) : played.player->send(step.event);
    if (!trace) return tl::unexpected(trace.error());
    played.trace = std::move(*trace);
    played.steps.push_back(std::move(step));
  } else if (what == "back") {
    if (auto done = played.player->back(1); !done) return tl::unexpected(done.error());
    if (!played.steps.empty()) played.steps.pop_back();
    played.trace = {};
  } else if (what != "start" && what != "look") {
    return fail("studio.request", fmt::format("\"{}\" is nothing that can be done to a chart", what));
  }
  return shown(played);
}

Value Simulations::shown(const PlayedChart& played) {
  const ChartPlayer& player = *played.player;
  std::vector<scxml::StateIndex> states;
  std::vector<scxml::TransitionIndex> transitions;
  const draw::Chart drawing =
      graph::drawing_of(player.chart(), &player.session(), scxml::kNoTransition, &states, &transitions);
  List active;
  for (std::size_t i = 0; i < drawing.states.size(); ++i) {
    if (drawing.states[i].active) active.push_back(static_cast<std::int64_t>(i));
  }
  List enabled;
  List taken;
  std::vector<int> lines;
  for (const ChartTrace::Entry& entry : played.trace.entries) {
    const Value* line = entry.what == "transition" ? entry.data.find("line") : nullptr;
    if (line != nullptr && line->as_int() != nullptr) lines.push_back(static_cast<int>(*line->as_int()));
  }
  for (std::size_t i = 0; i < transitions.size(); ++i) {
    const scxml::Transition& transition = player.chart().transitions()[transitions[i]];
    const auto place = static_cast<std::int64_t>(i);
    if (std::find(lines.begin(), lines.end(), transition.place.line) != lines.end()) taken.push_back(place);
    if (!player.session().running() || (transition.source != 0 && !player.session().is_active(transition.source)))
      continue;
    for (const std::string& event : transition.events)
      enabled.push_back(Map{{"event", event}, {"transition", place}, {"condition", transition.condition}});
  }
  List timers;
  for (const scxml::Timer& timer : player.session().timers())
    timers.push_back(Map{{"due", ns(timer.due)}, {"event", timer.event.name}});
  List trace;
  for (const ChartTrace::Entry& entry : played.trace.entries)
    trace.push_back(Map{{"what", entry.what}, {"time", ns(entry.at)}, {"text", entry.text}});
  List steps;
  for (const ChartStep& step : played.steps) {
    steps.push_back(Map{{"event", step.is_wait ? Value() : Value(step.event.name)},
                        {"data", step.event.data ? *step.event.data : Value()},
                        {"time", step.time.count()}});
  }
  // What is undefined can be given a value to begin with, too.
  Map data;
  for (const scxml::DataItem& item : player.chart().data()) data[item.id] = Value();
  for (auto& [name, value] : player.session().data(player.chart())) data[name] = value;
  const auto& failure = player.session().failure();
  return Map{{"version", static_cast<std::int64_t>(played.version)},
             {"time", ns(player.now())},
             {"status", to_string(player.session().status())},
             {"failure", failure ? to_string(*failure) : std::string()},
             {"active", std::move(active)},
             {"taken", std::move(taken)},
             {"enabled", std::move(enabled)},
             {"timers", std::move(timers)},
             {"data", std::move(data)},
             {"trace", std::move(trace)},
             {"steps", std::move(steps)}};
}

Result<Value> Simulations::tree(const Text& text, const bt::Palette& palette, const Value& request) {
  const std::string what = request_text(request, "do");
  const std::string id = request_text(request, "tree");
  const auto key = std::pair(text.file, id);
  auto played = trees_.find(key);
  const bool anew = played == trees_.end() || what == "start";
  if (anew || played->second.version != text.version) {
    const auto project = project::load_project(folder_);
    auto player = TreePlayer::start(
        text.text, text.file, id, palette, anew ? std::map<std::string, bt::Status>() : played->second.player.answers(),
        project.ok() ? project::start_entries(*project.value) : std::vector<bt::StartEntry>());
    if (!player) return tl::unexpected(player.error());
    if (played != trees_.end()) trees_.erase(played);
    played = trees_.emplace(key, PlayedTree{text.version, std::move(*player), 0}).first;
  }
  played->second.used = ++uses_;
  keep_few(trees_, kKeptMax);
  TreePlayer& player = played->second.player;
  Result<void> done;
  if (what == "answer") {
    const std::string status = request_text(request, "status");
    const bt::Status given = status == "SUCCESS"   ? bt::Status::kSuccess
                             : status == "FAILURE" ? bt::Status::kFailure
                             : status == "RUNNING" ? bt::Status::kRunning
                                                   : bt::Status::kIdle;
    if (given == bt::Status::kIdle) return fail("studio.request", fmt::format("\"{}\" is no answer of a leaf", status));
    done = player.answer(request_text(request, "leaf"), given);
  } else if (what == "tick") {
    done = player.tick();
  } else if (what == "wait") {
    done = player.wait();
  } else if (what == "back") {
    done = player.back();
  } else if (what != "start" && what != "look") {
    return fail("studio.request", fmt::format("\"{}\" is nothing that can be done to a tree", what));
  }
  if (!done) return tl::unexpected(done.error());
  return shown(played->second, text.text, id);
}

Value Simulations::shown(const PlayedTree& played, const std::string& text, const std::string& tree) {
  const TreePlayer& player = played.player;
  const bt::Tree& model = player.tree();
  List nodes;
  List leaves;
  for (bt::NodeId node = 0; node < model.size(); ++node) {
    const bool is_leaf = model.is_external(node);
    const std::string name = is_leaf ? model.event_name(node) : std::string();
    if (model.definition(node) == tree && model.enclosing_subtree(node) == bt::kNoNode) {
      nodes.push_back(Map{{"at", static_cast<std::int64_t>(design::offset_of(text, model.span(node)))},
                          {"status", to_string(player.said(node))},
                          {"leaf", is_leaf ? Value(name) : Value()}});
    }
    if (is_leaf) {
      leaves.push_back(Map{{"leaf", name},
                           {"name", std::string(model.path(node))},
                           {"condition", model.category(node) == bt::Category::kCondition},
                           {"answer", to_string(player.answer_of(node))},
                           {"status", to_string(player.said(node))}});
    }
  }
  const TimePoint timer = player.next_timer();
  return Map{{"version", static_cast<std::int64_t>(played.version)},
             {"time", ns(player.time())},
             {"timer", timer == kNever ? Value() : Value(ns(timer))},
             {"result", to_string(player.result())},
             {"ticks", static_cast<std::int64_t>(player.ticks())},
             {"back", static_cast<std::int64_t>(player.steps_back())},
             {"nodes", std::move(nodes)},
             {"leaves", std::move(leaves)}};
}

}  // namespace sentree::studio
