#include "sentree/mission/faults.h"

#include <algorithm>
#include <utility>

#include "sentree/idl/conform.h"
#include "sentree/project/check_intervention.h"

namespace sentree::mission {

namespace {

using Kind = project::Intervention::Kind;

constexpr std::string_view kReply = ".reply";

}  // namespace

Faults::Faults(const std::vector<project::DelayFault>& delays) {
  for (const project::DelayFault& delay : delays) {
    project::Intervention what;
    what.kind = Kind::kDelay;
    what.target = delay.message;
    what.by = delay.by;
    if (const auto id = next_id()) add(*id, std::move(what));
  }
}

Result<std::uint64_t> Faults::next_id() {
  if (entries_.size() >= kStandingMax) {
    return fail("steering.too-many", "more than " + std::to_string(kStandingMax) +
                                         " delays, falsified replies, forced results and breakpoints; clear one first");
  }
  return ++last_id_;
}

void Faults::add(std::uint64_t id, project::Intervention what) { entries_.push_back({{id, std::move(what), 0}}); }

Result<void> Faults::clear(std::uint64_t id) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.standing.id == id; });
  if (found == entries_.end()) {
    return fail("steering.unknown-id", "nothing stands with number " + std::to_string(id) +
                                           (id >= 1 && id <= last_id_ ? "; it has been used up or cleared" : ""));
  }
  entries_.erase(found);
  return {};
}

std::vector<StandingIntervention> Faults::list() const {
  std::vector<StandingIntervention> list;
  for (const Entry& entry : entries_) list.push_back(entry.standing);
  return list;
}

bool Faults::any(Kind kind) const {
  return std::any_of(entries_.begin(), entries_.end(),
                     [kind](const Entry& entry) { return entry.standing.what.kind == kind; });
}

template <class Matches, class Use>
void Faults::each(Kind kind, const Matches& matches, const Use& use_entry) {
  if (!any(kind)) return;
  for (Entry& entry : entries_) {
    if (entry.standing.what.kind == kind && matches(entry)) use_entry(entry);
  }
  std::erase_if(entries_, [](const Entry& entry) {
    const project::Intervention& what = entry.standing.what;
    return what.count != 0 && entry.standing.used >= what.count;
  });
}

Duration Faults::delay_of(std::string_view message) {
  Duration delay{0};
  // "battery.*" means requests: a reply is meant where it is named.
  const bool is_reply = message.ends_with(kReply);
  each(
      Kind::kDelay,
      [&](const Entry& entry) {
        const std::string& pattern = entry.standing.what.target;
        return pattern.ends_with(kReply) == is_reply && project::matches_pattern(pattern, message);
      },
      [&](Entry& entry) {
        ++entry.standing.used;
        delay = std::max(delay, entry.standing.what.by);
      });
  return delay;
}

void Faults::falsify(std::string_view call, const idl::Method& method, Value& result) {
  each(
      Kind::kFalsify, [&](const Entry& entry) { return project::matches_pattern(entry.standing.what.target, call); },
      [&](Entry& entry) {
        Value changed = result;
        if (!project::put_at(changed, entry.standing.what.path, entry.standing.what.value)) return;
        auto conformed = idl::conform(*method.result, std::move(changed), "result");
        if (!conformed) return;
        result = std::move(*conformed);
        ++entry.standing.used;
      });
}

bool Faults::fails(Kind how, std::string_view call) {
  bool fails = false;
  each(
      how, [&](const Entry& entry) { return project::matches_pattern(entry.standing.what.target, call); },
      [&](Entry& entry) {
        ++entry.standing.used;
        fails = true;
      });
  return fails;
}

std::optional<bt::Status> Faults::forced(std::string_view leaf) {
  std::optional<bt::Status> status;
  // The newest wins; only what is used is used up.
  Entry* newest = nullptr;
  each(
      Kind::kForce, [&](const Entry& entry) { return entry.standing.what.target == leaf; },
      [&](Entry& entry) {
        if (newest != nullptr) --newest->standing.used;
        newest = &entry;
        ++entry.standing.used;
        status = bt::parse_status(entry.standing.what.status);
      });
  return status;
}

std::vector<std::uint64_t> Faults::reached_by(const Message& message) {
  std::vector<std::uint64_t> reached;
  // The hit itself is no new one.
  if (message.name == "scenario.breakpoint") return reached;
  each(
      Kind::kBreakpoint,
      [&](const Entry& entry) {
        const project::Intervention& what = entry.standing.what;
        if (what.point == project::Intervention::Point::kMessage)
          return project::matches_pattern(what.target, message.name);
        if (what.point != project::Intervention::Point::kNode || message.name != "node.status") return false;
        const Value* to = message.data.find("to");
        return message.source == what.target && to != nullptr && (what.status.empty() || to->text() == what.status);
      },
      [&](Entry& entry) {
        ++entry.standing.used;
        reached.push_back(entry.standing.id);
      });
  return reached;
}

std::vector<std::uint64_t> Faults::reached_in(std::string_view chart,
                                              const std::function<bool(const std::string& state)>& is_active) {
  std::vector<std::uint64_t> reached;
  each(
      Kind::kBreakpoint,
      [&](const Entry& entry) {
        const project::Intervention& what = entry.standing.what;
        return what.point == project::Intervention::Point::kState && what.target == chart;
      },
      [&](Entry& entry) {
        const bool was_active = std::exchange(entry.active, is_active(entry.standing.what.state));
        const bool was_seen = std::exchange(entry.seen, true);
        if (!was_seen || was_active || !entry.active) return;
        ++entry.standing.used;
        reached.push_back(entry.standing.id);
      });
  return reached;
}

}  // namespace sentree::mission
