#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sentree/scxml/detail/data_model.h"
#include "sentree/scxml/detail/script_heap.h"
#include "sentree/scxml/expression.h"
#include "sentree/scxml/session.h"

namespace sentree::scxml {

class Interpreter;

/// SCXML B.2. The session's data are Values; simple expressions are evaluated on them directly. The first expression
/// that needs the interpreter leases a JavaScript heap for the rest of the step and gives it the data.
class EcmaScriptModel final : public DataModel, private NativeScope, private ScriptWorld {
 public:
  EcmaScriptModel(const Interpreter& interpreter, Session& session);

  void set_event(const Event* event) override;
  Result<bool> condition(ExpressionId id) override;
  Result<std::optional<Value>> evaluate(ExpressionId id) override;
  Result<std::optional<Value>> evaluate(std::string_view expression) override;
  Result<std::string> text(ExpressionId id) override;
  Result<void> assign(ExpressionId location, ExpressionId expr) override;
  Result<void> assign_value(ExpressionId location, const std::optional<Value>& value) override;
  Result<void> bind(std::uint32_t slot, ExpressionId expr) override;
  void bind_value(std::uint32_t slot, const std::optional<Value>& value) override;
  Result<void> run(ExpressionId script) override;
  Result<void> for_each(const Foreach& loop, const std::function<bool()>& body) override;
  void finish() override;

 private:
  // NativeScope
  bool variable(std::uint32_t slot, ScriptValue& value) override;
  const Event* event() override { return event_; }
  std::string_view system(SystemVariable variable) override;
  bool in(std::string_view state_id) override;
  bool call(std::string_view function, List&& arguments, Value& result) override;
  // ScriptWorld
  bool script_in(std::string_view state_id) override { return in(state_id); }
  double script_now_ms() override;
  double script_random() override { return session_.rng_.uniform(); }
  const std::vector<NativeFunction>& script_functions() override;
  Result<Value> script_call(std::size_t function, std::span<const Value> arguments) override;
  const std::vector<NativeValue>& script_values() override;

  /// Which objects an expression may give.
  enum class Objects : std::uint8_t {
    kNone,
    kNew,  ///< That it makes itself, whole.
    kAny,
  };
  /// False: the interpreter must evaluate.
  bool evaluate_here(ExpressionId id, ScriptValue& value, Objects objects);
  void store(std::uint32_t slot, std::optional<Value> value);
  /// A heap that holds this session's data and event. `changes`: what is called next may change data.
  Result<ScriptHeap*> heap(ExpressionId id, bool changes);
  Result<ScriptHeap*> ready_heap(bool changes);
  Result<void> load_heap();
  /// The interpreter is about to run, or has returned: for a watchdog.
  void enter(ExpressionId id);
  void leave();

  const Interpreter& interpreter_;
  Session& session_;
  const Model& model_;
  const Event* event_ = nullptr;
  std::shared_ptr<ScriptHeap> heap_;
  // What functions of the embedding program gave while the expression was evaluated here: if the interpreter has to
  // evaluate it again, it is given the same. So many of them it has been given.
  std::vector<Result<Value>> called_;
  std::size_t given_ = 0;
  ExpressionId here_ = kNoExpression;     // that is evaluated so
  bool event_current_ = false;            // the heap has the present event
  bool heap_newer_ = false;               // the heap's data may be newer than the session's
  std::vector<std::uint32_t> unwritten_;  // variables that are newer in the session than in the heap
};

}  // namespace sentree::scxml
