#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "sentree/bt/nodes/node.h"

namespace sentree::bt::nodes {

/// The child of the first case that equals the variable; the last child is the default.
struct Switch : AnyNode {
  // The child that runs, from 1; 0: none. The one that is ticked.
  enum : std::size_t { kRunning, kCurrent };
  static constexpr std::array kWords{Word{Word::Lives::kAlways, Word::Range::kCounted},
                                     Word{Word::Lives::kInTick, Word::Range::kChild}};
  static constexpr std::uint32_t kHaltsFrom = 0;
  static constexpr bool kStaysRunning = false;
  static may::Mask may_return(const may::Asked& asked) { return asked.any; }
  static Manifests manifests() {
    Manifests all;
    for (int cases = 2; cases <= 6; ++cases) {
      Ports ports{input<std::string>("variable")};
      for (int i = 1; i <= cases; ++i) ports.push_back(input<std::string>("case_" + std::to_string(i)));
      all.push_back(both(control("Switch" + std::to_string(cases), std::move(ports))));
    }
    return all;
  }

  /// As text, then as whole numbers or enums, then as reals within the precision of float. Format 3: as text only.
  static bool equal(const Machine& m, const std::string& a, const std::string& b) {
    if (a == b) return true;
    if (m.format3()) return false;
    const auto integer = [&m](const std::string& text) -> std::optional<std::int64_t> {
      if (const auto value = m.model().enum_value(text)) return value;
      return detail::parse_integer(text);
    };
    if (const auto i = integer(a)) {
      if (const auto j = integer(b); j && *i == *j) return true;
    }
    const auto real = [&m](const std::string& text) -> std::optional<double> {
      if (const auto value = m.model().enum_value(text)) return static_cast<double>(*value);
      return detail::parse_real(text);
    };
    const auto x = real(a);
    const auto y = real(b);
    return x && y && std::abs(*x - *y) <= static_cast<double>(std::numeric_limits<float>::epsilon());
  }

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const std::uint32_t cases = n.port_count - 1U;  // The ports are `variable` and the cases.
    if (n.child_count != cases + 1) {
      return m.fail(id, "bt.child-count",
                    "must have " + std::to_string(cases + 1) + " children (one per case, and the default) and has " +
                        std::to_string(n.child_count));
    }
    std::uint32_t match = cases;
    if (const auto variable = m.read_text(n, 0)) {
      for (std::uint32_t i = 0; i < cases; ++i) {
        const auto value = m.read_text(n, i + 1);
        if (value && equal(m, *variable, *value)) {
          match = i;
          break;
        }
      }
    }
    std::int32_t* const mem = m.memory(n);
    if (mem[kRunning] != 0 && static_cast<std::uint32_t>(mem[kRunning] - 1) != match) {
      m.reset(m.child(n, static_cast<std::uint32_t>(mem[kRunning] - 1)));
    }
    mem[kCurrent] = static_cast<std::int32_t>(match);
    return Next::tick(match);
  }

  static Next child_done(Machine& m, const Node& n, NodeId /*id*/, Status status) {
    std::int32_t* const mem = m.memory(n);
    if (status == Status::kSkipped) {
      mem[kRunning] = 0;
    } else if (status == Status::kRunning) {
      mem[kRunning] = mem[kCurrent] + 1;
    } else {
      m.reset_children(n);
      mem[kRunning] = 0;
    }
    return Next::done(status);
  }

  static void halt(Machine& m, const Node& n, NodeId /*id*/) {
    clear(m.memory(n), kWords);
    m.reset_children(n);
  }
};

}  // namespace sentree::bt::nodes
