#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/diagnostic.h"
#include "sentree/bt/index.h"
#include "sentree/bt/load.h"
#include "sentree/bt/node_list.h"
#include "sentree/bt/object.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/script.h"
#include "sentree/bt/status.h"
#include "sentree/bt/tree.h"
#include "sentree/bt/types.h"

// The compiled form of a tree: flat arrays, indices for references. For the files of this library; users see `Tree`.

namespace sentree::bt {

enum class Kind : std::uint8_t {
#define SENTREE_BT_NODE(name) k##name,
  SENTREE_BT_NODES(SENTREE_BT_NODE)
#undef SENTREE_BT_NODE
};

inline constexpr std::size_t kKinds = 0
#define SENTREE_BT_NODE(name) +1
    SENTREE_BT_NODES(SENTREE_BT_NODE)
#undef SENTREE_BT_NODE
    ;

inline constexpr std::uint32_t kNone = 0xFFFFFFFFU;

/// What the nodes of one ID have in common.
struct Manifest {
  std::string id;
  Category category = Category::kAction;
  Kind kind = Kind::kUser;
  bool synchronous = false;
  bool external = false;
  bool declared = true;  ///< Ports are known: built in, registered, or in the TreeNodesModel.
  Ports ports;
  std::string description;
  std::shared_ptr<const Behaviour> behaviour;
  std::uint32_t children_min = 0;
  std::uint32_t children_max = 0;
};

/// A node, as the machine visits it.
struct Node {
  static constexpr std::uint8_t kDecorator = 1;    ///< Its completed child is reset after each of its ticks.
  static constexpr std::uint8_t kSynchronous = 2;  ///< May not return RUNNING.
  static constexpr std::uint8_t kHasPre = 4;
  static constexpr std::uint8_t kHasPost = 8;
  static constexpr std::uint8_t kLeafChildren = 16;  ///< Its children are leaves, so their ids follow each other.

  /// How its parent ticks it. Most nodes answer in the step in which they are ticked, and all below them do: their
  /// parent calls what `Machine::kTicks` has for them. The others are walked to: external leaves, and what is above
  /// them or more than `kCalledLevels` above its lowest leaf.
  enum Tick : std::uint8_t {
    kWalked,
    kPlain,        ///< A leaf written in C++, without conditions.
    kConditional,  ///< It has pre-conditions.
    kByKind,       ///< The kind is added.
  };
  static constexpr std::uint8_t kCalledLevels = 100;

  Kind kind = Kind::kAlwaysSuccess;
  std::uint8_t flags = 0;
  std::uint16_t port_count = 0;
  NodeId parent = kNoNode;
  std::uint32_t first_child = 0;  ///< In Model::children.
  std::uint32_t child_count : 24 = 0;
  std::uint32_t tick : 8 = kWalked;  ///< A Tick.
  std::uint32_t memory = 0;          ///< In State::memory_.
  std::uint32_t ports = 0;           ///< In Model::bindings.
  std::uint32_t data = kNone;        ///< By kind: a script use, a user node, thresholds, …
  std::uint32_t conditions = kNone;
};
static_assert(kNodesMax < 1U << 24 && Node::kByKind + kKinds < 1U << 8);

/// What people ask about a node.
struct NodeInfo {
  std::uint32_t name_offset = 0;  ///< In Model::text.
  std::uint32_t name_length = 0;
  std::uint32_t manifest = 0;
  std::uint32_t tree = 0;    ///< In Model::trees.
  std::uint32_t offset = 0;  ///< Byte of the '<' in its file.
  std::uint32_t file = 0;
};

/// A port of a node, resolved.
struct Binding {
  enum class Kind : std::uint8_t { kAbsent, kLiteral, kEntry };
  Kind kind = Kind::kAbsent;
  bool from_default = false;
  std::uint16_t declared = 0xFFFF;  ///< Index into the manifest's ports; 0xFFFF: an attribute nobody declared.
  std::uint32_t name = 0;           ///< In Model::strings.
  std::uint32_t text = 0;           ///< As written; in Model::strings.
  std::uint32_t target = kNone;     ///< kLiteral: in Model::literals. kEntry: a cell.
  const PortType* type = nullptr;   ///< Null: any.
  std::uint64_t key = 0;            ///< PortName::key of the name.
};

/// A name in one blackboard.
struct Cell {
  std::uint32_t scope = 0;
  std::uint32_t name = 0;        ///< In Model::strings.
  std::uint32_t parent = kNone;  ///< The cell it is remapped to.
  std::uint32_t home = kNone;    ///< Where an entry of its own lives in State::entries_.
};

/// The blackboard of one SubTree instance; scope 0 is the root's.
struct Scope {
  std::uint32_t parent = kNone;
  NodeId subtree = kNoNode;  ///< Its SubTree node.
  std::string path;          ///< No other one has it; empty for the root's.
  bool autoremap = false;
  bool shared = false;  ///< Format 3, __shared_blackboard: every name is the parent's, '_' included.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> remaps;  ///< Own name → parent's name, by string.
  std::vector<std::uint32_t> first_mention;                     ///< Cells in order, for listing.
};

/// An instance of a BehaviorTree.
struct TreeInstance {
  NodeId subtree = kNoNode;  ///< Its SubTree node; kNoNode for the main tree.
  std::uint32_t scope = 0;
  std::uint32_t id = 0;  ///< Of the BehaviorTree; in Model::strings.
};

/// A script with its names resolved in one scope.
struct ScriptUse {
  std::uint32_t script = kNone;  ///< In Model::scripts.
  std::uint32_t first_cell = 0;  ///< In Model::script_cells, one per name of the script.
  std::uint32_t scope = 0;
  std::uint32_t first_step = 0;  ///< In Model::steps.
  std::uint32_t steps = 0;       ///< None: the script is more than numbers.
};

struct Conditions {
  enum Index : std::uint8_t { kFailureIf, kSuccessIf, kSkipIf, kWhile, kOnHalted, kOnFailure, kOnSuccess, kPost };
  static constexpr std::size_t kCount = 8;
  std::uint32_t use[kCount] = {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
  std::uint8_t before = 0;         ///< A bit for each of those up to kWhile that there is.
  Status verdict = Status::kIdle;  ///< What the node returns instead where the only one of these gives `when`.
  bool when = true;
  /// That one, where it compares an entry with a number.
  Instruction::Op test = Instruction::Op::kLoad;
  std::uint32_t test_cell = kNone;
  double test_number = 0;
};
/// "_failureIf" … in the order of Conditions::Index, which is the order of evaluation.
extern const std::string_view kConditionNames[Conditions::kCount];

struct UserNode {
  const Behaviour* behaviour = nullptr;
  const std::function<Status(Context&)>* function = nullptr;  ///< Of the behaviour.
  std::uint32_t object = kNone;                               ///< In State::objects_.
};

/// Thresholds of a Parallel that are literals, in children; not more than it has.
struct ParallelLimits {
  std::int32_t success, failure;
  std::int32_t skipped_succeeds;  ///< The success threshold was written negative.
};

/// A case of a Switch: a literal, as text and as the numbers that it stands for.
struct SwitchCase {
  std::string text;
  std::optional<std::int64_t> integer;
  std::optional<double> real;
};
/// A Switch whose cases are all literals.
struct SwitchData {
  std::uint32_t first_case = 0;  ///< In Model::cases.
  bool numbers = false;          ///< Some of them stand for numbers.
};

struct TestNodeData {
  Status status = Status::kSuccess;
  std::uint32_t status_use = kNone, success_use = kNone, failure_use = kNone, post_use = kNone;
  Duration delay{0};
  std::function<Status()> complete;
};

/// A constant that a SubTree is given: an entry in its own blackboard.
struct Constant {
  std::uint32_t cell;
  Datum datum;
  const PortType* type;
  std::uint32_t text;  ///< As written; in Model::strings.
};
/// An entry that a port declares, without a value.
struct DeclaredEntry {
  std::uint32_t cell;
  const PortType* type;
};

/// An input port that reads an entry of the blackboard which nothing in the tree writes.
struct UnwrittenEntry {
  NodeId node;
  const std::string& port;  ///< In Model::strings, as the next.
  const std::string& entry;
};

struct Model {
  int format = 4;
  std::string id;
  std::vector<Node> nodes;
  std::vector<UnwrittenEntry> unwritten;  ///< Format 4 only.
  std::vector<NodeInfo> infos;
  std::vector<NodeId> children;
  std::string text;  ///< Node names.
  std::vector<Manifest> manifests;
  std::vector<Binding> bindings;
  std::deque<std::string> strings;  ///< A deque: the texts do not move.
  Index string_index;
  std::vector<Datum> literals;
  std::vector<Cell> cells;
  Index cell_index;
  std::vector<Scope> scopes;
  std::vector<TreeInstance> trees;
  std::vector<Script> scripts;
  std::vector<ScriptUse> uses;
  std::vector<std::uint32_t> script_cells;
  std::vector<NumberStep> steps;
  std::vector<Conditions> conditions;
  std::vector<UserNode> users;
  std::vector<TestNodeData> tests;
  std::vector<ParallelLimits> parallels;
  std::vector<SwitchData> switches;
  std::vector<SwitchCase> cases;
  std::vector<std::vector<Value>> queues;  ///< Literal queues of Loop nodes.
  std::vector<NodeId> externals;
  std::vector<NodeId> changing;            ///< Nodes whose words do not always matter as they are (`encode`).
  std::map<NodeId, std::string> numbered;  ///< Paths of leaves whose names alone do not tell them apart.
  std::vector<Constant> constants;
  std::vector<DeclaredEntry> declared;
  /// Cells that ports of skills name without a type, where an entry would live. Nobody makes these entries, but a
  /// script's "=" may, as in BehaviorTree.CPP, where every port makes its entry. Sorted.
  std::vector<std::uint32_t> named;
  std::vector<std::pair<std::string, std::int64_t>> enums;
  std::vector<PolymorphicCast> casts;
  bool unsets = false;  ///< It has an UnsetBlackboard: entries may begin to count anew.
  std::uint32_t memory_words = 0;
  std::uint32_t homes = 0;
  std::uint32_t objects = 0;
  std::vector<std::string> files;
  std::vector<LineIndex> lines;  ///< Per file.

  [[nodiscard]] std::string_view name(NodeId node) const {
    const NodeInfo& info = infos[node];
    if (info.name_length == 0) return manifests[info.manifest].id;
    return std::string_view(text).substr(info.name_offset, info.name_length);
  }
  /// In `strings`; kNone where no part of the tree has it.
  [[nodiscard]] std::uint32_t find_string(std::string_view string) const;
  /// In `cells`, of a name as that scope has it; kNone.
  [[nodiscard]] std::uint32_t find_cell(std::uint32_t of, std::uint32_t string) const;
  /// Where the entry of a cell lives: up the remapping, but not past a constant.
  [[nodiscard]] std::uint32_t owner(std::uint32_t cell) const {
    while (cells[cell].home == kNone) cell = cells[cell].parent;
    return cell;
  }
  [[nodiscard]] std::uint32_t scope(NodeId node) const { return trees[infos[node].tree].scope; }
  [[nodiscard]] const Manifest& manifest(NodeId node) const { return manifests[infos[node].manifest]; }
  [[nodiscard]] std::optional<std::int64_t> enum_value(std::string_view name) const;
};

/// One of the words that a node has in State::memory_.
struct Word {
  /// Which values a state may hold, so that no damaged one leads out of the node's children.
  enum class Range : std::uint8_t {
    kAny,
    kChild,       ///< Index of a child.
    kChildOrEnd,  ///< The same, or the number of children where no tick is suspended below.
    kCounted,     ///< A child counted from 1, or 0.
    kChosen,      ///< The same, or a status negated.
    kResult,      ///< SUCCESS, FAILURE, or 0.
    kPosition,    ///< Not negative.
  };
  /// When the value matters.
  enum class Lives : std::uint8_t {
    kAlways,
    kUnlessIdle,  ///< Set anew where an IDLE node is entered.
    kInTick,      ///< Set anew by each tick: matters only while one is suspended below the node.
  };
  Lives lives = Lives::kAlways;
  Range range = Range::kAny;
};
/// True for a node whose first two words are the number of the last write that it has seen of the entry of
/// `Node::data`.
[[nodiscard]] bool waits_for_writes(Kind kind);
/// True for a node that may have a timer.
[[nodiscard]] bool starts_timers(Kind kind);
[[nodiscard]] inline std::uint64_t seen_of(const std::int32_t* words) {
  return static_cast<std::uint32_t>(words[0]) | std::uint64_t{static_cast<std::uint32_t>(words[1])} << 32;
}
inline void set_seen(std::int32_t* words, std::uint64_t seen) {
  words[0] = static_cast<std::int32_t>(seen);
  words[1] = static_cast<std::int32_t>(seen >> 32);
}
/// The words of a node of that kind; a Parallel has one bit per child behind them.
[[nodiscard]] std::span<const Word> words(Kind kind);
[[nodiscard]] std::uint32_t memory_words(Kind kind, std::uint32_t child_count);

/// A built-in node's manifest, and the formats that have it.
struct BuiltIn {
  Manifest manifest;
  bool in_format3 = false;
  bool in_format4 = false;
};
using Manifests = std::vector<BuiltIn>;
[[nodiscard]] Manifest control(std::string id, Ports ports = {});
[[nodiscard]] Manifest decorator(std::string id, Ports ports = {});
[[nodiscard]] Manifest leaf(std::string id, Category category, Ports ports = {});
[[nodiscard]] inline BuiltIn both(Manifest manifest) { return {std::move(manifest), true, true}; }
[[nodiscard]] inline BuiltIn format3(Manifest manifest) { return {std::move(manifest), true, false}; }
[[nodiscard]] inline BuiltIn format4(Manifest manifest) { return {std::move(manifest), false, true}; }

/// The nodes that every tree may use, with the names of the format. Sorted by ID.
[[nodiscard]] const std::vector<Manifest>& builtins(int format);
[[nodiscard]] const Manifest* find_builtin(std::string_view id, int format);

}  // namespace sentree::bt
