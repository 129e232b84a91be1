#include "sentree/studio/detail/past.h"

#include <algorithm>

#include "sentree/monitor/monitor_set.h"
#include "sentree/monitor/requirement.h"
#include "sentree/project/requirements.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/studio/detail/design_values.h"

namespace sentree::studio {

namespace fs = std::filesystem;

void Past::look(const project::Plan& plan) {
  std::vector<Recording> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(runs_, error)) {
    std::error_code each;
    if (entry.path().extension() != ".mcap" || entry.is_symlink(each) || !entry.is_regular_file(each)) continue;
    Recording recording;
    recording.path = entry.path();
    recording.written = entry.last_write_time(each);
    recording.size = entry.file_size(each);
    if (!each) found.push_back(std::move(recording));
  }
  std::sort(found.begin(), found.end(), [](const Recording& a, const Recording& b) {
    return a.written != b.written ? a.written > b.written : a.path > b.path;
  });
  if (found.size() > kPastRunsMax) found.resize(kPastRunsMax);
  for (Recording& recording : found) {
    const auto known = std::find_if(recordings_.begin(), recordings_.end(), [&](const Recording& before) {
      return before.path == recording.path && before.written == recording.written && before.size == recording.size;
    });
    if (known != recordings_.end())
      recording = std::move(*known);
    else
      read(recording, plan);
  }
  recordings_ = std::move(found);
}

void Past::read(Recording& recording, const project::Plan& plan) {
  if (recording.size > kPastBytesMax) {
    recording.problem = "it is too large to be judged while one types; see sentree monitor check";
    return;
  }
  auto run = replay::RecordedRun::open(recording.path.string());
  if (!run) {
    recording.problem = run.error().message;
    return;
  }
  const auto done = run->each([&](Message message) {
    replay::restore_numbers(plan, message);
    recording.observations.push_back(std::make_shared<const Message>(std::move(message)));
    return recording.observations.size() < kPastObservationsMax;
  });
  recording.ended = run->ended();
  recording.judged_until = run->judged_until();
  if (!done) recording.problem = done.error().message;
  if (recording.observations.size() >= kPastObservationsMax)
    recording.problem = "it has too many observations to be judged while one types; see sentree monitor check";
  if (!recording.problem.empty()) recording.observations = {};
}

Value Past::judge(const std::string& file, const std::string& text, const project::Plan& plan) {
  look(plan);
  const auto vocabulary = project::vocabulary_of(plan);
  const auto parsed = monitor::parse_requirements(text, file);
  std::vector<monitor::Model> models;
  List requirements;
  if (parsed.ok()) {
    for (const monitor::Requirement& requirement : parsed.value->requirements) {
      auto model = monitor::Model::make(requirement, &vocabulary);
      if (!model.ok()) continue;
      requirements.push_back(Map{{"name", model.value->name()},
                                 {"line", static_cast<std::int64_t>(requirement.span.line)},
                                 {"chart", chart_value(model.value->chart())},
                                 {"violated", List()}});
      models.push_back(std::move(*model.value));
    }
  }
  List runs;
  for (const Recording& recording : recordings_) {
    runs.push_back(Map{{"name", recording.path.stem().string()},
                       {"ended", recording.ended.time_since_epoch().count()},
                       {"problem", recording.problem}});
    std::vector<Value> first(models.size());
    monitor::MonitorSet set(models, TimePoint{});
    std::vector<monitor::MonitorSet::Decided> news;
    const auto take = [&] {
      for (const auto& decided : news) {
        if (decided.decision.verdict == monitor::Verdict::kViolated && first[decided.monitor].is_null())
          first[decided.monitor] = decided.decision.at.time_since_epoch().count();
      }
      news.clear();
    };
    if (recording.problem.empty()) {
      for (const auto& message : recording.observations) {
        set.observe(message, news);
        take();
      }
      set.advance(recording.judged_until, news);
      take();
    }
    for (std::size_t i = 0; i < models.size(); ++i)
      requirements[i].as_map()->find("violated")->as_list()->push_back(std::move(first[i]));
  }
  return Map{
      {"type", "design_past"}, {"file", file}, {"runs", std::move(runs)}, {"requirements", std::move(requirements)}};
}

}  // namespace sentree::studio
