#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
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

  /// What a text is compared as: as text, then as a whole number or an enum, then as a real within the precision of
  /// float. Format 3: as text only.
  struct Compared {
    std::string_view text;
    std::optional<std::int64_t> integer;
    std::optional<double> real;

    Compared(const Model& model, std::string_view of) : text(of) {
      if (model.format == 3) return;
      if (const auto value = model.enum_value(text)) {
        integer = *value;
        real = static_cast<double>(*value);
      } else {
        integer = detail::parse_integer(text);
        real = detail::parse_real(text);
      }
    }
    explicit Compared(const SwitchCase& of) : text(of.text), integer(of.integer), real(of.real) {}
    [[nodiscard]] bool is_number() const { return integer || real; }
    friend bool operator==(const Compared& a, const Compared& b) {
      if (a.text == b.text || (a.integer && b.integer && *a.integer == *b.integer)) return true;
      constexpr auto kEqualWithin = static_cast<double>(std::numeric_limits<float>::epsilon());
      return a.real && b.real && std::abs(*a.real - *b.real) <= kEqualWithin;
    }
  };

  static Next enter(Machine& m, const Node& n, NodeId id) {
    const std::uint32_t cases = n.port_count - 1U;  // The ports are `variable` and the cases.
    if (n.child_count != cases + 1) return bad_count(m, n, id, cases);
    const std::uint32_t match = matching(m, n, cases);
    std::int32_t* const mem = m.memory(n);
    if (mem[kRunning] != 0 && static_cast<std::uint32_t>(mem[kRunning] - 1) != match) {
      m.reset(m.child(n, static_cast<std::uint32_t>(mem[kRunning] - 1)));
    }
    mem[kCurrent] = static_cast<std::int32_t>(match);
    return Next::tick(match);
  }

  [[gnu::noinline, gnu::cold]] static Next bad_count(Machine& m, const Node& n, NodeId id, std::uint32_t cases) {
    return m.fail(id, "bt.child-count",
                  "must have " + std::to_string(cases + 1) + " children (one per case, and the default) and has " +
                      std::to_string(n.child_count));
  }
  /// The case that the variable equals; the number of cases if there is none.
  static std::uint32_t matching(Machine& m, const Node& n, std::uint32_t cases) {
    if (n.data == kNone) return matching_read(m, n, cases);
    const SwitchData& data = m.model().switches[n.data];
    const SwitchCase* const first = m.model().cases.data() + data.first_case;
    const std::string* const text = data.numbers ? nullptr : m.held_text(n, 0);
    if (text == nullptr) return matching_number(m, n, first, cases);
    // Nothing but text is equal to a text that stands for no number.
    const char begin = text->empty() ? '\0' : text->front();
    for (std::uint32_t i = 0; i < cases; ++i) {
      const std::string& one = first[i].text;
      if (one.size() == text->size() && (one.empty() || (one.front() == begin && one == *text))) return i;
    }
    return cases;
  }
  /// The same where numbers may be equal.
  [[gnu::noinline]] static std::uint32_t matching_number(Machine& m, const Node& n, const SwitchCase* first,
                                                         std::uint32_t cases) {
    Datum scratch;
    const auto text = m.read_view(n, 0, scratch);
    if (!text) return cases;
    const Compared variable(m.model(), *text);
    for (std::uint32_t i = 0; i < cases; ++i) {
      if (Compared(first[i]) == variable) return i;
    }
    return cases;
  }
  /// The same where a case is an entry.
  [[gnu::noinline]] static std::uint32_t matching_read(Machine& m, const Node& n, std::uint32_t cases) {
    Datum scratch;
    const auto text = m.read_view(n, 0, scratch);
    if (!text) return cases;
    const Compared variable(m.model(), *text);
    Datum scratch_of_case;
    for (std::uint32_t i = 0; i < cases; ++i) {
      const auto value = m.read_view(n, i + 1, scratch_of_case);
      if (!value) continue;
      if (*value == variable.text || (variable.is_number() && Compared(m.model(), *value) == variable)) return i;
    }
    return cases;
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
