#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "sentree/base/result.h"
#include "sentree/base/value.h"
#include "sentree/scxml/event.h"
#include "sentree/scxml/expression.h"
#include "sentree/scxml/host.h"
#include "sentree/scxml/model.h"

struct duk_hthread;

namespace sentree::scxml {

/// What scripts can ask of the session that they run in.
class ScriptWorld {
 public:
  virtual ~ScriptWorld() = default;
  virtual bool script_in(std::string_view state_id) = 0;
  virtual double script_now_ms() = 0;
  virtual double script_random() = 0;
  virtual const std::vector<NativeFunction>& script_functions() = 0;
  virtual Result<Value> script_call(std::size_t function, std::span<const Value> arguments) {
    return script_functions()[function].call(arguments);
  }
  virtual const std::vector<NativeValue>& script_values() = 0;
};

/// Lists and maps inside each other that data can have.
inline constexpr int kDataNestingMax = 100;

/// One JavaScript heap with the compiled expressions of one chart. It holds the data of at most one session at a time;
/// `reset` makes it forget them. Built-in objects are frozen, so that nothing of one session can reach the next.
///
/// Every call into the interpreter is protected: errors of scripts and want of memory come back as failures.
class ScriptHeap {
 public:
  /// Failure: not enough memory within `memory_max` bytes.
  static Result<std::shared_ptr<ScriptHeap>> create(const Model& model, std::size_t memory_max);
  /// One that can only tell `syntax_error`, at a tenth of the cost.
  static Result<std::shared_ptr<ScriptHeap>> create_for_syntax(const Model& model, std::size_t memory_max);
  ~ScriptHeap();
  ScriptHeap(const ScriptHeap&) = delete;
  ScriptHeap& operator=(const ScriptHeap&) = delete;

  /// Whom scripts speak to; borrowed until the next call.
  void attach(ScriptWorld* world) { world_ = world; }
  [[nodiscard]] ScriptWorld* world() const { return world_; }

  /// Forgets all data of the session it held. False: something cannot be undone; throw the heap away.
  [[nodiscard]] bool reset();
  /// Sets the read-only variables of SCXML 5.10.
  Result<void> set_system(std::string_view session_id, std::span<const Processor> processors);
  /// The functions that `set_system` made known last are these.
  [[nodiscard]] bool knows(const std::vector<NativeFunction>& functions) const {
    return std::equal(functions.begin(), functions.end(), known_.begin(), known_.end(),
                      [](const NativeFunction& function, const std::string& name) { return function.name == name; });
  }
  Result<void> set_event(const Event* event);

  Result<bool> condition(ExpressionId id);
  Result<std::optional<Value>> evaluate(ExpressionId id);
  Result<std::optional<Value>> evaluate(std::string_view expression);
  Result<std::string> text(ExpressionId id);
  Result<void> assign(ExpressionId location, ExpressionId expr);
  Result<void> assign_value(ExpressionId location, const std::optional<Value>& value);
  Result<void> bind(std::uint32_t slot, ExpressionId expr);
  Result<void> run(ExpressionId script);
  Result<void> for_each(const Foreach& loop, const std::function<bool()>& body);
  /// Nothing, or why it does not parse; `line` counts from 1 within the expression.
  [[nodiscard]] std::optional<std::string> syntax_error(ExpressionId id, int& line);

  Result<void> write(std::uint32_t slot, const std::optional<Value>& value);
  /// False: not a primitive without text.
  bool read_primitive(std::uint32_t slot, ScriptValue& value);
  Result<void> write_globals(const Map& globals);
  /// Reads all variables, and what scripts added. Failure: something has no Value form; the rest has been read.
  Result<void> read_all(std::vector<std::optional<Value>>& variables, Map& globals);
  /// Functions that exist now belong to the chart's own scripts, not to the data.
  Result<void> keep_functions();

  std::uint64_t tag = 0;   ///< Of the data that it holds; 0: none.
  std::string session_id;  ///< Whose `_sessionid` is set.
  std::size_t foreach_max = 0;

 private:
  struct Allocator;

  explicit ScriptHeap(const Model& model);
  static Result<std::shared_ptr<ScriptHeap>> create(const Model& model, std::size_t memory_max, bool whole);
  bool keep_compiled();
  bool build();
  template <class Body>
  Result<void> protect(ExpressionId id, Body&& body);
  void push_compiled(ExpressionId id);
  void push_call(ExpressionId id);
  Result<void> error_at_top(ExpressionId id);

  const Model& model_;
  std::unique_ptr<Allocator> allocator_;
  duk_hthread* context_ = nullptr;
  ScriptWorld* world_ = nullptr;
  void* base_ = nullptr;  // the frozen object that the global object inherits from
  void* global_ = nullptr;
  void* make_dom_ = nullptr;
  std::vector<void*> compiled_;  // by ExpressionId; null: not yet
  // Functions of the chart's own scripts, which are not data.
  struct Kept {
    std::string name;
    void* object;
  };
  // What can be come to from those that may have been given members.
  struct Members {
    std::string text;            // all of it
    std::vector<void*> objects;  // none twice
  };
  void look_at_members(duk_hthread* context, Members& members);
  [[nodiscard]] SourceSpan place_of(std::string_view name) const;

  std::vector<Kept> functions_;
  std::optional<Diagnostic> lost_function_;  // why one of them cannot be had again
  Members kept_members_;                     // when they were kept
  Members members_;                          // now
  std::vector<std::string> known_;           // names of native functions, which are called by their places
};

/// Heaps of one chart that no session uses at the moment. Thread-safe.
class HeapPool {
 public:
  static constexpr std::size_t kKeptMax = 4;

  /// The heap that holds the data of that tag, else any, else null.
  std::shared_ptr<ScriptHeap> take(std::uint64_t tag);
  void give(std::shared_ptr<ScriptHeap> heap);
  /// Never the same twice.
  [[nodiscard]] std::uint64_t next_tag();

 private:
  std::mutex mutex_;
  std::vector<std::shared_ptr<ScriptHeap>> free_;
  std::uint64_t tags_ = 0;
};

}  // namespace sentree::scxml
