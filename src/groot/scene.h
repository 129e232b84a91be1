#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/groot/groot1.h"
#include "sentree/groot/groot2.h"

namespace sentree::groot {

/// What both Groots see at present: a tree, the statuses of its nodes, its blackboard. Filled by whoever executes the
/// tree, asked by who serves Groot; from any thread. Nobody waits longer than for a copy.
class Scene {
 public:
  /// Changes that wait to be told to Groot 1; where there are more, each node's last one is told.
  static constexpr std::size_t kUpdateMax = 10'000;

  // --- For who executes the tree ------------------------------------------------------------------------------------

  /// Another tree from now on, all nodes idle.
  /// @param id  Another for each.
  void begin(TreeImage image, const TreeId& id);
  void changed(const Change& change);
  /// A node was skipped, which changes no status.
  void skipped(bt::NodeId node, std::int64_t at_us);
  /// All entries, as `boards` gives them.
  void blackboard(Value entries);

  // --- For who serves it --------------------------------------------------------------------------------------------

  /// A tree has begun.
  [[nodiscard]] bool has_tree() const;
  [[nodiscard]] TreeId id() const;
  [[nodiscard]] std::size_t nodes() const;
  [[nodiscard]] std::string xml() const;
  [[nodiscard]] std::string groot1_tree() const;
  /// What has changed since the last call; empty: nothing.
  [[nodiscard]] std::string take_update();
  [[nodiscard]] std::string statuses() const;
  /// The blackboards of those names, joined by ';', by name; null if there is none of them.
  [[nodiscard]] Value boards(std::string_view names) const;
  /// The recording begins, or ends.
  void record(bool on, std::int64_t now_us);
  /// What was recorded since the last call.
  [[nodiscard]] std::string take_records();

 private:
  void keep(bt::NodeId node, std::int64_t at_us, bt::Status status);

  mutable std::mutex mutex_;
  TreeImage image_;
  TreeId id_{};
  std::vector<bt::Status> statuses_;
  std::vector<StatusCode> codes_;
  std::vector<bt::Status> told_;  // to Groot 1
  std::vector<Change> changes_;   // since then
  Value entries_;
  bool recording_ = false;
  std::int64_t record_from_us_ = 0;
  std::deque<Record> records_;
};

}  // namespace sentree::groot
