#include "sentree/runtime/steering.h"

#include <utility>

namespace sentree::runtime {

namespace {

Result<void> done(Result<Steering::Applied> applied) {
  if (!applied) return tl::unexpected(applied.error());
  return {};
}

Result<std::uint64_t> number(Result<Steering::Applied> applied) {
  if (!applied) return tl::unexpected(applied.error());
  return applied->id;
}

Intervention of(Intervention::Kind kind, std::string target) {
  Intervention what;
  what.kind = kind;
  what.target = std::move(target);
  return what;
}

}  // namespace

Result<void> Steering::stop() { return done(apply(of(Intervention::Kind::kStop, ""))); }

Result<CallOutcome> Steering::call(std::string service, const std::string& method, Value args) {
  Intervention what = of(Intervention::Kind::kCall, std::move(service) + "." + method);
  what.args = std::move(args);
  auto applied = apply(what);
  if (!applied) return tl::unexpected(applied.error());
  return std::move(applied->outcome);
}

Result<void> Steering::kill(std::string part) { return done(apply(of(Intervention::Kind::kKill, std::move(part)))); }

Result<void> Steering::restart(std::string part) {
  return done(apply(of(Intervention::Kind::kRestart, std::move(part))));
}

Result<std::uint64_t> Steering::delay(std::string messages, Duration by, std::uint64_t count) {
  Intervention what = of(Intervention::Kind::kDelay, std::move(messages));
  what.by = by;
  what.count = count;
  return number(apply(what));
}

Result<std::uint64_t> Steering::falsify(std::string calls, std::string path, Value value, std::uint64_t count) {
  Intervention what = of(Intervention::Kind::kFalsify, std::move(calls));
  what.path = std::move(path);
  what.value = std::move(value);
  what.count = count;
  return number(apply(what));
}

Result<std::uint64_t> Steering::force(std::string leaf, std::string status, bool once) {
  Intervention what = of(Intervention::Kind::kForce, std::move(leaf));
  what.status = std::move(status);
  what.count = once ? 1 : 0;
  return number(apply(what));
}

Result<std::uint64_t> Steering::break_at_node(std::string path, std::string status) {
  Intervention what = of(Intervention::Kind::kBreakpoint, std::move(path));
  what.point = Intervention::Point::kNode;
  what.status = std::move(status);
  return number(apply(what));
}

Result<std::uint64_t> Steering::break_at_state(std::string chart, std::string state) {
  Intervention what = of(Intervention::Kind::kBreakpoint, std::move(chart));
  what.point = Intervention::Point::kState;
  what.state = std::move(state);
  return number(apply(what));
}

Result<std::uint64_t> Steering::break_at_message(std::string pattern) {
  Intervention what = of(Intervention::Kind::kBreakpoint, std::move(pattern));
  what.point = Intervention::Point::kMessage;
  return number(apply(what));
}

Result<void> Steering::clear(std::uint64_t id) {
  Intervention what = of(Intervention::Kind::kClear, "");
  what.id = id;
  return done(apply(what));
}

}  // namespace sentree::runtime
