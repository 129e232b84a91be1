#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "sentree/bt/detail/blackboard.h"
#include "sentree/bt/detail/members.h"
#include "sentree/bt/encode.h"
#include "sentree/bt/model.h"
#include "sentree/bt/state.h"
#include "sentree/bt/tree.h"

// A state as bytes: a magic word, a version, a fingerprint of the tree, then the members in order, little-endian.

namespace sentree::bt {

namespace {

constexpr std::string_view kMagic = "SBTS";
constexpr std::uint32_t kVersion = 2;
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

/// Appends members to bytes; `compact`: numbers take as many octets as they need, seven bits in each.
class Writer {
 public:
  explicit Writer(std::string& out, bool compact = false) : out_(out), compact_(compact) {}
  ~Writer() { flush(); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Now everything is in the string.
  void flush() {
    out_.append(waiting_, count_);
    count_ = 0;
  }

  /// What has no saved form, and is left out; empty if there is none.
  [[nodiscard]] const std::string& unsavable() const { return unsavable_; }
  /// Of the objects written, the first that has no saved form.
  /// What the `save` of that object threw; empty: nothing.
  [[nodiscard]] const std::string& thrown() const { return thrown_; }
  [[nodiscard]] std::optional<std::size_t> unsavable_object() const { return unsavable_object_; }

  void number(std::uint64_t value, std::size_t octets) {
    constexpr std::size_t kDigitsMax = 10;
    if (count_ + kDigitsMax > sizeof(waiting_)) flush();
    if (compact_) {
      for (; value >= 0x80; value >>= 7) waiting_[count_++] = static_cast<char>(value | 0x80);
      waiting_[count_++] = static_cast<char>(value);
    } else {
      for (; octets > 0; --octets, value >>= 8) waiting_[count_++] = static_cast<char>(value);
    }
  }
  void write(Status status) { number(static_cast<std::uint64_t>(status), 1); }
  void write(std::int32_t value) { number(static_cast<std::uint32_t>(value), 4); }
  void write(std::uint32_t value) { number(value, 4); }
  void write(std::uint64_t value) { number(value, 8); }
  void write(TimePoint time) { number(static_cast<std::uint64_t>(time.time_since_epoch().count()), 8); }
  void write(std::string_view text) {
    number(text.size(), 8);
    if (count_ + text.size() > sizeof(waiting_)) flush();
    if (text.size() > sizeof(waiting_)) {
      out_ += text;
    } else {
      count_ += text.copy(waiting_ + count_, text.size());
    }
  }
  void write(const std::string& text) { write(std::string_view(text)); }
  void write(const Value& v) {
    number(static_cast<std::uint64_t>(v.type()), 1);
    if (const auto* b = v.as_bool()) {
      number(*b ? 1 : 0, 1);
    } else if (const auto* i = v.as_int()) {
      write(static_cast<std::uint64_t>(*i));
    } else if (const auto* d = v.as_double()) {
      write(std::bit_cast<std::uint64_t>(*d));
    } else if (const auto* s = v.as_string()) {
      write(std::string_view(*s));
    } else if (const auto* octets = v.as_bytes()) {
      write(std::string_view(reinterpret_cast<const char*>(octets->octets.data()), octets->octets.size()));
    } else if (const auto* list = v.as_list()) {
      number(list->size(), 8);
      for (const Value& item : *list) write(item);
    } else if (const auto* map = v.as_map()) {
      number(map->size(), 8);
      for (const auto& [key, item] : *map) {
        write(std::string_view(key));
        write(item);
      }
    }
  }
  void write(const Datum& datum) {
    if (datum.object != nullptr && unsavable_.empty()) {
      unsavable_ = fmt::format(
          "an entry of the blackboard holds a C++ object of type {}, which has no saved form; specialise Convert for "
          "it",
          datum.object->type().name);
    }
    write(datum.value);
  }
  void write(const PortType* type) {
    number(type != nullptr ? 1 : 0, 1);
    if (type != nullptr) write(std::string_view(type->name));
  }
  void write(const ObjectSlot& slot) {
    std::optional<Value> saved;
    std::string why;
    // What is somebody else's may throw.
    try {
      if (slot.get() != nullptr) saved = slot.get()->save();
    } catch (const std::exception& thrown) {
      why = thrown.what();
    } catch (...) {
      why = "something that is no std::exception";
    }
    if (!saved && !unsavable_object_) {
      unsavable_object_ = objects_;
      thrown_ = std::move(why);
    }
    ++objects_;
    write(saved.value_or(Value()));
  }
  template <class T>
  void write(const std::vector<T>& list) {
    number(list.size(), 8);
    for (const T& item : list) write(item);
  }
  template <class T>
  requires requires(const T& object) { Snapshot::members(object); }
  void write(const T& object) {
    std::apply([this](const auto&... member) { (write(member), ...); }, Snapshot::members(object));
  }

 private:
  std::string& out_;
  char waiting_[256];  // many small ones are appended at once
  std::size_t count_ = 0;
  bool compact_;
  std::string unsavable_;
  std::size_t objects_ = 0;
  std::optional<std::size_t> unsavable_object_;
  std::string thrown_;
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

/// Reads what Writer wrote; after the first thing that does not fit, `ok` is false and everything reads as zero.
class Reader {
 public:
  Reader(const Model& model, std::string_view bytes) : model_(model), left_(bytes) {}
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

  void read(Status& status) {
    const std::uint64_t read = number(1);
    if (read > static_cast<std::uint64_t>(Status::kSkipped)) ok = false;
    status = ok ? static_cast<Status>(read) : Status::kIdle;
  }
  void read(std::int32_t& into) { into = static_cast<std::int32_t>(u32()); }
  void read(std::uint32_t& into) { into = u32(); }
  void read(std::uint64_t& into) { into = u64(); }
  void read(TimePoint& time) { time = TimePoint(Duration(static_cast<std::int64_t>(u64()))); }
  void read(std::string& into) { into = std::string(text()); }
  void read(Datum& datum) { datum = Datum{value(), nullptr}; }
  void read(const PortType*& type) {
    type = nullptr;
    if (number(1) == 0) return;
    type = find_type(model_, text());
    if (type == nullptr) ok = false;
  }
  void read(ObjectSlot& slot) {
    const Value saved = value();
    try {
      if (ok && (slot.get() == nullptr || !slot.get()->restore(saved))) ok = false;
    } catch (...) {
      ok = false;
    }
  }
  template <class T>
  void read(std::vector<T>& list) {
    const std::size_t size = count(1);
    if constexpr (std::is_same_v<T, ObjectSlot>) {
      // What C++ nodes remember is in objects of their own classes, which are there already.
      if (size != list.size()) ok = false;
      for (std::size_t i = 0; i < size && ok; ++i) read(list[i]);
    } else {
      list.clear();
      for (std::size_t i = 0; i < size && ok; ++i) read(list.emplace_back());
    }
  }
  template <class T>
  requires requires(T& object) { Snapshot::members(object); }
  void read(T& object) {
    std::apply([this](auto&... member) { (read(member), ...); }, Snapshot::members(object));
  }

 private:
  const Model& model_;
  std::string_view left_;
};

/// Ancestors of the leaf that a suspended tick waits for, from the root down: what they set for this tick matters.
std::vector<NodeId> open_nodes(const Model& model, NodeId waiting) {
  std::vector<NodeId> open;
  if (waiting == kNoNode) return open;
  for (NodeId id = model.nodes[waiting].parent; id != kNoNode; id = model.nodes[id].parent) open.push_back(id);
  std::reverse(open.begin(), open.end());
  return open;
}

bool in_range(Word::Range range, std::int32_t value, std::int32_t children, bool is_open) {
  switch (range) {
    case Word::Range::kAny: return true;
    case Word::Range::kChild: return value >= 0 && (value < children || value == 0);
    case Word::Range::kChildOrEnd: return value >= 0 && value <= children - (is_open ? 1 : 0);
    case Word::Range::kCounted: return value >= 0 && value <= children;
    case Word::Range::kChosen: return value >= -static_cast<std::int32_t>(Status::kSkipped) && value <= children;
    case Word::Range::kResult: return value >= 0 && value <= static_cast<std::int32_t>(Status::kFailure);
    case Word::Range::kPosition: return value >= 0;
  }
  return false;
}

/// Fails where something that was written has no saved form.
Result<void> checked(const Tree& tree, const Writer& out) {
  if (!out.unsavable().empty()) return fail("bt.unsavable", out.unsavable());
  if (!out.unsavable_object()) return {};
  const Model& model = tree.model();
  for (NodeId id = 0; id < model.nodes.size(); ++id) {
    if (model.nodes[id].kind != Kind::kUser || model.users[model.nodes[id].data].object != *out.unsavable_object())
      continue;
    if (!out.thrown().empty()) {
      return fail("bt.unsavable",
                  fmt::format("node \"{}\" ({}) cannot be saved: its save() threw {}", tree.path(id),
                              tree.registration(id), out.thrown()),
                  tree.span(id));
    }
    return fail("bt.unsavable",
                fmt::format("node \"{}\" ({}) keeps what cannot be saved; {}", tree.path(id), tree.registration(id),
                            model.users[model.nodes[id].data].behaviour->unsaved()),
                tree.span(id));
  }
  return {};
}

}  // namespace

Result<std::string> Snapshot::save(const Tree& tree, const State& state) {
  std::string bytes(kMagic);
  Writer out(bytes);
  out.write(kVersion);
  out.write(fingerprint(tree.model()));
  out.write(state);
  out.flush();
  if (auto complete = checked(tree, out); !complete) return tl::unexpected(std::move(complete.error()));
  return bytes;
}

Result<State> Snapshot::restore(const Tree& tree, std::string_view bytes) {
  const Model& model = tree.model();
  if (!bytes.starts_with(kMagic)) return fail("bt.bad-snapshot", "this is no saved state of a tree");
  bytes.remove_prefix(kMagic.size());
  Reader in(model, bytes);
  if (const std::uint32_t version = in.u32(); !in.ok || version != kVersion) {
    return fail("bt.bad-snapshot",
                fmt::format("the state was saved by version {}; this is version {}", version, kVersion));
  }
  if (in.u64() != fingerprint(model)) return fail("bt.bad-snapshot", "the state was saved with another tree");
  State state(tree);
  in.read(state);
  if (!in.at_end() || !consistent(model, state)) return fail("bt.bad-snapshot", "the saved state is damaged");
  return state;
}

namespace {

// The nodes of one tree that are nodes of another.
std::vector<NodeId> paired(const Tree& before, const Tree& after) {
  std::vector<NodeId> node_of(before.size(), kNoNode);
  const auto alike = [&](NodeId a, NodeId b) {
    return before.model().nodes[a].kind == after.model().nodes[b].kind &&
           before.registration(a) == after.registration(b) && before.name(a) == after.name(b);
  };
  if (alike(0, 0)) node_of[0] = 0;
  // Parents come before their children.
  for (NodeId id = 0; id < before.size(); ++id) {
    if (node_of[id] == kNoNode) continue;
    const auto theirs = after.children(node_of[id]);
    std::size_t from = 0;
    for (const NodeId child : before.children(id)) {
      const auto found = std::find_if(theirs.begin() + static_cast<std::ptrdiff_t>(from), theirs.end(),
                                      [&](NodeId other) { return alike(child, other); });
      if (found == theirs.end()) continue;
      node_of[child] = *found;
      from = static_cast<std::size_t>(found - theirs.begin()) + 1;
    }
  }
  std::vector<bool> taken(after.size(), false);
  for (const NodeId node : node_of) {
    if (node != kNoNode) taken[node] = true;
  }
  for (const NodeId leaf : before.external_leaves()) {
    if (node_of[leaf] != kNoNode) continue;
    for (const NodeId other : after.external_leaves()) {
      if (!taken[other] && before.event_name(leaf) == after.event_name(other) && alike(leaf, other)) {
        node_of[leaf] = other;
        taken[other] = true;
      }
    }
  }
  return node_of;
}

// A node's memory, with the places that its children have now.
// @param matters  Whether what it remembers of them would be missed.
// @return  What cannot be carried, each as the end of a sentence about the node.
std::vector<std::string_view> carry_memory(const Tree& before, const std::vector<std::int32_t>& memory, NodeId id,
                                           const Tree& after, std::vector<std::int32_t>& next, NodeId to,
                                           const std::vector<NodeId>& node_of, bool matters) {
  const Node& was = before.model().nodes[id];
  std::vector<std::string_view> refused;
  const auto theirs = after.children(to);
  const auto children = before.children(id);
  const auto place_of = [&](std::int32_t child) {
    const auto found = std::find(theirs.begin(), theirs.end(), node_of[children[static_cast<std::size_t>(child)]]);
    return static_cast<std::int32_t>(found - theirs.begin());
  };
  const auto count = static_cast<std::int32_t>(children.size());
  const auto their_count = static_cast<std::int32_t>(theirs.size());
  bool same_children = children.size() == theirs.size();
  for (std::int32_t i = 0; same_children && i < count; ++i) same_children = place_of(i) == i;
  const std::int32_t* from = memory.data() + was.memory;
  std::int32_t* into = next.data() + after.model().nodes[to].memory;
  for (const Word& word : words(was.kind)) {
    const std::int32_t value = *from++;
    std::int32_t& kept = *into++;
    const bool counts = word.range == Word::Range::kChild || word.range == Word::Range::kChildOrEnd ||
                        word.range == Word::Range::kCounted || word.range == Word::Range::kChosen;
    if (!counts || same_children) {
      kept = value;
    } else if (value == kept || (!matters && word.lives != Word::Lives::kAlways)) {
      continue;
    } else if (word.range == Word::Range::kChild || word.range == Word::Range::kChildOrEnd) {
      kept = value < count ? place_of(value) : their_count;
      if (value < count && kept == their_count) refused.push_back("is at a child that is gone");
    } else {
      refused.push_back("counts its children, which are others now");
    }
  }
  const std::size_t bits = memory_words(was.kind, 0) == memory_words(was.kind, 1) ? 0 : children.size();
  for (std::size_t i = 0; i < bits; ++i) {
    const std::int32_t place = place_of(static_cast<std::int32_t>(i));
    const bool set = (static_cast<std::uint32_t>(from[i / 32]) >> (i % 32) & 1U) != 0;
    if (set && place < their_count)
      into[place / 32] = static_cast<std::int32_t>(static_cast<std::uint32_t>(into[place / 32]) | 1U << (place % 32));
  }
  return refused;
}

}  // namespace

void Snapshot::carry_blackboard(const Tree& before, const State& state, const Tree& after, Carried& carried,
                                Diagnostics& diagnostics) {
  const Model& is = after.model();
  for (const EntryFact& fact : blackboard(before, state)) {
    if (fact.value->is_null()) continue;
    NodeId subtree = kNoNode;
    if (!fact.scope.empty()) {
      // That of a SubTree at work goes where the SubTree has gone, whatever it is called there.
      const NodeId own = find_scope(before, fact.scope);
      subtree =
          own != kNoNode && carried.node_of[own] != kNoNode ? carried.node_of[own] : find_scope(after, fact.scope);
      if (subtree == kNoNode) continue;
    }
    if (const auto set = set_entry(after, carried.state, fact.name, *fact.value, fact.stamp, subtree); !set) {
      diagnostics.push_back({Severity::kError, "bt.cannot-carry", set.error().message, before.span(0)});
      continue;
    }
    std::uint32_t scope = 0;
    while (scope + 1 < is.scopes.size() && is.scopes[scope].subtree != subtree) ++scope;
    Blackboard entries(is, carried.state, fact.stamp);
    if (auto* held = entries.find(entries.cell(scope, fact.name))) {
      held->sequence = fact.sequence;
      held->stamp = fact.stamp;
      if (held->type == nullptr && !fact.type.empty()) held->type = find_type(is, fact.type);
    }
  }
}

Loaded<Carried> Snapshot::carry(const Tree& before, const State& state, const Tree& after) {
  const Model& was = before.model();
  const Model& is = after.model();
  Loaded<Carried> out;
  const auto refuse = [&](NodeId node, const std::string& what) {
    out.diagnostics.push_back({Severity::kError, "bt.cannot-carry",
                               fmt::format("node \"{}\" ({}) {}", before.path(node), before.registration(node), what),
                               before.span(node)});
  };
  if (was.format != is.format)
    refuse(0, fmt::format("is of a tree of format {}, the new one is of {}", was.format, is.format));
  Carried carried{State(after), paired(before, after)};
  const std::vector<NodeId>& node_of = carried.node_of;
  State& next = carried.state;

  std::vector<NodeId> open = open_nodes(was, state.waiting_);
  std::vector<bool> at_work(before.size(), false);
  for (const NodeId id : open) at_work[id] = true;
  for (const State::Timer& timer : state.timers_) at_work[timer.node] = true;
  for (const NodeId id : state.halting_) at_work[id] = true;
  if (state.waiting_ != kNoNode) at_work[state.waiting_] = true;
  for (NodeId id = 0; id < before.size(); ++id) at_work[id] = at_work[id] || state.status_[id] == Status::kRunning;

  for (NodeId id = 0; id < before.size(); ++id) {
    const NodeId to = node_of[id];
    const NodeId parent = was.nodes[id].parent;
    if (to == kNoNode) {
      if (at_work[id]) refuse(id, "is at work, and there is none of that ID and name in its place");
      continue;
    }
    const bool stays = parent == kNoNode || node_of[parent] == is.nodes[to].parent;
    if (!stays) {
      // One that is idle begins anew wherever it stands.
      if (at_work[id]) refuse(id, "is at work, and has moved");
      continue;
    }
    next.status_[to] = state.status_[id];
    const bool matters = at_work[id] || state.status_[id] != Status::kIdle;
    for (const std::string_view what :
         carry_memory(before, state.memory_, id, after, next.memory_, to, node_of, matters))
      refuse(id, std::string(what));
    if (was.nodes[id].kind == Kind::kUser) {
      const std::uint32_t object = was.users[was.nodes[id].data].object;
      const std::uint32_t their_object = is.users[is.nodes[to].data].object;
      if (object != kNone && their_object != kNone) next.objects_[their_object] = state.objects_[object];
    }
  }
  const auto carry_over = [&](NodeId node) { return node_of[node]; };
  for (const State::Timer& timer : state.timers_) next.timers_.push_back({timer.due, carry_over(timer.node)});
  for (const NodeId leaf : state.halting_) next.halting_.push_back(carry_over(leaf));
  next.waiting_ = state.waiting_ == kNoNode ? kNoNode : carry_over(state.waiting_);

  carry_blackboard(before, state, after, carried, out.diagnostics);
  if (out.diagnostics.empty() && !consistent(is, next)) refuse(0, "and what is below it do not fit the new tree");
  if (out.diagnostics.empty()) out.value = std::move(carried);
  return out;
}

Loaded<Carried> carry(const Tree& before, const State& state, const Tree& after) {
  return Snapshot::carry(before, state, after);
}

namespace {

TimePoint relative(TimePoint time, TimePoint now) { return time == kNever ? kNever : TimePoint(time - now); }

/// How a node that waits for writes stands to its entry, where entries never begin to count anew: 0 if it has seen the
/// last write. An entry that was put back to fewer writes catches up with it; one with more never does.
std::uint64_t to_be_seen(std::uint64_t seen, std::uint64_t sequence) {
  constexpr std::uint64_t kNeverCaughtUp = ~std::uint64_t{0};
  return seen >= sequence ? seen - sequence : kNeverCaughtUp;
}

/// As it lies in memory: of so many of them, and for this process only.
template <class T>
void append(std::string& out, const std::vector<T>& list) {
  static_assert(std::has_unique_object_representations_v<T>);
  out.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof(T));
}

}  // namespace

// A type has another address in each shared library; types of one name are the same.
bool Snapshot::equal(const State& a, const State& b) {
  const auto& [status, memory, links, entries, dynamic, objects, timers, halting, waiting] = members(a);
  const auto rest = std::tie(status, memory, links, dynamic, objects, timers, halting, waiting);
  const auto same = [](const State::Entry& one, const State::Entry& other) {
    const auto& [datum, type, sequence, stamp, linked] = members(one);
    if ((type == nullptr) != (other.type == nullptr) || (type != nullptr && !(*type == *other.type))) return false;
    return std::tie(datum, sequence, stamp, linked) == std::tie(other.datum, other.sequence, other.stamp, other.links);
  };
  return rest == std::tie(b.status_, b.memory_, b.links_, b.dynamic_, b.objects_, b.timers_, b.halting_, b.waiting_) &&
         std::equal(entries.begin(), entries.end(), b.entries_.begin(), b.entries_.end(), same);
}

Result<void> Snapshot::encode(const Tree& tree, const State& state, TimePoint now, std::string& out, Times times) {
  const Model& model = tree.model();
  // Names all members, so that a new one does not compile before it is clear whether behaviour depends on it.
  const auto& [status, memory, links, entries, dynamic, objects, timers, halting, waiting] = members(state);
  const std::size_t before = out.size();
  Writer writer(out, true);
  if (times == Times::kAbsolute) writer.write(now);
  append(out, status);
  const std::size_t memory_at = out.size();
  append(out, memory);
  // Entries whose numbers and times of writes a C++ node may read.
  std::vector<bool> counted(entries.size(), model.unsets);
  const std::vector<NodeId> open = open_nodes(model, waiting);
  for (const NodeId id : model.changing) {
    const Node& node = model.nodes[id];
    char* const written = out.data() + memory_at + node.memory * sizeof(memory[0]);
    char* word_at = written;
    const bool is_open = std::binary_search(open.begin(), open.end(), id);
    for (const Word& word : words(node.kind)) {
      const bool matters = is_open || word.lives == Word::Lives::kAlways ||
                           (word.lives == Word::Lives::kUnlessIdle && status[id] != Status::kIdle);
      if (!matters) std::memset(word_at, 0, sizeof(memory[0]));
      word_at += sizeof(memory[0]);
    }
    if (node.kind == Kind::kUser) {
      if (memory[node.memory] != 0 && times == Times::kFromNow) {
        out.resize(before);
        return fail("bt.asks-time",
                    fmt::format("node {} in C++ asks for the time (Context::now), so that no state of the tree ever "
                                "comes again; let a Delay or Timeout, or a skill's chart, wait",
                                tree.path(id)),
                    tree.span(id));
      }
      for (std::uint32_t i = 0; i < node.port_count; ++i) {
        const Binding& b = model.bindings[node.ports + i];
        if (b.kind != Binding::Kind::kEntry) continue;
        const std::uint32_t entry = Blackboard::resolve(model, state, b.target);
        if (entry != State::kNoEntry) counted[entry] = true;
      }
    }
    if (waits_for_writes(node.kind) && !model.unsets) {
      const std::uint32_t entry = Blackboard::resolve(model, state, node.data);
      if (entry == State::kNoEntry) continue;
      std::int32_t seen[2];
      set_seen(seen, to_be_seen(seen_of(memory.data() + node.memory), entries[entry].sequence));
      std::memcpy(written, seen, sizeof(seen));
    }
  }

  // Entries by their first use; those of names made at run time in the order of the names.
  std::vector<std::uint32_t> place(entries.size(), 0);  // from 1 on
  std::vector<std::uint32_t> used;
  const auto write_link = [&](std::uint32_t link) {
    if (link == State::kNoEntry) return writer.write(0U);
    if (place[link] == 0) {
      used.push_back(link);
      place[link] = static_cast<std::uint32_t>(used.size());
    }
    writer.write(place[link]);
  };
  for (const std::uint32_t link : links) write_link(link);
  std::vector<std::uint32_t> order(dynamic.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&dynamic = dynamic](std::uint32_t a, std::uint32_t b) {
    return std::tie(dynamic[a].scope, dynamic[a].name) < std::tie(dynamic[b].scope, dynamic[b].name);
  });
  const auto cells = static_cast<std::uint32_t>(links.size());
  writer.number(order.size(), 4);
  for (const std::uint32_t i : order) {
    const State::DynamicCell& cell = dynamic[i];
    writer.write(cell.scope);
    writer.write(cell.name);
    const bool of_dynamic = cell.parent != State::kNoEntry && cell.parent >= cells;
    writer.write(of_dynamic ? cells + static_cast<std::uint32_t>(
                                          std::find(order.begin(), order.end(), cell.parent - cells) - order.begin())
                            : cell.parent);
    write_link(cell.link);
  }
  for (const std::uint32_t i : used) {
    const auto& [datum, type, sequence, stamp, linked] = members(entries[i]);
    writer.write(datum);
    writer.write(type);
    writer.write(linked);
    if (!counted[i]) continue;
    writer.write(sequence);
    // An entry that nobody wrote has no time.
    writer.write(stamp != TimePoint{} ? relative(stamp, now) : kNever);
  }
  writer.write(objects);

  // Of timers that are due at once, the one set first fires first.
  std::vector<State::Timer> rings = timers;
  for (State::Timer& timer : rings) timer.due = relative(timer.due, now);
  std::stable_sort(rings.begin(), rings.end(),
                   [](const State::Timer& a, const State::Timer& b) { return a.due < b.due; });
  writer.write(rings);
  std::vector<NodeId> halts = halting;
  std::sort(halts.begin(), halts.end());
  writer.write(halts);
  writer.write(waiting);
  writer.flush();

  auto complete = checked(tree, writer);
  if (!complete) out.resize(before);
  return complete;
}

bool Snapshot::consistent(const Model& model, const State& state) {
  const auto link_ok = [&](std::uint32_t link) {
    return link == State::kNoEntry || (link < state.entries_.size() && state.entries_[link].links > 0);
  };
  const auto node_ok = [&](NodeId node) { return node < model.nodes.size(); };
  const std::size_t cells = model.cells.size() + state.dynamic_.size();
  if (state.status_.size() != model.nodes.size() || state.memory_.size() != model.memory_words ||
      state.links_.size() != model.cells.size() || state.entries_.size() < model.homes) {
    return false;
  }
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
    return node_ok(timer.node) && starts_timers(model.nodes[timer.node].kind);
  };
  const auto is_external = [&](NodeId node) {
    return node_ok(node) &&
           (model.nodes[node].kind == Kind::kExternalAction || model.nodes[node].kind == Kind::kExternalCondition);
  };
  if (!std::all_of(state.timers_.begin(), state.timers_.end(), is_timed) ||
      !std::all_of(state.halting_.begin(), state.halting_.end(), is_external) ||
      (state.waiting_ != kNoNode && !is_external(state.waiting_))) {
    return false;
  }
  const std::vector<NodeId> open = open_nodes(model, state.waiting_);
  for (NodeId id = 0; id < model.nodes.size(); ++id) {
    const Node& node = model.nodes[id];
    const bool is_open = std::binary_search(open.begin(), open.end(), id);
    const std::int32_t* memory = state.memory_.data() + node.memory;
    for (const Word& word : words(node.kind)) {
      if (!in_range(word.range, *memory++, static_cast<std::int32_t>(node.child_count), is_open)) return false;
    }
  }
  return true;
}

bool operator==(const State& a, const State& b) { return Snapshot::equal(a, b); }

std::uint64_t State::hash() const {
  std::string bytes;
  Writer(bytes).write(*this);
  return hash_bytes(bytes);
}

Result<std::string> save(const Tree& tree, const State& state) { return Snapshot::save(tree, state); }
Result<State> restore(const Tree& tree, std::string_view bytes) { return Snapshot::restore(tree, bytes); }
Result<void> encode(const Tree& tree, const State& state, TimePoint now, std::string& out, Times times) {
  return Snapshot::encode(tree, state, now, out, times);
}

}  // namespace sentree::bt
