#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "sentree/draw/chart.h"
#include "sentree/project/plan.h"

namespace sentree::studio {

/// A chart that the page shows: a skill's or a monitor's.
struct ShownChart {
  std::string id;  ///< "skill:GoToKitchen", "monitor:battery".
  bool is_monitor = false;
  std::string name;  ///< Of the leaf or the monitor.
  scxml::Chart chart;
  draw::Chart drawing;
  std::unordered_map<std::string, int> drawn_states;  ///< By state id: its place in the drawing.
};

struct ShownMonitor {
  std::string name;
  const monitor::Model* model = nullptr;  ///< Null: it runs in another process.
};

/// What a run consists of, as far as the page shows it. Does not change while it goes on.
struct Subject {
  /// `plan` is borrowed.
  explicit Subject(const project::Plan& plan);

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  [[nodiscard]] std::size_t skill_chart(std::string_view leaf) const;
  [[nodiscard]] std::size_t monitor_index(std::string_view name) const;
  [[nodiscard]] std::size_t robot_index(std::string_view name) const;
  [[nodiscard]] bool is_leaf(std::string_view name) const { return leaves.contains(name); }

  const project::Plan& plan;
  std::vector<ShownChart> charts;  ///< Of the leaves, in the order of the tree, then of the monitors.
  std::vector<ShownMonitor> monitors;
  std::vector<std::string> robots;
  std::map<std::string, std::size_t, std::less<>> charts_by_id;
  std::map<std::string, bt::NodeId, std::less<>> leaves;  ///< Nodes, by the name of the leaf in messages.
};

/// The `model` message of docs/studio-protocol.md.
[[nodiscard]] std::string model_message(const Subject& subject, bool steerable);

/// The tree with the descendants of some nodes left out, and which nodes are left: for `layout`.
[[nodiscard]] Value folded_layout(const Subject& subject, const std::vector<bt::NodeId>& collapsed);

/// A chart in which the states of these ids hide what is in them: for `fold_chart`. Null: there is no such chart.
[[nodiscard]] Value folded_chart(const Subject& subject, std::string_view chart, const std::set<std::string>& closed);

/// The map's cells as octets, row by row from the bottom: 0 free to 100 occupied, 255 unknown. Empty without a world.
[[nodiscard]] std::string map_octets(const Subject& subject);

}  // namespace sentree::studio
