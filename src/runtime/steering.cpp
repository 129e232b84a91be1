#include "sentree/runtime/steering.h"

#include <fmt/format.h>

#include <utility>

namespace sentree::runtime {

namespace {

using namespace project::intervention;

Result<void> done(Result<Steering::Applied> applied) {
  if (!applied) return tl::unexpected(applied.error());
  return {};
}

Result<std::uint64_t> number(Result<Steering::Applied> applied) {
  if (!applied) return tl::unexpected(applied.error());
  return applied->id;
}

}  // namespace

Result<void> Steering::stop() { return done(apply(Stop{})); }

Result<mission::CallOutcome> Steering::call(const std::string& service, const std::string& method, Value args) {
  auto applied = apply(Call{.method = fmt::format("{}.{}", service, method), .args = std::move(args)});
  if (!applied) return tl::unexpected(applied.error());
  return std::move(applied->outcome);
}

Result<void> Steering::kill(std::string part) { return done(apply(Kill{std::move(part)})); }

Result<void> Steering::restart(std::string part) { return done(apply(Restart{std::move(part)})); }

Result<std::uint64_t> Steering::delay(std::string messages, Duration by, std::uint64_t count) {
  return number(apply(Delay{.message = std::move(messages), .by = by, .count = count}));
}

Result<std::uint64_t> Steering::falsify(std::string calls, std::string path, Value value, std::uint64_t count) {
  return number(
      apply(Falsify{.call = std::move(calls), .path = std::move(path), .value = std::move(value), .count = count}));
}

Result<std::uint64_t> Steering::force(std::string leaf, std::string status, bool once) {
  return number(apply(Force{.leaf = std::move(leaf), .status = std::move(status), .count = once ? 1U : 0U}));
}

Result<std::uint64_t> Steering::break_at_node(std::string path, std::string status) {
  return number(
      apply(Breakpoint{.point = Breakpoint::Point::kNode, .target = std::move(path), .status = std::move(status)}));
}

Result<std::uint64_t> Steering::break_at_state(std::string chart, std::string state) {
  return number(
      apply(Breakpoint{.point = Breakpoint::Point::kState, .target = std::move(chart), .state = std::move(state)}));
}

Result<std::uint64_t> Steering::break_at_message(std::string pattern) {
  return number(apply(Breakpoint{.target = std::move(pattern)}));
}

Result<void> Steering::clear(std::uint64_t id) { return done(apply(Clear{id})); }

}  // namespace sentree::runtime
