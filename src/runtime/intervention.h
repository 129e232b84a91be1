#pragma once

#include <cstdint>
#include <string>

#include "sentree/base/result.h"
#include "sentree/base/time.h"
#include "sentree/base/value.h"

namespace sentree::runtime {

/// Something that is done to a run from outside: by a scenario's timeline, or by a person who steers it.
struct Intervention {
  enum class Kind : std::uint8_t {
    kCall,        ///< A call to a service, or to the simulator's test control.
    kStop,        ///< The mission is halted.
    kKill,        ///< A part ends as if its process had been killed.
    kRestart,     ///< A part that was killed can be used again.
    kDelay,       ///< Messages are held back, as by a slow machine or network.
    kFalsify,     ///< A service's replies say something else.
    kForce,       ///< A leaf answers something else.
    kBreakpoint,  ///< When it is reached, that is observed, and a run that is steered pauses.
    kClear,       ///< One of the last four ends.
  };
  enum class Point : std::uint8_t { kNode, kState, kMessage };

  Kind kind = Kind::kCall;
  /// kCall: "SERVICE.METHOD". kKill, kRestart: the part's name. kDelay: "LEAF.tick", "LEAF.halt", "SERVICE.METHOD" (the
  /// request) or "SERVICE.METHOD.reply". kFalsify: "SERVICE.METHOD". kForce: the leaf. kBreakpoint: the node's path,
  /// the chart's name ("skill:LEAF", "monitor:NAME"), or the observation's name. In those of messages '*' stands for
  /// any text.
  std::string target;
  Value args;          ///< kCall: by name.
  Duration by{0};      ///< kDelay.
  std::string path;    ///< kFalsify: a member of the result, "percentage" or "pose.x"; empty: the result itself.
  Value value;         ///< kFalsify: what it becomes.
  std::string status;  ///< kForce: SUCCESS, FAILURE or RUNNING. kBreakpoint on a node: that status; empty: any.
  Point point = Point::kMessage;  ///< kBreakpoint: what it is on.
  std::string state;              ///< kBreakpoint on a chart: id of the state that is entered.
  std::uint64_t count = 0;        ///< kDelay, kFalsify, kForce: how many messages; 0: until it is cleared.
  std::uint64_t id = 0;           ///< kClear: which; standing ones are numbered from 1 in the order they came.

  friend bool operator==(const Intervention&, const Intervention&) = default;

  /// Whether it stays until it is used up or cleared.
  [[nodiscard]] bool stands() const {
    return kind == Kind::kDelay || kind == Kind::kFalsify || kind == Kind::kForce || kind == Kind::kBreakpoint;
  }
};

}  // namespace sentree::runtime
