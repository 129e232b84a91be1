#include "sentree/mission/faults.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "sentree/idl/conform.h"
#include "sentree/project/check_intervention.h"

namespace sentree::mission {

namespace {

using namespace project::intervention;

constexpr std::string_view kReply = ".reply";

}  // namespace

Faults::Faults(const std::vector<project::DelayFault>& delays) {
  for (const project::DelayFault& delay : delays) {
    if (const auto id = next_id()) add(*id, Delay{.message = delay.message, .by = delay.by});
  }
}

Result<std::uint64_t> Faults::next_id() {
  if (entries_.size() >= kStandingMax) {
    return fail("steering.too-many",
                fmt::format("more than {} delays, falsified replies, forced results and breakpoints; clear one first",
                            kStandingMax));
  }
  return ++last_id_;
}

void Faults::add(std::uint64_t id, project::Intervention what) { entries_.push_back({{id, std::move(what), 0}}); }

Result<void> Faults::clear(std::uint64_t id) {
  const auto found =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.standing.id == id; });
  if (found == entries_.end()) {
    return fail("steering.unknown-id",
                fmt::format("nothing stands with number {}{}", id,
                            id >= 1 && id <= last_id_ ? "; it has been used up or cleared" : ""));
  }
  entries_.erase(found);
  return {};
}

std::vector<StandingIntervention> Faults::list() const {
  std::vector<StandingIntervention> list;
  for (const Entry& entry : entries_) list.push_back(entry.standing);
  return list;
}

template <class Kind, class Matches, class Use>
void Faults::each(const Matches& matches, const Use& use_entry) {
  if (!any<Kind>()) return;
  for (Entry& entry : entries_) {
    if (const auto* what = std::get_if<Kind>(&entry.standing.what); what != nullptr && matches(*what))
      use_entry(entry, *what);
  }
  std::erase_if(entries_, [](const Entry& entry) {
    const std::uint64_t count = project::count_of(entry.standing.what);
    return count != 0 && entry.standing.used >= count;
  });
}

Duration Faults::delay_of(std::string_view message) {
  Duration longest{0};
  // "battery.*" means requests: a reply is meant where it is named.
  const bool is_reply = message.ends_with(kReply);
  each<Delay>(
      [&](const Delay& delay) {
        return delay.message.ends_with(kReply) == is_reply && project::matches_pattern(delay.message, message);
      },
      [&](Entry& entry, const Delay& delay) {
        ++entry.standing.used;
        longest = std::max(longest, delay.by);
      });
  return longest;
}

void Faults::falsify(std::string_view call, const idl::Method& method, Value& result) {
  each<Falsify>([&](const Falsify& falsify) { return project::matches_pattern(falsify.call, call); },
                [&](Entry& entry, const Falsify& falsify) {
                  Value changed = result;
                  if (!project::put_at(changed, falsify.path, falsify.value)) return;
                  auto conformed = idl::conform(*method.result, std::move(changed), "result");
                  if (!conformed) return;
                  result = std::move(*conformed);
                  ++entry.standing.used;
                });
}

bool Faults::fails(Failing how, std::string_view call) {
  bool fails = false;
  const auto matches = [&](const auto& fault) { return project::matches_pattern(fault.call, call); };
  const auto use_entry = [&](Entry& entry, const auto& /*fault*/) {
    ++entry.standing.used;
    fails = true;
  };
  switch (how) {
    case Failing::kUnreachable: each<Unreachable>(matches, use_entry); break;
    case Failing::kLate: each<Late>(matches, use_entry); break;
  }
  return fails;
}

std::optional<bt::Status> Faults::forced(std::string_view leaf) {
  std::optional<bt::Status> status;
  // The newest wins; only what is used is used up.
  Entry* newest = nullptr;
  each<Force>([&](const Force& force) { return force.leaf == leaf; },
              [&](Entry& entry, const Force& force) {
                if (newest != nullptr) --newest->standing.used;
                newest = &entry;
                ++entry.standing.used;
                status = bt::parse_status(force.status);
              });
  return status;
}

std::vector<std::uint64_t> Faults::reached_by(const Message& message) {
  std::vector<std::uint64_t> reached;
  // The hit itself is no new one.
  if (message.name == "scenario.breakpoint") return reached;
  each<Breakpoint>(
      [&](const Breakpoint& what) {
        if (what.point == Breakpoint::Point::kMessage) return project::matches_pattern(what.target, message.name);
        if (what.point != Breakpoint::Point::kNode || message.name != "node.status") return false;
        const Value* to = message.data.find("to");
        return message.source == what.target && to != nullptr && (what.status.empty() || to->text() == what.status);
      },
      [&](Entry& entry, const Breakpoint& /*what*/) {
        ++entry.standing.used;
        reached.push_back(entry.standing.id);
      });
  return reached;
}

std::vector<std::uint64_t> Faults::reached_in(std::string_view chart,
                                              const std::function<bool(const std::string& state)>& is_active) {
  std::vector<std::uint64_t> reached;
  each<Breakpoint>(
      [&](const Breakpoint& what) { return what.point == Breakpoint::Point::kState && what.target == chart; },
      [&](Entry& entry, const Breakpoint& what) {
        const bool was_active = std::exchange(entry.active, is_active(what.state));
        const bool was_seen = std::exchange(entry.seen, true);
        if (!was_seen || was_active || !entry.active) return;
        ++entry.standing.used;
        reached.push_back(entry.standing.id);
      });
  return reached;
}

}  // namespace sentree::mission
