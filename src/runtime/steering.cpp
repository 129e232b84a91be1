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

project::Intervention of(project::Intervention::Kind kind, std::string target) {
  project::Intervention what;
  what.kind = kind;
  what.target = std::move(target);
  return what;
}

}  // namespace

Result<void> Steering::stop() { return done(apply(of(project::Intervention::Kind::kStop, ""))); }

Result<mission::CallOutcome> Steering::call(std::string service, const std::string& method, Value args) {
  project::Intervention what = of(project::Intervention::Kind::kCall, std::move(service) + "." + method);
  what.args = std::move(args);
  auto applied = apply(what);
  if (!applied) return tl::unexpected(applied.error());
  return std::move(applied->outcome);
}

Result<void> Steering::kill(std::string part) {
  return done(apply(of(project::Intervention::Kind::kKill, std::move(part))));
}

Result<void> Steering::restart(std::string part) {
  return done(apply(of(project::Intervention::Kind::kRestart, std::move(part))));
}

Result<std::uint64_t> Steering::delay(std::string messages, Duration by, std::uint64_t count) {
  project::Intervention what = of(project::Intervention::Kind::kDelay, std::move(messages));
  what.by = by;
  what.count = count;
  return number(apply(what));
}

Result<std::uint64_t> Steering::falsify(std::string calls, std::string path, Value value, std::uint64_t count) {
  project::Intervention what = of(project::Intervention::Kind::kFalsify, std::move(calls));
  what.path = std::move(path);
  what.value = std::move(value);
  what.count = count;
  return number(apply(what));
}

Result<std::uint64_t> Steering::force(std::string leaf, std::string status, bool once) {
  project::Intervention what = of(project::Intervention::Kind::kForce, std::move(leaf));
  what.status = std::move(status);
  what.count = once ? 1 : 0;
  return number(apply(what));
}

Result<std::uint64_t> Steering::break_at_node(std::string path, std::string status) {
  project::Intervention what = of(project::Intervention::Kind::kBreakpoint, std::move(path));
  what.point = project::Intervention::Point::kNode;
  what.status = std::move(status);
  return number(apply(what));
}

Result<std::uint64_t> Steering::break_at_state(std::string chart, std::string state) {
  project::Intervention what = of(project::Intervention::Kind::kBreakpoint, std::move(chart));
  what.point = project::Intervention::Point::kState;
  what.state = std::move(state);
  return number(apply(what));
}

Result<std::uint64_t> Steering::break_at_message(std::string pattern) {
  project::Intervention what = of(project::Intervention::Kind::kBreakpoint, std::move(pattern));
  what.point = project::Intervention::Point::kMessage;
  return number(apply(what));
}

Result<void> Steering::clear(std::uint64_t id) {
  project::Intervention what = of(project::Intervention::Kind::kClear, "");
  what.id = id;
  return done(apply(what));
}

}  // namespace sentree::runtime
