#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "sentree/project/plan.h"
#include "sentree/verify/detail/reply_flow.h"

namespace sentree::verify {

/// Where replies of one service go in a mission: into the charts that get them, and through the blackboard into others.
class MissionFlow {
 public:
  /// @param callers  Leaves that call the service.
  /// Plan and types must outlive it. Cost: O(size of the callers' charts); where replies go into the blackboard,
  /// O(size of the mission · entries that they go into).
  MissionFlow(const project::Plan& plan, std::string service, const ReplyTypes& types, std::set<std::size_t> callers);

  /// By leaf, of those to which a reply comes.
  [[nodiscard]] const std::map<std::size_t, ReplyFlow>& flows() const { return flows_; }
  /// A node of the tree that makes something of what a reply has left on the blackboard, or a port of that kind that
  /// somebody looks at: verify.any-reply.
  [[nodiscard]] std::optional<Diagnostic> trouble(const LookedAt& looked_at) const;

 private:
  [[nodiscard]] std::string mentioned(std::string_view text) const;
  [[nodiscard]] Diagnostic told(bt::NodeId node, const std::string& entry) const;
  [[nodiscard]] std::set<std::string> far_inputs(const project::LeafPlan& leaf) const;
  void follow(std::size_t leaf);
  void follow(bt::NodeId node);
  void add(const std::string& entry);

  const project::Plan& plan_;
  std::string service_;
  const ReplyTypes& types_;
  std::set<std::size_t> callers_;
  std::map<std::size_t, ReplyFlow> flows_;
  std::map<std::size_t, std::set<std::string>> far_;      // ports and arguments of topics, by leaf
  std::set<std::string> entries_;                         // of all blackboards alike
  std::set<std::pair<std::string, std::string>> passed_;  // arguments, as `ReplyFlow` has them
};

}  // namespace sentree::verify
