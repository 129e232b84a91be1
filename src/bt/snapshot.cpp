#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

#include "sentree/bt/model.h"
#include "sentree/bt/state.h"
#include "sentree/bt/tree.h"

// A state as bytes: a magic word, a version, a fingerprint of the tree, then the members in order, little-endian.

namespace sentree::bt {

namespace {

constexpr std::string_view kMagic = "SBTS";
constexpr std::uint32_t kVersion = 1;
/// Lists and maps inside values that a snapshot may nest.
constexpr int kValueDepthMax = 100;

/// Changes when the compiled tree does.
std::uint64_t fingerprint(const Model& model) {
  std::uint64_t h = hash_combine(static_cast<std::uint64_t>(model.format), model.nodes.size());
  for (NodeId id = 0; id < model.nodes.size(); ++id) {
    const Node& node = model.nodes[id];
    h = hash_combine(h, static_cast<std::uint64_t>(node.kind) << 32 | node.child_count);
    h = hash_combine(h, node.memory);
  }
  for (const Manifest& manifest : model.manifests) h = hash_combine(h, hash_bytes(manifest.id));
  for (const Cell& cell : model.cells) h = hash_combine(h, hash_bytes(model.strings[cell.name]) + cell.scope);
  return h;
}

class Writer {
 public:
  std::string bytes;

  void number(std::uint64_t value, int octets) {
    for (int i = 0; i < octets; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFF);
  }
  void u32(std::uint64_t value) { number(value, 4); }
  void u64(std::uint64_t value) { number(value, 8); }
  void text(std::string_view value) {
    u64(value.size());
    bytes += value;
  }
  void value(const Value& v) {
    number(static_cast<std::uint64_t>(v.type()), 1);
    if (const auto* b = v.as_bool()) {
      number(*b ? 1 : 0, 1);
    } else if (const auto* i = v.as_int()) {
      u64(static_cast<std::uint64_t>(*i));
    } else if (const auto* d = v.as_double()) {
      u64(std::bit_cast<std::uint64_t>(*d));
    } else if (const auto* s = v.as_string()) {
      text(*s);
    } else if (const auto* octets = v.as_bytes()) {
      text({reinterpret_cast<const char*>(octets->octets.data()), octets->octets.size()});
    } else if (const auto* list = v.as_list()) {
      u64(list->size());
      for (const Value& item : *list) value(item);
    } else if (const auto* map = v.as_map()) {
      u64(map->size());
      for (const auto& [key, item] : *map) {
        text(key);
        value(item);
      }
    }
  }
};

/// Reads what Writer wrote; after the first thing that does not fit, `ok` is false and everything reads as zero.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : left_(bytes) {}
  bool ok = true;

  [[nodiscard]] bool at_end() const { return ok && left_.empty(); }
  std::uint64_t number(std::size_t octets) {
    if (!ok || left_.size() < octets) {
      ok = false;
      return 0;
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < octets; ++i) value |= std::uint64_t{static_cast<unsigned char>(left_[i])} << (8 * i);
    left_.remove_prefix(octets);
    return value;
  }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  /// A number of things that take at least `octets` each, so that no damaged count can ask for much memory.
  std::size_t count(std::size_t octets) {
    const std::uint64_t n = u64();
    if (n > left_.size() / octets) ok = false;
    return ok ? static_cast<std::size_t>(n) : 0;
  }
  std::string_view text() {
    const std::size_t size = count(1);
    const std::string_view value = left_.substr(0, size);
    left_.remove_prefix(size);
    return value;
  }
  Value value(int depth = 0) {
    if (depth > kValueDepthMax) ok = false;
    switch (ok ? number(1) : 0) {
      case 0: return {};
      case 1: return number(1) != 0;
      case 2: return static_cast<std::int64_t>(u64());
      case 3: return std::bit_cast<double>(u64());
      case 4: return std::string(text());
      case 5: {
        const std::string_view octets = text();
        Bytes b;
        b.octets.resize(octets.size());
        if (!octets.empty()) std::memcpy(b.octets.data(), octets.data(), octets.size());
        return b;
      }
      case 6: {
        List list;
        const std::size_t size = count(1);
        for (std::size_t i = 0; i < size && ok; ++i) list.push_back(value(depth + 1));
        return list;
      }
      case 7: {
        Map map;
        const std::size_t size = count(9);
        for (std::size_t i = 0; i < size && ok; ++i) {
          const std::string key(text());
          map[key] = value(depth + 1);
        }
        return map;
      }
      default: ok = false; return {};
    }
  }

 private:
  std::string_view left_;
};

/// The types that an entry of the tree may have: those of ports, and what TreeNodesModels name.
const PortType* find_type(const Model& model, std::string_view name) {
  for (const Manifest& manifest : model.manifests) {
    for (const PortInfo& port : manifest.ports) {
      if (port.type != nullptr && port.type->name == name) return port.type;
    }
  }
  if (name == type_of<Value>().name) return &type_of<Value>();
  return type_named(name);
}

}  // namespace

/// Reads and writes the members of a state.
struct Snapshot {
  static Result<std::string> save(const Tree& tree, const State& state) {
    const Model& model = tree.model();
    Writer out;
    out.bytes += kMagic;
    out.u32(kVersion);
    out.u64(fingerprint(model));
    for (const Status status : state.status_) out.number(static_cast<std::uint64_t>(status), 1);
    for (const std::int32_t word : state.memory_) out.u32(static_cast<std::uint32_t>(word));
    for (const std::uint32_t link : state.links_) out.u32(link);
    out.u64(state.entries_.size());
    for (const State::Entry& entry : state.entries_) {
      if (entry.datum.object != nullptr) {
        return fail("bt.unsavable", "an entry of the blackboard holds a C++ object of type " +
                                        entry.datum.object->type().name +
                                        ", which has no saved form; specialise Convert for it");
      }
      out.value(entry.datum.value);
      out.number(entry.type != nullptr ? 1 : 0, 1);
      if (entry.type != nullptr) out.text(entry.type->name);
      out.u64(entry.sequence);
      out.u64(static_cast<std::uint64_t>(entry.stamp.time_since_epoch().count()));
      out.u32(entry.links);
    }
    out.u64(state.dynamic_.size());
    for (const State::DynamicCell& cell : state.dynamic_) {
      out.u32(cell.scope);
      out.text(cell.name);
      out.u32(cell.parent);
      out.u32(cell.link);
    }
    for (NodeId id = 0; id < model.nodes.size(); ++id) {
      if (model.nodes[id].kind != Kind::kUser) continue;
      const std::uint32_t object = model.users[model.nodes[id].data].object;
      if (object == kNone) continue;
      const auto saved = state.objects_[object].get()->save();
      if (!saved) {
        return fail("bt.unsavable",
                    "node \"" + tree.path(id) + "\" (" + std::string(tree.registration(id)) +
                        ") keeps what cannot be saved; give its class save() and restore()",
                    tree.span(id));
      }
      out.value(*saved);
    }
    out.u64(state.timers_.size());
    for (const State::Timer& timer : state.timers_) {
      out.u64(static_cast<std::uint64_t>(timer.due.time_since_epoch().count()));
      out.u32(timer.node);
    }
    out.u64(state.halting_.size());
    for (const NodeId node : state.halting_) out.u32(node);
    out.u32(state.waiting_);
    return std::move(out.bytes);
  }

  static Result<State> restore(const Tree& tree, std::string_view bytes) {
    const Model& model = tree.model();
    if (!bytes.starts_with(kMagic)) return fail("bt.bad-snapshot", "this is no saved state of a tree");
    bytes.remove_prefix(kMagic.size());
    Reader in(bytes);
    if (const std::uint32_t version = in.u32(); !in.ok || version != kVersion) {
      return fail("bt.bad-snapshot", "the state was saved by version " + std::to_string(version) +
                                         "; this is version " + std::to_string(kVersion));
    }
    if (in.u64() != fingerprint(model)) return fail("bt.bad-snapshot", "the state was saved with another tree");
    State state(tree);
    for (Status& status : state.status_) {
      const std::uint64_t value = in.number(1);
      if (value > static_cast<std::uint64_t>(Status::kSkipped)) in.ok = false;
      status = static_cast<Status>(value);
    }
    for (std::int32_t& word : state.memory_) word = static_cast<std::int32_t>(in.u32());
    for (std::uint32_t& link : state.links_) link = in.u32();
    state.entries_.clear();
    const std::size_t entries = in.count(1);
    for (std::size_t i = 0; i < entries && in.ok; ++i) {
      State::Entry entry;
      entry.datum.value = in.value();
      if (in.number(1) != 0) {
        entry.type = find_type(model, in.text());
        if (entry.type == nullptr) in.ok = false;
      }
      entry.sequence = in.u64();
      entry.stamp = TimePoint(Duration(static_cast<std::int64_t>(in.u64())));
      entry.links = in.u32();
      state.entries_.push_back(std::move(entry));
    }
    const std::size_t dynamic = in.count(1);
    for (std::size_t i = 0; i < dynamic && in.ok; ++i) {
      State::DynamicCell cell;
      cell.scope = in.u32();
      cell.name = std::string(in.text());
      cell.parent = in.u32();
      cell.link = in.u32();
      state.dynamic_.push_back(std::move(cell));
    }
    for (const UserNode& user : model.users) {
      if (user.object == kNone) continue;
      const Value saved = in.value();
      if (in.ok && !state.objects_[user.object].get()->restore(saved)) in.ok = false;
    }
    const std::size_t timers = in.count(12);
    for (std::size_t i = 0; i < timers && in.ok; ++i) {
      const TimePoint due(Duration(static_cast<std::int64_t>(in.u64())));
      state.timers_.push_back({due, in.u32()});
    }
    const std::size_t halting = in.count(4);
    for (std::size_t i = 0; i < halting && in.ok; ++i) state.halting_.push_back(in.u32());
    state.waiting_ = in.u32();
    if (!in.at_end() || !consistent(model, state)) return fail("bt.bad-snapshot", "the saved state is damaged");
    return state;
  }

  /// Every index of the state leads somewhere, so that a damaged one cannot make a step read what is not there.
  static bool consistent(const Model& model, const State& state) {
    const auto link_ok = [&](std::uint32_t link) {
      return link == State::kNoEntry || (link < state.entries_.size() && state.entries_[link].links > 0);
    };
    const auto node_ok = [&](NodeId node) { return node < model.nodes.size(); };
    const std::size_t cells = model.cells.size() + state.dynamic_.size();
    if (state.entries_.size() < model.homes) return false;
    if (!std::all_of(state.links_.begin(), state.links_.end(), link_ok)) return false;
    for (std::size_t i = 0; i < state.dynamic_.size(); ++i) {
      const State::DynamicCell& cell = state.dynamic_[i];
      // Parents come before their children, so that following them ends.
      if (!link_ok(cell.link) || cell.scope >= model.scopes.size() ||
          (cell.parent != State::kNoEntry && (cell.parent >= cells || cell.parent >= model.cells.size() + i))) {
        return false;
      }
    }
    const auto is_timed = [&](const State::Timer& timer) {
      if (!node_ok(timer.node)) return false;
      const Kind kind = model.nodes[timer.node].kind;
      return kind == Kind::kDelay || kind == Kind::kTimeout || kind == Kind::kSleep || kind == Kind::kTestNode;
    };
    const auto is_external = [&](NodeId node) {
      return node_ok(node) &&
             (model.nodes[node].kind == Kind::kExternalAction || model.nodes[node].kind == Kind::kExternalCondition);
    };
    return std::all_of(state.timers_.begin(), state.timers_.end(), is_timed) &&
           std::all_of(state.halting_.begin(), state.halting_.end(), is_external) &&
           (state.waiting_ == kNoNode || is_external(state.waiting_)) && memory_in_range(model, state);
  }

  /// The places that control nodes keep are within their children.
  static bool memory_in_range(const Model& model, const State& state) {
    for (const Node& node : model.nodes) {
      const std::int32_t* mem = state.memory_.data() + node.memory;
      const auto children = static_cast<std::int32_t>(node.child_count);
      const auto within = [&](std::int32_t value, std::int32_t low, std::int32_t high) {
        return value >= low && value <= high;
      };
      switch (node.kind) {
        case Kind::kSequence:
        case Kind::kFallback:
        case Kind::kAsyncSequence:
        case Kind::kAsyncFallback:
        case Kind::kSequenceWithMemory:
          if (!within(mem[0], 0, children)) return false;
          break;
        case Kind::kReactiveSequence:
        case Kind::kReactiveFallback:
        case Kind::kIfThenElse:
        case Kind::kWhileDoElse:
        case Kind::kTryCatch:
          if (!within(mem[0], 0, std::max(children - 1, 0))) return false;
          break;
        case Kind::kParallel:
        case Kind::kParallelAll:
          if (!within(mem[0], -1, children)) return false;
          break;
        case Kind::kSwitch:
          if (!within(mem[0], 0, children) || !within(mem[1], 0, std::max(children - 1, 0))) return false;
          break;
        case Kind::kRunOnce:
          if (!within(mem[0], 0, static_cast<std::int32_t>(Status::kFailure))) return false;
          break;
        case Kind::kLoop:
          if (mem[1] < 0) return false;
          break;
        default: break;
      }
    }
    return true;
  }
};

Result<std::string> save(const Tree& tree, const State& state) { return Snapshot::save(tree, state); }
Result<State> restore(const Tree& tree, std::string_view bytes) { return Snapshot::restore(tree, bytes); }

}  // namespace sentree::bt
