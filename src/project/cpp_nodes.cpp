#include "sentree/project/cpp_nodes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

namespace sentree::project {

std::vector<std::string> cpp_nodes(const Plan& plan) {
  std::set<std::string> names;
  for (bt::NodeId node = 0; node < plan.tree.size(); ++node) {
    if (plan.tree.is_user(node)) names.emplace(plan.tree.registration(node));
  }
  return {names.begin(), names.end()};
}

std::string shown_cpp_nodes(const Plan& plan) {
  constexpr std::size_t kShown = 3;
  const std::vector<std::string> names = cpp_nodes(plan);
  const std::size_t shown = std::min(names.size(), kShown);
  std::string text =
      fmt::format("{}", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(shown), ", "));
  if (names.size() > shown) text += fmt::format(" and {} more", names.size() - shown);
  return text;
}

}  // namespace sentree::project
