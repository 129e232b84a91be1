#include "sentree/studio/detail/conversation.h"

#include <fmt/format.h>

#include <algorithm>

#include "sentree/base/json.h"
#include "sentree/text/json.h"

namespace sentree::studio {

namespace {

// Observations that one slice of a search looks at: some milliseconds.
constexpr std::size_t kSlice = 50'000;
constexpr std::size_t kTextSlice = 5'000;
constexpr std::int64_t kLaneWidthMax = 4000;
constexpr std::size_t kPageNameMax = 64;

// RFC 6455, 7.4.1.
constexpr std::uint16_t kPolicyViolation = 1008;
constexpr std::uint16_t kTooBig = 1009;

std::string_view group_of(History::Part part) {
  switch (part) {
    case History::Part::kChart: return "charts";
    case History::Part::kMonitor: return "monitors";
    case History::Part::kRobot: return "robots";
    case History::Part::kTree: return "tree";
    case History::Part::kBlackboard: return "blackboard";
    case History::Part::kOutputs: return "outputs";
    case History::Part::kObstacles: return "obstacles";
    case History::Part::kDoors: return "doors";
    case History::Part::kMission: return "run";
  }
  return {};
}

bool is_keyed(History::Part part) {
  return part == History::Part::kChart || part == History::Part::kMonitor || part == History::Part::kRobot;
}

const std::string& key_of(const Subject& subject, const History::PartId& part) {
  switch (part.part) {
    case History::Part::kChart: return subject.charts[part.index].id;
    case History::Part::kMonitor: return subject.monitors[part.index].name;
    default: return subject.robots[part.index];
  }
}

// Members of a state or a delta, those of one group together. Takes the parts in the order of `History::parts`.
class StateText {
 public:
  StateText(std::string& out, const Subject& subject, const std::string& facts)
      : out_(out), subject_(subject), facts_(facts) {}

  void add(const History::PartId& part, std::string_view json) {
    if (json.empty()) return;
    const std::string_view group = group_of(part.part);
    if (!is_keyed(part.part)) {
      close();
      out_ += ",\"";
      out_ += group;
      out_ += "\":";
      if (part.part == History::Part::kMission)
        out_ += fmt::format("{{\"mission\":{},{}}}", json, facts_);
      else
        out_ += json;
      return;
    }
    if (group != group_) {
      close();
      group_ = group;
      out_ += ",\"";
      out_ += group;
      out_ += "\":{";
    } else {
      out_ += ',';
    }
    append_json_string(out_, key_of(subject_, part));
    out_ += ':';
    out_ += json;
  }
  void close() {
    if (!group_.empty()) out_ += '}';
    group_ = {};
  }

 private:
  std::string& out_;
  const Subject& subject_;
  const std::string& facts_;
  std::string_view group_;
};

std::string head(std::string_view type, Nanoseconds time, const History::Moment& moment, bool live, Nanoseconds begin,
                 Nanoseconds end) {
  return fmt::format("{{\"type\":\"{}\",\"time\":{},\"tick\":{},\"sequence\":{},\"live\":{},\"begin\":{},\"end\":{}",
                     type, time, moment.tick, moment.sequence, live ? "true" : "false", begin, end);
}

std::string facts_text(const RunFacts& facts) {
  std::string text = to_json(Value(Map{{"state", facts.state},
                                       {"factor", facts.factor},
                                       {"reason", facts.reason},
                                       {"vacuous", facts.vacuous},
                                       {"stopped_at", facts.stopped_at},
                                       {"missed_ticks", static_cast<std::int64_t>(facts.missed_ticks)},
                                       {"processes", facts.processes}}));
  return text.substr(1, text.size() - 2);
}

std::string text_of(const Value& body, std::string_view name) {
  const Value* value = body.find(name);
  return value != nullptr ? std::string(value->text()) : std::string();
}

std::optional<std::int64_t> integer_of(const Value& body, std::string_view name) {
  const Value* value = body.find(name);
  if (value == nullptr || !value->is_number()) return std::nullopt;
  if (const auto* integer = value->as_int()) return *integer;
  constexpr double kLimit = 9e18;
  const double number = value->number();
  return number > -kLimit && number < kLimit ? std::optional(static_cast<std::int64_t>(number)) : std::nullopt;
}

}  // namespace

// ---- Composer ----

Composer::Composer(const Subject& shown, const History& past, const RunAccess& access, SteeringQueue* steering,
                   Options given)
    : subject(shown),
      history(past),
      run(access),
      queue(steering),
      options(std::move(given)),
      model(std::make_shared<const std::string>(model_message(shown, options.steerable))) {
  refresh();
}

void Composer::refresh() {
  // The facts first: what says that the run has ended so comes with all that was before.
  facts = facts_text(run.facts ? run.facts() : RunFacts{.state = "ended"});
  if (run.update) run.update();
  present = history.refresh(fragments);
}

// ---- Conversation ----

Conversation::Conversation(Composer& composer, std::uint64_t client, std::unique_ptr<MessageSink> sink)
    : composer_(&composer), client_(client), sink_(std::move(sink)), may_steer_(composer.options.token.empty()) {
  composer_->refresh();
  send_model();
  send_present_state();
}

void Conversation::send_model() {
  send(composer_->options.hello);
  sink_->send(composer_->model);
  send_news();
}

void Conversation::told(const std::shared_ptr<const std::string>& message) {
  if (may_steer_ && !sink_->send(message)) sink_->close(kTooBig, "the page does not keep up");
}

void Conversation::show(Composer& composer, bool stays) {
  const Nanoseconds before = composer_->present.time;
  composer_ = &composer;
  composer_->refresh();
  if (stays && live_ && composer_->present.time != before) {
    live_ = false;
    asked_time_ = before;
  }
  sent_.clear();
  sent_facts_.clear();
  sent_violations_ = sent_problems_ = 0;
  // A search of the run before would be answered with what is no longer there.
  for (Request& request : requests_) {
    request.begun = false;
    request.found.clear();
  }
  send_model();
  if (live_)
    send_present_state();
  else
    send_past_state(asked_time_);
}

Conversation::~Conversation() {
  if (composer_->queue != nullptr) composer_->queue->forget(client_);
}

void Conversation::send(std::string text) {
  if (!sink_->send(std::make_shared<const std::string>(std::move(text))))
    sink_->close(kTooBig, "the page does not keep up");
}

void Conversation::send_present_state() {
  const History::Present& present = composer_->present;
  std::string out = head("state", present.time, present.moment, true, present.begin, present.time);
  StateText text(out, composer_->subject, composer_->facts);
  sent_.resize(composer_->fragments.size());
  for (std::size_t i = 0; i < composer_->fragments.size(); ++i) {
    text.add(composer_->history.parts()[i], composer_->fragments[i].json);
    sent_[i] = composer_->fragments[i].version;
  }
  text.close();
  sent_facts_ = composer_->facts;
  sent_time_ = present.time;
  next_observation_ = present.moment.observations;
  send(out + "}");
}

void Conversation::send_news() {
  const std::size_t violations = composer_->history.violations();
  while (sent_violations_ < violations) send(composer_->history.violation(sent_violations_++));
  const std::size_t problems = composer_->history.problems();
  while (sent_problems_ < problems) {
    const History::Problem problem = composer_->history.problem(sent_problems_++);
    send(to_json(Value(Map{{"type", "problem"}, {"text", problem.text}, {"time", problem.time}})));
  }
}

void Conversation::send_delta() {
  if (is_behind()) return;
  send_news();
  if (!live_) return send_growth();
  const History::Present& present = composer_->present;
  std::string out = head("delta", present.time, present.moment, true, present.begin, present.time);
  StateText text(out, composer_->subject, composer_->facts);
  bool changed = present.time != sent_time_;
  for (std::size_t i = 0; i < composer_->fragments.size(); ++i) {
    const bool is_run = composer_->history.parts()[i].part == History::Part::kMission;
    if (sent_[i] == composer_->fragments[i].version && !(is_run && sent_facts_ != composer_->facts)) continue;
    text.add(composer_->history.parts()[i], composer_->fragments[i].json);
    sent_[i] = composer_->fragments[i].version;
    changed = true;
  }
  text.close();
  sent_facts_ = composer_->facts;
  sent_time_ = present.time;
  const std::size_t end = present.moment.observations;
  if (next_observation_ < end) {
    changed = true;
    std::size_t from = std::max(next_observation_, composer_->history.first_observation());
    if (end - from > kDeltaMessagesMax) from = end - kDeltaMessagesMax;
    out += fmt::format(",\"missed\":{},\"messages\":[", from - next_observation_);
    for (std::size_t position = from; position < end; ++position) {
      const std::string message = composer_->history.observation(position);
      if (message.empty()) continue;
      if (out.back() != '[') out += ',';
      out += message;
    }
    out += ']';
    next_observation_ = end;
  }
  if (changed) send(out + "}");
}

void Conversation::send_growth() {
  const History::Present& present = composer_->present;
  const bool has_other_facts = sent_facts_ != composer_->facts;
  if (present.time == sent_time_ && !has_other_facts) return;
  std::string out = fmt::format("{{\"type\":\"delta\",\"begin\":{},\"end\":{}", present.begin, present.time);
  if (has_other_facts) {
    StateText text(out, composer_->subject, composer_->facts);
    text.add({History::Part::kMission, 0}, past_mission_);
  }
  sent_facts_ = composer_->facts;
  sent_time_ = present.time;
  send(out + "}");
}

void Conversation::received(const std::string& text) {
  if (requests_.size() + steering_ >= kRequestsMax) return sink_->close(kPolicyViolation, "too many requests wait");
  auto body = text::parse_json(text);
  if (!body || body->as_map() == nullptr) return sink_->close(kPolicyViolation, "a request is a JSON object");
  Request request;
  request.id = integer_of(*body, "id").value_or(0);
  request.op = text_of(*body, "op");
  request.body = std::move(*body);
  requests_.push_back(std::move(request));
}

void Conversation::work() {
  if (requests_.empty() || is_behind()) return;
  if (advance(requests_.front())) requests_.pop_front();
}

void Conversation::answer_json(std::int64_t id, const std::string& json) {
  if (id == 0) return;
  send(fmt::format("{{\"type\":\"answer\",\"id\":{},\"ok\":true,\"value\":{}}}", id, json));
}

void Conversation::answer(std::int64_t id, const Value& value) { answer_json(id, to_json(value)); }

void Conversation::refuse(std::int64_t id, const std::string& why) {
  if (id == 0) return;
  send(to_json(Value(Map{{"type", "answer"}, {"id", id}, {"ok", false}, {"error", why}})));
}

bool Conversation::advance(Request& request) {
  if (request.op == "messages" || request.op == "find") return advance_search(request);
  if (request.op == "signal") return advance_signal(request);
  if (request.op == "signals") return advance_signals(request);
  if (request.op == "hello") {
    may_steer_ = may_steer_ || text_of(request.body, "token") == composer_->options.token;
    page_ = text_of(request.body, "page").substr(0, kPageNameMax);
    answer(request.id, Map{{"steerable", composer_->options.steerable && may_steer_}});
  } else if (request.op == "live") {
    follow();
    answer(request.id, {});
  } else if (request.op == "seek") {
    seek(request);
  } else if (request.op == "layout") {
    std::vector<bt::NodeId> collapsed;
    const Value* given = request.body.find("collapsed");
    if (given != nullptr && given->as_list() != nullptr) {
      for (const Value& id : *given->as_list()) {
        if (id.as_int() != nullptr && *id.as_int() >= 0) collapsed.push_back(static_cast<bt::NodeId>(*id.as_int()));
      }
    }
    answer(request.id, folded_layout(composer_->subject, collapsed));
  } else if (request.op == "fold_chart") {
    std::set<std::string> closed;
    const Value* given = request.body.find("closed");
    if (given != nullptr && given->as_list() != nullptr) {
      for (const Value& id : *given->as_list()) closed.emplace(id.text());
    }
    const std::string chart = text_of(request.body, "chart");
    if (Value folded = folded_chart(composer_->subject, chart, closed); !folded.is_null())
      answer(request.id, folded);
    else
      refuse(request.id, fmt::format("there is no chart \"{}\"", chart));
  } else if (request.op == "transitions") {
    const auto node = integer_of(request.body, "node").value_or(-1);
    constexpr std::size_t kTransitionsMax = 5'000;
    if (node < 0 || static_cast<std::size_t>(node) >= composer_->subject.plan.tree.size())
      refuse(request.id, "there is no such node");
    else
      answer(request.id, composer_->history.transitions(static_cast<bt::NodeId>(node), kTransitionsMax));
  } else if (request.op == "lanes") {
    const auto from = integer_of(request.body, "from").value_or(0);
    const auto to = integer_of(request.body, "to").value_or(composer_->history.end());
    const auto width = std::clamp<std::int64_t>(integer_of(request.body, "width").value_or(1000), 1, kLaneWidthMax);
    answer(request.id, composer_->history.lanes(std::max<Nanoseconds>(from, 0), std::max<Nanoseconds>(to, 0),
                                                static_cast<int>(width)));
  } else {
    steer(request);
  }
  return true;
}

void Conversation::follow() {
  composer_->refresh();
  live_ = true;
  send_present_state();
}

void Conversation::seek(const Request& request) {
  const auto time = integer_of(request.body, "time");
  if (!time) return refuse(request.id, "seek needs a time");
  live_ = false;
  asked_time_ = *time;
  answer(request.id, Map{{"time", send_past_state(*time)}});
}

Nanoseconds Conversation::send_past_state(Nanoseconds time) {
  const Nanoseconds begin = composer_->history.begin();
  const Nanoseconds end = composer_->history.end();
  const Nanoseconds at = std::clamp(time, begin, std::max(begin, end));
  std::string out = head("state", at, composer_->history.moment(at), false, begin, end);
  StateText text(out, composer_->subject, composer_->facts);
  std::string json;
  for (const History::PartId& part : composer_->history.parts()) {
    json.clear();
    composer_->history.append(json, part, at);
    text.add(part, json);
    if (part.part == History::Part::kMission) past_mission_ = json;
  }
  text.close();
  sent_facts_ = composer_->facts;
  sent_time_ = end;
  send(out + "}");
  return at;
}

void Conversation::steer(const Request& request) {
  const bool looks = request.op == "coverage" && composer_->options.coverage;
  if (composer_->queue == nullptr || !(looks || composer_->options.steerable))
    return refuse(request.id, "this run cannot be steered");
  if (!may_steer_ && !looks) return refuse(request.id, "only who came with the token of the printed address may steer");
  ++steering_;
  Value body = request.body;
  // What one page does, another does not undo.
  if (request.op.starts_with("design")) (*body.as_map())["page"] = page_;
  composer_->queue->put({client_, request.id, request.op, std::move(body)});
}

void Conversation::steered(std::int64_t id, Result<Value> result) {
  --steering_;
  if (result)
    answer(id, *result);
  else
    refuse(id, result.error().message);
}

// ---- Searching ----

void Conversation::begin_search(Request& request) {
  request.begun = true;
  if (const Value* filter = request.body.find("filter"); filter != nullptr) {
    request.filter = {text_of(*filter, "text"), text_of(*filter, "service"), text_of(*filter, "leaf"),
                      text_of(*filter, "kind"), text_of(*filter, "name")};
  }
  const History& history = composer_->history;
  const auto before = integer_of(request.body, "before");
  const auto after = integer_of(request.body, "after");
  request.forwards = after.has_value();
  if (request.op == "find") {
    request.limit = 1;
    request.position = after ? history.after_time(*after) : history.after_time(before.value_or(0) - 1);
    return;
  }
  request.limit = static_cast<std::size_t>(
      std::clamp<std::int64_t>(integer_of(request.body, "limit").value_or(kAnswerMessagesMax), 1, kAnswerMessagesMax));
  if (after)
    request.position = history.find_sequence(static_cast<std::uint64_t>(std::max<std::int64_t>(*after, 0)) + 1);
  else if (before)
    request.position = history.find_sequence(static_cast<std::uint64_t>(std::max<std::int64_t>(*before, 0)));
  else if (const auto until = integer_of(request.body, "until"))
    request.position = history.after_time(*until);
  else
    request.position = history.end_observation();
}

bool Conversation::advance_search(Request& request) {
  if (!request.begun) begin_search(request);
  const std::size_t budget = request.filter.text.empty() ? kSlice : kTextSlice;
  const History& history = composer_->history;
  bool more = true;
  for (std::size_t left = budget; left > 0;) {
    const History::Found found = history.find(request.filter, request.position, request.forwards, left);
    const std::size_t looked = request.forwards ? found.next - std::min(found.next, request.position)
                                                : request.position - std::min(found.next, request.position);
    left -= std::min(left, std::max<std::size_t>(looked, 1));
    request.position = found.next;
    more = !found.at_end;
    if (found.position) request.found.push_back(*found.position);
    if (!more || request.found.size() >= request.limit) break;
    if (left == 0) return false;
  }
  if (more && request.found.size() < request.limit) return false;
  if (request.op == "find") {
    answer_json(request.id, request.found.empty() ? "null" : history.observation(request.found.front()));
    return true;
  }
  if (!request.forwards) std::reverse(request.found.begin(), request.found.end());
  std::string json = "{\"messages\":[";
  for (const std::size_t position : request.found) {
    const std::string message = history.observation(position);
    if (message.empty()) continue;
    if (json.back() != '[') json += ',';
    json += message;
  }
  answer_json(request.id, fmt::format("{}],\"more\":{}}}", json, more ? "true" : "false"));
  return true;
}

}  // namespace sentree::studio
