#include "sentree/mission/model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/diagnostic.h"
#include "sentree/base/rng.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/faults.h"
#include "sentree/scxml/step.h"

namespace sentree::mission {

namespace {

constexpr std::string_view kFailure = "error.execution";
// Behind SERVICE.METHOD.
constexpr std::string_view kRequest = ".request";

using Arguments = std::span<const Value>;

// Publications of one step whose veto the chart is told of.
constexpr std::size_t kRefusedMax = 256;
// Steps of between(); more are refused.
constexpr double kStepsMax = 1e9;

const Value* param(const scxml::OutgoingSend& send, std::string_view name) {
  return send.data ? send.data->find(name) : nullptr;
}

// Whether something in it, or it itself, is so.
template <class Is>
bool anywhere(const Value& value, const Is& is) {
  if (is(value)) return true;
  if (const List* const list = value.as_list())
    return std::any_of(list->begin(), list->end(), [&](const Value& item) { return anywhere(item, is); });
  const Map* const map = value.as_map();
  return map != nullptr &&
         std::any_of(map->begin(), map->end(), [&](const auto& member) { return anywhere(member.second, is); });
}

bool is_undefined(const Value& value) { return value.find("$undefined") != nullptr; }

// What is written as another value is: a number that is none as a text, octets as an object.
bool is_written_as_another(const Value& value) {
  const double* const number = value.as_double();
  return (number != nullptr && !std::isfinite(*number)) || value.as_bytes() != nullptr;
}

// That scenarios and recordings, which have the alternatives' written forms, tell them apart. Equal ones need not be.
Result<void> check_written(const Choice& choice) {
  bool may_be_alike = false;
  for (std::uint64_t i = 0; i < choice.count; ++i) {
    const Value value = choice.alternative(i);
    may_be_alike = may_be_alike || anywhere(value, is_written_as_another);
    if (!anywhere(value, is_undefined)) continue;
    return fail("model.choice",
                fmt::format("{}(): alternative {} is, or holds, undefined or a function, which no scenario can write; "
                            "leave null or a text open instead, and make of that what is meant",
                            choice.function, i + 1));
  }
  std::map<std::string, std::uint64_t> written;
  for (std::uint64_t i = 0; may_be_alike && i < choice.count; ++i) {
    const auto [other, is_new] = written.emplace(to_json(choice.alternative(i)), i);
    if (is_new || choice.alternative(i) == choice.alternative(other->second)) continue;
    return fail("model.choice",
                fmt::format("{}(): alternatives {} and {} are both written {}, so that no scenario tells them apart; "
                            "leave texts open instead, and make of them what is meant",
                            choice.function, other->second + 1, i + 1, other->first));
  }
  return {};
}

std::vector<std::string> names_of(const ComponentModel& model) {
  std::vector<std::string> names;
  for (const auto* services : {&model.serves, &model.topics}) {
    for (const auto& [name, service] : *services) names.push_back(name);
  }
  return names;
}

}  // namespace

ComponentModel component_model(const project::Plan& plan, std::size_t model) {
  const project::ModelPlan& of = plan.models[model];
  ComponentModel made{.name = of.name,
                      .file = of.file,
                      .seed = hash_combine(plan.scenario.seed, hash_bytes(of.name)),
                      .patience = plan.scenario.project.deadlines.call,
                      .chart = of.chart,
                      .serves = {}};
  for (const std::string& service : of.serves) made.serves[service] = plan.services.at(service).service;
  for (const auto& [name, service] : plan.services) {
    if (service.at == "topics") made.topics[name] = service.service;
  }
  return made;
}

ModelMachine::ModelMachine(ComponentModel model, scxml::ExecutionWatch* watch) : model_(std::move(model)) {
  host_.processors.push_back({"thrift", ""});
  host_.on_send = [this](const scxml::OutgoingSend& send) -> Result<void> {
    if (send.type != "thrift") return {};
    auto meaning = meaning_of(send);
    if (meaning) {
      // An id that the chart gives may come twice.
      if (send.delay <= Duration(0) && send.sendid.starts_with(send.session))
        meanings_.emplace_back(send.sendid, *std::move(meaning));
      return {};
    }
    if (memory_) memory_->spoil();
    wrong_.push_back(meaning.error());
    if (wrong_.back().span.line == 0) wrong_.back().span = send.span;
    return tl::unexpected(meaning.error());
  };
  host_.watch = watch != nullptr ? watch : &watch_;
  host_.observer = &observer_;
  const auto handled = model_.chart.events_handled();
  handles_failures_ = std::any_of(handled.begin(), handled.end(), [](const std::string& descriptor) {
    return scxml::event_matches(descriptor, kFailure);
  });
  add_choices();
}

// Half of a model stands for nothing: what it answered then would be nobody's behaviour.
void ModelMachine::Observer::event(const scxml::Chart& chart, std::string_view, const scxml::Event& event) {
  if (!(chart == machine.model_.chart) || event.name != kFailure || machine.handles_failures_) return;
  if (!machine.wrong_.empty()) return;  // said already
  if (machine.memory_) machine.memory_->spoil();
  const Value* const message = event.data ? event.data->find("message") : nullptr;
  machine.wrong_.push_back(
      {Severity::kError, "model.script",
       fmt::format("model {}: {} (and its chart has no transition for {})", machine.model_.name,
                   message != nullptr ? message->text() : "a script failed", kFailure),
       chart.span(machine.latest_ ? chart.transitions()[*machine.latest_].place : scxml::Place{})});
}

void ModelMachine::Observer::transition(const scxml::Chart& chart, std::string_view, scxml::TransitionIndex taken) {
  if (!(chart == machine.model_.chart)) return;
  machine.latest_ = taken;
  machine.surroundings_->taken(taken);
}

void ModelMachine::Observer::entered(const scxml::Chart& chart, std::string_view, scxml::StateIndex state) {
  if (chart == machine.model_.chart) machine.surroundings_->entered(state);
}

std::string ModelMachine::place() const {
  const SourceSpan span = host_.watch->place();
  return span.line == 0 ? std::string() : fmt::format("{}:{}", model_.file, span.line);
}

Result<Value> ModelMachine::decide(const Choice& choice, const std::function<std::uint64_t(Rng&)>& by_chance) {
  const auto given = memory_ ? memory_->given() : std::nullopt;
  const std::uint64_t alternative = given ? *given : ask(choice, by_chance);
  if (memory_) memory_->chosen(choice, alternative);
  return choice.alternative(alternative);
}

std::uint64_t ModelMachine::ask(Choice choice, const std::function<std::uint64_t(Rng&)>& by_chance) {
  choice.model = model_.name;
  choice.number = ++stepped_->choices;
  const std::optional<std::uint64_t> told = surroundings_->choose(choice);
  const std::uint64_t alternative = told ? *told : by_chance(stepped_->rng);
  Map said{{"function", choice.function}};
  if (!choice.name.empty()) said["name"] = std::move(choice.name);
  said["value"] = choice.alternative(alternative);
  if (!choice.place.empty()) said["place"] = std::move(choice.place);
  choices_.push_back(std::move(said));
  return alternative;
}

void ModelMachine::add_choices() {
  const auto add = [this](const char* name, std::function<Result<Value>(Arguments)> call) {
    host_.functions.push_back({name, [this, call = std::move(call)](Arguments of) {
                                 auto result = call(of);
                                 if (result) return result;
                                 // Whatever the chart makes of the error: a model that leaves nothing open is wrong.
                                 if (memory_) memory_->spoil();
                                 wrong_.push_back(result.error());
                                 wrong_.back().message.insert(0, fmt::format("model {}: ", model_.name));
                                 wrong_.back().span = host_.watch->place();
                                 return result;
                               }});
  };
  const auto one_of = [this](const char* function, std::string name, Arguments of) {
    Choice choice{.function = function, .name = std::move(name), .place = place(), .count = of.size()};
    choice.alternative = [of](std::uint64_t i) { return of[i]; };
    if (auto written = check_written(choice); !written) return Result<Value>(tl::unexpected(written.error()));
    return decide(choice, [of](Rng& rng) { return rng.below(of.size()); });
  };
  add("choose", [one_of](Arguments of) -> Result<Value> {
    if (of.empty()) return fail("model.choice", "choose() needs something to choose from");
    return one_of("choose", "", of);
  });
  add("pick", [one_of](Arguments of) -> Result<Value> {
    if (of.size() < 2 || of[0].as_string() == nullptr)
      return fail("model.choice", "pick('NAME', a, …) needs a name and something to pick");
    return one_of("pick", *of[0].as_string(), of.subspan(1));
  });
  add("between", [this](Arguments of) -> Result<Value> {
    const bool are_numbers = std::all_of(of.begin(), of.end(), [](const Value& v) { return v.is_number(); });
    if (of.size() < 2 || of.size() > 3 || !are_numbers)
      return fail("model.choice", "between(low, high, step) needs two or three numbers");
    const double low = of[0].number();
    const double step = of.size() == 3 ? of[2].number() : 1.0;
    // A step that ends at `high` but for rounding belongs to it.
    const double steps = std::floor((of[1].number() - low) / step + 1e-9);
    if (!(step > 0) || !(steps >= 0))
      return fail("model.choice", "between(low, high, step) needs low ≤ high and a step above 0");
    if (steps > kStepsMax)
      return fail("model.choice",
                  fmt::format("between(low, high, step) has more than {} steps: a greater step has fewer",
                              static_cast<std::uint64_t>(kStepsMax)));
    Choice choice{.function = "between", .place = place(), .count = static_cast<std::uint64_t>(steps) + 1};
    choice.alternative = [low, step](std::uint64_t i) {
      constexpr double kWholeMax = 9007199254740992;  // as far as every whole number is one
      const double number = low + step * static_cast<double>(i);
      const bool is_whole = number == std::floor(number) && std::abs(number) <= kWholeMax;
      return is_whole && !(number == 0 && std::signbit(number)) ? Value(static_cast<std::int64_t>(number))
                                                                : Value(number);
    };
    const std::uint64_t count = choice.count;
    return decide(choice, [count](Rng& rng) { return rng.below(count); });
  });
  add("chance", [this](Arguments of) -> Result<Value> {
    if (of.size() != 1 || !of[0].is_number() || !(of[0].number() >= 0 && of[0].number() <= 1))
      return fail("model.choice", "chance(p) needs a probability from 0 to 1");
    const double p = of[0].number();
    // What is impossible is no alternative.
    const bool can_fail = p < 1;
    const bool can_be = p > 0;
    Choice choice{.function = "chance", .place = place(), .count = (can_fail ? 1U : 0U) + (can_be ? 1U : 0U)};
    choice.alternative = [can_fail](std::uint64_t i) { return Value(!can_fail || i == 1); };
    choice.probability = [can_fail, p](std::uint64_t i) { return !can_fail || i == 1 ? p : 1 - p; };
    return decide(choice, [p, can_fail](Rng& rng) -> std::uint64_t { return rng.uniform() < p && can_fail ? 1 : 0; });
  });
  add("draw", [this](Arguments of) -> Result<Value> {
    const List* list = of.size() == 1 ? of[0].as_list() : nullptr;
    double sum = 0;
    std::vector<const List*> possible;
    for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
      const List* pair = (*list)[i].as_list();
      const bool is_pair = pair != nullptr && pair->size() == 2 && (*pair)[0].is_number() && (*pair)[0].number() >= 0;
      if (!is_pair) {
        list = nullptr;
        break;
      }
      sum += (*pair)[0].number();
      if ((*pair)[0].number() > 0) possible.push_back(pair);
    }
    if (list == nullptr || std::abs(sum - 1) > 1e-9)
      return fail("model.choice", "draw([[p, a], …]) needs pairs whose probabilities add up to 1");
    Choice choice{.function = "draw", .place = place(), .count = possible.size()};
    choice.alternative = [&possible](std::uint64_t i) { return (*possible[i])[1]; };
    choice.probability = [&possible](std::uint64_t i) { return (*possible[i])[0].number(); };
    if (auto written = check_written(choice); !written) return tl::unexpected(written.error());
    return decide(choice, [&possible](Rng& rng) {
      double left = rng.uniform();
      for (std::size_t i = 0; i < possible.size(); ++i) {
        if ((left -= (*possible[i])[0].number()) < 0) return static_cast<std::uint64_t>(i);
      }
      return static_cast<std::uint64_t>(possible.size() - 1);
    });
  });
  add("fresh", [this](Arguments of) -> Result<Value> {
    if (!of.empty()) return fail("model.choice", "fresh() takes nothing");
    if (memory_) memory_->spoil();
    return Value(static_cast<std::int64_t>(++stepped_->fresh));
  });
}

Result<ModelMachine::Topic> ModelMachine::topic_of(const scxml::OutgoingSend& send, const idl::Service& service) const {
  const auto method = idl::find_method(service, send.event, send.target, send.span);
  if (!method) return tl::unexpected(method.error());
  if (!(*method)->oneway) {
    return fail("model.answer",
                fmt::format("\"{}\" is no answer; send METHOD.reply or METHOD.error. Published are one-way methods",
                            send.event),
                send.span);
  }
  auto args = idl::conform_arguments(**method, send.data.value_or(Value(Map())));
  if (!args) return tl::unexpected(args.error());
  return Topic{send.target, send.event, std::move(*args)};
}

// "METHOD.reply" or "METHOD.error" to a service that it serves, with a result that the interface has; or "METHOD", with
// its arguments.
Result<ModelMachine::Meaning> ModelMachine::meaning_of(const scxml::OutgoingSend& send) const {
  const bool is_topic = send.event.find('.') == std::string::npos;
  if (const auto topics = model_.topics.find(send.target); topics != model_.topics.end())
    return topic_of(send, *topics->second);
  const auto service = model_.serves.find(send.target);
  if (service == model_.serves.end()) {
    return fail(
        "model.answer",
        fmt::format("the model does not serve \"{}\"{}", send.target, did_you_mean(send.target, names_of(model_))),
        send.span);
  }
  if (is_topic && service->second->find(send.event) != nullptr) return topic_of(send, *service->second);
  const std::string_view event = send.event;
  const std::size_t dot = event.rfind('.');
  const std::string_view method = event.substr(0, dot);
  const std::string_view what = dot == std::string_view::npos ? std::string_view() : event.substr(dot + 1);
  if (what != "reply" && what != "error")
    return fail("model.answer", fmt::format("\"{}\" is no answer; send METHOD.reply or METHOD.error", send.event),
                send.span);
  const auto found = idl::find_method(*service->second, method, send.target, send.span);
  if (!found) return tl::unexpected(found.error());
  Answer answer{.service = send.target, .method = std::string(method), .outcome = {}, .id = 0};
  if (const Value* id = param(send, "id")) {
    if (!id->is_number() || id->number() < 1)
      return fail("model.answer", "the id of an answer is that of the call, _event.data.id", send.span);
    answer.id = static_cast<std::uint64_t>(id->number());
  }
  if (what == "error") {
    const Value* kind = param(send, "kind");
    const Value* message = param(send, "message");
    const std::string word(kind != nullptr ? kind->text() : "exception");
    const auto known = idl::parse_call_error_kind(word);
    if (!known) {
      return fail("model.answer",
                  fmt::format("there is no kind of error \"{}\"{}", word, did_you_mean(word, idl::call_error_kinds())),
                  send.span);
    }
    answer.outcome = CallOutcome::failed(*known, message != nullptr ? std::string(message->text()) : "");
    const Value* exception = param(send, "exception");
    if (exception == nullptr) return answer;
    if (*known != idl::CallErrorKind::kException)
      return fail("model.answer", "an exception is of kind 'exception', and of no other", send.span);
    auto thrown = idl::conform_exception(**found, *exception);
    if (!thrown) return tl::unexpected(thrown.error());
    answer.outcome.result = *std::move(thrown);
    return answer;
  }
  answer.outcome.ok = true;
  if ((*found)->result->kind == idl::Kind::kVoid) return answer;
  const Value* result = param(send, "result");
  auto conforming = idl::conform(*(*found)->result, result != nullptr ? *result : Value(), "result");
  if (!conforming) return tl::unexpected(conforming.error());
  answer.outcome.result = *std::move(conforming);
  return answer;
}

/// One delivery to one model.
class ModelMachine::Step {
 public:
  Step(ModelMachine& machine, ModelState& state, ModelHost& host)
      : machine_(machine), model_(machine.model_), state_(state), host_(host) {
    machine_.stepped_ = &state;
    machine_.surroundings_ = &host;
  }

  void operator()(const StartModel&) {
    state_.rng = Rng(model_.seed);
    execute("start", true, [&] {
      return scxml::start(model_.chart, state_.session, {.data = {}, .session_id = model_.name, .seed = model_.seed},
                          host_.now(), machine_.effects_, machine_.host_)
          .enabled;
    });
  }

  void operator()(const ServeCall& serve) {
    const idl::Method* const method = model_.serves.at(serve.call->service)->find(serve.call->method);
    const bool is_answered = method == nullptr || !method->oneway;
    if (!state_.session.running())
      return host_.answer(
          serve.leaf, serve.call,
          CallOutcome::failed(idl::CallErrorKind::kUnreachable, fmt::format("the model {} has ended", model_.name)));
    if (is_answered && state_.open.size() >= kOpenCallsMax) {
      return host_.answer(serve.leaf, serve.call,
                          CallOutcome::failed(idl::CallErrorKind::kUnreachable,
                                              fmt::format("{} calls are open already", kOpenCallsMax)));
    }
    const Call& call = *serve.call;
    const std::uint64_t id = is_answered ? unused_id() : 0;
    if (is_answered)
      state_.open.push_back({serve.leaf, serve.call, add_saturating(host_.now(), model_.patience), id});
    else
      host_.answer(serve.leaf, serve.call, CallOutcome::returned());
    scxml::Event event;
    event.name.reserve(call.service.size() + call.method.size() + kRequest.size() + 1);
    event.name.append(call.service).append(1, '.').append(call.method).append(kRequest);
    event.origintype = "thrift";
    Map data;
    data.reserve(3);
    data.append("args", call.args);
    data.append("source", serve.source);
    data.append("id", static_cast<std::int64_t>(id));
    event.data = idl::for_script(std::move(data));
    take(event);
  }

  void operator()(const Published& published) { tell(published.what->topic, idl::for_script(published.what->args)); }

  void operator()(const Refused& refused) {
    const std::string name = fmt::format("{}.{}.error", refused.service, refused.method);
    Map data{{"args", refused.args}, {"kind", "vetoed"}};
    data["message"] =
        fmt::format("vetoed{}: {}", refused.veto.by.empty() ? "" : " by " + refused.veto.by, refused.veto.reason);
    if (!refused.veto.by.empty()) data["vetoed_by"] = refused.veto.by;
    Message message;
    message.kind = MessageKind::kError;
    message.source = model_.name;
    message.target = refused.service;
    message.name = name;
    message.call = refused.id;
    message.data = data;
    host_.publish(std::move(message));
    tell(name, idl::for_script(std::move(data)));
  }

  void operator()(const ModelTimer& timer) {
    if (state_.wake != timer.when) return;
    state_.wake = kNever;
    if (state_.session.running() && state_.session.next_timer() <= host_.now()) {
      execute(StepMemory::kTimers, false, [&] {
        return scxml::step_timers(model_.chart, state_.session, host_.now(), machine_.effects_, machine_.host_).enabled;
      });
    }
    // An answer of the same instant is in time.
    while (!state_.open.empty() && state_.open.front().due <= host_.now()) {
      const ModelState::OpenCall late = state_.open.front();
      state_.open.erase(state_.open.begin());
      host_.answer(late.leaf, late.call,
                   CallOutcome::failed(idl::CallErrorKind::kLate,
                                       late.lost ? std::string(kMadeLate)
                                                 : fmt::format("the model {} has not answered in time", model_.name)));
    }
  }

  void schedule() {
    TimePoint next = state_.session.running() ? state_.session.next_timer() : kNever;
    if (!state_.open.empty()) next = std::min(next, state_.open.front().due);
    if (next == kNever || next == state_.wake) return;
    state_.wake = next;
    host_.deliver_at(next, Rank::kSimulator, ModelTimer{next});
  }

 private:
  void say(const std::string& what, Map data) {
    Message message;
    message.source = model_.name;
    message.name = fmt::format("{}.{}", model_.name, what);
    message.data = std::move(data);
    host_.publish(std::move(message));
  }

  void tell(const std::string& name, Value data) {
    if (!state_.session.running()) return;
    scxml::Event event;
    event.name = name;
    event.origintype = "thrift";
    event.data = std::move(data);
    take(event);
  }

  void take(const scxml::Event& event) {
    execute(machine_.memory_ ? StepMemory::name_of(event) : std::string(), false, [&] {
      return scxml::step(model_.chart, state_.session, event, host_.now(), machine_.effects_, machine_.host_).enabled;
    });
  }

  // @param what  Tells steps apart; only with a memory.
  void execute(std::string_view what, bool begins, const std::function<bool()>& run) {
    if (machine_.memory_) {
      const auto no_chance = [this](Rng&) -> std::uint64_t {
        machine_.memory_->spoil();
        return 0;
      };
      machine_.memory_->step(
          what, begins, state_.session, host_.now(), machine_.effects_,
          [&](Choice choice) { return machine_.ask(std::move(choice), no_chance); }, [](const StepMemory::Seen&) {},
          run);
    } else {
      run();
    }
    follow();
  }

  void publish(Topic&& topic) {
    Message request;
    request.kind = MessageKind::kRequest;
    request.source = model_.name;
    request.target = topic.service;
    request.name = fmt::format("{}.{}.request", topic.service, topic.method);
    request.call = host_.next_call();
    request.data = Map{{"args", topic.args}};
    const std::uint64_t id = request.call;
    const auto admission = host_.request(std::move(request));
    if (admission && admission->veto)
      refused_.push_back({topic.service, topic.method, id, std::move(topic.args), *admission->veto});
  }

  std::uint64_t unused_id() const {
    std::uint64_t id = 1;
    while (std::any_of(state_.open.begin(), state_.open.end(), [&](const auto& open) { return open.id == id; })) ++id;
    return id;
  }

  void follow() {
    machine_.latest_.reset();
    for (const Diagnostic& why : std::exchange(machine_.wrong_, {})) host_.refused(why);
    for (Map& choice : std::exchange(machine_.choices_, {})) say("choice", std::move(choice));
    for (scxml::Effect& effect : machine_.effects_) {
      if (auto* send = std::get_if<scxml::OutgoingSend>(&effect)) {
        auto meaning = take_meaning(*send);
        if (!meaning) continue;
        if (auto* topic = std::get_if<Topic>(&*meaning))
          publish(std::move(*topic));
        else
          answer(std::get<Answer>(std::move(*meaning)));
      } else if (const auto* line = std::get_if<scxml::LogLine>(&effect)) {
        say("log", Map{{"label", line->label}, {"text", line->text}});
      }
    }
    machine_.effects_.clear();
    machine_.meanings_.clear();
    // What the chart does about it may be refused again, at most as often as it can take steps.
    if (!refused_.empty() && !telling_) {
      telling_ = true;
      for (std::size_t i = 0; i < refused_.size() && i < kRefusedMax; ++i) (*this)(Refused(refused_[i]));
      refused_.clear();
      telling_ = false;
    }
    if (state_.session.status() != scxml::SessionStatus::kFailed || told_) return;
    told_ = true;
    const auto& failure = state_.session.failure();
    host_.refused(
        {Severity::kError,
         "model.given-up",
         fmt::format("the model {} was given up: {}", model_.name, failure ? to_string(*failure) : "its chart failed"),
         {}});
  }

  Result<Meaning> take_meaning(const scxml::OutgoingSend& send) {
    auto& known = machine_.meanings_;
    if (known.empty() || known.front().first != send.sendid) return machine_.meaning_of(send);
    Meaning meaning = std::move(known.front().second);
    known.pop_front();
    return meaning;
  }

  // An answer to a call that is late, or that nobody made, reaches nobody.
  void answer(Answer&& answer) {
    const auto open = std::find_if(state_.open.begin(), state_.open.end(), [&](const ModelState::OpenCall& one) {
      return !one.lost && one.call->service == answer.service && one.call->method == answer.method &&
             (answer.id == 0 || one.id == answer.id);
    });
    if (open == state_.open.end()) return;
    if (answer.outcome.is_served() && open->leaf != ServeCall::kOutside &&
        host_.is_made_late(answer.service + '.' + answer.method)) {
      open->lost = true;
      return;
    }
    const ModelState::OpenCall answered = *open;
    state_.open.erase(open);
    host_.answer(answered.leaf, answered.call, std::move(answer.outcome));
  }

  ModelMachine& machine_;
  const ComponentModel& model_;
  ModelState& state_;
  ModelHost& host_;
  bool told_ = false;
  bool telling_ = false;
  std::vector<Refused> refused_;  // which the chart has not been told of
};

void ModelMachine::step(ModelState& state, ModelDelivery&& delivery, ModelHost& host) {
  Step step(*this, state, host);
  std::visit([&](auto&& what) { step(what); }, delivery);
  step.schedule();
}

void ModelMachine::refuse(ModelState& state, const ModelDelivery& delivery, const std::string& why, ModelHost& host) {
  for (const ModelState::OpenCall& open : std::exchange(state.open, {}))
    host.answer(open.leaf, open.call, CallOutcome::failed(idl::CallErrorKind::kUnreachable, why));
  if (const auto* serve = std::get_if<ServeCall>(&delivery))
    host.answer(serve->leaf, serve->call, CallOutcome::failed(idl::CallErrorKind::kUnreachable, why));
}

}  // namespace sentree::mission
