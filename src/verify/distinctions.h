#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sentree/project/plan.h"

namespace sentree::verify {

/// What a mission tells apart of the replies of one service: by the name under which its expressions read a value, that
/// of a member, or "result".
struct Distinctions {
  std::set<std::string> names;                         ///< That some expression mentions at all.
  std::set<std::string> words;                         ///< Texts that are written anywhere, in charts and in the tree.
  std::map<std::string, std::set<double>> numbers;     ///< That values are compared with, after + - * / by constants.
  std::map<std::string, std::set<std::string>> texts;  ///< Likewise.
  /// That are compared with such values that came before, and with how many at once.
  std::map<std::string, std::size_t> several;
  std::set<std::string> absent;  ///< Of which it is asked whether they are there.
  /// What is told apart is not known: values are compared with each other, or otherwise than with constants.
  std::optional<Diagnostic> trouble;
};

/// Reads the charts of all skills that call the service, the tree and all monitors.
/// @param methods  Gets those of the service that some skill calls and waits for; may be null.
[[nodiscard]] Distinctions distinctions(const project::Plan& plan, const std::string& service,
                                        std::vector<const idl::Method*>* methods = nullptr);

}  // namespace sentree::verify
