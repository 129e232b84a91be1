#include <algorithm>
#include <utility>

#include "sentree/bt/model.h"
#include "sentree/bt/write.h"
#include "sentree/text/xml_format.h"

// The canonical form of a file.

namespace sentree::bt {

namespace {

/// Place of an attribute: the names first, conditions last, everything else as it was.
int rank(std::string_view name) {
  if (name == "BTCPP_format") return 0;
  if (name == "main_tree_to_execute") return 1;
  if (name == "ID") return 2;
  if (name == "name") return 3;
  const auto condition = std::find(std::begin(kConditionNames), std::end(kConditionNames), name);
  if (condition != std::end(kConditionNames)) return 5 + static_cast<int>(condition - std::begin(kConditionNames));
  return 4;
}

}  // namespace

Result<std::string> format(std::string_view xml, std::string file) {
  return text::format_xml(xml, std::move(file), {.attribute_rank = rank, .verbatim = {}}, {.lenient = true});
}

}  // namespace sentree::bt
