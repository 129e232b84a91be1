#include "sentree/campaign/detail/shrink.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "sentree/project/scenario_text.h"

namespace sentree::campaign {

namespace {

using text::YamlNode;

bool shows(const Runner::Executed& executed, const std::string& property) {
  if (!executed.report || !executed.report->error.empty() || !executed.report->given_up.empty()) return false;
  if (property == "mission") return executed.report->mission == bt::Status::kFailure;
  return executed.violated_at.contains(property);
}

// Rounder ones, the roundest first.
std::vector<std::string> rounder(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || !std::isfinite(number)) return {};
  std::vector<std::string> out;
  for (int digits = 1; digits <= 3; ++digits) {
    std::string round = fmt::format("{:.{}g}", number, digits) + end;
    // 2e+02 as people write it.
    if (round.find('e') != std::string::npos) round = fmt::format("{:g}", std::strtod(round.c_str(), nullptr)) + end;
    if (round == text) break;
    out.push_back(std::move(round));
  }
  return out;
}

class Shrinking {
 public:
  Shrinking(Runner& runner, const std::string& property) : runner_(runner), property_(property) {}

  std::optional<Least> operator()(const Draw& draw) {
    if (!tried(draw)) return std::nullopt;
    shorten();
    remove();
    round();
    if (best_.draw.seed != 1) {
      Draw other = best_.draw;
      other.seed = 1;
      (void)tried(other);
    }
    shorten();
    best_.tried = runs_;
    return std::move(best_);
  }

 private:
  bool tried(const Draw& draw) {
    if (runs_ >= kShrinkRunsMax || runner_.spoilt()) return false;
    ++runs_;
    Runner::Executed executed = runner_.execute(draw);
    if (!shows(executed, property_)) return false;
    best_.draw = draw;
    best_.executed = std::move(executed);
    return true;
  }

  void shorten() {
    const double shown =
        property_ == "mission" ? seconds(best_.executed.report->ended) : best_.executed.violated_at.at(property_);
    Draw shorter = best_.draw;
    shorter.duration = std::min(shorter.duration, from_seconds(std::floor(shown) + 1.0));
    if (shorter.duration < best_.draw.duration) (void)tried(shorter);
  }

  template <class Place>
  bool without(Place&& place) {
    if (!place(best_.draw)) return false;
    Draw less = best_.draw;
    place(less).reset();
    return tried(less);
  }

  void remove() {
    const std::size_t events = best_.draw.events.size();
    const std::size_t parameters = best_.draw.parameters.size();
    Draw bare = best_.draw;
    for (auto& parameter : bare.parameters) parameter.reset();
    (void)tried(bare);
    for (bool less = true; less;) {
      less = false;
      for (std::size_t i = 0; i < events; ++i)
        less = without([i](Draw & draw) -> auto& { return draw.events[i]; }) || less;
      for (std::size_t i = 0; i < parameters; ++i)
        less = without([i](Draw & draw) -> auto& { return draw.parameters[i]; }) || less;
    }
  }

  // Every number of what is left, one by one.
  void round() {
    for (std::size_t i = 0; i < best_.draw.parameters.size(); ++i)
      round_in([i](Draw & draw) -> auto& { return draw.parameters[i]; });
    for (std::size_t i = 0; i < best_.draw.events.size(); ++i)
      round_in([i](Draw & draw) -> auto& { return draw.events[i]; });
  }

  template <class Place>
  void round_in(Place&& place) {
    if (!place(best_.draw)) return;
    std::vector<std::vector<std::size_t>> paths;
    std::vector<std::size_t> path;
    find_scalars(*place(best_.draw), path, paths);
    for (const auto& at : paths) {
      const YamlNode* node = node_at(*place(best_.draw), at);
      for (const std::string& candidate : rounder(node->scalar)) {
        Draw rounded = best_.draw;
        node_at(*place(rounded), at)->scalar = candidate;
        if (tried(rounded)) break;
      }
    }
  }

  static void find_scalars(const YamlNode& node, std::vector<std::size_t>& path,
                           std::vector<std::vector<std::size_t>>& paths) {
    if (node.is_scalar() && !node.quoted) paths.push_back(path);
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      path.push_back(i);
      find_scalars(node.items[i], path, paths);
      path.pop_back();
    }
    for (std::size_t i = 0; i < node.entries.size(); ++i) {
      path.push_back(i);
      find_scalars(node.entries[i].second, path, paths);
      path.pop_back();
    }
  }
  static YamlNode* node_at(YamlNode& node, const std::vector<std::size_t>& path) {
    YamlNode* at = &node;
    for (const std::size_t i : path) at = at->is_sequence() ? &at->items[i] : &at->entries[i].second;
    return at;
  }

  Runner& runner_;
  const std::string& property_;
  Least best_;
  std::uint64_t runs_ = 0;
};

}  // namespace

std::optional<Least> shrink(Runner& runner, const Draw& draw, const std::string& property) {
  return Shrinking(runner, property)(draw);
}

std::string least_text(const Runner& runner, const Least& least, const std::string& about, const std::string& project) {
  auto scenario = scenario_of(runner.base(), runner.vary(), least.draw);
  if (!scenario.ok()) return {};
  YamlNode& source = scenario.value->source;
  source.kind = YamlNode::Kind::kMapping;
  std::erase_if(source.entries, [](const auto& entry) { return entry.first.scalar == "description"; });
  YamlNode key;
  YamlNode value;
  key.kind = value.kind = YamlNode::Kind::kScalar;
  key.scalar = "description";
  value.scalar = about;
  value.quoted = true;
  source.entries.emplace_back(std::move(key), std::move(value));
  project::RunOutcome outcome;
  const runtime::RunReport& report = *least.executed.report;
  outcome.mission = std::string(to_string(report.mission));
  if (outcome.mission == "IDLE") outcome.mission.clear();
  for (const runtime::MonitorReport& monitor : report.monitors)
    outcome.verdicts[monitor.name] = std::string(to_string(monitor.verdict));
  return project::scenario_text(*scenario.value, {}, outcome, project);
}

}  // namespace sentree::campaign
