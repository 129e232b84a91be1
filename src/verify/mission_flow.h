#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/project/plan.h"
#include "sentree/verify/reply_flow.h"

namespace sentree::verify {

/// Where replies of one service go in a mission: into the charts that get them, and through the blackboard into others.
class MissionFlow {
 public:
  /// @param calls  Leaves, in the order of the plan's, that call the service.
  /// Plan and types must outlive it. Cost: O(size of the charts · entries that replies go into).
  MissionFlow(const project::Plan& plan, std::string service, const ReplyTypes& types, const std::vector<bool>& calls);

  /// Of a leaf; null: no reply comes to it.
  [[nodiscard]] const ReplyFlow* of(std::size_t leaf) const { return flows_[leaf] ? &*flows_[leaf] : nullptr; }
  /// A node of the tree that makes something of what a reply has left on the blackboard: verify.any-reply.
  [[nodiscard]] std::optional<Diagnostic> trouble() const;

 private:
  [[nodiscard]] std::string mentioned(std::string_view text) const;
  [[nodiscard]] Diagnostic told(bt::NodeId node, const std::string& entry) const;
  void follow(std::size_t leaf, bool calls);
  void follow(bt::NodeId node);
  void add(const std::string& entry);

  const project::Plan& plan_;
  std::string service_;
  const ReplyTypes& types_;
  std::set<bt::NodeId> charted_;                 // leaves of which there is a chart
  std::vector<std::optional<ReplyFlow>> flows_;  // by leaf
  std::vector<std::set<std::string>> far_;       // ports, by leaf
  std::set<std::string> entries_;                // of all blackboards alike
};

}  // namespace sentree::verify
