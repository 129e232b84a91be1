#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "sentree/bt/status.h"

/// Which statuses a node may return, as far as its file says.
namespace sentree::bt::may {

using Mask = std::uint8_t;
inline constexpr Mask kSuccess = 1, kFailure = 2, kRunning = 4;
inline constexpr Mask kSkipped = 8;   ///< By something that the file says.
inline constexpr Mask kUnknown = 16;  ///< A leaf of somebody else's making: it may return SKIPPED too, but seldom does.
inline constexpr Mask kLeaf = kSuccess | kFailure | kUnknown;

[[nodiscard]] constexpr Mask mask_of(std::optional<Status> status) {
  if (!status) return kLeaf | kRunning;
  switch (*status) {
    case Status::kSuccess: return kSuccess;
    case Status::kFailure: return kFailure;
    case Status::kRunning: return kRunning;
    case Status::kSkipped: return kSkipped;
    case Status::kIdle: return 0;
  }
  return 0;
}

/// A node of a file, and what its children may return.
struct Asked {
  std::span<const Mask> children;
  Mask any = 0;              ///< Of some child.
  Mask all = 0;              ///< Of each: kSkipped, kUnknown.
  std::size_t& reached;      ///< How many of the children can be ticked; all, unless the node says otherwise.
  bool synchronous = false;  ///< It may not return RUNNING.

  virtual ~Asked() = default;
  /// The text of a port, by its place in the manifest, where it is a literal.
  [[nodiscard]] virtual std::optional<std::string_view> literal(std::size_t port) const = 0;
  /// Of a SubTree: what its tree may return.
  [[nodiscard]] virtual Mask subtree() const = 0;

  [[nodiscard]] Mask child() const { return children.empty() ? Mask{0} : children.front(); }
  /// What of the child's a decorator hands on as it is.
  [[nodiscard]] Mask passed() const { return child() & static_cast<Mask>(kRunning | kSkipped | kUnknown); }
  /// Of a port with a status.
  [[nodiscard]] Mask status(std::size_t port) const {
    const auto text = literal(port);
    return mask_of(text ? parse_status(*text) : std::nullopt);
  }

 protected:
  Asked(std::span<const Mask> children_in, std::size_t& reached_in) : children(children_in), reached(reached_in) {}
};

/// Why every tick of a node fails, whatever the run brings.
struct Failing {
  std::size_t port;  ///< That it is about, by its place in the manifest.
  std::string_view code;
  std::string why;  ///< "{port} " goes before it.
};

/// A node as its file gives it.
struct Given {
  std::uint32_t children = 0;

  virtual ~Given() = default;
  /// A port's literal.
  [[nodiscard]] virtual std::optional<std::int64_t> integer(std::size_t port) const = 0;
  /// Neither given, nor has it a default.
  [[nodiscard]] virtual bool absent(std::size_t port) const = 0;

  /// Of a literal that is greater than it may be with so many children.
  [[nodiscard]] std::optional<Failing> greater(std::size_t port, std::int64_t most, std::string_view code,
                                               std::string_view how = {}) const {
    const auto value = integer(port);
    if (!value || *value <= most) return std::nullopt;
    return Failing{port, code,
                   "is " + std::to_string(*value) + ", and there " + (children == 1 ? "is" : "are") + " " +
                       std::to_string(children) + (children == 1 ? " child" : " children") + std::string(how)};
  }
  /// Of a node that cannot do without these ports.
  [[nodiscard]] std::optional<Failing> lacks(std::initializer_list<std::size_t> ports) const {
    for (const std::size_t port : ports) {
      if (absent(port)) return Failing{port, "bt.missing-port", "is missing"};
    }
    return std::nullopt;
  }

 protected:
  Given() = default;
};

/// A Sequence (`go_on` is SUCCESS) or Fallback: what it may return, and how many of the children can be reached.
[[nodiscard]] inline std::pair<Mask, std::size_t> ordered(std::span<const Mask> children, Mask go_on) {
  Mask out = 0;
  Mask all = kSkipped | kUnknown;
  for (std::size_t reached = 0; reached < children.size();) {
    const Mask child = children[reached++];
    out |= child & static_cast<Mask>((kSuccess | kFailure | kRunning) & ~go_on);
    all &= (child & kSkipped) != 0 ? kSkipped | kUnknown : child & kUnknown;
    if ((child & (go_on | kSkipped | kUnknown)) == 0) return {out, reached};
  }
  const bool goes_on = std::any_of(children.begin(), children.end(), [&](Mask m) { return (m & go_on) != 0; });
  return {out | all | (goes_on ? go_on : Mask{0}), children.size()};
}
[[nodiscard]] inline Mask ordered(const Asked& asked, Mask go_on) {
  const auto [out, reached] = ordered(asked.children, go_on);
  asked.reached = reached;
  return out;
}

/// A condition, what follows if it succeeds, and perhaps what follows if not.
[[nodiscard]] inline Mask branches(const Asked& asked) {
  const auto& children = asked.children;
  Mask out = asked.child() & kRunning;
  if (children.size() > 1) out |= children[1];
  if (children.size() > 2) out |= children[2];
  return children.size() > 2 ? out : out | (asked.child() & kFailure);
}

}  // namespace sentree::bt::may
