#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/monitor/requirement.h"

namespace sentree::monitor {

struct DataMember;

/// The members of a record, in order. Copies share them: a dozen structs, each with ten members of the one before, have
/// 10^12 members by their paths, and some hundred by their types.
class DataMembers {
 public:
  DataMembers() = default;
  DataMembers(std::initializer_list<DataMember> members);

  [[nodiscard]] const DataMember* begin() const;
  [[nodiscard]] const DataMember* end() const;
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] bool empty() const { return size() == 0; }
  /// Cost: if they are shared, a copy of this level.
  void push_back(DataMember member);

  /// Cost: the pairs of records that stand at the same place, each once.
  friend bool operator==(const DataMembers& a, const DataMembers& b);

 private:
  std::shared_ptr<std::vector<DataMember>> list_;  // null: none
};

/// What a value can be.
struct DataType {
  enum class Kind : std::uint8_t {
    kUnknown,
    kNumber,
    kTruth,
    kText,
    kRecord,  ///< Has members; a requirement names one of them.
    kOther,   ///< Lists, octets: nothing that can be compared.
  };
  Kind kind = Kind::kUnknown;
  std::string name;           ///< For messages: "double", "NavigationStatus".
  std::string unit;           ///< kNumber; empty: not known.
  bool is_wide = false;       ///< kNumber: an integer of 64 bits, which scripts have as a decimal text beyond 2^53.
  bool may_be_absent = true;  ///< An observation may come without it.
  std::vector<std::string> words;  ///< kText of an enumeration: its enumerators.
  /// Other kText: what the project's files give for it, as far as they tell (places of the mission and the world).
  std::vector<std::string> samples;
  bool samples_are_all = false;  ///< It never is anything else.
  DataMembers members;           ///< kRecord.
  DataMembers items;             ///< kOther, of a list or of a map by texts: one, which is what it holds; or none.
  friend bool operator==(const DataType&, const DataType&) = default;
};

struct DataMember {
  std::string name;
  DataType type;
  friend bool operator==(const DataMember&, const DataMember&) = default;
};

/// What a project observes: that by which requirements are checked before it runs.
struct Vocabulary {
  struct Method {
    DataType arguments;  ///< kRecord.
    DataType result;
    bool oneway = false;     ///< A topic: published by anybody, answered by nobody.
    bool overheard = false;  ///< Others call it, and no leaf does.
    DataType exceptions;     ///< kRecord of those that it declares by the names of their types; unknown: not told.
    friend bool operator==(const Method&, const Method&) = default;
  };
  std::map<std::string, std::map<std::string, Method>> services;
  std::vector<std::string> leaves;  ///< Names of leaves as observations have them.
  struct Ports {
    DataType inputs;
    DataType outputs;
    friend bool operator==(const Ports&, const Ports&) = default;
  };
  std::map<std::string, Ports> ports;  ///< Of leaves of which they are known.
  std::vector<std::string> nodes;      ///< Paths of the tree's nodes.
  std::vector<std::string> models;     ///< Names of charts that stand for components.
  struct Choices {
    DataType name;   ///< Those of pick('NAME', …).
    DataType value;  ///< What is chosen.
    friend bool operator==(const Choices&, const Choices&) = default;
  };
  std::map<std::string, Choices> choices;  ///< Of models of which they are known.
  struct Call {
    std::string leaf;
    std::string service;
    std::string method;
    friend bool operator==(const Call&, const Call&) = default;
  };
  /// Every call that some skill can make; nothing: that is not known (a skill in another language).
  std::optional<std::vector<Call>> calls;
  friend bool operator==(const Vocabulary&, const Vocabulary&) = default;
};

/// The types of a requirement's values, by their text ("reply(battery.getBatteryState).percentage"; inside where by the
/// member's: "args.name").
using Typing = std::map<std::string, DataType>;

/// Finds the type of every value: from the vocabulary, else from how it is used.
///
/// Errors: requirement.unknown-service, requirement.unknown-method, requirement.unknown-member,
/// requirement.unknown-leaf, requirement.unknown-word, requirement.type, requirement.unit. Warnings:
/// requirement.unknown-word (where other words are possible), requirement.unit, requirement.out-of-range,
/// requirement.never-violated, requirement.never-triggered.
/// @param vocabulary  Null: nothing is known but the requirement itself.
[[nodiscard]] Typing check_requirement(const Requirement& requirement, const Vocabulary* vocabulary,
                                       Diagnostics& diagnostics);

/// The definitions that no requirement uses: that they are not, and what is wrong with those without parameters.
/// Errors: as `check_requirement`. Warnings: likewise, and requirement.unused.
void check_definitions(const RequirementFile& file, const Vocabulary* vocabulary, Diagnostics& diagnostics);

/// True if no run, however it goes on, violates it: what it owes has no end.
[[nodiscard]] bool can_be_violated(const Requirement& requirement);

}  // namespace sentree::monitor
