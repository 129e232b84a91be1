#include "sentree/design/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "sentree/bt/write.h"
#include "sentree/graph/chart.h"
#include "sentree/graph/tree.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/diff.h"
#include "sentree/scxml/model.h"
#include "sentree/text/xml.h"

namespace sentree::design {

namespace {

using text::Difference;
using text::XmlDocument;
using text::XmlElement;

constexpr int kNowhere = -1;

// Bytes of places that findings and charts have as line and column.
class ComparedLines {
 public:
  explicit ComparedLines(std::string_view text) {
    for (std::size_t at = text.find('\n'); at != std::string_view::npos; at = text.find('\n', at + 1))
      starts_.push_back(at + 1);
  }
  [[nodiscard]] std::size_t offset(int line, int column) const {
    const auto place = static_cast<std::size_t>(std::max(line - 1, 0));
    return starts_[std::min(place, starts_.size() - 1)] + static_cast<std::size_t>(std::max(column - 1, 0));
  }

 private:
  std::vector<std::size_t> starts_{0};
};

// One side of a picture: what a part is in, always an earlier one; and which part of the other side it is.
struct Side {
  std::vector<int> parents;
  std::vector<int> partners;
};

// A part of the joined picture: where it is on either side.
struct ComparedPart {
  int before = kNowhere;
  int after = kNowhere;
  int parent = kNowhere;
  Mark mark = Mark::kNone;
};

struct Joined {
  std::vector<ComparedPart> parts;  // a part before those in it
  std::vector<int> of_before;
  std::vector<int> of_after;
  std::vector<std::pair<int, int>> moves;
};

// Everything of the second side, in its order; what the first has beyond that where it was.
class Joiner {
 public:
  Joiner(const Side& before, const Side& after, const std::vector<bool>& moved)
      : before_(before), after_(after), moved_(moved) {}

  Joined run() {
    for (std::size_t i = 0; i < after_.parents.size(); ++i) {
      const int partner = after_.partners[i];
      const Mark mark = partner == kNowhere                         ? Mark::kAdded
                        : moved_[static_cast<std::size_t>(partner)] ? Mark::kMoved
                                                                    : Mark::kNone;
      add({partner, static_cast<int>(i), after_.parents[i], mark}, kEnd);
    }
    // Where each part of the first side is now, as what is in it is told; and where one that moved was.
    std::vector<int> now(before_.parents.size(), kNowhere);
    std::vector<int> left(before_.parents.size(), kNowhere);
    for (std::size_t i = 0; i < before_.parents.size(); ++i) {
      const int partner = before_.partners[i];
      const int parent = before_.parents[i] == kNowhere ? kNowhere : now[static_cast<std::size_t>(before_.parents[i])];
      const bool is_ghost = partner == kNowhere || moved_[i];
      if (is_ghost) {
        const int ghost =
            add({static_cast<int>(i), partner, parent, partner == kNowhere ? Mark::kRemoved : Mark::kLeft},
                behind(i, parent, now, left));
        if (partner == kNowhere)
          now[i] = ghost;
        else
          left[i] = ghost;
      }
      if (partner != kNowhere) now[i] = partner;
    }
    return flat(now);
  }

 private:
  static constexpr std::size_t kEnd = static_cast<std::size_t>(-1);

  std::vector<int>& inside(int parent) {
    return parent == kNowhere ? roots_ : children_[static_cast<std::size_t>(parent)];
  }

  int add(ComparedPart part, std::size_t at) {
    const int index = static_cast<int>(parts_.size());
    parts_.push_back(part);
    children_.emplace_back();
    auto& list = inside(part.parent);
    list.insert(at == kEnd ? list.end() : list.begin() + static_cast<std::ptrdiff_t>(at), index);
    return index;
  }

  // Where a part of the first side belongs among those in `parent`: behind the nearest one before it that is there too.
  std::size_t behind(std::size_t part, int parent, const std::vector<int>& now, const std::vector<int>& left) {
    const auto& list = inside(parent);
    for (std::size_t i = part; i-- > 0;) {
      if (before_.parents[i] != before_.parents[part]) continue;
      for (const int candidate : {left[i], now[i]}) {
        const auto found = std::find(list.begin(), list.end(), candidate);
        if (candidate != kNowhere && found != list.end()) return static_cast<std::size_t>(found - list.begin()) + 1;
      }
    }
    return 0;
  }

  Joined flat(const std::vector<int>& now) const {
    Joined joined;
    std::vector<int> place(parts_.size(), kNowhere);
    std::vector<int> rest(roots_.rbegin(), roots_.rend());
    while (!rest.empty()) {
      const int index = rest.back();
      rest.pop_back();
      const auto at = static_cast<std::size_t>(index);
      place[at] = static_cast<int>(joined.parts.size());
      joined.parts.push_back(parts_[at]);
      ComparedPart& part = joined.parts.back();
      if (part.parent != kNowhere) part.parent = place[static_cast<std::size_t>(part.parent)];
      rest.insert(rest.end(), children_[at].rbegin(), children_[at].rend());
    }
    joined.of_before.assign(now.size(), kNowhere);
    for (std::size_t i = 0; i < now.size(); ++i) joined.of_before[i] = place[static_cast<std::size_t>(now[i])];
    joined.of_after.assign(place.begin(), place.begin() + static_cast<std::ptrdiff_t>(after_.parents.size()));
    for (std::size_t i = after_.parents.size(); i < parts_.size(); ++i) {
      if (parts_[i].mark == Mark::kLeft)
        joined.moves.emplace_back(place[i], place[static_cast<std::size_t>(parts_[i].after)]);
    }
    return joined;
  }

  const Side& before_;
  const Side& after_;
  const std::vector<bool>& moved_;
  std::vector<ComparedPart> parts_;
  std::vector<std::vector<int>> children_;
  std::vector<int> roots_;
};

// What is written in both, once; else what was and what is.
std::string either(const std::string& was, const std::string& is) {
  if (was == is) return is;
  return fmt::format("{} → {}", was.empty() ? "(none)" : was, is.empty() ? "(none)" : is);
}

using Texts = std::vector<std::string>;
Texts both(const Texts& was, const Texts& is) {
  Texts lines;
  for (const std::string& line : was) {
    if (std::find(is.begin(), is.end(), line) == is.end()) lines.push_back("− " + line);
  }
  for (const std::string& line : is)
    lines.push_back(std::find(was.begin(), was.end(), line) == was.end() ? "+ " + line : line);
  return lines;
}

// A node whose ports are "kitchen → hall" where they differ.
draw::TreeNode drawing_of_both(const OutlineNode& was, const OutlineNode& is) {
  draw::TreeNode drawn = drawing_of(is);
  const draw::TreeNode before = drawing_of(was);
  drawn.symbol = either(before.symbol, drawn.symbol);
  drawn.title = either(before.title, drawn.title);
  drawn.lines.clear();
  if (drawn.symbol.empty() && (was.id != is.id || (!is.name.empty() && is.name != is.id)))
    drawn.lines.push_back(either(was.id, is.id));
  const std::map<std::string, std::string> old(was.attributes.begin(), was.attributes.end());
  std::set<std::string> now;
  for (const auto& [name, value] : is.attributes) {
    now.insert(name);
    const auto before_value = old.find(name);
    drawn.lines.push_back(before_value == old.end() ? fmt::format("+ {}: {}", name, value)
                                                    : fmt::format("{}: {}", name, either(before_value->second, value)));
  }
  for (const auto& [name, value] : was.attributes) {
    if (!now.contains(name)) drawn.lines.push_back(fmt::format("− {}: {}", name, value));
  }
  return drawn;
}

// ---- trees ----

using Counterparts = std::map<std::size_t, std::size_t>;

struct Differences {
  std::vector<Difference> list;
  Counterparts pairs;                   // bytes
  std::set<std::size_t> moved;          // bytes in the first text
  std::map<std::size_t, bool> arrived;  // bytes in the second text that have a counterpart: it has moved
  std::vector<std::size_t> offsets;     // by difference: byte in the second text, of what is gone in the first
};

Differences located(std::vector<Difference> list, const text::ElementPairs& pairs, std::string_view before,
                    std::string_view after) {
  Differences found{std::move(list), Counterparts(pairs.begin(), pairs.end()), {}, {}, {}};
  const ComparedLines first(before);
  const ComparedLines second(after);
  for (const Difference& difference : found.list) {
    const bool is_gone = difference.kind == Difference::Kind::kRemoved;
    if (difference.kind == Difference::Kind::kMoved)
      found.moved.insert(first.offset(difference.before.line, difference.before.column));
    found.offsets.push_back(is_gone ? first.offset(difference.before.line, difference.before.column)
                                    : second.offset(difference.after.line, difference.after.column));
  }
  for (const auto& [was, is] : found.pairs) found.arrived[is] = found.moved.contains(was);
  return found;
}

Side side_of(const std::vector<OutlineNode>& nodes) {
  Side side;
  for (const OutlineNode& node : nodes) side.parents.push_back(node.parent);
  side.partners.assign(nodes.size(), kNowhere);
  return side;
}

const OutlineTree* find(const Outline& outline, const std::string& id) {
  const auto found =
      std::find_if(outline.trees.begin(), outline.trees.end(), [&](const auto& t) { return t.id == id; });
  return found != outline.trees.end() ? &*found : nullptr;
}

// Where the bytes of either text are in the picture.
struct ShownAt {
  std::map<std::size_t, std::pair<int, int>> before;  // tree and node
  std::map<std::size_t, std::pair<int, int>> after;
};

ComparedTree compare_tree(const OutlineTree& before, const OutlineTree& after, const Differences& differences,
                          int tree_index, ShownAt& shown) {
  Side first = side_of(before.nodes);
  Side second = side_of(after.nodes);
  std::map<std::size_t, int> place;
  for (std::size_t i = 0; i < after.nodes.size(); ++i) place[after.nodes[i].from] = static_cast<int>(i);
  std::vector<bool> moved(before.nodes.size(), false);
  for (std::size_t i = 0; i < before.nodes.size(); ++i) {
    const auto pair = differences.pairs.find(before.nodes[i].from);
    const auto partner = pair != differences.pairs.end() ? place.find(pair->second) : place.end();
    if (partner == place.end() || second.partners[static_cast<std::size_t>(partner->second)] != kNowhere) continue;
    first.partners[i] = partner->second;
    second.partners[static_cast<std::size_t>(partner->second)] = static_cast<int>(i);
    moved[i] = differences.moved.contains(before.nodes[i].from);
  }
  const Joined joined = Joiner(first, second, moved).run();
  ComparedTree compared{.id = after.id, .drawing = {}, .marks = {}, .moves = joined.moves};
  for (ComparedPart part : joined.parts) {
    const auto was = static_cast<std::size_t>(part.before);
    const auto is = static_cast<std::size_t>(part.after);
    // One that went from one tree to another is in both pictures.
    if (part.mark == Mark::kRemoved && differences.pairs.contains(before.nodes[was].from)) part.mark = Mark::kLeft;
    if (part.mark == Mark::kAdded && differences.arrived.contains(after.nodes[is].from))
      part.mark = differences.arrived.at(after.nodes[is].from) ? Mark::kMoved : Mark::kNone;
    draw::TreeNode drawn = part.mark == Mark::kRemoved || part.mark == Mark::kLeft ? drawing_of(before.nodes[was])
                           : part.before == kNowhere                               ? drawing_of(after.nodes[is])
                                                     : drawing_of_both(before.nodes[was], after.nodes[is]);
    if (part.mark == Mark::kLeft) drawn.lines.clear();
    drawn.parent = part.parent;
    compared.drawing.nodes.push_back(std::move(drawn));
    compared.marks.push_back(part.mark);
  }
  compared.drawing.direction = draw::best_direction(compared.drawing);
  for (std::size_t i = 0; i < before.nodes.size(); ++i)
    shown.before[before.nodes[i].from] = {tree_index, joined.of_before[i]};
  for (std::size_t i = 0; i < after.nodes.size(); ++i)
    shown.after[after.nodes[i].from] = {tree_index, joined.of_after[i]};
  // What is said of a tree is shown at its root.
  if (!joined.parts.empty()) {
    shown.before.emplace(before.from, std::pair(tree_index, 0));
    shown.after.emplace(after.from, std::pair(tree_index, 0));
  }
  return compared;
}

Result<Comparison> compare_trees(std::string_view before, std::string_view after, const Kinds& kinds,
                                 const std::string& before_file, const std::string& after_file) {
  text::ElementPairs pairs;
  auto list = bt::diff(before, after, before_file, after_file, &pairs);
  if (!list) return tl::unexpected(list.error());
  const auto first = outline_of(before, kinds, before_file);
  if (!first) return tl::unexpected(first.error());
  const auto second = outline_of(after, kinds, after_file);
  if (!second) return tl::unexpected(second.error());
  Differences differences = located(std::move(*list), pairs, before, after);
  Comparison comparison;
  ShownAt shown;
  const auto add = [&](const OutlineTree& was, const OutlineTree& is) {
    comparison.trees.push_back(compare_tree(was, is, differences, static_cast<int>(comparison.trees.size()), shown));
  };
  const OutlineTree none;
  for (const OutlineTree& tree : second->trees) {
    const OutlineTree* const was = find(*first, tree.id);
    add(was != nullptr ? *was : none, tree);
  }
  for (const OutlineTree& tree : first->trees) {
    if (find(*second, tree.id) != nullptr) continue;
    OutlineTree gone;
    gone.id = tree.id;
    gone.from = tree.from;
    add(tree, gone);
  }
  for (std::size_t i = 0; i < differences.list.size(); ++i) {
    const Difference& difference = differences.list[i];
    const bool is_gone = difference.kind == Difference::Kind::kRemoved;
    const auto& places = is_gone ? shown.before : shown.after;
    const auto found = places.find(differences.offsets[i]);
    ComparedPlace place;
    if (found != places.end()) {
      place.tree = found->second.first;
      place.part = found->second.second;
      Mark& mark = comparison.trees[static_cast<std::size_t>(place.tree)].marks[static_cast<std::size_t>(place.part)];
      if (difference.kind == Difference::Kind::kChanged && mark == Mark::kNone) mark = Mark::kChanged;
    }
    comparison.places.push_back(place);
  }
  comparison.differences = std::move(differences.list);
  return comparison;
}

// ---- charts ----

struct ChartSide {
  scxml::Chart chart;
  draw::Chart drawing;
  std::vector<scxml::StateIndex> states;
  std::vector<scxml::TransitionIndex> transitions;
  std::vector<std::size_t> state_bytes;               // by drawn state; of a dot: of what it is in
  std::vector<std::size_t> transition_bytes;          // by drawn transition
  std::map<std::size_t, std::pair<int, int>> owners;  // by byte of an element: drawn state or transition that it is in
};

// The drawn state or transition that each element is in.
void find_owners(const XmlElement& root, ChartSide& side) {
  std::map<std::size_t, std::pair<int, int>> own;
  int begin = kNowhere;
  for (std::size_t i = 0; i < side.transitions.size(); ++i) {
    const auto source = static_cast<std::size_t>(side.drawing.transitions[i].source);
    if (side.states[source] != scxml::kNoState)
      own[side.transition_bytes[i]] = {kNowhere, static_cast<int>(i)};
    else if (side.drawing.states[source].parent == kNowhere)
      begin = static_cast<int>(i);
  }
  for (std::size_t i = 0; i < side.states.size(); ++i) {
    if (side.states[i] != scxml::kNoState) own[side.state_bytes[i]] = {static_cast<int>(i), kNowhere};
  }
  std::vector<std::pair<XmlElement, std::pair<int, int>>> rest{{root, {kNowhere, kNowhere}}};
  while (!rest.empty()) {
    auto [element, owner] = rest.back();
    rest.pop_back();
    if (const auto found = own.find(element.offset()); found != own.end()) owner = found->second;
    side.owners[element.offset()] = owner;
    for (const XmlElement& child : element.children()) rest.emplace_back(child, owner);
  }
  // What is said of the chart itself is shown where it begins.
  side.owners[root.offset()] = {kNowhere, begin};
}

Result<ChartSide> chart_side(std::string_view source, const std::string& file) {
  auto loaded = scxml::load(std::string(source), file);
  if (!loaded.value) {
    const auto error = std::find_if(loaded.diagnostics.begin(), loaded.diagnostics.end(),
                                    [](const Diagnostic& d) { return d.severity == Severity::kError; });
    if (error != loaded.diagnostics.end()) return tl::unexpected(*error);
    return fail("scxml.no-scxml", file + " is no state chart");
  }
  auto document = XmlDocument::parse(std::string(source), file, {.lenient = true});
  if (!document) return tl::unexpected(document.error());
  ChartSide side{std::move(*loaded.value), {}, {}, {}, {}, {}, {}};
  side.drawing = graph::drawing_of(side.chart, nullptr, scxml::kNoTransition, &side.states, &side.transitions);
  const ComparedLines lines(source);
  for (std::size_t i = 0; i < side.states.size(); ++i) {
    const bool is_dot = side.states[i] == scxml::kNoState;
    const int parent = side.drawing.states[i].parent;
    const scxml::StateIndex of = !is_dot              ? side.states[i]
                                 : parent == kNowhere ? scxml::StateIndex{0}
                                                      : side.states[static_cast<std::size_t>(parent)];
    const scxml::Place& place = side.chart.states()[of].place;
    side.state_bytes.push_back(lines.offset(place.line, place.column));
  }
  for (std::size_t i = 0; i < side.transitions.size(); ++i) {
    const scxml::Place& place = side.chart.transitions()[side.transitions[i]].place;
    const auto from = static_cast<std::size_t>(side.drawing.transitions[i].source);
    // The one of an attribute `initial` has no element; that of what it is in stands for it.
    side.transition_bytes.push_back(side.states[from] == scxml::kNoState ? side.state_bytes[from]
                                                                         : lines.offset(place.line, place.column));
  }
  find_owners(document->root(), side);
  return side;
}

bool is_dot(const ChartSide& side, int state) {
  return side.states[static_cast<std::size_t>(state)] == scxml::kNoState;
}

Side nesting_of(const ChartSide& side) {
  Side nesting;
  for (const draw::ChartState& state : side.drawing.states) nesting.parents.push_back(state.parent);
  nesting.partners.assign(side.states.size(), kNowhere);
  return nesting;
}

draw::ChartTransition drawing_of_both(const draw::ChartTransition& was, const draw::ChartTransition& is) {
  draw::ChartTransition drawn = is;
  drawn.event = was.event == is.event ? is.event : either(was.event, is.event);
  drawn.condition = was.condition == is.condition ? is.condition : either(was.condition, is.condition);
  drawn.actions = was.actions == is.actions ? is.actions : either(was.actions, is.actions);
  return drawn;
}

class ChartComparison {
 public:
  ChartComparison(const ChartSide& before, const ChartSide& after, const Differences& differences)
      : before_(before), after_(after), differences_(differences) {}

  void run(Comparison& comparison) {
    join_states();
    join_transitions();
    for (std::size_t i = 0; i < differences_.list.size(); ++i) comparison.places.push_back(place_of(i));
    comparison.chart = std::move(compared_);
  }

 private:
  void join_states() {
    Side first = nesting_of(before_);
    Side second = nesting_of(after_);
    // A dot is the one of what it is in: both kinds are found by the byte of that, apart from one another.
    std::map<std::pair<bool, std::size_t>, int> places;
    for (std::size_t i = 0; i < after_.states.size(); ++i)
      places.emplace(std::pair(is_dot(after_, static_cast<int>(i)), after_.state_bytes[i]), static_cast<int>(i));
    std::vector<bool> moved(before_.states.size(), false);
    for (std::size_t i = 0; i < before_.states.size(); ++i) {
      const bool dot = is_dot(before_, static_cast<int>(i));
      const auto pair = differences_.pairs.find(before_.state_bytes[i]);
      const auto partner = pair != differences_.pairs.end() ? places.find({dot, pair->second}) : places.end();
      if (partner == places.end()) continue;
      first.partners[i] = partner->second;
      second.partners[static_cast<std::size_t>(partner->second)] = static_cast<int>(i);
      moved[i] = !dot && differences_.moved.contains(before_.state_bytes[i]);
    }
    joined_ = Joiner(first, second, moved).run();
    for (const ComparedPart& part : joined_.parts) {
      const bool is_ghost = part.mark == Mark::kRemoved || part.mark == Mark::kLeft;
      draw::ChartState drawn = is_ghost ? before_.drawing.states[static_cast<std::size_t>(part.before)]
                                        : after_.drawing.states[static_cast<std::size_t>(part.after)];
      if (part.mark == Mark::kLeft) drawn.lines.clear();
      if (!is_ghost && part.before != kNowhere) {
        const draw::ChartState& was = before_.drawing.states[static_cast<std::size_t>(part.before)];
        drawn.lines = both(was.lines, drawn.lines);
        if (was.name != drawn.name) drawn.name = either(was.name, drawn.name);
      }
      drawn.parent = part.parent;
      compared_.drawing.states.push_back(std::move(drawn));
      compared_.states.push_back(part.mark);
    }
    compared_.moves = joined_.moves;
  }

  void join_transitions() {
    std::map<std::pair<bool, std::size_t>, std::size_t> places;
    for (std::size_t i = 0; i < after_.transitions.size(); ++i)
      places.emplace(std::pair(is_dot(after_, after_.drawing.transitions[i].source), after_.transition_bytes[i]), i);
    std::vector<int> partner_of(after_.transitions.size(), kNowhere);
    std::vector<std::size_t> gone;
    for (std::size_t i = 0; i < before_.transitions.size(); ++i) {
      const bool from_dot = is_dot(before_, before_.drawing.transitions[i].source);
      const auto pair = differences_.pairs.find(before_.transition_bytes[i]);
      const auto partner = pair != differences_.pairs.end() ? places.find({from_dot, pair->second}) : places.end();
      if (partner != places.end() && partner_of[partner->second] == kNowhere)
        partner_of[partner->second] = static_cast<int>(i);
      else
        gone.push_back(i);
    }
    for (std::size_t i = 0; i < after_.transitions.size(); ++i) {
      const draw::ChartTransition& is = after_.drawing.transitions[i];
      const int was = partner_of[i];
      Mark mark = was == kNowhere ? Mark::kAdded : Mark::kNone;
      draw::ChartTransition drawn =
          was == kNowhere ? is : drawing_of_both(before_.drawing.transitions[static_cast<std::size_t>(was)], is);
      put(drawn, joined_.of_after, mark);
      if (was == kNowhere) continue;
      // One that leads elsewhere now: its old arrow as well.
      const draw::ChartTransition& old = before_.drawing.transitions[static_cast<std::size_t>(was)];
      if (targets(old, joined_.of_before) == targets(is, joined_.of_after)) continue;
      compared_.transitions.back() = Mark::kChanged;
      redirected_.push_back(old);
    }
    for (draw::ChartTransition& ghost : redirected_) {
      ghost.event = ghost.condition = ghost.actions = "";
      put(ghost, joined_.of_before, Mark::kLeft);
    }
    for (const std::size_t i : gone) {
      gone_at_[i] = static_cast<int>(compared_.transitions.size());
      put(before_.drawing.transitions[i], joined_.of_before, Mark::kRemoved);
    }
  }

  static std::vector<int> targets(const draw::ChartTransition& transition, const std::vector<int>& places) {
    std::vector<int> list;
    for (const int target : transition.targets) list.push_back(places[static_cast<std::size_t>(target)]);
    return list;
  }

  void put(draw::ChartTransition drawn, const std::vector<int>& places, Mark mark) {
    drawn.targets = targets(drawn, places);
    drawn.source = places[static_cast<std::size_t>(drawn.source)];
    compared_.drawing.transitions.push_back(std::move(drawn));
    compared_.transitions.push_back(mark);
  }

  ComparedPlace place_of(std::size_t difference) {
    const bool is_gone = differences_.list[difference].kind == Difference::Kind::kRemoved;
    const ChartSide& side = is_gone ? before_ : after_;
    const auto owner = side.owners.find(differences_.offsets[difference]);
    ComparedPlace place;
    if (owner == side.owners.end()) return place;
    const auto [state, transition] = owner->second;
    const auto change = [](Mark& mark) {
      if (mark == Mark::kNone) mark = Mark::kChanged;
    };
    if (state != kNowhere) {
      place.part = (is_gone ? joined_.of_before : joined_.of_after)[static_cast<std::size_t>(state)];
      change(compared_.states[static_cast<std::size_t>(place.part)]);
    } else if (transition != kNowhere) {
      place.transition = transition;
      if (is_gone) {
        const auto gone = gone_at_.find(static_cast<std::size_t>(transition));
        place.transition = gone != gone_at_.end() ? gone->second : after_of(static_cast<std::size_t>(transition));
      }
      if (place.transition != kNowhere) change(compared_.transitions[static_cast<std::size_t>(place.transition)]);
    }
    return place;
  }

  // Of a transition of the first text that there still is.
  [[nodiscard]] int after_of(std::size_t transition) const {
    const auto pair = differences_.pairs.find(before_.transition_bytes[transition]);
    if (pair == differences_.pairs.end()) return kNowhere;
    const auto owner = after_.owners.find(pair->second);
    return owner != after_.owners.end() ? owner->second.second : kNowhere;
  }

  const ChartSide& before_;
  const ChartSide& after_;
  const Differences& differences_;
  Joined joined_;
  ComparedChart compared_;
  std::map<std::size_t, int> gone_at_;
  std::vector<draw::ChartTransition> redirected_;
};

Result<Comparison> compare_charts(std::string_view before, std::string_view after, const std::string& before_file,
                                  const std::string& after_file) {
  text::ElementPairs pairs;
  auto list = scxml::diff(before, after, before_file, after_file, &pairs);
  if (!list) return tl::unexpected(list.error());
  const auto first = chart_side(before, before_file);
  if (!first) return tl::unexpected(first.error());
  const auto second = chart_side(after, after_file);
  if (!second) return tl::unexpected(second.error());
  Differences differences = located(std::move(*list), pairs, before, after);
  Comparison comparison;
  ChartComparison(*first, *second, differences).run(comparison);
  comparison.differences = std::move(differences.list);
  return comparison;
}

enum class What { kTree, kChart, kOther };

// Errors: those of XML that cannot be read; what does not look like XML is something else.
Result<What> what_is(std::string_view source, const std::string& file) {
  const auto document = XmlDocument::parse(std::string(source), file, {.lenient = true});
  if (!document) {
    const std::size_t begin = source.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
    const bool is_xml =
        file.ends_with(".xml") || file.ends_with(".scxml") || (begin != std::string_view::npos && source[begin] == '<');
    return is_xml ? tl::unexpected(document.error()) : Result<What>(What::kOther);
  }
  if (scxml::is_chart(document->root())) return What::kChart;
  return document->root().name() == "root" ? What::kTree : What::kOther;
}

}  // namespace

std::string_view to_string(Mark mark) {
  switch (mark) {
    case Mark::kNone: return "";
    case Mark::kAdded: return "added";
    case Mark::kRemoved: return "removed";
    case Mark::kChanged: return "changed";
    case Mark::kMoved: return "moved";
    case Mark::kLeft: return "left";
  }
  return "";
}

draw::TreeNode drawing_of(const OutlineNode& node) {
  draw::TreeNode drawn;
  drawn.parent = node.parent;
  switch (node.category) {
    case bt::Category::kControl: drawn.shape = draw::TreeShape::kControl; break;
    case bt::Category::kDecorator: drawn.shape = draw::TreeShape::kDecorator; break;
    case bt::Category::kCondition: drawn.shape = draw::TreeShape::kCondition; break;
    case bt::Category::kAction: drawn.shape = draw::TreeShape::kAction; break;
    case bt::Category::kSubTree: drawn.shape = draw::TreeShape::kSubtree; break;
  }
  if (node.category == bt::Category::kControl || node.category == bt::Category::kDecorator) {
    drawn.symbol = graph::symbol_of(node.id);
    drawn.title = node.name != node.id ? node.name : "";
  } else {
    drawn.title = node.name.empty() ? node.id : node.name;
    if (!node.name.empty() && node.name != node.id) drawn.lines.push_back(node.id);
  }
  for (const auto& [name, value] : node.attributes) drawn.lines.push_back(fmt::format("{}: {}", name, value));
  return drawn;
}

Result<Comparison> compare(std::string_view before, std::string_view after, const Kinds& kinds,
                           const std::string& before_file, const std::string& after_file) {
  const auto unreadable = [&](Diagnostic why, const char* side) {
    why.message = fmt::format("{}cannot be read, so that texts are compared: {}", before_file == after_file ? side : "",
                              why.message);
    return tl::unexpected(std::move(why));
  };
  const auto first = what_is(before, before_file);
  if (!first) return unreadable(first.error(), "what was there ");
  const auto second = what_is(after, after_file);
  if (!second) return unreadable(second.error(), "what is there now ");
  if (*first != *second || *first == What::kOther)
    return fail("diff.unlike", "what can be drawn as one picture are two trees or two charts; " +
                                   (before_file == after_file
                                        ? after_file + " is compared as text"
                                        : fmt::format("{} and {} are compared as texts", before_file, after_file)));
  return *first == What::kTree ? compare_trees(before, after, kinds, before_file, after_file)
                               : compare_charts(before, after, before_file, after_file);
}

}  // namespace sentree::design
