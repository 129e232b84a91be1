#include "sentree/mission/instant.h"

#include <algorithm>
#include <utility>
#include <variant>

#include <fmt/format.h>

namespace sentree::mission {

namespace {

// What somebody gets, in the words of a chart.
struct Said {
  std::string operator()(const TreeDelivery& what) const { return std::visit(*this, what); }
  std::string operator()(const SkillDelivery& what) const { return std::visit(*this, what); }
  std::string operator()(const ModelDelivery& what) const { return std::visit(*this, what); }

  std::string operator()(const Period&) const { return "a tick"; }
  std::string operator()(const TreeTimer&) const { return "its timer"; }
  std::string operator()(const AnswerDue&) const { return "the end of a leaf's time"; }
  std::string operator()(const Answered&) const { return "a leaf's answer"; }
  std::string operator()(const Halted&) const { return "that a leaf has halted"; }
  std::string operator()(const Stop&) const { return "a halt"; }
  std::string operator()(const HaltLimit&) const { return "the end of the time to halt"; }

  std::string operator()(const TickSkill&) const { return "tick"; }
  std::string operator()(const HaltSkill&) const { return "halt"; }
  std::string operator()(const CancelSkill&) const { return "a cancellation"; }
  std::string operator()(const KillSkill&) const { return "a kill"; }
  std::string operator()(const RestartSkill&) const { return "a restart"; }
  std::string operator()(const SkillTimer&) const { return kOwn; }
  std::string operator()(const Admitted& of) const { return "leave for " + call(of.call); }
  std::string operator()(const Send& of) const { return "the turn of " + call(of.call); }
  std::string operator()(const Outcome& of) const { return call(of.call) + (of.outcome.ok ? ".reply" : ".error"); }
  std::string operator()(const Finish& of) const { return call(of.call) + (of.outcome.ok ? ".reply" : ".error"); }
  std::string operator()(const Published& of) const { return fmt::format("{} of {}", of.what->topic, of.what->source); }

  std::string operator()(const StartModel&) const { return "its start"; }
  std::string operator()(const ServeCall& of) const {
    return fmt::format("{}.request of {}", call(of.call), of.source);
  }
  std::string operator()(const ModelTimer&) const { return kOwn; }
  std::string operator()(const Refused& of) const { return fmt::format("a refusal of {}.{}", of.service, of.method); }

  static constexpr const char* kOwn = "an event that it sent to itself";
  static std::string call(const Shared<Call>& of) { return fmt::format("{}.{}", of->service, of->method); }
};

}  // namespace

void Instant::tell(std::string who, const Delivery& what) {
  if (last_.size() == 2 * kToldOf) last_.erase(last_.begin(), last_.begin() + kToldOf);
  last_.push_back({std::move(who), std::visit(Said(), what.what)});
}

std::string Instant::why() const {
  static constexpr std::size_t kShownMax = 6;
  // The least number of messages behind which the same come again; if there is none, all.
  std::size_t round = last_.size();
  for (std::size_t length = 1; 2 * length <= last_.size(); ++length) {
    if (!std::equal(last_.begin() + static_cast<std::ptrdiff_t>(length), last_.end(), last_.begin())) continue;
    round = length;
    break;
  }
  std::vector<std::string> who;
  std::vector<std::string> what;
  const auto add = [](std::vector<std::string>& to, const std::string& one) {
    if (std::find(to.begin(), to.end(), one) == to.end()) to.push_back(one);
  };
  for (std::size_t i = last_.size() - round; i < last_.size(); ++i) {
    add(who, last_[i].who);
    add(what, fmt::format("{} gets {}", last_[i].who.substr(0, last_[i].who.find(" (")), last_[i].what));
  }
  const auto listed = [](const std::vector<std::string>& all) {
    std::string text;
    for (std::size_t i = 0; i < std::min(all.size(), kShownMax); ++i) text += (i == 0 ? "" : ", ") + all[i];
    return all.size() > kShownMax ? text + ", …" : text;
  };
  return fmt::format(
      "{} {} for ever: {} without time passing; {}: {}. Let one of them wait: for the next tick, or by a <send> with a "
      "delay",
      listed(who), who.size() == 1 ? "goes on" : "answer each other",
      delivered_ > kDeliveredMax ? fmt::format("more than {} messages", kDeliveredMax)
                                 : fmt::format("more than {} messages wait", waiting_max_),
      round < last_.size() ? "again and again" : "lately", listed(what));
}

}  // namespace sentree::mission
