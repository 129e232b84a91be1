#include "sentree/scxml/detail/ecmascript_model.h"

#include <algorithm>
#include <utility>

#include "sentree/scxml/detail/interpreter.h"

namespace sentree::scxml {
namespace {

// Strings made while a native expression is evaluated. Per thread: an evaluation never waits for another.
std::vector<std::string>& native_text() {
  thread_local std::vector<std::string> text;
  return text;
}

std::size_t members_of(const Value& value) {
  const Map* const map = value.as_map();
  if (map == nullptr) return 0;
  std::size_t sum = map->size();
  for (const auto& [name, member] : *map) sum += members_of(member);
  return sum;
}

// Whether an expression is an object literal, and all its members are there: an undefined one is, to scripts, but has
// no form as data. What it makes is nobody else's.
bool is_made_whole(const NativeCode& code, const Value& made) {
  using Op = NativeCode::Op;
  const Op last = code.nodes.back().op;
  if (last != Op::kObject && last != Op::kWith) return false;
  const auto members =
      std::count_if(code.nodes.begin(), code.nodes.end(), [](const auto& node) { return node.op == Op::kWith; });
  return static_cast<std::size_t>(members) == members_of(made);
}

}  // namespace

EcmaScriptModel::EcmaScriptModel(const Interpreter& interpreter, Session& session)
    : interpreter_(interpreter), session_(session), model_(interpreter.chart().model()) {}

void EcmaScriptModel::set_event(const Event* event) {
  event_ = event;
  event_current_ = false;
}

// ---- Without the interpreter ----

bool EcmaScriptModel::variable(std::uint32_t slot, ScriptValue& value) {
  const bool here = std::find(unwritten_.begin(), unwritten_.end(), slot) != unwritten_.end();
  if (heap_newer_ && !here) return heap_->read_primitive(slot, value);
  const std::optional<Value>& variable = (*session_.variables_)[slot];
  value = variable ? ScriptValue::of(*variable) : ScriptValue();
  return true;
}

std::string_view EcmaScriptModel::system(SystemVariable variable) {
  return variable == SystemVariable::kSessionId ? std::string_view(session_.id()) : std::string_view(model_.name);
}

bool EcmaScriptModel::in(std::string_view state_id) {
  const auto state = interpreter_.chart().find(state_id);
  return state && interpreter_.is_active(*state);
}

double EcmaScriptModel::script_now_ms() {
  return static_cast<double>(interpreter_.now().time_since_epoch() / std::chrono::milliseconds(1));
}

const std::vector<NativeFunction>& EcmaScriptModel::script_functions() { return interpreter_.host().functions; }

const std::vector<NativeValue>& EcmaScriptModel::script_values() { return interpreter_.host().values; }

Result<Value> EcmaScriptModel::script_call(std::size_t function, std::span<const Value> arguments) {
  if (given_ < called_.size()) return called_[given_++];
  return script_functions()[function].call(arguments);
}

bool EcmaScriptModel::call(std::string_view name, List&& arguments, Value& result) {
  const auto& functions = script_functions();
  const auto known = std::find_if(functions.begin(), functions.end(), [&](const auto& f) { return f.name == name; });
  // A debugger may have defined one of that name.
  if (known == functions.end() || session_.globals_->find(name) != nullptr) return false;
  enter(here_);
  called_.push_back(known->call(arguments));
  leave();
  const bool is_primitive = called_.back() && called_.back()->as_bytes() == nullptr &&
                            called_.back()->as_list() == nullptr && called_.back()->as_map() == nullptr;
  if (is_primitive) result = *called_.back();
  return is_primitive;
}

bool EcmaScriptModel::evaluate_here(ExpressionId id, ScriptValue& value, Objects objects) {
  const NativeCode& code = model_.expressions[id].native;
  if (code.empty() || session_.heap_.pinned) return false;
  here_ = id;
  given_ = 0;
  called_.clear();
  if (!evaluate_native(code, *this, native_text(), value)) return false;
  if (value.kind == ScriptValue::Kind::kObject && objects != Objects::kAny &&
      !(objects == Objects::kNew && is_made_whole(code, *value.object)))
    return false;
  called_.clear();
  return true;
}

void EcmaScriptModel::store(std::uint32_t slot, std::optional<Value> value) {
  session_.variables_.edit()[slot] = std::move(value);
  if (!heap_)
    session_.heap_.tag = 0;
  else if (std::find(unwritten_.begin(), unwritten_.end(), slot) == unwritten_.end())
    unwritten_.push_back(slot);
}

// ---- Evaluation ----

Result<bool> EcmaScriptModel::condition(ExpressionId id) {
  ScriptValue value;
  if (evaluate_here(id, value, Objects::kAny)) return value.truthy();
  auto h = heap(id, !model_.expressions[id].pure);
  if (!h) return tl::unexpected(std::move(h.error()));
  auto result = (*h)->condition(id);
  leave();
  return result;
}

Result<std::optional<Value>> EcmaScriptModel::evaluate(ExpressionId id) {
  ScriptValue value;
  if (evaluate_here(id, value, Objects::kAny)) return take_value(value);
  auto h = heap(id, !model_.expressions[id].pure);
  if (!h) return tl::unexpected(std::move(h.error()));
  auto result = (*h)->evaluate(id);
  leave();
  return result;
}

Result<std::optional<Value>> EcmaScriptModel::evaluate(std::string_view expression) {
  auto h = heap(kNoExpression, true);
  if (!h) return tl::unexpected(std::move(h.error()));
  auto result = (*h)->evaluate(expression);
  leave();
  return result;
}

Result<std::string> EcmaScriptModel::text(ExpressionId id) {
  ScriptValue value;
  if (evaluate_here(id, value, Objects::kNone)) {
    switch (value.kind) {
      case ScriptValue::Kind::kUndefined: return "undefined";
      case ScriptValue::Kind::kNull: return "null";
      case ScriptValue::Kind::kBool: return value.boolean ? "true" : "false";
      case ScriptValue::Kind::kNumber: return number_to_string(value.number);
      case ScriptValue::Kind::kString: return std::string(value.string);
      case ScriptValue::Kind::kObject: break;
    }
  }
  auto h = heap(id, !model_.expressions[id].pure);
  if (!h) return tl::unexpected(std::move(h.error()));
  auto result = (*h)->text(id);
  leave();
  return result;
}

Result<void> EcmaScriptModel::assign(ExpressionId location, ExpressionId expr) {
  const auto slot = model_.expressions[location].slot;
  ScriptValue value;
  // Objects are shared, not copied, when scripts assign them: that is left to the interpreter.
  if (slot && evaluate_here(expr, value, Objects::kNew)) {
    store(*slot, take_value(value));
    return {};
  }
  auto h = heap(expr, true);
  if (!h) return tl::unexpected(std::move(h.error()));
  auto result = (*h)->assign(location, expr);
  leave();
  return result;
}

Result<void> EcmaScriptModel::assign_value(ExpressionId location, const std::optional<Value>& value) {
  const auto slot = model_.expressions[location].slot;
  if (slot && !session_.heap_.pinned) {
    store(*slot, value);
    return {};
  }
  auto h = heap(location, true);
  if (!h) return tl::unexpected(std::move(h.error()));
  auto result = (*h)->assign_value(location, value);
  leave();
  return result;
}

Result<void> EcmaScriptModel::bind(std::uint32_t slot, ExpressionId expr) {
  ScriptValue value;
  if (evaluate_here(expr, value, Objects::kNew)) {
    store(slot, take_value(value));
    return {};
  }
  auto h = heap(expr, true);
  if (!h) return tl::unexpected(std::move(h.error()));
  auto result = (*h)->bind(slot, expr);
  leave();
  return result;
}

void EcmaScriptModel::bind_value(std::uint32_t slot, const std::optional<Value>& value) {
  if (session_.heap_.pinned) {
    if (auto h = heap(kNoExpression, true)) {
      static_cast<void>((*h)->write(slot, value));
      leave();
    }
    return;
  }
  store(slot, value);
}

Result<void> EcmaScriptModel::run(ExpressionId script) {
  auto h = heap(script, true);
  if (!h) return tl::unexpected(std::move(h.error()));
  auto result = (*h)->run(script);
  if (std::find(model_.scripts.begin(), model_.scripts.end(), script) != model_.scripts.end()) {
    session_.scripts_run_ = true;
    static_cast<void>((*h)->keep_functions());
  }
  leave();
  return result;
}

Result<void> EcmaScriptModel::for_each(const Foreach& loop, const std::function<bool()>& body) {
  auto h = heap(loop.array, true);
  if (!h) return tl::unexpected(std::move(h.error()));
  Result<void> failure;
  const std::function<bool()> with_current_data = [&] {
    heap_newer_ = true;
    const bool go_on = body();
    // The body may have written natively, or seen another event's error; the next item needs the heap up to date.
    if (auto again = heap(loop.array, true); !again) failure = tl::unexpected(std::move(again.error()));
    return go_on && failure.has_value();
  };
  auto result = (*h)->for_each(loop, with_current_data);
  leave();
  return result ? failure : result;
}

// ---- The heap ----

Result<ScriptHeap*> EcmaScriptModel::heap(ExpressionId id, bool changes) {
  if (here_ == kNoExpression || id != here_) called_.clear();
  here_ = kNoExpression;
  enter(id);
  auto ready = ready_heap(changes);
  if (!ready) leave();
  return ready;
}

Result<ScriptHeap*> EcmaScriptModel::ready_heap(bool changes) {
  if (!heap_) {
    if (session_.heap_.pinned) {
      heap_ = session_.heap_.pinned;
    } else {
      heap_ = model_.heaps->take(session_.heap_.tag);
    }
    if (heap_ && !session_.heap_.pinned && (session_.heap_.tag == 0 || heap_->tag != session_.heap_.tag) &&
        !heap_->reset())
      heap_.reset();
    if (!heap_) {
      auto created = ScriptHeap::create(model_, interpreter_.host().limits.script_memory_max);
      if (!created) return tl::unexpected(std::move(created.error()));
      heap_ = *std::move(created);
    }
    heap_->attach(this);
    heap_->foreach_max = interpreter_.host().limits.foreach_max;
    const Host& host = interpreter_.host();
    if (heap_->session_id != session_.id() || !heap_->knows(host.functions) || !host.values.empty()) {
      if (auto set = heap_->set_system(session_.id(), interpreter_.host().processors); !set)
        return tl::unexpected(std::move(set.error()));
    }
    if (heap_->tag == 0 && !session_.heap_.pinned) {
      if (auto loaded = load_heap(); !loaded) return tl::unexpected(std::move(loaded.error()));
    }
  }
  for (const std::uint32_t slot : unwritten_) {
    if (auto written = heap_->write(slot, (*session_.variables_)[slot]); !written)
      return tl::unexpected(std::move(written.error()));
  }
  if (!unwritten_.empty()) heap_->tag = 0;
  unwritten_.clear();
  if (!event_current_) {
    if (auto set = heap_->set_event(event_); !set) return tl::unexpected(std::move(set.error()));
    event_current_ = true;
  }
  // What the heap holds is no longer what its tag says.
  if (changes) {
    heap_newer_ = true;
    heap_->tag = 0;
  }
  return heap_.get();
}

void EcmaScriptModel::enter(ExpressionId id) {
  for (ExecutionWatch* watch : {interpreter_.host().watch, WatchThread::present()}) {
    if (watch) watch->begin_evaluation(model_, id == kNoExpression ? Place() : model_.expressions[id].place);
  }
}

void EcmaScriptModel::leave() {
  for (ExecutionWatch* watch : {WatchThread::present(), interpreter_.host().watch}) {
    if (watch) watch->end_evaluation();
  }
}

Result<void> EcmaScriptModel::load_heap() {
  const auto write_variables = [&]() -> Result<void> {
    const auto& variables = *session_.variables_;
    for (std::uint32_t slot = 0; slot < variables.size(); ++slot) {
      if (!variables[slot]) continue;
      if (auto written = heap_->write(slot, variables[slot]); !written) return written;
    }
    return {};
  };
  if (auto written = write_variables(); !written) return written;
  unwritten_.clear();
  if (!session_.scripts_run_ || model_.scripts.empty()) return heap_->write_globals(*session_.globals_);
  // The chart's own scripts define its functions again; what they did to the data is undone.
  const Rng rng = session_.rng_;
  for (const ExpressionId script : model_.scripts) {
    enter(script);
    static_cast<void>(heap_->run(script));
  }
  session_.rng_ = rng;
  if (auto kept = heap_->keep_functions(); !kept) return kept;
  if (auto written = write_variables(); !written) return written;
  return heap_->write_globals(*session_.globals_);
}

void EcmaScriptModel::finish() {
  if (!heap_) return;
  event_ = nullptr;
  static_cast<void>(heap_->set_event(nullptr));
  for (const std::uint32_t slot : unwritten_) static_cast<void>(heap_->write(slot, (*session_.variables_)[slot]));
  if (!unwritten_.empty()) heap_->tag = 0;
  if (heap_newer_) {
    // Reading data runs the getters that scripts have defined.
    enter(kNoExpression);
    const auto read = heap_->read_all(session_.variables_.edit(), session_.globals_.edit());
    leave();
    if (!read) {
      session_.heap_.pinned = std::move(heap_);
      session_.heap_.pinned->attach(nullptr);
      session_.heap_.unsaveable.edit() = read.error();
      return;
    }
  } else if (session_.heap_.pinned) {
    // What could not be read before still cannot.
    heap_->attach(nullptr);
    return;
  }
  session_.heap_.pinned.reset();
  session_.heap_.unsaveable.reset();
  if (heap_->tag == 0) heap_->tag = model_.heaps->next_tag();
  session_.heap_.tag = heap_->tag;
  model_.heaps->give(std::move(heap_));
}

}  // namespace sentree::scxml
