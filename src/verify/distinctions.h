#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/project/plan.h"

namespace sentree::verify {

/// What a mission tells apart of the replies of one service: by the name under which its expressions read a value, that
/// of a member, or "result".
struct Distinctions {
  std::set<std::string> names;                         ///< That some expression mentions at all.
  std::set<std::string> words;                         ///< Texts that are written anywhere, in charts and in the tree.
  std::map<std::string, std::set<double>> numbers;     ///< That values are compared with, after + - * / by constants.
  std::map<std::string, std::set<std::string>> texts;  ///< Likewise.
  std::set<std::string> several;                       ///< That may be compared with such a value that came before.
  std::set<std::string> absent;                        ///< Of which it is asked whether they are there.
  /// What is told apart is not known: values are compared with each other, or otherwise than with constants.
  std::optional<Diagnostic> trouble;
};

/// Reads the charts of all skills that call the service, the tree and all monitors.
/// @param methods  Gets those of the service that some skill calls and waits for; may be null.
[[nodiscard]] Distinctions distinctions(const project::Plan& plan, const std::string& service,
                                        std::vector<const idl::Method*>* methods = nullptr);

/// A reply as a mission sees it.
struct Look {
  /// Equal for replies that nothing in the mission tells apart: members that nothing names are not there, numbers are
  /// places among the constants that they are compared with.
  Value alike;
  /// What it consists of, by path ("percentage", "target.pose.x"; of a bare value "result").
  std::vector<std::pair<std::string, Value>> shown;
  /// Numbers and texts that are named and compared with nothing, by name: they can be handed back.
  std::vector<std::pair<std::string, Value>> handed;
};
/// @param result  Conforms to the method's type.
/// @param exact   Everything is told apart, numbers too.
[[nodiscard]] Look look(const Distinctions& distinctions, const idl::Method& method, const Value& result,
                        bool exact = false);

}  // namespace sentree::verify
