#include <fmt/format.h>

#include <algorithm>

#include "sentree/studio/detail/history_impl.h"

// The timeline: what was when, merged to what a picture of some width can show.

namespace sentree::studio {

namespace {

// Makes spans of values in time. What changes faster than a pixel is shown, pixel by pixel, as what held longest.
class Spans {
 public:
  Spans(Nanoseconds from, Nanoseconds to, int width)
      : from_(from), to_(to), pixel_(std::max<Nanoseconds>((to - from) / std::max(width, 1), 1)) {}

  /// From the time of the last one on, until `until`, it was this; an empty label is a gap.
  void add(Nanoseconds since, Nanoseconds until, std::string_view label) {
    since = std::max(since, from_);
    until = std::min(until, to_);
    if (until <= since) return;
    if (until - since >= pixel_) {
      flush();
      emit(since, until, label);
      return;
    }
    if (!shares_.empty() && until - pending_from_ > pixel_) flush();
    if (shares_.empty()) pending_from_ = since;
    pending_to_ = until;
    for (auto& [known, share] : shares_) {
      if (known == label) {
        share += until - since;
        return;
      }
    }
    shares_.emplace_back(label, until - since);
  }

  [[nodiscard]] List take() {
    flush();
    List list;
    for (const Span& span : spans_) {
      if (!span.label.empty()) list.push_back(List{span.from, span.to, span.label});
    }
    return list;
  }

 private:
  struct Span {
    Nanoseconds from;
    Nanoseconds to;
    std::string label;
  };

  void flush() {
    if (shares_.empty()) return;
    const auto most = std::max_element(shares_.begin(), shares_.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    emit(pending_from_, pending_to_, most->first);
    shares_.clear();
  }

  void emit(Nanoseconds since, Nanoseconds until, std::string_view label) {
    if (!spans_.empty() && spans_.back().label == label && spans_.back().to >= since)
      spans_.back().to = until;
    else
      spans_.push_back({since, until, std::string(label)});
  }

  Nanoseconds from_;
  Nanoseconds to_;
  Nanoseconds pixel_;
  std::vector<Span> spans_;
  std::vector<std::pair<std::string, Nanoseconds>> shares_;  // of the pixel that is being filled
  Nanoseconds pending_from_ = 0;
  Nanoseconds pending_to_ = 0;
};

template <class T, class Label>
List spans_of(const Track<T>& track, Nanoseconds from, Nanoseconds to, int width, Nanoseconds end, Label&& label) {
  Spans spans(from, to, width);
  std::size_t i = track.position(from);
  if (i == Track<T>::npos) i = 0;
  for (; i < track.size() && track[i].time < to; ++i)
    spans.add(track[i].time, i + 1 < track.size() ? track[i + 1].time : std::max(end, track[i].time),
              label(track[i].value));
  return spans.take();
}

// A leaf that a reactive parent resets is idle again in the tick that gave its result: it is shown with that result
// until the next tick, one and a half periods at most.
List leaf_spans(const Track<std::uint8_t>& track, Nanoseconds from, Nanoseconds to, int width, Nanoseconds end,
                Nanoseconds period) {
  Spans spans(from, to, width);
  std::size_t i = track.position(from);
  if (i == Track<std::uint8_t>::npos) i = 0;
  for (; i < track.size() && track[i].time < to; ++i) {
    const Nanoseconds until = i + 1 < track.size() ? track[i + 1].time : std::max(end, track[i].time);
    auto status = static_cast<bt::Status>(track[i].value);
    Nanoseconds shown_until = until;
    if (status == bt::Status::kIdle && i > 0 && is_completed(static_cast<bt::Status>(track[i - 1].value))) {
      status = static_cast<bt::Status>(track[i - 1].value);
      shown_until = std::min(until, track[i].time + period + period / 2);
    }
    spans.add(track[i].time, shown_until, status == bt::Status::kIdle ? std::string_view() : to_string(status));
    spans.add(shown_until, until, {});
  }
  return spans.take();
}

Map lane(std::string id, const char* kind, std::string name, List spans) {
  return Map{{"id", std::move(id)}, {"kind", kind}, {"name", std::move(name)}, {"spans", std::move(spans)}};
}

// One point a pixel, and the extremes.
List points_of(const Track<BatteryValue>& track, Nanoseconds from, Nanoseconds to, int width) {
  const Nanoseconds pixel = std::max<Nanoseconds>((to - from) / std::max(width, 1), 1);
  List points;
  std::size_t i = track.position(from);
  if (i == Track<BatteryValue>::npos) i = 0;
  Nanoseconds last = from - 2 * pixel;
  for (; i < track.size() && track[i].time <= to; ++i) {
    const bool is_last = i + 1 == track.size() || track[i + 1].time > to;
    if (track[i].time - last < pixel && !is_last) continue;
    last = track[i].time;
    points.push_back(List{track[i].time, track[i].value.percentage * 100});
  }
  return points;
}

}  // namespace

Value History::transitions(bt::NodeId node, std::size_t max) const {
  const std::lock_guard lock(impl_->mutex);
  const Track<std::uint8_t>& track = impl_->nodes[node];
  const std::size_t first = track.size() - std::min(track.size(), max);
  List rows;
  for (std::size_t i = first; i < track.size(); ++i)
    rows.push_back(List{track[i].time, to_string(static_cast<bt::Status>(track[i].value))});
  return Map{{"rows", std::move(rows)}, {"left_out", static_cast<std::int64_t>(first)}};
}

Value History::lanes(Nanoseconds from, Nanoseconds to, int width) const {
  List lanes;
  const Impl& impl = *impl_;
  const Nanoseconds end = impl.end;
  const auto status = [](std::uint8_t value) {
    return value == 0 ? std::string_view() : to_string(static_cast<bt::Status>(value));
  };
  const auto add = [&](auto&& make) {
    const std::lock_guard lock(impl.mutex);
    lanes.push_back(make());
  };
  add([&] { return lane("mission", "mission", "mission", spans_of(impl.mission, from, to, width, end, status)); });
  for (const project::LeafPlan& leaf : impl.subject.plan.leaves) {
    add([&] {
      return lane(
          "leaf:" + leaf.name, "leaf", leaf.name,
          leaf_spans(impl.nodes[leaf.node], from, to, width, end, impl.subject.plan.scenario.project.period.count()));
    });
  }
  for (std::size_t i = 0; i < impl.subject.charts.size(); ++i) {
    const ShownChart& chart = impl.subject.charts[i];
    if (chart.is_monitor) continue;
    add([&] {
      return lane(chart.id, "skill", chart.name,
                  spans_of(impl.charts[i], from, to, width, end, [&](const ChartMoment& moment) {
                    return moment.running ? std::string_view(impl.configurations[moment.configuration].label)
                                          : std::string_view();
                  }));
    });
  }
  for (std::size_t i = 0; i < impl.subject.monitors.size(); ++i) {
    const std::string& name = impl.subject.monitors[i].name;
    add([&] {
      return lane("monitor:" + name, "monitor", name,
                  spans_of(impl.monitors[i], from, to, width, end,
                           [](const MonitorMoment& moment) { return to_string(moment.verdict); }));
    });
  }
  for (std::size_t i = 0; i < impl.subject.robots.size(); ++i) {
    const std::string& name = impl.subject.robots[i];
    add([&] {
      return Map{{"id", "battery:" + name},
                 {"kind", "value"},
                 {"name", fmt::format("battery of {} [%]", name)},
                 {"points", points_of(impl.robots[i].battery, from, to, width)}};
    });
  }
  List marks;
  const std::lock_guard lock(impl.mutex);
  constexpr std::size_t kShownMarksMax = 2000;
  std::size_t i = impl.marks.position(from - 1);
  for (i = i == Track<Mark>::npos ? 0 : i + 1; i < impl.marks.size() && impl.marks[i].time <= to; ++i) {
    if (marks.size() >= kShownMarksMax) break;
    const Mark& mark = impl.marks[i].value;
    Map said{{"time", impl.marks[i].time},
             {"kind", mark.kind},
             {"text", mark.text},
             {"sequence", static_cast<std::int64_t>(mark.sequence)}};
    if (mark.from) said["from"] = *mark.from;
    marks.emplace_back(std::move(said));
  }
  return Map{{"lanes", std::move(lanes)}, {"marks", std::move(marks)}};
}

}  // namespace sentree::studio
