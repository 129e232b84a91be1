#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/design/tree_edit.h"
#include "sentree/draw/chart.h"
#include "sentree/draw/tree.h"
#include "sentree/text/xml_diff.h"

namespace sentree::design {

/// What became of a part of a picture from one text to the other.
enum class Mark {
  kNone,
  kAdded,
  kRemoved,  ///< Drawn where it was.
  kChanged,  ///< Its texts say what was and what is.
  kMoved,    ///< Where it is now.
  kLeft,     ///< Where one that moved was.
};

[[nodiscard]] std::string_view to_string(Mark mark);

/// Two trees of one ID as one picture.
struct ComparedTree {
  std::string id;
  draw::Tree drawing;
  std::vector<Mark> marks;                 ///< By node of the drawing.
  std::vector<std::pair<int, int>> moves;  ///< From a kLeft to its kMoved.
};

/// Two charts as one picture.
struct ComparedChart {
  draw::Chart drawing;
  std::vector<Mark> states;
  std::vector<Mark> transitions;
  std::vector<std::pair<int, int>> moves;  ///< Of states.
};

/// Where the picture shows a difference.
struct ComparedPlace {
  int tree = -1;        ///< In `Comparison::trees`; -1: the picture does not show it, or it is of a chart.
  int part = -1;        ///< Node or state; -1: the picture does not show it.
  int transition = -1;  ///< Of a chart, instead of a state.
};

struct Comparison {
  std::vector<text::Difference> differences;  ///< What `sentree diff` says, one by one.
  std::vector<ComparedPlace> places;          ///< By difference.
  std::vector<ComparedTree> trees;
  std::optional<ComparedChart> chart;
};

/// Two texts of trees, or of charts, as one picture. Nodes and states are paired as `bt::diff` and `scxml::diff` do.
/// Errors: those of them; those of `outline_of` or `scxml::load`; diff.unlike (a tree and a chart, or neither).
/// Cost: that of the diff, and O(size).
[[nodiscard]] Result<Comparison> compare(std::string_view before, std::string_view after, const Kinds& kinds,
                                         const std::string& before_file, const std::string& after_file);

/// How a node of a file is drawn: symbol, name, what it is, and a line for each attribute.
[[nodiscard]] draw::TreeNode drawing_of(const OutlineNode& node);

}  // namespace sentree::design
