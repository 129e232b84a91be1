#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sentree/bt/detail/loader.h"
#include "sentree/bt/nodes/of_kind.h"
#include "sentree/bt/tree.h"

// What each node of a tree may return, and what follows from it: children that are never reached, and corners of the
// semantics that look like defects and that this very tree depends on (docs/deviations.md).

namespace sentree::bt {

namespace {

using namespace may;

/// True if the node may halt that child of its own accord.
bool halts(Kind kind, std::uint32_t child) {
  return nodes::of_kind(kind, [&]<class T>() { return child >= T::kHaltsFrom; });
}

bool repeats(Kind kind) {
  return nodes::of_kind(kind, []<class T>() { return T::kRepeats; });
}

bool stays_running(Kind kind) {
  return nodes::of_kind(kind, []<class T>() { return T::kStaysRunning; });
}

}  // namespace

std::uint8_t Loader::result_of(const Definition& definition, const DefinedNode& node,
                               std::span<const std::uint8_t> children, std::size_t& reached) {
  const Manifest& own = model_->manifests[node.manifest];
  struct InFile final : Asked {
    InFile(std::span<const Mask> children_in, std::size_t& reached_in,
           std::function<std::optional<std::string_view>(std::size_t)> literal_in, std::function<Mask()> subtree_in)
        : Asked(children_in, reached_in), literal_of(std::move(literal_in)), subtree_of(std::move(subtree_in)) {}
    std::optional<std::string_view> literal(std::size_t port) const override { return literal_of(port); }
    Mask subtree() const override { return subtree_of(); }
    std::function<std::optional<std::string_view>(std::size_t)> literal_of;
    std::function<Mask()> subtree_of;
  };
  const auto literal = [&](std::size_t port) -> std::optional<std::string_view> {
    if (port >= node.port_count) return std::nullopt;
    const DefinedPort& p = definition.ports[node.first_port + port];
    if (p.kind != Binding::Kind::kLiteral) return std::nullopt;
    return model_->strings[p.text];
  };
  const auto subtree = [&]() -> Mask { return node.data == kNone ? kLeaf | kRunning : tree_result(node.data); };
  reached = children.size();
  InFile asked(children, reached, literal, subtree);
  asked.synchronous = own.synchronous;
  asked.all = kSkipped | kUnknown;
  for (const Mask m : children) {
    asked.any |= m;
    asked.all &= (m & kSkipped) != 0 ? kSkipped | kUnknown : m & kUnknown;
  }
  return nodes::of_kind(own.kind, [&]<class T>() { return T::may_return(asked); });
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
    check_braces(node);
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
             fmt::format("{} is never reached: what stands before it always ends {}", own.id, manifest(parent).id),
             node.element.span());
      }
      if (place == 0 && (above == Kind::kIfThenElse || above == Kind::kWhileDoElse) &&
          (results[i].total & kSkipped) != 0) {
        warn("bt.skipped-condition",
             fmt::format("the condition of {} may be SKIPPED; that gives the tick up", manifest(parent).id),
             node.element.span());
      }
      const std::string_view tag = node.element.name();
      if (above == Kind::kReactiveSequence && is_explicit_tag(tag)) {
        warn("bt.explicit-in-reactive",
             fmt::format("BehaviorTree.CPP 4.10 refuses <{} ID=…> under ReactiveSequence; <{}> works in both", tag,
                         own.id),
             node.element.span());
      }
    }
    if (has(Conditions::kWhile)) halted[i] = 1;
    check_arity(node, own);
    check_literals(definition, node, own);
    if (has(Conditions::kOnHalted) && on_halted_count++ == 0) on_halted = &node;
    const bool frozen = has(Conditions::kFailureIf) || has(Conditions::kSuccessIf) || has(Conditions::kSkipIf);
    if ((frozen || has(Conditions::kOnHalted)) && (results[i].own & kSkipped) != 0 && own.children_max != 0 &&
        stays_running(own.kind)) {
      warn("bt.skipped-stays-running",
           fmt::format("{} may be SKIPPED because of its children and stays RUNNING inside then: {}", own.id,
                       frozen ? "its _failureIf, _successIf, _skipIf are not asked again until its parent resets it"
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
           fmt::format("RunOnce is never armed again, not by {} either",
                       repeated[i] != 0 ? "the next cycle of what repeats it" : "halting"),
           node.element.span());
    }
    if (own.kind == Kind::kSequenceWithMemory && model_->format != 3 && halted[i] != 0 && node.child_count > 1) {
      warn("bt.memory-kept", own.id + " keeps its place when it is halted and goes on there", node.element.span());
    }
  }
  if (on_halted != nullptr) {
    warn("bt.on-halted",
         fmt::format("_onHalted also runs for nodes that never ran when the whole tree is halted, and twice for those "
                     "that run{}",
                     on_halted_count > 1 ? fmt::format(" ({} nodes of this tree have one)", on_halted_count) : ""),
         on_halted->element.attribute_span("_onHalted"));
  }
}

void Loader::check_arity(const DefinedNode& node, const Manifest& own) {
  if (own.kind == Kind::kIfThenElse || own.kind == Kind::kWhileDoElse) {
    const std::uint32_t least = own.kind == Kind::kWhileDoElse && model_->format == 3 ? 3 : 2;
    if (node.child_count < least || node.child_count > 3) {
      warn("bt.child-count",
           fmt::format("{} has {} children; with other than {} every tick of it fails", own.id, node.child_count,
                       least == 3 ? "3" : "2 or 3"),
           node.element.span());
    }
  }
  if (own.kind == Kind::kSwitch && node.child_count != own.ports.size()) {
    warn("bt.child-count",
         fmt::format("{} has {} children; it needs one per case and the default, {}, or every tick of it fails", own.id,
                     node.child_count, own.ports.size()),
         node.element.span());
  }
}

// An entry of the blackboard of which one brace is missing would be a text, without a word.
void Loader::check_braces(const DefinedNode& node) {
  for (const auto& attribute : node.element.attributes()) {
    const std::string_view value = attribute.value;
    const bool begins = value.starts_with('{');
    if (value.size() < 2 || begins == value.ends_with('}')) continue;
    if (value.find(begins ? '}' : '{') != std::string_view::npos) continue;
    warn("bt.half-entry",
         fmt::format("{}=\"{}\" is a text; an entry of the blackboard is between two braces, {{…}}", attribute.name,
                     value),
         node.element.attribute_value_span(attribute.name));
  }
}

void Loader::check_literals(const Definition& definition, const DefinedNode& node, const Manifest& own) {
  const auto port_of = [&](std::size_t port) -> const DefinedPort* {
    return port < node.port_count ? &definition.ports[node.first_port + port] : nullptr;
  };
  struct InFile final : may::Given {
    InFile(const Model& model_in, std::function<const DefinedPort*(std::size_t)> port_in)
        : model(model_in), port_of(std::move(port_in)) {}
    std::optional<std::int64_t> integer(std::size_t port) const override {
      const DefinedPort* const p = port_of(port);
      if (p == nullptr || p->kind != Binding::Kind::kLiteral || p->target == kNone) return std::nullopt;
      const std::int64_t* const value = model.literals[p->target].value.as_int();
      return value != nullptr ? std::optional(*value) : std::nullopt;
    }
    bool absent(std::size_t port) const override {
      const DefinedPort* const p = port_of(port);
      return p == nullptr || p->kind == Binding::Kind::kAbsent;
    }
    const Model& model;
    std::function<const DefinedPort*(std::size_t)> port_of;
  };
  InFile given(*model_, port_of);
  given.children = node.child_count;
  const auto failing = nodes::of_kind(own.kind, [&]<class T>() { return T::always_fails(given); });
  if (!failing) return;
  const std::string& port = own.ports[failing->port].name;
  warn(std::string(failing->code), fmt::format("{} of {} {}; every tick of it fails", port, own.id, failing->why),
       given.absent(failing->port) ? node.element.span() : node.element.attribute_value_span(port));
}

}  // namespace sentree::bt
