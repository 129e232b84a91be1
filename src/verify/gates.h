#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "sentree/base/message.h"
#include "sentree/base/result.h"
#include "sentree/mission/parts.h"
#include "sentree/monitor/monitor.h"
#include "sentree/project/plan.h"

namespace sentree::verify {

/// The monitors of a plan that are gates, on one run: what they have seen, and what they refuse. They judge as in a run
/// (`runtime::Monitors`). States of each that decide alike have one number.
class Gates {
 public:
  /// @param plan  Borrowed.
  explicit Gates(const project::Plan& plan);
  [[nodiscard]] bool empty() const { return gates_.empty(); }

  /// The run begins at 0.
  void begin();
  /// Time passes up to just before `now` first.
  void observed(const Message& message, TimePoint now);
  /// Why a request is refused; nothing: it goes out.
  [[nodiscard]] std::optional<mission::Veto> judge(const Message& request, TimePoint now);

  /// Lets time pass up to and including `now`, and appends the number of each one's state.
  /// Error: scxml.no-value-form.
  [[nodiscard]] Result<void> keep(TimePoint now, std::vector<std::uint32_t>& out);
  /// They are in states of `keep` again.
  void again(std::span<const std::uint32_t> numbers, TimePoint now);
  /// About.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  struct Gate {
    const project::GatePlan* plan;
    const monitor::Model* model;
    monitor::Core core;
    TimePoint zero{};  // of the run, in the core's time
  };
  struct Kept {
    monitor::Core core;
    TimePoint at{};
  };

  static void advance(Gate& gate, TimePoint until);

  std::vector<Gate> gates_;
  std::vector<Kept> kept_;
  std::unordered_map<std::string, std::uint32_t> number_of_;
  std::uint64_t bytes_ = 0;
  Message message_;
};

}  // namespace sentree::verify
