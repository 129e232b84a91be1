#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "sentree/scxml/model.h"
#include "sentree/scxml/plain.h"

namespace sentree::scxml {

/// What a plan of plain steps is made of: written by plain_compile.cpp, read by plain.cpp.
namespace plain {

using PlainKind = PlainValue::Kind;

enum class PlainOp : std::uint8_t {
  kIn,           // a: state
  kHasKind,      // a; b: a bit of each kind that it may be
  kConditional,  // a ? b : c
  kAnd,
  kOr,  // a, b
  kNot,
  kNegate,
  kPlus,
  kTypeof,  // a
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kModulo,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  kEqual,
  kNotEqual,
  kStrictEqual,
  kStrictNotEqual,  // a, b
};

// What an expression, or a part of one, is: a value that lies somewhere, or a node. Where: the two highest bits.
using Operand = std::uint32_t;
constexpr unsigned kPlaceBits = 30;
constexpr Operand kPlaceMask = (1U << kPlaceBits) - 1;
constexpr Operand kConstants = 0U << kPlaceBits;
constexpr Operand kMembers = 1U << kPlaceBits;    // of the event
constexpr Operand kVariables = 2U << kPlaceBits;  // by slot
constexpr Operand kNodes = 3U << kPlaceBits;
constexpr Operand kAlways = 0xFFFFFFFFU;

/// As `typeof` has it.
[[nodiscard]] constexpr std::string_view type_name(PlainKind kind) {
  switch (kind) {
    case PlainKind::kBool: return "boolean";
    case PlainKind::kNumber: return "number";
    case PlainKind::kText: return "string";
    case PlainKind::kNull:
    case PlainKind::kObject: return "object";
    default: return "undefined";
  }
}

struct PlainNode {
  PlainOp op = PlainOp::kIn;
  Operand a = 0;
  Operand b = 0;
  Operand c = 0;
};

struct PlainAction {
  enum class What : std::uint8_t {
    kAssign,  // a: slot, b: expression
    kRaise,   // a: event of the plan
    kUnless,  // a: expression, b: where to go on if it does not hold
    kGoTo,    // b
    kSend,    // a: of the plan's timers
    kCancel,  // a: of the plan's ids
  };
  What what = What::kAssign;
  std::uint32_t a = 0;
  std::uint32_t b = 0;
};

struct Range {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
};

struct Candidate {
  TransitionIndex transition = 0;
  Operand condition = kAlways;
  bool plain = false;
  Range actions;
  StateIndex domain = kNoState;  // kNoState: it leads nowhere
  Range entered;                 // of the plan's paths: the states from below the domain to an atomic one
};

// What an event of one name may enable.
struct PlainEvent {
  std::string name;
  std::vector<Range> of_state;  // candidates of an atomic state and its ancestors, in their order
  std::vector<Candidate> candidates;
  // By state, what is executed when it is left or entered.
  std::vector<Range> onexit;
  std::vector<Range> onentry;
  std::vector<bool> may_be_left;  // by state
};

}  // namespace plain

struct PlainPlan::Content {
  explicit Content(Chart of) : chart(std::move(of)) {}

  Chart chart;  // whose texts constants borrow
  std::uint64_t fingerprint = 0;
  std::array<std::uint64_t, 2> atomic{};
  std::array<std::uint64_t, 2> restless{};  // atomic states in which eventless transitions may be enabled
  std::vector<plain::PlainEvent> events;    // the external one first, then those that are raised
  std::vector<plain::PlainNode> nodes;
  std::vector<PlainValue> constants;
  std::uint64_t read = 0;  // the slots that expressions read
  std::vector<plain::PlainAction> actions;
  std::vector<std::unique_ptr<std::string>> names;  // of events, as constants borrow them
  std::vector<StateIndex> paths;
  std::vector<Timer> timers;  // as a <send> makes them, but for when they are due
  std::vector<std::string> ids;
};

}  // namespace sentree::scxml
