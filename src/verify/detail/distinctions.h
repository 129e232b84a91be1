#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sentree/project/plan.h"

namespace sentree::verify {

/// What a mission tells apart of the replies of one service: by the name under which its expressions read a value, that
/// of a member, or "result".
struct Distinctions {
  /// Names that expressions mention at all, and texts that are written down, in charts and in the tree.
  struct Mentioned {
    std::set<std::string> names;
    std::set<std::string> words;
  };
  Mentioned own;                                       ///< By those who get a reply.
  std::shared_ptr<const Mentioned> common;             ///< By others.
  std::map<std::string, std::set<double>> numbers;     ///< That values are compared with, after + - * / by constants.
  std::map<std::string, std::set<std::string>> texts;  ///< Likewise.
  /// That are compared with such values that came before: how many are there at once, those that just come among them.
  std::map<std::string, std::size_t> at_once;
  /// Where values are ordered against such earlier ones ("<", not "==="): each may be greater than all before.
  struct Ordered {
    SourceSpan place;
    std::string monitor;  ///< Whose verdict depends on it; empty: what the mission does.
  };
  std::map<std::string, std::vector<Ordered>> ordered;
  std::set<std::string> absent;  ///< Of which it is asked whether they are there.
  /// What is told apart is not known: values are compared with each other, or otherwise than with constants.
  std::optional<Diagnostic> trouble;

  [[nodiscard]] bool mentions(const std::string& name) const {
    return own.names.contains(name) || common->names.contains(name);
  }
  [[nodiscard]] bool writes(const std::string& word) const {
    return own.words.contains(word) || common->words.contains(word);
  }
};

/// What a mission tells apart of replies, service by service: what they have in common is read once.
class MissionDistinctions {
 public:
  /// @param plan  Borrowed. Cost: O(size of the mission, its monitors, models and interfaces).
  explicit MissionDistinctions(const project::Plan& plan);
  MissionDistinctions(const MissionDistinctions&) = delete;
  MissionDistinctions& operator=(const MissionDistinctions&) = delete;
  ~MissionDistinctions();

  /// Reads the charts of all skills that call the service, and of all monitors that may see what it replies.
  /// @param methods  Gets those of the service that some skill calls and waits for; may be null.
  [[nodiscard]] Distinctions of(const std::string& service, std::vector<const idl::Method*>* methods = nullptr) const;

 private:
  struct Common;
  std::unique_ptr<const Common> common_;
};

}  // namespace sentree::verify
