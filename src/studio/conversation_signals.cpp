#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sentree/studio/detail/conversation.h"
#include "sentree/text/json.h"

// Signals: one number of what is observed, or of a part of the state, over time.

namespace sentree::studio {

namespace {

constexpr std::size_t kPathMax = 32;
constexpr std::int64_t kSignalWidthMax = 4000;
// What one slice looks at: some milliseconds.
constexpr std::size_t kObservationsASlice = 50'000;
constexpr std::size_t kValuesASlice = 1'000;
constexpr std::size_t kMomentsASlice = 50;
// Signals that are offered, and entries of a list that are signals each: longer ones are pictures.
constexpr std::size_t kOfferedMax = 2'000;
constexpr std::size_t kEntriesMax = 16;

std::optional<double> number_in(const Value* value, const std::vector<std::string>& path, std::size_t at) {
  for (; value != nullptr && at < path.size(); ++at) {
    const std::string& key = path[at];
    if (const List* const list = value->as_list()) {
      std::size_t place = 0;
      for (const char c : key)
        place = c >= '0' && c <= '9' && place < list->size() ? 10 * place + (c - '0') : list->size();
      value = !key.empty() && place < list->size() ? &(*list)[place] : nullptr;
    } else {
      value = value->find(key);
    }
  }
  if (value == nullptr) return std::nullopt;
  if (value->as_bool() != nullptr) return *value->as_bool() ? 1.0 : 0.0;
  return value->is_number() && std::isfinite(value->number()) ? std::optional(value->number()) : std::nullopt;
}

// Adds the ways to the numbers and truth values of some data.
void offer_numbers(const Value& value, List& path, List& offered) {
  if (offered.size() >= kOfferedMax || path.size() > kPathMax) return;
  const auto inside = [&](std::string key, const Value& part) {
    path.emplace_back(std::move(key));
    offer_numbers(part, path, offered);
    path.pop_back();
  };
  if (value.as_bool() != nullptr || value.is_number()) {
    offered.emplace_back(path);
  } else if (const Map* const map = value.as_map()) {
    for (const auto& [key, part] : *map) inside(key, part);
  } else if (const List* const list = value.as_list(); list != nullptr && list->size() <= kEntriesMax) {
    for (std::size_t i = 0; i < list->size(); ++i) inside(std::to_string(i), (*list)[i]);
  }
}

// The part of the state that a path begins with, and where in the path its inside begins.
std::optional<std::pair<History::PartId, std::size_t>> part_of(const Subject& subject,
                                                               const std::vector<std::string>& path) {
  const std::string& group = path.front();
  if (group == "blackboard") return std::pair(History::PartId{History::Part::kBlackboard, 0}, std::size_t{1});
  const auto found = [](History::Part part, std::size_t index) {
    return index == Subject::kNone ? std::nullopt
                                   : std::optional(std::pair(History::PartId{part, index}, std::size_t{2}));
  };
  if (path.size() < 2) return std::nullopt;
  if (group == "robots") return found(History::Part::kRobot, subject.robot_index(path[1]));
  if (group == "charts") {
    const auto chart = subject.charts_by_id.find(path[1]);
    return found(History::Part::kChart, chart != subject.charts_by_id.end() ? chart->second : Subject::kNone);
  }
  return std::nullopt;
}

// Older recordings do not hold the data of monitors.
bool has_data(const History& history, std::size_t chart) {
  std::string json;
  history.append(json, {History::Part::kChart, chart}, history.end());
  const auto state = json.empty() ? Result<Value>(Value()) : text::parse_json(json);
  return state && state->find("data") != nullptr;
}

}  // namespace

void SignalPoints::add(Nanoseconds time, double value) {
  const std::int64_t pixel = (time - from) / std::max<Nanoseconds>((to - from) / width, 1);
  if (pixels.empty() || pixels.back().pixel != pixel) {
    pixels.push_back({pixel, {time, value}, {time, value}, {time, value}, {time, value}});
    return;
  }
  Pixel& last = pixels.back();
  if (value < last.least.second) last.least = {time, value};
  if (value > last.most.second) last.most = {time, value};
  last.last = {time, value};
}

List SignalPoints::take() const {
  List points;
  for (const Pixel& pixel : pixels) {
    std::array<Point, 4> some{pixel.first, pixel.least, pixel.most, pixel.last};
    std::stable_sort(some.begin(), some.end(), [](const Point& a, const Point& b) { return a.first < b.first; });
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (i > 0 && some[i] == some[i - 1]) continue;
      points.push_back(List{some[i].first, some[i].second});
    }
  }
  return points;
}

// True: it is answered.
bool Conversation::advance_signal(Request& request) {
  const History& history = composer_->history;
  SignalPoints& points = request.points;
  if (!request.begun) {
    request.begun = true;
    request.path.clear();
    points.pixels.clear();
    if (const Value* path = request.body.find("path"); path != nullptr && path->as_list() != nullptr) {
      for (const Value& key : *path->as_list()) request.path.emplace_back(key.text());
    }
    const auto time = [&](std::string_view name, Nanoseconds otherwise) {
      const Value* value = request.body.find(name);
      return value != nullptr && value->as_int() != nullptr ? *value->as_int() : otherwise;
    };
    points.from = std::max(time("from", history.begin()), history.begin());
    points.to = std::max(std::min(time("to", history.end()), history.end()), points.from + 1);
    points.width = std::clamp<std::int64_t>(time("width", 1000), 1, kSignalWidthMax);
    if (request.path.size() < 2 || request.path.size() > kPathMax) {
      refuse(request.id, "a signal is a path: messages, charts, robots or blackboard, which one, and what of it");
      return true;
    }
    request.filter = {.name = request.path[1]};
    request.position = request.path[0] == "messages" ? history.after_time(points.from - 1) : 0;
  }
  if (request.path[0] == "messages") {
    std::size_t values = 0;
    for (std::size_t left = kObservationsASlice; left > 0 && values < kValuesASlice;) {
      const History::Found found = history.find(request.filter, request.position, true, left);
      left -= std::min(left, std::max<std::size_t>(found.next - std::min(found.next, request.position), 1));
      request.position = found.next;
      if (!found.position) {
        if (!found.at_end) continue;
        answer(request.id, Map{{"points", points.take()}});
        return true;
      }
      ++values;
      const auto message = text::parse_json(history.observation(*found.position));
      const Value* const when = message ? message->find("time") : nullptr;
      if (when == nullptr || when->as_int() == nullptr) continue;
      if (*when->as_int() > points.to) {
        answer(request.id, Map{{"points", points.take()}});
        return true;
      }
      if (const auto number = number_in(message->find("data"), request.path, 2)) points.add(*when->as_int(), *number);
    }
    return false;
  }
  const auto part = part_of(composer_->subject, request.path);
  if (!part) {
    refuse(request.id, fmt::format("there is no {} \"{}\"", request.path[0], request.path[1]));
    return true;
  }
  const Nanoseconds span = points.to - points.from;
  for (std::size_t i = 0; i < kMomentsASlice; ++i, ++request.position) {
    if (request.position > static_cast<std::size_t>(points.width)) {
      answer(request.id, Map{{"points", points.take()}});
      return true;
    }
    const Nanoseconds time =
        points.from + static_cast<Nanoseconds>(static_cast<double>(span) * static_cast<double>(request.position) /
                                               static_cast<double>(points.width));
    std::string json;
    history.append(json, part->first, time);
    const auto value = json.empty() ? Result<Value>(Value()) : text::parse_json(json);
    if (!value) continue;
    if (const auto number = number_in(&*value, request.path, part->second)) points.add(time, *number);
  }
  return false;
}

// What the newest observation of each name has, and the data of charts. True: it is answered.
bool Conversation::advance_signals(Request& request) {
  const History& history = composer_->history;
  if (!request.begun) {
    request.begun = true;
    request.names = history.names();
    request.position = history.end_observation();
    request.offered.clear();
    const auto& charts = composer_->subject.charts;
    for (std::size_t i = 0; i < charts.size(); ++i) {
      const ShownChart& chart = charts[i];
      if (chart.is_monitor && !has_data(history, i)) continue;
      for (const scxml::DataItem& item : chart.chart.data())
        request.offered.push_back(List{"charts", chart.id, "data", item.id});
    }
  }
  for (std::size_t left = kObservationsASlice; left > 0 && !request.names.empty();) {
    const History::Found found = history.find({.name = request.names.back()}, request.position, false, left);
    left -= std::min(left, std::max<std::size_t>(request.position - std::min(found.next, request.position), 1));
    request.position = found.next;
    if (!found.position && !found.at_end) continue;
    const auto message =
        found.position ? text::parse_json(history.observation(*found.position)) : Result<Value>(Value());
    List path{"messages", request.names.back()};
    if (const Value* const data = message ? message->find("data") : nullptr)
      offer_numbers(*data, path, request.offered);
    request.names.pop_back();
    request.position = history.end_observation();
  }
  if (!request.names.empty()) return false;
  answer(request.id, Map{{"paths", std::move(request.offered)}});
  return true;
}

}  // namespace sentree::studio
