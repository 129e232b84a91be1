#include <fmt/format.h>

#include <utility>

#include "sentree/scxml/detail/interpreter.h"

namespace sentree::scxml {

void Interpreter::execute_blocks(const std::vector<Block>& blocks) {
  // SCXML 3.8: an error in one handler does not keep the others from running.
  for (const Block& block : blocks) execute(block);
}

bool Interpreter::execute(const Block& block) {
  for (const Action& action : block) {
    if (!spend(action.place) || !execute(action)) return false;
  }
  return true;
}

bool Interpreter::spend(const Place& place) {
  run_.place = place;
  if (++run_.actions <= run_.host.limits.actions_max) return true;
  if (session_.status_ != SessionStatus::kFailed) {
    fail_session("scxml.endless-step",
                 fmt::format("the chart executes more than {} pieces of executable content in one step",
                             run_.host.limits.actions_max),
                 place);
  }
  return false;
}

bool Interpreter::spend_output(std::size_t bytes, const Place& place) {
  constexpr std::size_t kOfEach = 256;  // its names and its place in a queue
  run_.output += bytes + kOfEach;
  if (run_.output <= kOutputMax) return true;
  if (session_.status_ != SessionStatus::kFailed) {
    fail_session("scxml.endless-step",
                 fmt::format("the chart logs and sends more than {} MiB in one step", kOutputMax >> 20U), place);
  }
  return false;
}

bool Interpreter::execute(const Action& action) {
  const auto done = [this](Result<void>&& result) {
    if (!result) raise_error(std::move(result.error()));
    return result.has_value();
  };
  if (const auto* assign = std::get_if<Assign>(&action.what)) {
    return done(assign->expr != kNoExpression ? data_->assign(assign->location, assign->expr)
                                              : data_->assign_value(assign->location, assign->content));
  }
  if (const auto* raised = std::get_if<Raise>(&action.what)) {
    raise({.name = raised->event, .type = EventType::kInternal});
    return true;
  }
  if (const auto* send = std::get_if<Send>(&action.what)) return execute_send(*send, action.place);
  if (const auto* branch = std::get_if<If>(&action.what)) return execute_if(*branch);
  if (const auto* log = std::get_if<Log>(&action.what)) return execute_log(*log, action.place);
  if (const auto* script = std::get_if<Script>(&action.what)) return done(data_->run(script->code));
  if (const auto* loop = std::get_if<Foreach>(&action.what)) return execute_foreach(*loop, action.place);
  return execute_cancel(std::get<Cancel>(action.what));
}

bool Interpreter::execute_if(const If& action) {
  for (const If::Branch& branch : action.branches) {
    if (branch.condition != kNoExpression) {
      auto holds = data_->condition(branch.condition);
      // SCXML 5.9.1: an error counts as false.
      if (!holds) raise_error(std::move(holds.error()));
      if (!holds || !*holds) continue;
    }
    return execute(branch.body);
  }
  return true;
}

bool Interpreter::execute_foreach(const Foreach& action, const Place& place) {
  bool body_ok = true;
  auto result = data_->for_each(action, [&] {
    // A round counts even if there is nothing in it.
    body_ok = spend(place) && execute(*action.body);
    return body_ok && session_.status_ != SessionStatus::kFailed;
  });
  if (!result) raise_error(std::move(result.error()));
  return result.has_value() && body_ok;
}

bool Interpreter::execute_log(const Log& action, const Place& place) {
  LogLine line;
  line.label = action.label;
  line.span = chart_.span(place);
  if (action.expr != kNoExpression) {
    auto text = data_->text(action.expr);
    if (!text) {
      raise_error(std::move(text.error()));
      return false;
    }
    line.text = *std::move(text);
  }
  if (!spend_output(line.text.size(), place)) return false;
  run_.effects.emplace_back(std::move(line));
  return true;
}

Result<std::string> Interpreter::text_of(const Text& text) {
  if (text.expr == kNoExpression) return text.constant;
  return data_->text(text.expr);
}

Result<std::optional<Value>> Interpreter::payload_data(const Payload& payload, bool strict) {
  if (payload.has_content) {
    if (payload.content_expr == kNoExpression) return payload.content;
    auto value = data_->evaluate(payload.content_expr);
    if (value || strict) return value;
    // SCXML 5.6.2: the content is then empty.
    raise_error(std::move(value.error()));
    return std::optional<Value>();
  }
  if (payload.params.empty() && payload.namelist.empty()) return std::optional<Value>();
  Map map;
  map.reserve(payload.params.size() + payload.namelist.size());
  // What comes later of one name counts.
  const auto put = [&map](const std::string& name, Value value) {
    if (Value* const there = map.find(name))
      *there = std::move(value);
    else
      map.append(name, std::move(value));
  };
  for (const auto* list : {&payload.namelist, &payload.params}) {
    for (const Param& param : *list) {
      auto value = data_->evaluate(param.expr);
      if (value) {
        if (*value)
          put(param.name, **std::move(value));
        else if (strict)
          put(param.name, Value());
        continue;
      }
      if (strict) return tl::unexpected(std::move(value.error()));
      // SCXML 5.7.2: name and value are then left out.
      raise_error(std::move(value.error()));
    }
  }
  if (map.empty()) return std::optional<Value>();
  return std::optional<Value>(std::move(map));
}

}  // namespace sentree::scxml
