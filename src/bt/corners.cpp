#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "sentree/bt/loader.h"
#include "sentree/bt/tree.h"

// What each node of a tree may return, and what follows from it: children that are never reached, and corners of the
// semantics that look like defects and that this very tree depends on (docs/deviations.md).

namespace sentree::bt {

namespace {

using Mask = std::uint8_t;
constexpr Mask kSuccess = 1, kFailure = 2, kRunning = 4;
constexpr Mask kSkipped = 8;   ///< By something that the file says.
constexpr Mask kUnknown = 16;  ///< A leaf of somebody else's making: it may return SKIPPED too, but seldom does.
constexpr Mask kLeaf = kSuccess | kFailure | kUnknown;

Mask mask_of(std::optional<Status> status) {
  if (!status) return kLeaf | kRunning;
  switch (*status) {
    case Status::kSuccess: return kSuccess;
    case Status::kFailure: return kFailure;
    case Status::kRunning: return kRunning;
    case Status::kSkipped: return kSkipped;
    case Status::kIdle: return 0;
  }
  return 0;
}

/// A Sequence (`go_on` is SUCCESS) or Fallback. `reached`: how many of the children can be.
Mask ordered(std::span<const Mask> children, Mask go_on, std::size_t& reached) {
  Mask out = 0;
  Mask all = kSkipped | kUnknown;
  for (reached = 0; reached < children.size();) {
    const Mask child = children[reached++];
    out |= child & static_cast<Mask>((kSuccess | kFailure | kRunning) & ~go_on);
    all &= (child & kSkipped) != 0 ? kSkipped | kUnknown : child & kUnknown;
    if ((child & (go_on | kSkipped | kUnknown)) == 0) return out;
  }
  const bool goes_on = std::any_of(children.begin(), children.end(), [&](Mask m) { return (m & go_on) != 0; });
  return out | all | (goes_on ? go_on : Mask{0});
}

/// True if the node may halt that child of its own accord.
bool halts(Kind kind, std::uint32_t child) {
  switch (kind) {
    case Kind::kReactiveSequence:
    case Kind::kReactiveFallback:
    case Kind::kWhileDoElse: return child > 0;
    case Kind::kParallel:
    case Kind::kSwitch:
    case Kind::kTimeout: return true;
    default: return false;
  }
}

bool repeats(Kind kind) {
  return kind == Kind::kRepeat || kind == Kind::kRetry || kind == Kind::kKeepRunningUntilFailure || kind == Kind::kLoop;
}

/// True if the node sets itself RUNNING before its children, and stays so when it returns SKIPPED because of them.
bool stays_running(Kind kind) {
  switch (kind) {
    case Kind::kSwitch:
    case Kind::kPrecondition:
    case Kind::kSkipUnlessUpdated:
    case Kind::kWaitValueUpdate:
    case Kind::kBlackboardCheck: return false;
    default: return true;
  }
}

}  // namespace

std::uint8_t Loader::result_of(const Definition& definition, const DefinedNode& node,
                               std::span<const std::uint8_t> children, std::size_t& reached) {
  const Manifest& own = model_->manifests[node.manifest];
  const auto literal = [&](std::size_t port) -> std::optional<std::string_view> {
    if (port >= node.port_count) return std::nullopt;
    const DefinedPort& p = definition.ports[node.first_port + port];
    if (p.kind != Binding::Kind::kLiteral) return std::nullopt;
    return model_->strings[p.text];
  };
  const auto status = [&](std::size_t port) -> Mask {
    const auto text = literal(port);
    return mask_of(text ? parse_status(*text) : std::nullopt);
  };
  reached = children.size();
  const Mask child = children.empty() ? Mask{0} : children.front();
  const Mask passed = child & static_cast<Mask>(kRunning | kSkipped | kUnknown);
  const bool completes = (child & (kSuccess | kFailure)) != 0;
  Mask any = 0;
  Mask all = kSkipped | kUnknown;
  for (const Mask m : children) {
    any |= m;
    all &= (m & kSkipped) != 0 ? kSkipped | kUnknown : m & kUnknown;
  }
  switch (own.kind) {
    case Kind::kSequence:
    case Kind::kReactiveSequence: return ordered(children, kSuccess, reached);
    case Kind::kAsyncSequence:
    case Kind::kSequenceWithMemory:
      return ordered(children, kSuccess, reached) | (children.size() > 1 ? kRunning : Mask{0});
    case Kind::kFallback:
    case Kind::kReactiveFallback: return ordered(children, kFailure, reached);
    case Kind::kAsyncFallback: return ordered(children, kFailure, reached) | (children.size() > 1 ? kRunning : Mask{0});
    case Kind::kParallel:
    case Kind::kParallelAll: return (any & (kSuccess | kFailure | kRunning)) | all | kRunning;
    case Kind::kIfThenElse:
    case Kind::kWhileDoElse: {
      Mask out = child & kRunning;
      if (children.size() > 1) out |= children[1];
      if (children.size() > 2) out |= children[2];
      return children.size() > 2 ? out : out | (child & kFailure);
    }
    case Kind::kSwitch: return any;
    case Kind::kManualSelector: return any | kRunning;
    case Kind::kTryCatch: {
      if (children.empty()) return 0;
      std::size_t tried = 0;
      const Mask out = ordered(children.first(children.size() - 1), kSuccess, tried);
      return out | (children.back() & kRunning);
    }
    case Kind::kInverter:
      return passed | ((child & kSuccess) != 0 ? kFailure : Mask{0}) | ((child & kFailure) != 0 ? kSuccess : Mask{0});
    case Kind::kForceSuccess: return passed | (completes ? kSuccess : Mask{0});
    case Kind::kForceFailure: return passed | (completes ? kFailure : Mask{0});
    case Kind::kRepeat:
    case Kind::kRetry: return child | kRunning | kSuccess | kFailure;
    case Kind::kKeepRunningUntilFailure: return (child & kFailure) | kRunning;
    case Kind::kDelay:
    case Kind::kWaitValueUpdate: return child | kRunning;
    case Kind::kTimeout: return child | kFailure;
    case Kind::kRunOnce: {
      const auto then_skip = literal(0);
      return then_skip && detail::parse_bool(*then_skip) == false ? child : child | kSkipped;
    }
    case Kind::kPrecondition: return child | status(1);
    case Kind::kSkipUnlessUpdated: return child | kSkipped;
    case Kind::kLoop: return (child & kFailure) | kRunning | status(1);
    case Kind::kBlackboardCheck: return child | status(2);
    case Kind::kSubTree: return node.data == kNone ? kLeaf | kRunning : tree_result(node.data);
    case Kind::kAlwaysSuccess:
    case Kind::kScript:
    case Kind::kSetBlackboard:
    case Kind::kUnsetBlackboard: return kSuccess;
    case Kind::kAlwaysFailure: return kFailure;
    case Kind::kScriptCondition:
    case Kind::kWasEntryUpdated: return kSuccess | kFailure;
    case Kind::kSleep: return kSuccess | kRunning;
    case Kind::kExternalCondition: return kLeaf;
    case Kind::kTestNode:
    case Kind::kExternalAction: return kLeaf | kRunning;
    case Kind::kUser: return own.synchronous ? kLeaf : kLeaf | kRunning;
    case Kind::kUnknown: return kLeaf | kRunning;
  }
  return kLeaf | kRunning;
}

std::uint8_t Loader::tree_result(std::uint32_t index) {
  const Definition& definition = definitions_[index];
  if (definition.nodes.empty()) return kLeaf | kRunning;
  Results& results = results_[index];
  // A tree that contains itself is an error already; of a longer chain of SubTrees less is told.
  constexpr std::size_t kChainMax = 200;
  if (results.nodes.empty()) {
    if (results.open || results_depth_ > kChainMax) return kLeaf | kRunning;
    results.open = true;
    ++results_depth_;
    find_results(index);
    --results_depth_;
    results.open = false;
  }
  return results.nodes.front().total;
}

void Loader::find_results(std::uint32_t index) {
  const Definition& definition = definitions_[index];
  std::vector<NodeResult> nodes(definition.nodes.size());
  // Results of children, those of one parent together; `next` is one past the place of a parent's next child from
  // behind.
  std::vector<Mask> masks(definition.nodes.size());
  std::vector<std::uint32_t> next(definition.nodes.size());
  std::uint32_t places = 0;
  for (std::size_t i = 0; i < definition.nodes.size(); ++i) next[i] = places += definition.nodes[i].child_count;
  // In document order, so backwards every child comes before its parent.
  for (std::size_t i = definition.nodes.size(); i-- > 0;) {
    const DefinedNode& node = definition.nodes[i];
    std::size_t reached = 0;
    NodeResult& result = nodes[i];
    result.own = result.total = result_of(definition, node, {masks.data() + next[i], node.child_count}, reached);
    result.reached = static_cast<std::uint32_t>(reached);
    if (node.conditions != kNone) {
      const auto& use = definition.conditions[node.conditions].use;
      if (use[Conditions::kFailureIf] != kNone) result.total |= kFailure;
      if (use[Conditions::kSuccessIf] != kNone) result.total |= kSuccess;
      if (use[Conditions::kSkipIf] != kNone || use[Conditions::kWhile] != kNone) result.total |= kSkipped;
    }
    if (node.parent != kNone) masks[--next[node.parent]] = result.total;
  }
  results_[index].nodes = std::move(nodes);
}

void Loader::check_corners(std::uint32_t index) {
  tree_result(index);
  const Definition& definition = definitions_[index];
  const std::vector<NodeResult>& results = results_[index].nodes;
  const auto manifest = [&](const DefinedNode& node) -> const Manifest& { return model_->manifests[node.manifest]; };
  std::vector<std::uint32_t> visited(definition.nodes.size(), 0);  // Children so far.
  // What surrounds a node in its tree.
  std::vector<std::uint8_t> halted(definition.nodes.size(), 0);
  std::vector<std::uint8_t> repeated(definition.nodes.size(), 0);
  const DefinedNode* on_halted = nullptr;
  std::size_t on_halted_count = 0;
  for (std::size_t i = 0; i < definition.nodes.size(); ++i) {
    const DefinedNode& node = definition.nodes[i];
    const Manifest& own = manifest(node);
    const auto has = [&](Conditions::Index condition) {
      return node.conditions != kNone && definition.conditions[node.conditions].use[condition] != kNone;
    };
    if (node.parent != kNone) {
      const DefinedNode& parent = definition.nodes[node.parent];
      const Kind above = manifest(parent).kind;
      const std::uint32_t place = visited[node.parent]++;
      halted[i] = halted[node.parent] != 0 || halts(above, place);
      repeated[i] = repeated[node.parent] != 0 || repeats(above);
      if (place == results[node.parent].reached) {
        warn("bt.unreachable-child",
             own.id + " is never reached: what stands before it always ends " + manifest(parent).id,
             node.element.span());
      }
      if (place == 0 && (above == Kind::kIfThenElse || above == Kind::kWhileDoElse) &&
          (results[i].total & kSkipped) != 0) {
        warn("bt.skipped-condition",
             "the condition of " + manifest(parent).id + " may be SKIPPED; that gives the tick up",
             node.element.span());
      }
      const std::string_view tag = node.element.name();
      if (above == Kind::kReactiveSequence && is_explicit_tag(tag)) {
        warn("bt.explicit-in-reactive",
             "BehaviorTree.CPP 4.10 refuses <" + std::string(tag) + " ID=…> under ReactiveSequence; <" + own.id +
                 "> works in both",
             node.element.span());
      }
    }
    if (has(Conditions::kWhile)) halted[i] = 1;
    check_arity(node, own);
    if (has(Conditions::kOnHalted) && on_halted_count++ == 0) on_halted = &node;
    const bool frozen = has(Conditions::kFailureIf) || has(Conditions::kSuccessIf) || has(Conditions::kSkipIf);
    if ((frozen || has(Conditions::kOnHalted)) && (results[i].own & kSkipped) != 0 && own.children_max != 0 &&
        stays_running(own.kind)) {
      warn("bt.skipped-stays-running",
           own.id + " may be SKIPPED because of its children and stays RUNNING inside then: " +
               (frozen ? "its _failureIf, _successIf, _skipIf are not asked again until its parent resets it"
                       : "its _onHalted runs when its parent resets it"),
           node.element.span());
    }
    const Mask below = i + 1 < results.size() ? results[i + 1].total : Mask{0};  // Of a decorator's child.
    if (own.kind == Kind::kPrecondition && ((below & kSkipped) != 0 || (halted[i] != 0 && (below & kRunning) != 0))) {
      warn(
          "bt.precondition-once",
          "Precondition does not check \"if\" again once its child has started, not even after the child was halted or "
          "skipped; _while and ScriptCondition do",
          node.element.span());
    }
    if (own.kind == Kind::kRunOnce && (halted[i] != 0 || repeated[i] != 0)) {
      warn("bt.run-once",
           std::string("RunOnce is never armed again, not by ") +
               (repeated[i] != 0 ? "the next cycle of what repeats it" : "halting") + " either",
           node.element.span());
    }
    if (own.kind == Kind::kSequenceWithMemory && model_->format != 3 && halted[i] != 0 && node.child_count > 1) {
      warn("bt.memory-kept", own.id + " keeps its place when it is halted and goes on there", node.element.span());
    }
  }
  if (on_halted != nullptr) {
    warn("bt.on-halted",
         "_onHalted also runs for nodes that never ran when the whole tree is halted, and twice for those that run" +
             (on_halted_count > 1 ? " (" + std::to_string(on_halted_count) + " nodes of this tree have one)" : ""),
         on_halted->element.attribute_span("_onHalted"));
  }
}

void Loader::check_arity(const DefinedNode& node, const Manifest& own) {
  if (own.kind == Kind::kIfThenElse || own.kind == Kind::kWhileDoElse) {
    const std::uint32_t least = own.kind == Kind::kWhileDoElse && model_->format == 3 ? 3 : 2;
    if (node.child_count < least || node.child_count > 3) {
      warn("bt.child-count",
           own.id + " has " + std::to_string(node.child_count) + " children; with other than " +
               (least == 3 ? "3" : "2 or 3") + " every tick of it fails",
           node.element.span());
    }
  }
  if (own.kind == Kind::kSwitch && node.child_count != own.ports.size()) {
    warn("bt.child-count",
         own.id + " has " + std::to_string(node.child_count) + " children; it needs one per case and the default, " +
             std::to_string(own.ports.size()) + ", or every tick of it fails",
         node.element.span());
  }
}

}  // namespace sentree::bt
