#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/tree.h"
#include "sentree/bt/types.h"

namespace sentree::text {
class XmlElement;
}

namespace sentree::bt {

/// What a palette (Groot's, the studio's) must know of a node.
struct NodeModel {
  std::string id;
  Category category = Category::kAction;
  Ports ports;
  std::string description;
};

/// The nodes that the file's own TreeNodesModel describes, in its order. Errors: xml.*, bt.not-a-tree.
[[nodiscard]] Result<std::vector<NodeModel>> read_models(std::string_view xml, std::string file = {});

/// One element of a TreeNodesModel. Nothing for one that describes no node.
[[nodiscard]] std::optional<NodeModel> read_model(const text::XmlElement& element);

/// What nodes are, said outside the tree that uses them: for `LoadOptions::palette`.
class Palette {
 public:
  /// Of two models of one ID the first counts.
  void add(const std::vector<NodeModel>& models);
  /// Null: the palette does not know it. A SubTree is no node of a palette.
  [[nodiscard]] const NodeModel* find(std::string_view id) const;
  [[nodiscard]] const std::map<std::string, NodeModel, std::less<>>& nodes() const { return nodes_; }

 private:
  std::map<std::string, NodeModel, std::less<>> nodes_;
};

/// What `models` describe, apart from SubTrees: "a palette of N nodes" has so many.
[[nodiscard]] std::size_t node_count(const std::vector<NodeModel>& models);

}  // namespace sentree::bt
