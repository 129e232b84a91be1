#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/bt/palette.h"
#include "sentree/bt/registry.h"
#include "sentree/bt/tree.h"
#include "sentree/bt/types.h"
#include "sentree/text/xml_diff.h"

namespace sentree::bt {

/// The C++ nodes of a registry as models, by ID; with the built-in ones of format 4 if asked for.
[[nodiscard]] std::vector<NodeModel> models(const Registry& registry, bool with_builtins = false);

/// A `<TreeNodesModel>` element with those nodes, indented by two spaces, ending in a line break.
[[nodiscard]] std::string write_models(const std::vector<NodeModel>& models);

/// The file with its TreeNodesModel replaced by (or, where it has none, extended by) these models. Nodes of the file's
/// own model that are not among them, or that say the same already, stay; so does everything outside it, byte for byte.
/// Errors: xml.*, bt.not-a-tree.
[[nodiscard]] Result<std::string> with_models(std::string_view xml, const std::vector<NodeModel>& models,
                                              std::string file = {});

/// The file in the canonical form of `text::format_xml`, attributes as `ID`, `name`, ports, conditions; comments,
/// unknown attributes and the order of elements kept. Formatting twice changes nothing, and the tree stays the same.
/// Errors: xml.*.
[[nodiscard]] Result<std::string> format(std::string_view xml, std::string file = {});

using text::Difference;

/// What differs in meaning: trees, nodes, ports, conditions. White space, comments, the order of attributes and whether
/// a node is written explicitly or compactly do not count. A node that went to another parent has moved, with all that
/// is below it. Errors: xml.*, bt.not-a-tree.
/// @param pairs  If given, receives which elements are the same; without those of models and includes.
[[nodiscard]] Result<std::vector<Difference>> diff(std::string_view before, std::string_view after,
                                                   std::string before_file = {}, std::string after_file = {},
                                                   text::ElementPairs* pairs = nullptr);

}  // namespace sentree::bt
