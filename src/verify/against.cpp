#include "sentree/verify/against.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "sentree/base/encoder.h"
#include "sentree/base/json.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/model.h"
#include "sentree/mission/parts.h"
#include "sentree/scxml/encode.h"
#include "sentree/verify/detail/distinctions.h"
#include "sentree/verify/detail/look.h"
#include "sentree/verify/explore.h"

namespace sentree::verify {

namespace {

using mission::CallOutcome;

// Steps of a model between two observations; beyond it runs for ever.
constexpr std::size_t kStepsMax = 100'000;
// Values that were handed out and may come back.
constexpr std::size_t kHandedMax = 64;
constexpr std::string_view kNothing = "no answer";

// What the recording says of a request, from its outcome.
enum class Fate : std::uint8_t {
  kAnswered,
  kUnknown,  // It reached the component, and what that answered is not known.
  kLost,     // It did not reach it.
};

// An outcome as it is compared and told.
struct Answer {
  std::string alike;
  std::string shown;
  std::vector<std::pair<std::string, Value>> handed;
};

bool is_outcome(const Message& message) {
  return message.call != 0 && (message.kind == MessageKind::kReply || message.kind == MessageKind::kError);
}

// "SERVICE.METHOD" of "SERVICE.METHOD.reply".
std::string call_of(const Message& message) { return message.name.substr(0, message.name.rfind('.')); }

Fate fate_of(const Message& outcome) {
  const Value* const kind = outcome.data.find("kind");
  if (kind == nullptr) return Fate::kAnswered;
  const Value* const why = outcome.data.find("message");
  if (kind->text() == "late" && why != nullptr && why->text().starts_with("a fault")) return Fate::kUnknown;
  return kind->text() == "exception" || kind->text() == "late" ? Fate::kAnswered : Fate::kLost;
}

// Follows the recording with one model.
class Follower final : public mission::ModelHost {
 public:
  Follower(const project::Plan& plan, const mission::Parts& parts, std::size_t model, const AgainstOptions& options)
      : plan_(plan),
        parts_(parts),
        index_(model),
        options_(options),
        machine_(mission::component_model(plan, model)),
        chart_(plan.models[model].chart) {
    machine_.remember_steps();
    out_.model = plan.models[model].name;
    const MissionDistinctions mission(plan);
    for (const std::string& service : plan.models[model].serves) distinctions_.emplace(service, mission.of(service));
  }

  Result<Agreement> operator()(std::span<const Message> recording) {
    for (const Message& message : recording) {
      if (is_outcome(message) && distinctions_.contains(message.target)) fates_.emplace(message.call, fate_of(message));
    }
    std::vector<Possible> first(1);
    if (auto done = step(first.front(), TimePoint{}, mission::StartModel{}, possible_); !done)
      return tl::unexpected(done.error());
    for (const Message& message : recording) {
      if (!out_.given_up.empty()) break;
      const bool is_answer = is_outcome(message) && pending_.contains(message.call);
      if (!is_answer && message.kind != MessageKind::kRequest) {
        out_.followed_to = std::max(out_.followed_to, message.time);
        continue;
      }
      auto done = is_answer ? answered(message) : asked(message);
      if (!done) {
        done.error().message += fmt::format(" ({} s, {})", shortest_decimal(seconds(message.time)), told(message));
        return tl::unexpected(std::move(done.error()));
      }
      if (!out_.given_up.empty()) out_.given_up += fmt::format(" ({})", told(message));
      out_.followed_to = std::max(out_.followed_to, message.time);
    }
    out_.possible = possible_.size();
    return std::move(out_);
  }

 private:
  struct Given {
    std::uint64_t call = 0;
    CallOutcome outcome;
    TimePoint at{};
  };
  // A behaviour up to now.
  struct Possible {
    mission::ModelState state;
    TimePoint now{};           // of the model
    std::vector<Given> given;  // that the recording has not come to
    // What values that were recorded mean to it, by name and value; the oldest first.
    std::vector<std::pair<std::string, Value>> meant;
  };

  static std::string told(const Message& message) { return fmt::format("tick {}: {}", message.tick, message.name); }

  // ---- what is recorded

  Result<void> asked(const Message& message) {
    const std::string call = call_of(message);
    const Value* const args = message.data.find("args");
    std::optional<mission::ModelDelivery> heard;
    bool serves = false;
    if (distinctions_.contains(message.target)) {
      serves = true;
      const auto fate = fates_.find(message.call);
      if (fate != fates_.end() && fate->second == Fate::kLost) return {};
      ++out_.requests;
      if (fate != fates_.end() && fate->second == Fate::kAnswered)
        pending_.emplace(message.call, args != nullptr ? *args : Value(Map()));
    } else if (const auto told = parts_.subscriptions().told_of(message); told.takers != nullptr) {
      for (const auto& taker : *told.takers) {
        if (taker.is_model && taker.index == index_) heard = mission::Published{told.what};
      }
    }
    if (!serves && !heard) return {};
    if (auto done = pass(message.time); !done || !out_.given_up.empty()) return done;
    std::vector<Possible> next;
    for (const Possible& one : possible_) {
      const TimePoint at = std::max(one.now, std::min(message.time, one.state.wake));
      if (auto done = step(one, at, heard ? *heard : delivery(message, call, one), next); !done) return done;
    }
    return become(std::move(next), message.time);
  }

  mission::ModelDelivery delivery(const Message& message, const std::string& name, const Possible& one) const {
    const Value* const args = message.data.find("args");
    mission::Call call{.run = 0,
                       .id = message.call,
                       .service = message.target,
                       .method = name.substr(message.target.size() + 1),
                       .args = args != nullptr ? *args : Value(Map()),
                       .sendid = {},
                       .session = {}};
    if (Map* const members = call.args.as_map()) {
      for (auto& [member, value] : *members) {
        const auto meant = find_meant(one, member, value);
        if (meant != one.meant.end()) value = meant->second;
      }
    }
    if (const idl::Method* const method = method_of(call.service, call.method)) {
      if (auto conforming = idl::conform_arguments(*method, call.args)) call.args = std::move(*conforming);
    }
    return mission::ServeCall{mission::ServeCall::kOutside, message.source,
                              mission::Shared<mission::Call>(std::move(call))};
  }

  static std::string key_of(const std::string& name, const Value& value) { return name + '\n' + to_json(value); }
  static auto find_meant(const Possible& one, const std::string& name, const Value& value)
      -> decltype(one.meant.begin()) {
    const std::string key = key_of(name, value);
    return std::find_if(one.meant.begin(), one.meant.end(), [&](const auto& m) { return m.first == key; });
  }

  Result<void> answered(const Message& message) {
    const std::string call = call_of(message);
    const Answer recorded = answer_of(message, call);
    if (auto done = pass(message.time); !done || !out_.given_up.empty()) return done;
    const Value args = std::move(pending_.extract(message.call).mapped());
    ++out_.answers;
    std::vector<Possible> agreeing;
    std::vector<std::string> allowed;
    for (Possible& one : possible_) {
      const auto given =
          std::find_if(one.given.begin(), one.given.end(), [&](const Given& g) { return g.call == message.call; });
      std::string shown(kNothing);
      if (given != one.given.end()) {
        const Answer answer = answer_of(given->outcome, call);
        const bool in_time = given->at >= message.time - options_.tolerance;
        shown = answer.shown + (in_time ? "" : fmt::format(" at {} s", shortest_decimal(seconds(given->at))));
        if (in_time && answer.alike == recorded.alike) {
          agreeing.push_back(one);
          auto& at = agreeing.back();
          at.given.erase(at.given.begin() + (given - one.given.begin()));
          remember(at, recorded.handed, answer.handed);
          continue;
        }
        one.given.erase(given);
      }
      if (std::find(allowed.begin(), allowed.end(), shown) == allowed.end()) allowed.push_back(std::move(shown));
    }
    if (!agreeing.empty()) return become(std::move(agreeing), message.time);
    ++out_.not_allowed;
    if (out_.disallowed.size() < kDisallowedToldMax) {
      // That it has not answered yet says little beside what it would have said.
      if (allowed.size() > 1) std::erase(allowed, kNothing);
      std::sort(allowed.begin(), allowed.end());
      if (allowed.size() > kAllowedToldMax) allowed.resize(kAllowedToldMax);
      out_.disallowed.push_back({.at = message.time,
                                 .tick = message.tick,
                                 .call = call,
                                 .args = args,
                                 .answered = recorded.shown,
                                 .allowed = std::move(allowed)});
    }
    return become(std::move(possible_), message.time);
  }

  // What was recorded means what the model said.
  static void remember(Possible& one, const std::vector<std::pair<std::string, Value>>& recorded,
                       const std::vector<std::pair<std::string, Value>>& said) {
    for (std::size_t i = 0; i < std::min(recorded.size(), said.size()); ++i) {
      if (recorded[i].first != said[i].first) return;
      const std::string key = key_of(recorded[i].first, recorded[i].second);
      std::erase_if(one.meant, [&](const auto& m) { return m.first == key; });
      if (recorded[i].second == said[i].second) continue;
      if (one.meant.size() >= kHandedMax) one.meant.erase(one.meant.begin());
      one.meant.emplace_back(key, said[i].second);
    }
  }

  // ---- what is compared

  const idl::Method* method_of(const std::string& service, const std::string& method) const {
    return plan_.services.at(service).service->find(method);
  }

  Answer of_result(const std::string& call, const Value& result) const {
    const std::size_t dot = call.find('.');
    const idl::Method* const method = method_of(call.substr(0, dot), call.substr(dot + 1));
    if (method == nullptr) return {"result " + to_json(result), to_json(result), {}};
    Look seen = look(distinctions_.at(call.substr(0, dot)), *method, result, options_.exact);
    Answer answer{"result " + to_json(seen.alike), {}, std::move(seen.handed)};
    for (const auto& [path, value] : seen.shown)
      answer.shown += (answer.shown.empty() ? "" : ", ") + (path == "result" ? "" : path + " ") + to_json(value);
    if (answer.shown.empty()) answer.shown = "a reply";
    return answer;
  }
  static Answer of_error(const std::string& kind) { return {"error " + kind, kind, {}}; }

  Answer answer_of(const Message& message, const std::string& call) const {
    if (const Value* const kind = message.data.find("kind")) return of_error(std::string(kind->text()));
    const Value* const result = message.data.find("result");
    return of_result(call, result != nullptr ? *result : Value());
  }
  Answer answer_of(const CallOutcome& outcome, const std::string& call) const {
    return outcome.ok ? of_result(call, outcome.result) : of_error(std::string(outcome.kind_word()));
  }

  // ---- what the model does

  // What its timers do up to `time`, give or take the tolerance: each may ring or not while it may still.
  Result<void> pass(TimePoint time) {
    const TimePoint must = time - options_.tolerance;
    const TimePoint may = add_saturating(time, options_.tolerance);
    std::vector<Possible> done;
    std::vector<Possible> open = std::move(possible_);
    possible_.clear();
    for (std::size_t steps = 0; !open.empty(); ++steps) {
      if (steps > kStepsMax || done.size() + open.size() > 4 * kPossibleMax) {
        out_.given_up = steps > kStepsMax ? "its timers ring without end" : too_many();
        return {};
      }
      Possible one = std::move(open.back());
      open.pop_back();
      const TimePoint wake = one.state.wake;
      const bool rings = wake <= may;
      if (rings) {
        if (auto stepped = step(one, std::max(one.now, wake), mission::ModelTimer{wake}, open); !stepped)
          return stepped;
      }
      if (!rings || wake >= must) done.push_back(std::move(one));
    }
    return become(std::move(done), time);
  }

  // Every way in which one step can go.
  Result<void> step(const Possible& from, TimePoint at, const mission::ModelDelivery& what,
                    std::vector<Possible>& out) {
    script_.clear();
    for (std::size_t ways = 0;; ++ways) {
      if (ways > kWaysMax) return tl::unexpected(too_many_ways());
      Possible next = from;
      next.now = std::max(next.now, at);
      stepped_ = &next;
      made_.clear();
      machine_.step(next.state, mission::ModelDelivery(what), *this);
      if (error_) return tl::unexpected(*error_);
      out.push_back(std::move(next));
      while (!made_.empty() && made_.back().taken + 1 >= made_.back().count) made_.pop_back();
      if (made_.empty()) return {};
      script_.clear();
      for (const Taken& one : made_) script_.push_back(one.taken);
      ++script_.back();
    }
  }

  // Those of which one stands for all that go on alike.
  Result<void> become(std::vector<Possible> all, TimePoint time) {
    std::unordered_set<std::string> known;
    possible_.clear();
    for (Possible& one : all) {
      one.now = std::max(one.now, std::min(time, one.state.wake));
      std::string form;
      if (auto encoded = encode(one, form); !encoded) return encoded;
      if (!known.insert(std::move(form)).second) continue;
      possible_.push_back(std::move(one));
    }
    out_.possible_most = std::max(out_.possible_most, possible_.size());
    if (possible_.size() > kPossibleMax) {
      out_.given_up = too_many();
      possible_.resize(1);
    }
    return {};
  }

  // With the place that has left most open so far.
  std::string too_many() const {
    const auto most = std::max_element(left_open_.begin(), left_open_.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    return fmt::format("it can be in more than {} states{}", kPossibleMax,
                       most == left_open_.end() ? "" : "; most is left open at " + most->first);
  }

  // With the places at which the step leaves something open.
  Diagnostic too_many_ways() const {
    std::vector<std::string> places;
    for (const Taken& one : made_) {
      if (one.count > 1 && std::find(places.begin(), places.end(), one.place) == places.end())
        places.push_back(one.place);
    }
    const std::size_t all = places.size();
    places.resize(std::min(all, kAllowedToldMax));
    return {Severity::kError, "verify.choice",
            fmt::format("model {} can go on in more than {} ways at once; leave less open at {}{}", out_.model,
                        kWaysMax, fmt::join(places, ", "), all > places.size() ? ", …" : ""),
            SourceSpan{plan_.models[index_].chart.file()}};
  }

  Result<void> encode(const Possible& one, std::string& form) const {
    Encoder out(form);
    out.integer(one.now.time_since_epoch().count());
    out.integer(one.state.wake == kNever ? -1 : (one.state.wake - one.now).count());
    out.number(one.state.fresh);
    for (const auto& open : one.state.open) {
      out.number(open.id);
      out.number(open.call->id);
      out.integer((open.due - one.now).count());
    }
    out.text("");
    for (const Given& given : one.given) {
      out.number(given.call);
      out.integer(given.at.time_since_epoch().count());
      out.text(given.outcome.ok ? to_json(given.outcome.result) : std::string(given.outcome.kind_word()));
    }
    out.text("");
    for (const auto& [key, value] : one.meant) out.text(key + '\n' + to_json(value));
    out.text("");
    return scxml::encode(chart_, one.state.session, one.now, form);
  }

  // ModelHost
  TimePoint now() const override { return stepped_->now; }
  void publish(Message) override {}
  std::uint64_t next_call() override { return 1; }
  std::optional<mission::Admission> request(Message) override { return mission::Admission{}; }
  void deliver_at(TimePoint, mission::Rank, mission::ModelDelivery) override {}  // `ModelState::wake` says when
  std::optional<std::uint64_t> choose(const mission::Choice& choice) override {
    if (choice.count > kAlternativesMax && !error_) error_ = too_many_alternatives(plan_, choice);
    if (choice.count > 1) ++left_open_[choice.place];
    const std::uint64_t taken = made_.size() < script_.size() ? script_[made_.size()] : 0;
    made_.push_back({taken, error_ ? 1 : choice.count, choice.place});
    return taken;
  }
  void answer(std::size_t, const mission::Shared<mission::Call>& call, CallOutcome outcome) override {
    if (pending_.contains(call->id)) stepped_->given.push_back({call->id, std::move(outcome), stepped_->now});
  }
  void problem(const std::string&) override {}
  void refused(const Diagnostic& why) override {
    if (error_) return;
    error_ = why;
    error_->code = "verify.reply";
  }

  const project::Plan& plan_;
  const mission::Parts& parts_;
  std::size_t index_;
  const AgainstOptions& options_;
  mission::ModelMachine machine_;
  const scxml::Chart& chart_;
  Agreement out_;
  std::map<std::string, Distinctions> distinctions_;  // by service
  std::unordered_map<std::uint64_t, Fate> fates_;     // by call
  std::unordered_map<std::uint64_t, Value> pending_;  // arguments of calls whose outcome is to come and is compared
  std::vector<Possible> possible_;
  // Of the step that is tried.
  Possible* stepped_ = nullptr;
  std::vector<std::uint64_t> script_;
  struct Taken {
    std::uint64_t taken = 0;
    std::uint64_t count = 1;
    std::string place;
  };
  std::vector<Taken> made_;
  std::map<std::string, std::uint64_t> left_open_;  // how often, by place
  std::optional<Diagnostic> error_;
};

}  // namespace

Result<std::vector<Agreement>> against(const project::Plan& plan, std::span<const Message> recording,
                                       const AgainstOptions& options) {
  const mission::Parts parts(plan);
  std::vector<Agreement> all;
  for (std::size_t i = 0; i < plan.models.size(); ++i) {
    auto one = Follower(plan, parts, i, options)(recording);
    if (!one) return tl::unexpected(one.error());
    all.push_back(std::move(*one));
  }
  return all;
}

}  // namespace sentree::verify
