#pragma once

#include <algorithm>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "sentree/base/result.h"

namespace sentree::import {

/// What stands between white space.
inline std::vector<std::string> words(std::string_view text) {
  std::istringstream stream{std::string(text)};
  std::vector<std::string> found;
  for (std::string word; stream >> word;) found.push_back(word);
  return found;
}

template <class List>
bool contains(const List& list, std::string_view name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

/// C++ that no chart can say.
inline tl::unexpected<Diagnostic> cannot(std::string message) { return fail("import.cpp", std::move(message)); }

/// Of the addresses that stand in for components and nodes.
inline constexpr int kFirstPort = 10'001;

}  // namespace sentree::import
