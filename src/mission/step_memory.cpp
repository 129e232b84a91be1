#include "sentree/mission/step_memory.h"

#include <algorithm>
#include <utility>

#include "sentree/base/json.h"
#include "sentree/scxml/encode.h"

namespace sentree::mission {

StepMemory::StepMemory(const scxml::Chart& chart) : chart_(chart) { remembers_ = chart.ambient().empty(); }

Choice StepMemory::Asked::choice() const {
  Choice choice{.function = function, .name = name, .place = place, .count = alternatives.size()};
  choice.alternative = [this](std::uint64_t i) { return alternatives[i]; };
  if (!probabilities.empty()) choice.probability = [this](std::uint64_t i) { return probabilities[i]; };
  return choice;
}

bool StepMemory::step(std::string_view what, bool begins, scxml::Session& session, TimePoint now,
                      scxml::Effects& effects, const std::function<std::uint64_t(Choice)>& ask,
                      const std::function<void(const Seen&)>& see, const std::function<bool()>& execute) {
  given_.clear();
  taken_ = 0;
  told_ = 0;
  known_ = 0;
  chosen_.clear();
  seen_.clear();
  key_.assign(what);
  key_ += '\n';
  spoilt_ = !remembers_;
  if (spoilt_) {
    ++executed_;
    return execute();
  }
  // Delayed sends that wait matter to few events, so they are looked at only where they do.
  const bool with_timers = !begins && (what == kTimers || session.timers().empty() || !session.invocations().empty());
  const auto add_form = [&](const scxml::Session& of) { spoilt_ = spoilt_ || !scxml::encode(chart_, of, now, key_); };
  if (with_timers) {
    add_form(session);
  } else if (!begins) {
    // Not the step of a session that has none: what a <cancel> does not find there is not noticed below.
    key_ += "any timers\n";
    scxml::Session bare = session;
    scxml::take_timers(bare, scxml::Session());
    add_form(bare);
  }
  Node* node = spoilt_ ? nullptr : follow(named(key_), ask);
  bool keeps_timers = !with_timers && !begins;
  if (node != nullptr && node->looks_at_timers) {
    keeps_timers = false;
    key_ += "\ntimers\n";
    add_form(session);
    node = spoilt_ ? nullptr : follow(named(key_), ask);
  }
  spoilt_ = spoilt_ || node == nullptr;
  if (node != nullptr && node->done) {
    ++looked_up_;
    const Done& done = *node->done;
    if (keeps_timers) {
      const scxml::Session own = std::exchange(session, done.session);
      scxml::take_timers(session, own);
    } else {
      session = done.session;
      scxml::postpone(session, now - done.at);
    }
    effects.insert(effects.end(), done.effects.begin(), done.effects.end());
    for (const Seen& seen : done.seen) see(seen);
    return done.result;
  }
  ++executed_;
  if (executed_ == kTried && looked_up_ * 2 < executed_) {
    remembers_ = false;
    spoilt_ = true;
    steps_.clear();
  }
  const std::size_t before = effects.size();
  const std::optional<scxml::Session> was = keeps_timers ? std::optional(session) : std::nullopt;
  const bool result = execute();
  if (spoilt_ || session.status() == scxml::SessionStatus::kFailed) return result;
  for (Chosen& chosen : chosen_) {
    node->asked = std::move(chosen.asked);
    node->next.resize(chosen.count);
    node->next[chosen.alternative] = std::make_unique<Node>();
    node = node->next[chosen.alternative].get();
  }
  // A <cancel> makes them the session's own, whether it finds one or not.
  if (was && (&was->timers() != &session.timers() || !session.invocations().empty())) {
    node->looks_at_timers = true;
    return result;
  }
  ++remembered_;
  node->done =
      Done{session, now, {effects.begin() + static_cast<std::ptrdiff_t>(before), effects.end()}, seen_, result};
  return result;
}

StepMemory::Node* StepMemory::named(const std::string& key) {
  if (const auto found = steps_.find(key); found != steps_.end()) return &found->second;
  return remembered_ < kStepsMax ? &steps_[key] : nullptr;
}

// To where what is known ends. What has been asked once is not asked again.
StepMemory::Node* StepMemory::follow(Node* node, const std::function<std::uint64_t(Choice)>& ask) {
  known_ = 0;
  for (std::size_t i = 0; node != nullptr && node->asked; ++i) {
    if (i == given_.size()) given_.push_back(ask(node->asked->choice()));
    auto& next = node->next[given_[i]];
    if (!next) next = std::make_unique<Node>();
    node = next.get();
    known_ = i + 1;
  }
  return node;
}

std::string StepMemory::name_of(const scxml::Event& event) {
  std::string name = event.name;
  name += '\n';
  name += static_cast<char>('0' + static_cast<int>(event.type));
  if (event.data) append_json(name, *event.data);
  return name;
}

std::optional<std::uint64_t> StepMemory::given() {
  if (taken_ >= given_.size()) return std::nullopt;
  return given_[taken_++];
}

void StepMemory::chosen(const Choice& choice, std::uint64_t alternative) {
  if (told_++ < known_) return;
  if (choice.count > kAlternativesMax) spoilt_ = true;
  if (spoilt_) return;
  Asked asked{choice.function, choice.name, choice.place, {}, {}};
  for (std::uint64_t i = 0; i < choice.count; ++i) {
    asked.alternatives.push_back(choice.alternative(i));
    if (choice.probability) asked.probabilities.push_back(choice.probability(i));
  }
  chosen_.push_back({std::move(asked), alternative, static_cast<std::size_t>(choice.count)});
}

void StepMemory::saw(Seen seen) { seen_.push_back(std::move(seen)); }

}  // namespace sentree::mission
